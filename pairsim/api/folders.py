"""Results from folders: `open`."""

from __future__ import annotations

from os import PathLike
from pathlib import Path

from pairsim.api.results import KINDS, CriticalResult, CurveResult, RunResult
from pairsim.api.sweeps import SweepResult
from pairsim.results.folders import kind_of, read_record
from pairsim.results.output import FORMAT
from pairsim.runtime.errors import InputError


def open_folder(folder: str | PathLike[str]) -> RunResult | CurveResult | CriticalResult | SweepResult:
    """Read the results in a folder of `run`, `curve`, `critical` or `sweep`, of this or an earlier version of pairsim.

    Args:
        folder: The folder. The computation may still go on: what is there when it is asked for is read.

    Returns:
        The same result as that of the function which computed it.

    Raises:
        InputError: The folder holds no results, those of a study, or a format that this version does not know.
    """
    path = Path(folder)
    kind = kind_of(path)
    if kind == "sweep":
        return SweepResult(path)
    if kind == "study":
        raise InputError(str(path), "", None, "holds a study: read study.csv, or open one of its sweeps, sweep-1 ...")
    number = read_record(path).get("format", FORMAT)  # early records have none
    if not isinstance(number, int) or number > FORMAT:
        allowed = f"must be at most {FORMAT}; a newer pairsim wrote this folder"
        raise InputError(str(path / "run.json"), "format", number, allowed)
    return KINDS[kind](path)
