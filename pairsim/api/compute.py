"""Compute one case: `run`, `curve` and `critical`."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import asdict
from os import PathLike
from pathlib import Path
from typing import Any, cast

import pairsim.runtime.fenicsx  # noqa: F401  # before everything else that loads MPI or is compiled

# isort: split
from pairsim.api.cases import AnyCase, load
from pairsim.api.results import CriticalResult, CurveResult, Result, RunResult, result_of
from pairsim.commands import COMMANDS, Command
from pairsim.drivers.progress import Style, make_reporter, style_of
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
        WriteFailure: The first files of the folder or the last run.json cannot be written.
    """
    if resume and folder is None:
        raise InputError("pairsim.run", "resume", resume, "must be left out without a folder, which has the checkpoint")
    how = folder, overwrite and not resume, progress, signals
    return cast(RunResult, compute(COMMANDS["run"], case, *how, overrides, resume=resume))


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
        WriteFailure: The first files of the folder or the last run.json cannot be written.
    """
    how = folder, overwrite, progress, signals
    return cast(CurveResult, compute(COMMANDS["curve"], case, *how, overrides, sensitivities=sensitivities))


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
        WriteFailure: The first files of the folder or the last run.json cannot be written.
    """
    how = folder, overwrite, progress, signals
    return cast(CriticalResult, compute(COMMANDS["critical"], case, *how, overrides))


def function_of(command: Command[Any]) -> Callable[..., Result]:
    """The function of a command that has none of its own here; its arguments are those of `critical` and its flags."""

    def function(
        case: AnyCase,
        *,
        folder: Folder = None,
        overwrite: bool = False,
        progress: bool | Style = False,
        signals: bool = False,
        **overrides: Any,
    ) -> Result:
        more = {flag.name: overrides.pop(flag.name, False) for flag in command.flags}
        result: Result = compute(command, case, folder, overwrite, progress, signals, overrides, **more)
        return result

    function.__name__, function.__doc__ = command.name, command.about
    return function


def compute(
    command: Command[Any],
    case: AnyCase,
    folder: Folder,
    overwrite: bool,
    progress: bool | Style,
    signals: bool,
    overrides: Mapping[str, Any],
    **more: Any,
) -> Any:
    """Compute a case in a folder; if none is given, in a temporary folder whose files are read and removed.

    Args:
        command: The command.
        case, folder, overwrite, progress, signals, overrides: As for `run`.
        more: Keywords of the command's own.

    Returns:
        The result of the command.
    """
    checked = load(case, kind=command.name, **overrides)
    reporter = make_reporter(style_of(progress))
    options = Options(overwrite, reporter, command_line(), signals)
    directory = Path(tempfile.mkdtemp(prefix="pairsim-") if folder is None else folder)
    try:
        outcome = command.compute(checked, directory, options, **more)
        result = result_of(command, directory, asdict(outcome))
        if style_of(progress) != "none":
            reporter.answer(result.answer, result.status, result.warnings)
        return result if folder is not None else result.in_memory()
    finally:
        if folder is None:
            shutil.rmtree(directory, ignore_errors=True)
