"""A fixed step is kept, shortened only to land on an output, or ends the run."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import pairsim
from pairsim.errors import NewtonFailure

PAIR = {"beta": 0.4, "De": 0, "Ca_e": 0.1, "d0": 0.1, "ends": "developed", "length": 4, "mesh": {"Np": 8}}
PAIR |= {"output": {"fields": False}}


def fixed(step: float, end: float, **keys: Any) -> pairsim.RunResult:
    """A run with a fixed step."""
    return pairsim.run({**PAIR, "time": {"fixed_step": step, "end": end}, **keys})


def steps(result: pairsim.RunResult) -> list[float]:
    """The sizes of the steps of a finished run."""
    return list(np.diff(result.check().table["t"], prepend=0.0))


@pytest.mark.slow
def test_fixed_step_is_kept_from_the_first_one_on() -> None:
    coarse, fine = fixed(0.1, 0.5), fixed(0.01, 0.5)
    assert steps(coarse) == pytest.approx([0.1] * 5)
    assert coarse.table["newton"].iloc[0] < 40
    assert coarse.table["dU"].iloc[-1] == pytest.approx(fine.check().table["dU"].iloc[-1], rel=0.1)


def test_fixed_step_is_shortened_to_land_on_an_output_alone() -> None:
    assert steps(fixed(0.02, 0.1, output={"times": [0.05]})) == pytest.approx([0.02, 0.015, 0.015] * 2)


def test_fixed_step_that_cannot_be_solved_ends_the_run() -> None:
    with pytest.raises(NewtonFailure, match=r"fixed_step = 20 failed at t = 0: .*smaller time.fixed_step"):
        fixed(20.0, 40.0).check()
