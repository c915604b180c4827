"""The Python functions of questions, such as `pairsim.curve`, made from their records."""

from __future__ import annotations

from typing import Any

from pairsim.questions.compute import Computation
from pairsim.questions.registry import QUESTIONS
from pairsim.sweeps.files import FILES


def function_of(name: str) -> Computation[Any]:
    """The function of a question."""
    return Computation(QUESTIONS[name], FILES)
