"""Open folders of results: `open`."""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import Any

from pairsim.api.sweeps import SweepResult
from pairsim.computing import QUESTIONS
from pairsim.results.folder import kind_of
from pairsim.runtime.errors import InputError


def open(folder: str | PathLike[str]) -> Any:
    """Open the results of a question such as `curve`, or of `sweep`.

    Args:
        folder: The folder of results. The computation may still be running; files are read when first accessed.

    Returns:
        A result of the same type as that of the function which computed it.

    Raises:
        InputError: The folder has no results, or those of a study, which is its study.csv.
    """
    path = Path(folder)
    kind = kind_of(path)
    if kind == "sweep":
        return SweepResult(path)
    if kind not in QUESTIONS:
        allowed = f"must be a folder of {', '.join(QUESTIONS)} or sweep, not of `pairsim {kind}`"
        raise InputError(str(path), "", None, allowed)
    return QUESTIONS[kind].result(QUESTIONS[kind], path)
