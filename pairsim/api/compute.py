"""Computing one case: `run`, `curve` and `critical`."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Callable
from dataclasses import asdict
from os import PathLike
from pathlib import Path
from typing import Any

from pairsim.runtime.fenicsx import MPI  # before everything else that loads MPI or is compiled

# isort: split
from pairsim.api.cases import AnyCase, load
from pairsim.api.results import CriticalResult, CurveResult, Result, RunResult
from pairsim.drivers.critical import run_critical
from pairsim.drivers.curve import run_curve
from pairsim.drivers.outcome import Outcome
from pairsim.drivers.progress import Style, make_reporter, style_of
from pairsim.drivers.run import run_case
from pairsim.drivers.session import Options
from pairsim.runtime.errors import InputError
from pairsim.runtime.launcher import check_launcher
from pairsim.runtime.locks import command_line

Folder = str | PathLike[str] | None


def run(
    case: AnyCase,
    *,
    folder: Folder = None,
    overwrite: bool = False,
    resume: bool = False,
    progress: bool | Style = False,
    signals: bool = False,
    **overrides: Any,
) -> RunResult:
    """Compute a case in time.

    Under mpirun every process calls this, computes its share and gets the result.

    Args:
        case: Path of a case file, a dict of its keys, or a case from `load`.
        folder: Where series.csv, fields.xdmf, case.yaml and run.json go; None: nothing is written.
        overwrite: Replace earlier results in the folder.
        resume: Continue from the folder's checkpoint, or begin where there is none.
        progress: Show progress on stderr: True, or one of "bar", "lines" and "json".
        signals: End in order at SIGINT and SIGTERM, as the command line does. Without it no signal handler is
            installed; a KeyboardInterrupt ends the computation, and what was computed until then is returned.
        overrides: Keys to replace, as for `load`.

    Returns:
        The result, also where the computation failed or was interrupted: see its `status`, or call its `check`.

    Raises:
        InputError: The case or the folder cannot be used.
        WriteFailure: Results cannot be written.
        KeyboardInterrupt: On several processes, which would otherwise wait for each other.
    """
    checked = load(case, kind="run", **overrides)
    if resume and folder is None:
        raise InputError("pairsim.run", "resume", resume, "goes with folder, which has the checkpoint")

    def work(directory: Path, options: Options) -> Outcome:
        return run_case(checked, directory, options, resume=resume)

    return _computed(RunResult, work, folder, overwrite and not resume, progress, signals)


def curve(
    case: AnyCase,
    *,
    folder: Folder = None,
    overwrite: bool = False,
    sensitivities: bool = False,
    progress: bool | Style = False,
    signals: bool = False,
    **overrides: Any,
) -> CurveResult:
    """Solve the quasi-steady master curve dU(d) of a case, and its zeros.

    The case has `d` in place of `d0`. Arguments, result and errors are those of `run`, but for one.

    Args:
        sensitivities: Add the derivatives of dU by Ca_e, De and beta at the same d.
    """
    checked = load(case, kind="curve", **overrides)

    def work(directory: Path, options: Options) -> Outcome:
        return run_curve(checked, directory, options, sensitivities=sensitivities)

    return _computed(CurveResult, work, folder, overwrite, progress, signals)


def critical(
    case: AnyCase,
    *,
    folder: Folder = None,
    overwrite: bool = False,
    progress: bool | Style = False,
    signals: bool = False,
    **overrides: Any,
) -> CriticalResult:
    """Find the distances at which a pair neither separates nor collides, and follow them over Ca_e or De.

    The case has `along`, and `d` as the least and the largest distance. Arguments, result and errors are those of
    `run`.
    """
    checked = load(case, kind="critical", **overrides)

    def work(directory: Path, options: Options) -> Outcome:
        return run_critical(checked, directory, options)

    return _computed(CriticalResult, work, folder, overwrite, progress, signals)


def _computed[R: Result](
    kind: type[R],
    work: Callable[[Path, Options], Outcome],
    folder: Folder,
    overwrite: bool,
    progress: bool | Style,
    signals: bool,
) -> R:
    """Compute into a folder; without one into a temporary folder which is read and removed."""
    comm = MPI.COMM_WORLD
    check_launcher(comm)
    options = Options(comm, overwrite, make_reporter(style_of(progress), comm.rank), command_line(), signals)
    if folder is not None:
        outcome = work(Path(folder), options)
        _wait_for_all(outcome, options)
        return kind(Path(folder), asdict(outcome))
    directory = comm.bcast(Path(tempfile.mkdtemp(prefix="pairsim-")) if comm.rank == 0 else None)
    try:
        outcome = work(directory, options)
        _wait_for_all(outcome, options)
        return comm.bcast(kind(directory, asdict(outcome)).in_memory() if comm.rank == 0 else None)
    finally:
        if comm.rank == 0:
            shutil.rmtree(directory, ignore_errors=True)


def _wait_for_all(outcome: Outcome, options: Options) -> None:
    """Let the first process finish its files, which all are about to read.

    Raises:
        KeyboardInterrupt: One has stopped several processes, of which others may still be anywhere in the computation.
    """
    if outcome.status != "interrupted":
        options.comm.Barrier()
    elif options.comm.size > 1 and not options.signals:
        raise KeyboardInterrupt
