"""Soft spheres in a Newtonian tube against first-order theory in Ca_e and the statements of the paper's Fig. 6."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from studies.soft.bullet import modes_of_sphere
from studies.soft.references import F_3, F_5, S
from support.scenes import dU, march, soft_pair

import pairsim
from pairsim.fem.meshes.geometry import MeshSettings
from pairsim.solvers.nonlinear.newton import TRANSIENT
from pairsim.solvers.stepping.step_size import StepControl

PAIR = {"beta": 0.4, "De": 0, "Ca_e": 0.1, "d0": 0.1, "ends": "developed", "length": 4.9, "output": {"fields": False}}


def run(**keys: Any) -> pd.DataFrame:
    """The table of a run of the pair."""
    return pairsim.run({**PAIR, **keys}).check().table


@pytest.mark.slow
def test_a_nearly_rigid_pair_in_time_separates_as_first_order_theory() -> None:
    """When the stresses have developed and d has not moved; curves do so at other beta and d, too (test_curve.py)."""
    Ca = 1e-3
    time = {"end": 60 * Ca, "max_step": 3 * Ca, "first_step": Ca / 100}
    dU = run(Ca_e=Ca, length="auto", mesh={"Np": 20}, time=time)["dU"].iloc[-1]
    assert dU / Ca == pytest.approx(S[0.4, 0.1], rel=5e-3)


@pytest.mark.slow
def test_single_sphere_becomes_a_bullet() -> None:
    small = modes_of_sphere(1e-3, mesh=MeshSettings(Np=24), length=6.0, periodic=False)
    assert small[3] == pytest.approx(F_3, rel=3e-3)
    assert small[5] == pytest.approx(F_5, rel=3e-2)
    assert abs(small[2]) < 0.01


@pytest.mark.slow
def test_softness_gives_a_dip_and_then_a_separation_that_grows_with_it() -> None:
    """Fig. 6a: a negative relative velocity at first, then a positive one that grows with Ca_e."""
    late = []
    for Ca in (0.02, 0.1):
        series = run(Ca_e=Ca, mesh={"Np": 12}, time={"end": 1.0, "first_step": min(5e-4, Ca / 100)})
        assert series["dU"].min() < -0.03 * Ca
        late.append(series["dU"].iloc[-1])
    assert late == sorted(late)
    assert late[0] > 0


@pytest.mark.slow
@pytest.mark.parametrize(("Np", "end", "jump"), [(20, 1.6, 1e-2), pytest.param(40, 5.0, 2e-3, marks=pytest.mark.long)])
def test_remeshing_leaves_no_jump(Np: int, end: float, jump: float) -> None:
    """dU on the new mesh continues the parabola through the three steps before it."""
    series = run(Ca_e=0.15, mesh={"Np": Np}, time={"end": end, "max_step": 0.3})
    t, found, mesh = (series[name].to_numpy() for name in ("t", "dU", "mesh"))
    new = [k for k in range(3, len(t)) if mesh[k] != mesh[k - 1]]
    assert new
    for k in new:
        parabola = np.polyfit(t[k - 3 : k], found[k - 3 : k], 2)
        assert abs(np.polyval(parabola, t[k]) - found[k]) < jump * np.abs(found).max()


@pytest.mark.slow
def test_fixed_steps_leave_an_error_of_second_order_by_the_first_one() -> None:
    """dU and D keep what BDF1's first step leaves, of second order; the source m of the pressure gauge, which the
    time scheme leaves where volume and flux disagree, does not.
    """

    def states(dt: float) -> tuple[np.ndarray, float]:
        control = StepControl(1.0, 1e-12, 1.0, fixed=dt)
        scene = {"mesh": MeshSettings(Np=8), "length": 4.9, "periodic": False}
        problem = soft_pair(0.4, 0.1, 0.1, control=control, newton=replace(TRANSIENT, tolerance=1e-11), **scene)
        step = march(problem, [0.1])[-1]
        return np.array([dU(step), *step.observation.D]), step.observation.m

    (coarse, m_1), (middle, m_2), (fine, m_3) = (states(dt) for dt in (0.005, 0.0025, 0.00125))
    order = np.log2(np.abs((coarse - middle) / (middle - fine)))
    assert (order > 1.8).all()
    assert (order < 2.5).all()
    assert np.log2(m_1 / m_2) > 2.8
    assert np.log2(m_2 / m_3) > 2.8


@pytest.mark.slow
def test_default_steps_keep_one_percent_of_small_particles() -> None:
    """The tolerance is one of velocities, and dU is small at beta .2: 1e-3 would leave 1.2 % of its peak."""
    times = [0.1, 0.5, 1.0, 1.5]

    def found(**time: float) -> np.ndarray:
        keys = {"time": {"end": times[-1], **time}, "output": {"times": times}}
        series = run(beta=0.2, d0=0.2, length=4.4, mesh={"Np": 14}, **keys)
        return series["dU"][np.isin(series["t"].round(9), times)].to_numpy()

    fine = found(tol=3e-5)
    assert len(fine) == len(times)
    assert np.abs(found() - fine).max() < 0.01 * np.abs(fine).max()
