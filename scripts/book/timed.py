"""Cases that are computed in separate processes, with the processor time that each takes."""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Any

from book.apart import apart
from book.study import Stopped


def timed(question: str, case: Mapping[str, Any]) -> tuple[Any, float]:
    """The result of a case and its processor time, without that for loading libraries [s].

    Args:
        question: Such as "curve".
        case: Keys and values.

    Raises:
        InputError: A key or value is not allowed.
        Stopped: The study was stopped.
    """
    result, seconds = apart(_timed, question, dict(case))
    if result.status == "interrupted":
        raise Stopped
    return result, seconds


def _timed(question: str, case: dict[str, Any]) -> tuple[Any, float]:
    import pairsim.runtime.fenicsx  # noqa: F401  # is no part of the time
    from pairsim.app.question_functions import function_of

    begin = time.process_time()
    result = function_of(question)(case)
    return result, time.process_time() - begin
