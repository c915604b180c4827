"""A viscosity law with a structure, a field of its own that the liquid carries along: thixotropy after Moore (1959)."""

from __future__ import annotations

from contextlib import closing
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import pytest
from scipy.optimize import brentq

from pairsim.fem.meshes.geometry import MeshSettings
from pairsim.laws import Field, StructuredLaw, ViscousLaw, operations
from pairsim.physics.homogeneous import steady_shear
from pairsim.physics.liquids import Liquid, single
from pairsim.physics.material import parameter
from pairsim.physics.pipe import Pipe
from pairsim.physics.solids import soft
from pairsim.solvers.check_law import checks
from pairsim.solvers.curves.branch import Branch
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.problems import SteadyProblem
from pairsim.solvers.steady.ends import arrived
from pairsim.solvers.steady.first_solution import first_scene

ETA_INF = 0.2


@dataclass(frozen=True)
class Moore(StructuredLaw):
    """Dl/Dt = k1 (1 - l) - k2 gamma l, eta/eta_0 = eta_inf + l (1 - eta_inf)."""

    label = "Moore"
    words = "thixotropy: shear breaks down a structure that builds up at rest"
    transported: ClassVar[tuple[Field, ...]] = (
        Field("lambda", 2, transported=True, rest=1.0, step_weight=0.4, most_change=0.3),
    )

    k1: Any = parameter("k_1", "rate at which structure builds up", 1e-3, 1e6)
    k2: Any = parameter("k_2", "structure broken down by a unit of strain", 0.0, 1e6)

    def viscosity_at(self, gamma2: Any, *state: Any) -> Any:
        (structure,) = state
        return ETA_INF + structure * (1 - ETA_INF)

    def rates(self, gamma2: Any, *state: Any) -> tuple[Any, ...]:
        (structure,) = state
        return (self.k1 * (1 - structure) - self.k2 * operations.sqrt(gamma2) * structure,)

    def in_steady_shear(self, gamma2: Any) -> tuple[Any, ...]:
        return (self.k1 / (self.k1 + self.k2 * operations.sqrt(gamma2)),)

    @property
    def memory(self) -> Any:
        return 1 / self.k1


@dataclass(frozen=True)
class Thinning(ViscousLaw):
    """The viscosity of the same liquid where its structure follows the shear rate at once."""

    ratio: Any = parameter("k_2/k_1", "structure that a shear rate breaks down", 0.0, 1e6)

    def viscosity(self, gamma2: Any) -> Any:
        return ETA_INF + (1 - ETA_INF) / (1 + self.ratio * operations.sqrt(gamma2))


# Not in their classes, by which laws are found: these are no laws of a user.
Moore.name, Thinning.name = "moore", "thinning"
LAW = Moore(k1=2.0, k2=0.5)


def test_a_law_with_a_structure_holds_what_all_laws_must() -> None:
    """Jacobian, and start-up in a tube beside that of one dimension, too."""
    assert [check for check in checks(LAW) if not check.holds] == []


def test_viscosity_in_steady_shear_is_that_of_its_structure() -> None:
    rates = np.array([0.1, 1.0, 10.0])
    expected = ETA_INF + (1 - ETA_INF) / (1 + 0.25 * rates)
    assert steady_shear(single(LAW), rates)[0] == pytest.approx(expected, rel=1e-12)


def test_developed_flow_is_that_of_a_quadrature() -> None:
    x, w = np.polynomial.legendre.leggauss(100)
    r, w = (x + 1) / 4, w / 4

    def mean(gradient: float) -> float:
        law = Thinning(ratio=0.25)
        rates = [brentq(lambda g, s=s: law.viscosity(g**2) * g - s, 0, 1e4) for s in gradient * r / 2]
        return float(4 * w @ (r**2 * rates))

    wanted = brentq(lambda gradient: mean(gradient) - 1, 1, 40)
    developed = Pipe(single(LAW)).steady()
    assert developed.gradient == pytest.approx(wanted, rel=1e-9)
    started = Pipe(single(LAW)).until(10.0)
    assert started(10.0).gradient == pytest.approx(wanted, rel=1e-7)
    assert started(0.0).gradient == pytest.approx(32.0, rel=1e-9), "everywhere at rest: a Newtonian liquid"
    assert developed.profiles(developed.r)["lambda"][0] == pytest.approx(1.0, abs=1e-5)


@pytest.mark.slow
def test_a_structure_that_follows_at_once_is_a_viscosity_that_depends_on_the_shear_rate() -> None:
    """dU of a soft pair as k1 grows at fixed k2/k1, beside that of the generalised Newtonian liquid."""

    def dU(liquid: Liquid) -> float:
        mesh, start = MeshSettings(Np=10), Parameters((0.2,), soft(0.1, 0.1), liquid)
        problem = SteadyProblem(betas=(0.4, 0.4), length=4.0, periodic=False, mesh=mesh, narrowest=0.2)
        with closing(Branch(arrived(first_scene(problem, start)))) as branch:
            return float(arrived(branch.at(start)).discrete.dU[0])

    wanted = dU(single(Thinning(ratio=0.25)))
    slow, fast, faster = (dU(single(Moore(k1=k1, k2=k1 / 4))) for k1 in (2.0, 200.0, 2e4))
    assert abs(slow - wanted) > 0.5 * abs(wanted), "its memory makes a difference"
    assert abs(fast - wanted) < 0.1 * abs(slow - wanted)
    assert faster == pytest.approx(wanted, rel=0.02)
