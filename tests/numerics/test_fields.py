"""Fields that a law declares: whatever is done with one of them follows from its declaration."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import pytest
from support.scenes import march, soft_pair

from pairsim.fem.meshes.geometry import MeshSettings
from pairsim.physics.fields import PRESSURE, VELOCITY, Field
from pairsim.physics.liquids import LAWS, Liquid, Newtonian, liquid
from pairsim.physics.liquids.conformation import LOG_CONFORMATION
from pairsim.physics.liquids.structured import StructuredLaw
from pairsim.physics.pipe import Pipe
from pairsim.solvers.mesh_transfer import carry_liquid, free_unknowns
from pairsim.solvers.stepping.step_size import StepControl
from pairsim.solvers.transient.transient import Transient

GIESEKUS = LAWS["giesekus"]()
TWO_MODES = Liquid(Newtonian(), 0.09, 0.5, (replace(GIESEKUS, weight=0.6), replace(GIESEKUS, time=0.2, weight=0.4)))
STRUCTURE = Field("lambda", 2, transported=True, rest=1.0)


@dataclass(frozen=True)
class Structured(StructuredLaw):
    """A viscosity law that declares a field."""

    transported: ClassVar[tuple[Field, ...]] = (STRUCTURE,)


PAIR = soft_pair(
    *(0.4, 0.1, 0.1),
    mesh=MeshSettings(Np=6),
    control=StepControl(3e-4, 1e-8, 2.0, fixed=1e-3),
    length=4.0,
    periodic=False,
    liquid=TWO_MODES,
    t_end=0.1,
)


@pytest.fixture
def pair() -> Iterator[Transient]:
    """Two soft spheres in a liquid of two modes, at rest."""
    transient = Transient(PAIR)
    yield transient
    transient.close()


def test_conformations_of_all_modes_are_one_field() -> None:
    assert TWO_MODES.fields == (VELOCITY, PRESSURE, LOG_CONFORMATION.times(2))
    assert (TWO_MODES.transported[0].components, TWO_MODES.transported[0].odd) == (8, (1, 5))


def test_a_liquid_has_the_fields_that_its_laws_declare() -> None:
    both = Liquid(Structured(), 0.5, 0.5, (GIESEKUS,))
    assert both.transported == (STRUCTURE, LOG_CONFORMATION)
    assert Liquid(Structured()).has_memory
    assert not Liquid(Structured()).newtonian
    assert not Liquid().has_memory


def test_developed_flow_has_what_the_liquid_carries_along() -> None:
    profiles = Pipe(TWO_MODES).steady().profiles(np.array([0.0, 0.2, 0.5]))
    assert {name: values.shape for name, values in profiles.items()} == {"u": (3, 1), "s": (3, 8)}
    newtonian = Pipe(Liquid()).steady().profiles(np.array([0.0, 0.5]))
    assert list(newtonian) == ["u"]
    assert newtonian["u"][:, 0] == pytest.approx([2.0, 0.0], abs=1e-12)


def test_every_field_is_carried_to_another_mesh(pair: Transient) -> None:
    """Onto the same mesh each one as it is, but for the displacement, which is made there."""
    scene, random = pair.scene, np.random.default_rng(0)
    x = random.standard_normal(scene.size)
    scene.liquid.nodal("eta", x)[:] = 0.0
    new = carry_liquid(scene, x, scene, np.zeros(scene.size))
    for field in scene.liquid.fields:
        assert scene.liquid.nodal(field.name, new) == pytest.approx(scene.liquid.nodal(field.name, x), abs=1e-9)


def test_free_unknowns_are_those_of_all_fields(pair: Transient) -> None:
    constraints, random = pair.constraints, np.random.default_rng(0)
    y, own = random.standard_normal(constraints.size), [field.unknowns for field in pair.scene.liquid.fields]
    assert own == ["u", "p_f", "s", "eta"]
    found = free_unknowns(pair.scene, constraints, constraints.N @ y)
    for name, at in constraints.fields.items():
        assert found[at] == pytest.approx(y[at] if name in own else 0.0)


def test_error_of_a_step_counts_fields_by_their_weights(monkeypatch: pytest.MonkeyPatch) -> None:
    """Stresses build up before anything has moved: the error is theirs."""
    errors = []
    for factor in (1.0, 10.0):
        weight = factor * LOG_CONFORMATION.step_weight
        monkeypatch.setattr(f"{liquid.__name__}.LOG_CONFORMATION", replace(LOG_CONFORMATION, step_weight=weight))
        errors.append(march(PAIR, [4e-3])[-1].error)
    assert errors[1] == pytest.approx(10 * errors[0], rel=1e-9)
