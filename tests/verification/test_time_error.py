"""A fixed step is kept, shortened only to land on an output, or ends the run."""

from __future__ import annotations

import pytest
from support.scenes import dU, march, soft_pair

from pairsim.fem.geometry import MeshSettings
from pairsim.runtime.errors import NewtonFailure
from pairsim.solvers.step_size import StepControl

COARSE = MeshSettings(Np=12)


def fixed(step: float) -> StepControl:
    return StepControl(3e-4, 1e-8, 2.0, fixed=step)


def test_fixed_step_is_kept_from_the_first_one_on() -> None:
    steps = march(soft_pair(0.4, 0.1, 0.1, mesh=COARSE, control=fixed(0.1)), [0.5])
    assert [step.dt for step in steps] == pytest.approx([0.1] * 5)
    assert steps[0].report.iterations < 40
    fine = march(soft_pair(0.4, 0.1, 0.1, mesh=COARSE, control=fixed(0.01)), [0.5])
    assert dU(steps[-1]) == pytest.approx(dU(fine[-1]), rel=0.1)


def test_fixed_step_is_shortened_to_land_on_an_output_alone() -> None:
    steps = march(soft_pair(0.4, 0.1, 0.1, mesh=COARSE, control=fixed(0.02)), [0.05, 0.1])
    assert [step.dt for step in steps] == pytest.approx([0.02, 0.015, 0.015] * 2)


def test_fixed_step_that_cannot_be_solved_ends_the_run() -> None:
    problem = soft_pair(0.4, 0.1, 0.1, mesh=COARSE, control=fixed(20.0))
    with pytest.raises(NewtonFailure, match=r"fixed_step = 20 failed at t = 0: .*smaller time.fixed_step"):
        march(problem, [40.0])
