"""When a run makes a new mesh, where the stress is balanced there, and how it takes its first step."""

from __future__ import annotations

from collections.abc import Container
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pytest

from pairsim.fem.algebra.scene_constraints import balance_constraints
from pairsim.fem.diagnostics import liquid_distortion
from pairsim.fem.meshes.geometry import MeshSettings
from pairsim.fem.scene import Scene
from pairsim.physics.liquids import single
from pairsim.physics.liquids.giesekus import Giesekus
from pairsim.physics.solids import soft
from pairsim.physics.solids.kelvin_voigt import KelvinVoigt
from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import InvertedCell
from pairsim.solvers.mesh_transfer import free_unknowns
from pairsim.solvers.stepping.step_size import StepControl
from pairsim.solvers.transient.transient import Step, Transient
from tests.support.scenes import soft_pair

GIESEKUS = single(Giesekus(), De=1.0)
FIXED, CONTROLLED = StepControl(3e-4, 1e-8, 2.0, fixed=0.02), StepControl(3e-4, 1e-8, 2.0)


@dataclass
class Attempts:
    """Every attempted step, counted from 1; in some Newton's method diverges, in others a cell is inverted."""

    failing: int = 0
    inverting: Container[int] = ()
    found: list[dict[str, Any]] = field(default_factory=list)


@pytest.fixture
def attempts(monkeypatch: pytest.MonkeyPatch) -> Attempts:
    known = Attempts()
    attempt = Transient._attempt

    def watched(self: Transient, dt: float, gradually: bool = False) -> Any:
        *others, report, error = attempt(self, dt, gradually)
        known.found.append({"t": self.history.t[0], "dt": dt, "gradually": gradually, "mesh": self.counts.remeshings})
        return *others, replace(report, converged=report.converged and len(known.found) != known.failing), error

    def distortion(scene: Scene, x: Array) -> float:
        return -0.1 if len(known.found) in known.inverting else liquid_distortion(scene, x)

    monkeypatch.setattr(Transient, "_attempt", watched)
    monkeypatch.setattr("pairsim.fem.diagnostics.liquid_distortion", distortion)
    return known


def first_steps(number: int, control: StepControl = CONTROLLED, new_mesh_after: int = 0, **changes: Any) -> list[Step]:
    """The first steps of a soft pair on coarse cells."""
    problem = soft_pair(0.4, 0.1, 0.1, control=control, mesh=MeshSettings(Np=8), length=4.9, **changes)
    transient = Transient(problem)
    found = []
    try:
        for step in transient.steps(iter([1.0])):
            found.append(step)
            transient._due = len(found) == new_mesh_after
            if len(found) == number:
                break
    finally:
        transient.close()
    return found


@pytest.mark.parametrize(("control", "gradually"), [(FIXED, [True, False, True]), (CONTROLLED, [True, False, False])])
def test_fixed_steps_begin_gradually_on_every_mesh(
    control: StepControl, gradually: list[bool], attempts: Attempts
) -> None:
    """A prescribed step cannot be made smaller where the first guess is interpolated."""
    found = first_steps(3, control, new_mesh_after=2)
    assert [step.mesh_id for step in found] == [0, 0, 1]
    assert [attempt["gradually"] for attempt in attempts.found] == gradually


@pytest.mark.parametrize(("failing", "inverting"), [(4, ()), (0, (4,))], ids=["diverges", "inverts a cell"])
def test_step_that_fails_is_repeated_on_a_new_mesh(
    failing: int, inverting: tuple[int, ...], attempts: Attempts
) -> None:
    attempts.failing, attempts.inverting = failing, inverting
    assert [step.mesh_id for step in first_steps(4)] == [0, 0, 0, 1]
    failed, repeated = attempts.found[3:5]
    assert repeated == failed | {"mesh": 1}


def test_step_that_fails_on_a_new_mesh_is_made_smaller(attempts: Attempts) -> None:
    attempts.failing = 3
    assert [step.mesh_id for step in first_steps(3, new_mesh_after=2)] == [0, 0, 1]
    failed, repeated = attempts.found[2:4]
    assert repeated["t"] == failed["t"]
    assert repeated["dt"] < failed["dt"]


def test_smallest_step_that_inverts_a_cell_ends_the_run(attempts: Attempts) -> None:
    attempts.inverting = range(10)
    with pytest.raises(InvertedCell):
        first_steps(1, StepControl(3e-4, 1e-4, 2.0))
    assert len(attempts.found) == 2


def test_stress_is_balanced_on_a_new_mesh(monkeypatch: pytest.MonkeyPatch) -> None:
    """Once, in a viscoelastic liquid; test_viscoelastic.py shows what that is good for."""
    balanced = []

    def watched(scene: Scene, x: Array, *_: object) -> Array:
        balanced.append(scene)
        return x

    monkeypatch.setattr("pairsim.solvers.transient.scene.balanced", watched)
    *_, last = first_steps(2, new_mesh_after=1, liquid=GIESEKUS, solids=(None, None), t_end=1.0)
    assert balanced == [last.scene]
    first_steps(2, new_mesh_after=1)
    assert len(balanced) == 1


def test_stress_is_balanced_at_the_velocities_of_the_surfaces() -> None:
    """With the velocities of the material as unknowns the liquid has the velocity that it has in a step."""
    pair = soft_pair(0.4, 0.1, 0.1, mesh=MeshSettings(Np=8), length=4.0, periodic=False, liquid=GIESEKUS)
    transient = Transient(replace(pair, solids=soft(0.1, 0.0)))
    try:
        scene, constraints, h = transient.scene, transient.constraints, transient.history.h[0]
        y = np.random.default_rng(0).standard_normal(constraints.size)
        x = constraints.expand(y, h)
        balance = balance_constraints(scene, x)
        unknowns, material = free_unknowns(scene, balance, x), balance.V.tocoo()
        unknowns[material.col] = (constraints.M @ y)[material.row]
        assert scene.liquid.nodal("u", balance.expand(unknowns, h)) == pytest.approx(scene.liquid.nodal("u", x))
    finally:
        transient.close()


@pytest.mark.slow
@pytest.mark.parametrize("before", ["resumed", "after a rejected step"])
def test_viscous_particles_keep_their_velocity_over_a_remeshing(before: str) -> None:
    """The stress that is balanced on the new mesh contains that of the particles, whatever was assembled before."""
    pair = soft_pair(0.4, 0.1, 0.15, mesh=MeshSettings(Np=10), length=4.0, periodic=False, t_end=10.0)
    solid = KelvinVoigt(0.15, eta=2.0)
    problem = replace(pair, liquid=replace(GIESEKUS, De=0.5), solids=(solid, solid))
    transient = Transient(problem)
    steps = list(transient.steps(iter([0.1])))
    state = replace(transient.state, due=True)

    def next_dU() -> float:
        return float(next(transient.steps(iter([10.0]))).observation.dU[0])

    transient._due = True
    expected = next_dU()
    transient.close()
    transient = Transient(problem, state)
    if before == "after a rejected step":
        transient._attempt(20 * steps[-1].dt)
    assert next_dU() == pytest.approx(expected, rel=1e-3)
    transient.close()
