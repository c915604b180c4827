"""Compute one case: `run`, `curve` and `critical`."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Callable
from dataclasses import asdict
from os import PathLike
from pathlib import Path
from typing import Any

import pairsim.runtime.fenicsx  # noqa: F401  # before everything else that loads MPI or is compiled

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
        The result, also if the computation failed or was interrupted: see its `status`, or call its `check`.

    Raises:
        InputError: The case or the folder cannot be used.
        WriteFailure: Results cannot be written.
    """
    checked = load(case, kind="run", **overrides)
    if resume and folder is None:
        raise InputError("pairsim.run", "resume", resume, "must be left out without a folder, which has the checkpoint")

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
    """Compute the quasi-steady master curve dU(d) of a case, and its zeros.

    The case has `d` in place of `d0`.

    Args:
        case: Path of a case file, a dict of its keys, or a case from `load`.
        folder: Folder for curve.csv, equilibria.csv, case.yaml and run.json. None: no files are kept.
        overwrite: As for `run`.
        sensitivities: Whether to compute the derivatives of dU with respect to Ca_e, De and beta at fixed d.
        progress: As for `run`.
        signals: As for `run`.
        overrides: Keys to replace, as for `load`.

    Returns:
        The result, also if the computation failed or was interrupted.

    Raises:
        InputError: The case or the folder cannot be used.
        WriteFailure: The first files of the folder cannot be written.
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
    """Find the distances at which dU = 0, and follow them over Ca_e or De.

    The case has `along`, and `d` with the least and the largest distance.

    Args:
        case: Path of a case file, a dict of its keys, or a case from `load`.
        folder: Folder for critical.csv, case.yaml and run.json. None: no files are kept.
        overwrite: As for `run`.
        progress: As for `run`.
        signals: As for `run`.
        overrides: Keys to replace, as for `load`.

    Returns:
        The result, also if the computation failed or was interrupted.

    Raises:
        InputError: The case or the folder cannot be used.
        WriteFailure: The first files of the folder cannot be written.
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
    """Compute in a folder; if none is given, in a temporary folder whose files are read and removed."""
    reporter = make_reporter(style_of(progress))
    options = Options(overwrite, reporter, command_line(), signals)
    directory = Path(tempfile.mkdtemp(prefix="pairsim-") if folder is None else folder)
    try:
        result = kind(directory, asdict(work(directory, options)))
        if style_of(progress) != "none":
            reporter.answer(result.answer, result.status, result.warnings)
        return result if folder is not None else result.in_memory()
    finally:
        if folder is None:
            shutil.rmtree(directory, ignore_errors=True)
