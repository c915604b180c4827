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
        InputError: The folder has no results or those of a study.
    """
    path = Path(folder)
    kind = kind_of(path)
    if kind == "sweep":
        return SweepResult(path)
    if kind == "study":
        raise InputError(
            str(path),
            "",
            None,
            "must not be a folder of study: read its study.csv, or open one of its sweeps, sweep-1 ...",
        )
    if kind not in QUESTIONS:
        raise InputError(str(path / "run.json"), "kind", kind, f"must be {' or '.join(QUESTIONS)}")
    return QUESTIONS[kind].result(QUESTIONS[kind], path)
