"""Runs in a flow that varies in time, solved in process without files."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from pairsim.cases.run_case import Case
from pairsim.computing.case_files import parse_case
from pairsim.computing.problems import problem_of
from pairsim.physics.waveform import Waveform
from pairsim.questions.registry import QUESTIONS
from pairsim.solvers.stepping.step import Step
from pairsim.solvers.transient.cycles import Cycles
from pairsim.solvers.transient.transient import Transient


def case_of(**keys: Any) -> Case:
    """A case of a run."""
    return parse_case(QUESTIONS["run"], keys, "test")


def pulses(waveform: dict[str, Any], end: float, **keys: Any) -> tuple[list[Step], Cycles | None, Waveform]:
    """All steps of a run up to a time, what its cycles were, and its flow."""
    case = case_of(**keys, waveform=waveform)
    transient = Transient(replace(problem_of(case), t_end=end))
    try:
        steps = list(transient.steps(iter([end])))
        return steps, transient.cycles, case.drive.waveform  # type: ignore[return-value]
    finally:
        transient.close()
