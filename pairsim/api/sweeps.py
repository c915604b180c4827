"""Compute many cases: `sweep`."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from html import escape
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pairsim.api.results import SHOWN, Result, result_of
from pairsim.commands import COMMANDS
from pairsim.config.merging import section_of
from pairsim.drivers.progress import Style, make_reporter, style_of
from pairsim.results.output import plain
from pairsim.runtime.errors import InputError
from pairsim.runtime.launcher import launcher_communicator
from pairsim.runtime.locks import is_locked
from pairsim.sweeps.grid import grid_from, read_grid
from pairsim.sweeps.ledger import ENDED, read_sweep, rows_of
from pairsim.sweeps.options import Options
from pairsim.sweeps.sweep import run_sweep

if TYPE_CHECKING:
    import pandas as pd


class SweepResult:
    """The result of a sweep; returned by `sweep` and `open`. Files are read when first accessed.

    Args:
        folder: The folder of the sweep.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    @cached_property
    def record(self) -> dict[str, Any]:
        """The content of sweep.json, with the status of every case (of all shards)."""
        return read_sweep(self.folder)

    @cached_property
    def table(self) -> pd.DataFrame:
        """results.csv: a row for each case that has ended, with parameters and main results; lists are lists."""
        import pandas as pd

        from pairsim.results.tables import whole_numbers

        header, rows = rows_of(self.record)
        return whole_numbers(pd.DataFrame(rows, columns=header))

    def frame(self, name: str | None = None, *, physical: bool = False, tidy: bool = False) -> pd.DataFrame:
        """The tables of all cases as one, with the keys that vary as its first columns.

        Args:
            name: Name of the table without .csv, such as "equilibria"; the main one of the command by default.
            physical: Whether to convert to micrometres, seconds and pascals.
            tidy: Whether to make a row for each gap.

        Raises:
            InputError: No case has such a table, or `physical` is set and a case has no `physical` block.
        """
        from pairsim.sweeps.tables import table_of_all

        return table_of_all(self.folder, name, physical, tidy)

    @cached_property
    def cases(self) -> list[Result]:
        """Results of the cases that have ended, in the order of `table`."""
        command = COMMANDS[self.record["command"]]
        ended = [entry for entry in self.record["cases"] if entry["status"] in ENDED]
        return [result_of(command, self.folder / entry["folder"], entry) for entry in ended]

    @property
    def status(self) -> str:
        """One of "failed" (a case failed or timed out), "finished" (all cases), "running" and "interrupted"."""
        counts = self.record["counts"]
        if counts["failed"] + counts["timeout"]:
            return "failed"
        if not counts["pending"] + counts["running"]:
            return "finished"
        return "running" if is_locked(self.folder) else "interrupted"

    @property
    def reason(self) -> str:
        """Reasons of the cases that failed or timed out, separated by commas."""
        ended = self.record["cases"]
        return ", ".join(sorted({entry["reason"] for entry in ended if entry["status"] in ("failed", "timeout")}))

    @property
    def warnings(self) -> list[str]:
        """Warnings about the results, each after the folder of its case."""
        return [f"{case.folder.name}: {warning}" for case in self.cases if case.folder for warning in case.warnings]

    def plot(self, folder: Path | str | None = None, **options: Any) -> list[Path]:
        """Draw the sweep, as `pairsim plot` does.

        Args:
            folder: Where to; the sweep's folder by default.
            options: `formats`, `width`, `group` and `panels` of `pairsim.plot`.

        Returns:
            Paths of the pictures.
        """
        from pairsim.api.pictures import plot

        return plot(self.folder, out=folder, **options)

    def _headline(self) -> str:
        counts = ", ".join(f"{count} {status}" for status, count in self.record["counts"].items() if count)
        return f"pairsim sweep {self.record['name']}: {counts}, {self.folder}"

    def __repr__(self) -> str:
        return f"<{self._headline()}>"

    def _repr_html_(self) -> str:
        return f"<p><b>{escape(self._headline())}</b></p>{self.table.to_html(max_rows=SHOWN, index=False)}"


def sweep(
    grid: str | PathLike[str] | Mapping[str, Any],
    *,
    folder: str | PathLike[str],
    workers: int = 1,
    progress: bool | Style = False,
    signals: bool = False,
    only_failed: bool = False,
    limit: int | None = None,
    case_timeout: float | None = None,
) -> SweepResult:
    """Compute every case of a grid that is not finished yet, in child processes.

    Under mpirun, all processes call this function and each computes cases.

    Args:
        grid: Path of a grid file, or a dict of its keys: base, grid, zip, cases, exclude, command.
        folder: Folder of the sweep; made, or continued.
        workers: Cases that are computed at the same time, without mpirun.
        progress: Show progress on stderr: True, "bar" or "lines".
        signals: End in order at SIGINT and SIGTERM, as the command line does. Without it no signal handler is
            installed; a KeyboardInterrupt stops the running cases, and the same call continues later.
        only_failed: Repeat the cases that failed or timed out, and nothing else.
        limit: Cases to start at most.
        case_timeout: Allowed wall time of a case, in seconds.

    Returns:
        The result, also if cases failed or the sweep was interrupted.

    Raises:
        InputError: The grid is invalid, the folder belongs to another grid, or another sweep is writing to it.
    """
    if isinstance(workers, bool) or not isinstance(workers, int) or workers < 1:
        raise InputError("pairsim.sweep", "workers", workers, "must be a whole number of at least 1")
    checked = grid_from(Path("grid"), section_of(plain(grid))) if isinstance(grid, Mapping) else read_grid(Path(grid))
    comm = launcher_communicator()
    reporter = make_reporter(style_of(progress), comm.rank if comm else 0)
    options = Options(limit=limit, only_failed=only_failed, case_timeout=case_timeout, workers=workers, signals=signals)
    run_sweep(checked, Path(folder), options, comm, reporter)
    if comm:
        comm.Barrier()
    return SweepResult(Path(folder))
