"""Results from folders: `open`."""

from __future__ import annotations

import json
from os import PathLike
from pathlib import Path

from pairsim.api.results import KINDS, CriticalResult, CurveResult, RunResult
from pairsim.api.sweeps import SweepResult
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
    if not path.is_dir():
        raise InputError(str(path), "", None, "no such folder; give a folder of results")
    if any(path.glob("sweep.json")) or any(path.glob("sweep-*-of-*.json")):
        return SweepResult(path)
    if (path / "study.csv").is_file():
        raise InputError(str(path), "", None, "holds a study: read study.csv, or open one of its sweeps, sweep-1 ...")
    return open_case(path)


def open_case(path: Path) -> RunResult | CurveResult | CriticalResult:
    """Read the folder of one case.

    Raises:
        InputError: It holds no results, or a format that this version does not know.
    """
    try:
        record = json.loads((path / "run.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        record = {}
    number, name = record.get("format", 0), record.get("kind")  # a record without them is of format 1 as well
    if not isinstance(number, int) or number > FORMAT:
        allowed = f"at most {FORMAT}; a newer pairsim wrote this folder"
        raise InputError(str(path / "run.json"), "format", number, allowed)
    if name is None:
        name = next((kind for kind, result in KINDS.items() if (path / result.table_name).is_file()), None)
    if name not in KINDS:
        tables = ", ".join(result.table_name for result in KINDS.values())
        raise InputError(str(path), "", None, f"holds no results of pairsim: none of {tables}, sweep.json")
    return KINDS[name](path)
