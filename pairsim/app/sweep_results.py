"""Compute many cases: `sweep`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from contextlib import nullcontext
from functools import cached_property
from importlib.util import find_spec
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pairsim.cases.identity import RUNS
from pairsim.computing.events import Outcome
from pairsim.computing.loading import written
from pairsim.computing.result import Result
from pairsim.record.record import scales_for
from pairsim.runtime.errors import EnvironmentFailure, InputError
from pairsim.runtime.locks import is_locked
from pairsim.runtime.signals import Signals
from pairsim.sweeps.folder import SweepRecord, read_sweep
from pairsim.sweeps.grid import grid_from, read_grid
from pairsim.sweeps.sweep import Options, Workers, run_sweep, with_workers

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr


class SweepResult:
    """The result of a sweep; returned by `sweep` and `open`. Files are read when first accessed.

    Attributes:
        folder: The folder of the sweep.
        exit_code, message: How the call that has returned it has ended, as on the command line.
    """

    def __init__(self, folder: Path, exit_code: int = 0, message: str = "") -> None:
        self.folder, self.exit_code, self.message = folder, exit_code, message

    @cached_property
    def record(self) -> SweepRecord:
        """The content of sweep.json, with the state of each case from its folder, and `counts` by status."""
        return read_sweep(self.folder)

    @cached_property
    def table(self) -> pd.DataFrame:
        """results.csv: a row for each case that has ended, with parameters and main results; lists are lists.

        Quantities of the `physical` block are numbers in one unit, that of the first case; `attrs["units"]` has it.
        """
        import pandas as pd

        from pairsim.record.tables import described, with_numbers

        header, rows = self.record.results()
        frame = described(pd.DataFrame(rows, columns=header), self.record.question.sweep_columns)
        return with_numbers(frame, self.record.parameters)

    def frame(
        self, name: str | None = None, *, physical: bool | None = False, at: Sequence[float | str] = ()
    ) -> pd.DataFrame:
        """The tables of all cases as one, with the keys that vary as its first columns, quantities as in `table`.

        Arguments and errors are those of `Result.frame`; there is an error, too, if no case has the table yet. The
        name "results" stands for `table`.
        """
        from pairsim.record.tables import UNITS, in_units, stacked, with_numbers

        question = self.record.question
        if name == "results":
            scales = scales_for([self.folder / case.folder for case in self.record.ended], physical)
            table = self.table.copy()
            if not scales:
                return table
            found = in_units(table, question.sweep_columns, scales, self.record.parameters)
            found.attrs[UNITS] |= {key: self.table.attrs[UNITS][key] for key in self.record.parameters}
            return found
        name = question.table_named(name, str(self.folder))
        having = [case for case in self.record.cases if (self.folder / case.folder / f"{name}.csv").is_file()]
        physical = bool(scales_for([self.folder / case.folder for case in having], physical))
        parts = []
        for case in having:
            part = question.result(question, self.folder / case.folder).frame(name, physical=physical, at=at)
            for place, key in enumerate(key for key in self.record.varying if key not in part):
                part.insert(place, key, [case.parameters.get(key)] * len(part))
            parts.append(part)
        if not parts:
            raise InputError(str(self.folder), "", None, f"has no case with {name}.csv yet")
        return with_numbers(stacked(parts), self.record.varying)

    def to_xarray(self, name: str | None = None, *, physical: bool | None = False) -> xr.Dataset:
        """The tables of all cases as one data set, at the places (times, distances) that all of them have.

        Its dimensions are the keys that vary, if the cases are all combinations of their values, or else `case`; and d,
        t or whichever column comes first. Variables have `units` and `long_name`; errors are variables like others.

        Arguments and errors are those of `frame`; there is an error, too, if the cases have no place in common, or
        xarray is not installed.
        """
        if find_spec("xarray") is None:
            raise EnvironmentFailure("there is no xarray", advice="pip install 'pairsim[netcdf]'")
        frame = self.frame(name, physical=physical)
        units = frame.attrs["units"]
        keys = [key for key in self.record.varying if key in frame]
        along = next(str(name) for name in frame if name not in keys)
        case = frame.groupby(keys, sort=False, dropna=False).ngroup() if keys else 0 * frame.index
        frame = frame.assign(case=case).groupby(along).filter(lambda rows: rows["case"].nunique() == case.max() + 1)
        if frame.empty:
            raise InputError(str(self.folder), "", None, f"must have cases with a common {along}")
        full = frame[keys].nunique().prod() == case.max() + 1
        of_cases = frame.drop_duplicates("case").set_index("case")[keys].to_xarray()
        left_out = ["case"] if full else keys
        found = frame.drop(columns=left_out).set_index([*(keys if full else ["case"]), along]).to_xarray()
        found = found if full else found.assign_coords(of_cases.data_vars)
        question = self.record.question
        declared = question.tables[question.table_named(name, str(self.folder))]
        for each in map(str, found.variables):
            if (column := declared.get(each)) is not None:
                found[each].attrs.update(units=units.get(each, ""), long_name=column.meaning)
            elif units.get(each):
                found[each].attrs.update(units=units[each])
        return found.assign_attrs(name=self.record.name, command=question.name, **self.record.versions)

    @cached_property
    def cases(self) -> list[Result]:
        """Results of the cases that have ended, in the order of `table`."""
        question, ended = self.record.question, self.record.ended
        endings = [Outcome(case.state.status, case.state.reason, case.state.message) for case in ended]
        folders = [self.folder / case.folder for case in ended]
        return [question.result(question, *each) for each in zip(folders, endings, strict=True)]

    @property
    def status(self) -> str:
        """One of "failed" (a case has failed), "finished" (all cases), "running" and "interrupted"."""
        counts = self.record.counts
        if counts["failed"]:
            return "failed"
        if not counts["pending"] + counts["running"]:
            return "finished"
        return "running" if is_locked(self.folder) else "interrupted"

    @property
    def reason(self) -> str:
        """Reasons of the cases that failed, separated by commas."""
        return ", ".join(sorted({case.state.reason for case in self.record.cases if case.state.status == "failed"}))

    @property
    def warnings(self) -> list[str]:
        """Warnings about the results, each after the folder of its case."""
        return [f"{case.folder.name}: {warning}" for case in self.cases if case.folder for warning in case.warnings]

    def __repr__(self) -> str:
        counts = ", ".join(f"{count} {status}" for status, count in self.record.counts.items() if count)
        return f"<pairsim sweep {self.record.name}: {counts}, {self.folder}>"


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

    Each case is computed in a child process of its worker, so that a crash or a hang costs no other case. Under mpirun
    all processes call this function and compute cases.

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
            checked = grid_from(Path("grid"), written(grid, "grid"), settings)
        else:
            checked = read_grid(Path(grid), settings)
        directory = Path(folder or RUNS / checked.name)
        with Signals() if signals is True else nullcontext(signals or None) as caught:
            options = Options(case_timeout, progress, caught)
            return SweepResult(directory, *run_sweep(checked, directory, options, workers))

    return with_workers(compute, executor, workers)
