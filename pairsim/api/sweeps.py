"""Compute many cases: `sweep`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from contextlib import nullcontext
from functools import cached_property
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pairsim.api.results import Result
from pairsim.cases.identity import RUNS
from pairsim.computing import QUESTIONS
from pairsim.results.folder import plain
from pairsim.results.units import scales_for
from pairsim.runtime.errors import InputError
from pairsim.runtime.locks import is_locked
from pairsim.runtime.signals import Signals
from pairsim.sweeps.folder import ENDED, read_sweep, rows_of
from pairsim.sweeps.grid import grid_from, read_grid
from pairsim.sweeps.sweep import Options, Workers, run_sweep, with_workers

if TYPE_CHECKING:
    import pandas as pd


class SweepResult:
    """The result of a sweep; returned by `sweep` and `open`. Files are read when first accessed.

    Attributes:
        folder: The folder of the sweep.
        exit_code, message: How the call that has returned it ended, as on the command line.
    """

    def __init__(self, folder: Path, exit_code: int = 0, message: str = "") -> None:
        self.folder, self.exit_code, self.message = folder, exit_code, message

    @cached_property
    def record(self) -> dict[str, Any]:
        """The content of sweep.json, with how each case stands by its folder, and `counts` by status."""
        return read_sweep(self.folder)

    @cached_property
    def table(self) -> pd.DataFrame:
        """results.csv: a row for each case that has ended, with parameters and main results; lists are lists."""
        import pandas as pd

        from pairsim.results.tables import whole_numbers

        header, rows = rows_of(self.record)
        return whole_numbers(pd.DataFrame(rows, columns=header))

    def frame(
        self, name: str | None = None, *, physical: bool | None = False, at: Sequence[float | str] = ()
    ) -> pd.DataFrame:
        """The tables of all cases as one, with the keys that vary as its first columns.

        Arguments and errors are those of `Result.frame`; there is an error, too, if no case has the table yet. The
        name "results" stands for `table`.
        """
        import pandas as pd

        from pairsim.results.tables import in_units, table_of, with_units

        if name == "results":
            scales = scales_for([self.folder / each for each in self.table["folder"]], physical)
            keys = self.record["parameters"]
            return in_units(self.table, scales, keys) if scales else with_units(self.table.copy())
        name = QUESTIONS[self.record["command"]].table_named(name, self.folder)
        having = [case for case in self.record["cases"] if (self.folder / case["folder"] / f"{name}.csv").is_file()]
        physical = bool(scales_for([self.folder / case["folder"] for case in having], physical))
        parts = []
        for case in having:
            part = table_of(self.folder / case["folder"], name, physical, at)
            for place, key in enumerate(key for key in self.record["varying"] if key not in part):
                part.insert(place, key, [case["parameters"].get(key)] * len(part))
            parts.append(part)
        if not parts:
            raise InputError(str(self.folder), "", None, f"has no case with {name}.csv yet")
        found = pd.concat(parts, ignore_index=True)
        found.attrs["units"] = {key: parts[0].attrs["units"].get(key, "") for key in found}
        return found

    @cached_property
    def cases(self) -> list[Result]:
        """Results of the cases that have ended, in the order of `table`."""
        question = QUESTIONS[self.record["command"]]
        ended = [entry for entry in self.record["cases"] if entry["status"] in ENDED]
        return [question.result(question, self.folder / entry["folder"], entry) for entry in ended]

    @property
    def status(self) -> str:
        """One of "failed" (a case has failed), "finished" (all cases), "running" and "interrupted"."""
        counts = self.record["counts"]
        if counts["failed"]:
            return "failed"
        if not counts["pending"] + counts["running"]:
            return "finished"
        return "running" if is_locked(self.folder) else "interrupted"

    @property
    def reason(self) -> str:
        """Reasons of the cases that failed, separated by commas."""
        return ", ".join(sorted({case["reason"] for case in self.record["cases"] if case["status"] == "failed"}))

    @property
    def warnings(self) -> list[str]:
        """Warnings about the results, each after the folder of its case."""
        return [f"{case.folder.name}: {warning}" for case in self.cases if case.folder for warning in case.warnings]

    def __repr__(self) -> str:
        counts = ", ".join(f"{count} {status}" for status, count in self.record["counts"].items() if count)
        return f"<pairsim sweep {self.record['name']}: {counts}, {self.folder}>"


def sweep(
    grid: str | PathLike[str] | Mapping[str, Any],
    *,
    folder: str | PathLike[str] | None = None,
    executor: Executor | None = None,
    workers: int = 1,
    case_timeout: float | None = None,
    progress: bool = False,
    signals: bool | Signals = False,
    settings: Sequence[str] = (),
) -> SweepResult:
    """Compute every case of a grid that is not finished yet.

    A case is computed in a child process of the worker that has it, so that one that crashes or hangs costs itself
    alone. Under mpirun all processes call this function and compute cases.

    Args:
        grid: Path of a grid file, or a dict of its keys: base, grid, zip, cases, exclude, command.
        folder: Folder of the sweep; made, or continued. Default: runs/<name of the grid>.
        executor: A `concurrent.futures.Executor`, such as that of a Dask client; threads of this process by default.
        workers: Cases that are computed at the same time, without an executor.
        case_timeout: Allowed wall time of a case, in seconds.
        progress: Show progress on stderr.
        signals: End in order at SIGINT, SIGTERM and SIGHUP, as the command line does: True, or a
            `pairsim.runtime.signals.Signals` that the caller has entered. Without it no signal handler is installed; a
            KeyboardInterrupt stops the running cases, and the same call continues later.
        settings: Keys to replace in every case, such as "mesh.Np=20".

    Returns:
        The result, also if cases failed or the sweep was interrupted.

    Raises:
        InputError: The grid is invalid, the folder belongs to another grid, or another sweep is writing to it.
    """
    if isinstance(workers, bool) or not isinstance(workers, int) or workers < 1:
        raise InputError("pairsim.sweep", "workers", workers, "must be a whole number of at least 1")

    def compute(workers: Workers) -> SweepResult:
        if isinstance(grid, Mapping):
            checked = grid_from(Path("grid"), plain(grid), settings)
        else:
            checked = read_grid(Path(grid), settings)
        directory = Path(folder or RUNS / checked.name)
        with Signals() if signals is True else nullcontext(signals or None) as caught:
            options = Options(case_timeout, progress, caught)
            return SweepResult(directory, *run_sweep(checked, directory, options, workers))

    return with_workers(compute, executor, workers)
