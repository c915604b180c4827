"""Every law by itself: shear, extension and small strains against closed forms; its flow in the tube; log c in UFL."""

from __future__ import annotations

import ast
import inspect
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import ufl
from scipy.integrate import quad
from scipy.linalg import expm
from scipy.optimize import brentq
from studies.tube.pipe import steady_shear

import pairsim
from pairsim.physics import liquids, solids
from pairsim.physics.conformation import polymer_stress
from pairsim.physics.homogeneous import extension, shear, stress_after
from pairsim.physics.kinematics import Expr
from pairsim.physics.liquids import ConformationLaw, Liquid, ViscousLaw, single
from pairsim.physics.liquids.bingham import Bingham
from pairsim.physics.liquids.carreau import Carreau
from pairsim.physics.liquids.conformation import Invariants
from pairsim.physics.liquids.fene_p import FeneP
from pairsim.physics.liquids.giesekus import Giesekus
from pairsim.physics.liquids.herschel_bulkley import HerschelBulkley
from pairsim.physics.liquids.newtonian import Newtonian
from pairsim.physics.liquids.oldroyd_b import OldroydB
from pairsim.physics.liquids.power_law import PowerLaw
from pairsim.physics.liquids.ptt import ExponentialPTT, LinearPTT
from pairsim.physics.liquids.white_metzner import WhiteMetzner
from pairsim.physics.liquids.yielding import Saramito2007, Saramito2009
from pairsim.physics.log_conformation import SMALL, LogConformation
from pairsim.physics.material import Material
from pairsim.physics.pipe import Pipe
from pairsim.physics.softest import WALL_RATE, beyond_tension, tension
from pairsim.physics.solids import Solid
from pairsim.physics.solids.kelvin_voigt import KelvinVoigt
from pairsim.physics.solids.mooney_rivlin import MooneyRivlin
from pairsim.physics.solids.neo_hookean import NeoHookean
from pairsim.solvers.check_law import checks

YIELDING = [Bingham(Bn=2.0), HerschelBulkley(Bn=0.5, n=0.5)]
VISCOUS: list[ViscousLaw] = [
    *(Newtonian(), PowerLaw(n=0.6), Carreau(n=0.5, Cu=3.0, a=1.5, eta_inf=0.1)),
    *YIELDING,
]
ELASTIC: list[ConformationLaw] = [
    *(OldroydB(), Giesekus(alpha=0.3), LinearPTT(epsilon=0.25), ExponentialPTT(epsilon=0.25), FeneP(L2=50.0)),
    WhiteMetzner(n=0.5, Cu=1.0),
]
SOLIDS: list[Solid] = [NeoHookean(0.1), KelvinVoigt(0.1, eta=2.0), MooneyRivlin(0.1, c=0.4)]
DE, XI = 0.8, 0.09


def name_of(law: Material) -> str:
    return law.name


def test_every_law_is_here() -> None:
    assert {law.name for law in (*VISCOUS, *ELASTIC)} == set(liquids.LAWS)
    assert {law.name for law in SOLIDS} == set(solids.LAWS)


def test_no_other_file_names_a_law() -> None:
    """But for the Newtonian liquid, in which a solvent, and a liquid without elasticity, has its law."""
    laws = [(law, Path(inspect.getfile(type(law)))) for law in (*VISCOUS[1:], *ELASTIC, *SOLIDS)]
    for file in Path(pairsim.__file__).parent.rglob("*.py"):
        nodes = list(ast.walk(ast.parse(file.read_text())))
        texts = {node.value for node in nodes if isinstance(node, ast.Constant)}
        names = {node.id for node in nodes if isinstance(node, ast.Name)}
        for law, own in laws:
            assert law.name not in texts or file == own, file
            assert type(law).__name__ not in names or file.parent == own.parent, file


QUICK = ("giesekus", "newtonian", "kelvin-voigt")


@pytest.mark.parametrize(
    "law",
    [
        pytest.param(law, marks=() if law.name in QUICK else pytest.mark.slow)
        for law in (*VISCOUS, *ELASTIC, *SOLIDS, Saramito2007(Bn=1.0), Saramito2009(Bn=0.5, n=0.5))
    ],
    ids=name_of,
)
def test_every_law_fulfils_what_own_laws_are_checked_for(law: Material) -> None:
    assert [check for check in checks(law) if not check.holds] == []


class SolidAtRest(OldroydB):
    """A law of a user's own that relaxes above a stress of G, but for a blunted kink."""

    def relaxation(self, at: Invariants) -> tuple[Any, Any, Any]:
        over = (at.square - at.trace**2 / 3) / 2 - 1
        kappa = (over + (over**2 + 1e-4) ** 0.5) / 2
        return -kappa, kappa, 0.0


def test_a_law_may_be_solid_at_rest() -> None:
    quick = list(islice(checks(SolidAtRest()), 5))
    assert [check for check in quick if not check.holds] == []


@pytest.mark.parametrize("law", ELASTIC, ids=name_of)
def test_steady_shear_is_that_of_closed_forms(law: ConformationLaw) -> None:
    rate = 2.5
    zz, zr, rr, tt = stress_after(single(law, DE, XI), shear(rate), 60) * DE / (1 - XI)
    assert (zr, zz - rr, rr - tt) == pytest.approx(steady_shear(law, DE * rate, DE), rel=1e-7, abs=1e-9)


@pytest.mark.parametrize(
    ("one", "other", "within"),
    [
        (Giesekus(alpha=0.0), OldroydB(), 1e-8),
        (LinearPTT(epsilon=0.0), OldroydB(), 1e-8),
        (ExponentialPTT(epsilon=0.0), OldroydB(), 1e-8),
        (FeneP(L2=1e8), OldroydB(), 1e-7),
        (WhiteMetzner(n=1.0, Cu=1.0), OldroydB(), 1e-8),
        (ExponentialPTT(epsilon=1e-5), LinearPTT(epsilon=1e-5), 1e-7),
    ],
    ids=str,
)
def test_laws_become_one_another_at_the_ends_of_their_parameters(
    one: ConformationLaw, other: ConformationLaw, within: float
) -> None:
    """In shear and extension; linear and exponential PTT in the first order of epsilon, which changes 1e-5."""
    for flow in (shear(2.5), extension(0.5)):
        a, b = (stress_after(single(law, DE, XI), flow, 2.0) for law in (one, other))
        assert a == pytest.approx(b, rel=within, abs=1e-7)


def test_start_up_of_a_hookean_mode_is_exact() -> None:
    rate, t = 2.5, 0.7
    tau = stress_after(single(OldroydB(), DE, XI), shear(rate), t)
    left = np.exp(-t / DE)
    assert tau[1] == pytest.approx((1 - XI) * rate * (1 - left), rel=1e-8)
    assert tau[0] == pytest.approx(2 * (1 - XI) * DE * rate**2 * (1 - left * (1 + t / DE)), rel=1e-8)


def test_steady_extension_is_that_of_closed_forms() -> None:
    rate, a = 0.5, 0.3
    tau = stress_after(single(OldroydB(), DE, XI), extension(rate), 100)
    exact = (1 - XI) * rate * (2 / (1 - 2 * DE * rate) + 1 / (1 + DE * rate))
    assert tau[0] - tau[2] == pytest.approx(exact, rel=1e-7)
    rate, g = 3.0, 3.0 * DE
    tau = stress_after(single(Giesekus(alpha=a), DE, XI), extension(rate), 60)
    roots = np.sqrt(1 - 4 * (1 - 2 * a) * g + 4 * g**2) - np.sqrt(1 + 2 * (1 - 2 * a) * g + g**2)
    assert tau[0] - tau[2] == pytest.approx((1 - XI) * rate / (2 * a) * (3 + roots / g), rel=1e-7)


MODES = ((1.0, 0.5), (0.3, 0.3), (0.05, 0.2))


def in_modes(laws: list[ConformationLaw], times_and_weights: tuple[tuple[float, float], ...], De: float = DE) -> Liquid:
    modes = (replace(law, time=t, weight=w) for law, (t, w) in zip(laws, times_and_weights, strict=True))
    return Liquid(Newtonian(), XI, De, tuple(modes))


@pytest.mark.parametrize("law", ELASTIC, ids=name_of)
def test_small_strains_relax_as_the_sum_of_maxwell_modes(law: ConformationLaw) -> None:
    rate, t = 1e-5, 0.4
    tau = stress_after(in_modes([law] * 3, MODES), shear(rate), t)
    exact = sum((1 - XI) * w * rate * (1 - np.exp(-t / (DE * time))) for time, w in MODES)
    assert tau[1] == pytest.approx(exact, rel=1e-6)


def test_two_modes_of_half_the_weight_are_one() -> None:
    one, two = single(Giesekus(), DE, XI), in_modes([Giesekus()] * 2, ((1.0, 0.5), (1.0, 0.5)))
    assert stress_after(two, shear(2.0), 1.3) == pytest.approx(stress_after(one, shear(2.0), 1.3), rel=1e-9)
    flows = [Pipe(liquid).steady() for liquid in (one, two)]
    assert flows[1].gradient == pytest.approx(flows[0].gradient, rel=1e-13)
    assert flows[1].u == pytest.approx(flows[0].u, rel=1e-12, abs=1e-13)


def test_a_lone_mode_of_twice_the_time_is_one_at_twice_De() -> None:
    liquids = [Liquid(De=De, xi=0.1, modes=(Giesekus(time=time),)) for De, time in ((1.0, 2.0), (2.0, 1.0))]
    assert liquids[0].longest == liquids[1].longest == 2.0
    flows = [Pipe(liquid).steady() for liquid in liquids]
    assert flows[0].gradient == pytest.approx(flows[1].gradient, rel=1e-12)
    assert flows[0].c == pytest.approx(flows[1].c, rel=1e-10, abs=1e-11)


@pytest.mark.parametrize("n", [0.3, 0.4, 0.6, 0.8, 1.0, 1.2])
def test_power_law_in_the_tube_is_exact(n: float) -> None:
    flow = Pipe(Liquid(PowerLaw(n=n))).steady()
    exact = (3 * n + 1) / (n + 1) * (1 - (2 * flow.r) ** ((n + 1) / n))
    assert flow.u == pytest.approx(exact, abs=1e-8)
    assert flow.gradient == pytest.approx(4 * (2 * (3 * n + 1) / n) ** n, rel=1e-10)
    assert flow.wall_rate == pytest.approx(2 * (3 * n + 1) / n, rel=1e-8)


@pytest.mark.parametrize("n", [0.3, 1.0])
@pytest.mark.parametrize("Bn", [0.01, 2.0, 50.0, 2000.0])
def test_flow_of_a_liquid_with_a_yield_stress_in_the_tube_is_exact(Bn: float, n: float) -> None:
    """That of Buckingham (1921) and Reiner, for any n: the plug ends where the stress G r/2 is the yield stress."""

    def flow_rate(G: float) -> float:
        plug, k = 2 * Bn / G, 1 / n
        s = G / 4 - Bn  # what the stress at the wall exceeds the yield stress by; u' = (G r/2 - Bn)^k
        parts = [s ** (k + i) * plug ** (3 - i) * (2 / G) ** i * c / (k + i) for i, c in ((1, 1), (2, 2), (3, 1))]
        return sum(parts)

    G = brentq(lambda G: flow_rate(G) - 0.25, 4 * Bn * (1 + 1e-9) + 1e-3, 1e5, rtol=1e-14)
    flow = Pipe(Liquid(HerschelBulkley(Bn=Bn, n=n, m=1e6) if n < 1 else Bingham(Bn=Bn, m=1e6))).steady()
    assert flow.gradient == pytest.approx(G, rel=4e-5)
    assert flow.wall_rate == pytest.approx((G / 4 - Bn) ** (1 / n), rel=1e-3)
    inside = flow.u[flow.r < 0.9 * 2 * Bn / G]
    assert np.ptp(inside) < 1e-3 * inside[0]


@pytest.mark.parametrize("law", YIELDING, ids=name_of)
def test_simple_shear_of_a_liquid_with_a_yield_stress_is_exact(law: Bingham) -> None:
    rates, n = np.array([1.0, 10.0]), getattr(law, "n", 1.0)
    assert rates * law.viscosity(rates**2) == pytest.approx(law.Bn + rates**n, rel=1e-15)
    at_rest = replace(law, m=1e3).viscosity(1e-20) - law.flowing(1e-20)
    assert at_rest == pytest.approx(1e3 * law.Bn, rel=1e-6)


@pytest.mark.parametrize("Cu", [0.1, 1.0, 10.0])
def test_carreau_liquid_in_the_tube_is_exact(Cu: float) -> None:
    """The flow rate of a wall shear rate by Rabinowitsch: the stress, not its derivative, is integrated."""
    law = Carreau(n=0.5, Cu=Cu, eta_inf=0.02)

    def sigma(rate: float) -> float:
        return float(rate * law.viscosity(rate**2))

    def flow_rate(wall: float) -> float:
        moments = quad(lambda g: sigma(g) ** 3, 0, wall, epsabs=0, epsrel=1e-12)[0] / sigma(wall) ** 3
        return float(np.pi / 24 * (wall - moments))

    wall = brentq(lambda rate: flow_rate(rate) - np.pi / 4, 1, 60, xtol=1e-12)
    flow = Pipe(Liquid(law)).steady()
    assert flow.gradient == pytest.approx(4 * sigma(wall), rel=1e-8)
    assert flow.wall_rate == pytest.approx(wall, rel=1e-6)


def test_carreau_tends_to_a_newtonian_liquid_and_to_a_power_law() -> None:
    assert Pipe(Liquid(Carreau(n=0.5, Cu=1e-4))).steady().gradient == pytest.approx(32, rel=1e-6)
    n, Cu = 0.6, 1e4
    gradient = Pipe(Liquid(Carreau(n=n, Cu=Cu))).steady().gradient
    assert gradient * Cu ** (1 - n) == pytest.approx(Pipe(Liquid(PowerLaw(n=n))).steady().gradient, rel=1e-5)


@pytest.mark.parametrize(
    "solvent", [VISCOUS[0], *(pytest.param(law, marks=pytest.mark.slow) for law in VISCOUS[1:3])], ids=name_of
)
def test_flow_of_a_viscoelastic_liquid_in_any_solvent_balances_the_pressure(solvent: ViscousLaw) -> None:
    liquid = Liquid(solvent, XI, DE, (Giesekus(),))
    flow = Pipe(liquid).steady()
    rate = np.gradient(flow.u, flow.r)[5:-5]
    r = flow.r[5:-5]
    viscous = XI * solvent.viscosity(rate**2) * rate
    tau = polymer_stress(liquid, flow.c)[5:-5, 1]
    assert viscous + tau == pytest.approx(-flow.gradient * r / 2, rel=2e-2)
    started = Pipe(liquid).until(60)(60)
    assert started.gradient == pytest.approx(flow.gradient, rel=1e-6), "the start-up ends in the steady flow"


@pytest.mark.parametrize("solid", SOLIDS, ids=name_of)
def test_solids_are_hookean_at_small_strain(solid: Solid) -> None:
    """B = I + 2 e: the stress is 2 e/Ca_e, up to a pressure."""
    e = 1e-6
    zz, zr, rr, tt = solid.stress((1 + 2 * e, e, 1 - e, 1 - e))
    assert [(zz - rr) * 0.1, zr * 0.1, rr - tt] == pytest.approx([3 * e, e, 0], rel=1e-5, abs=1e-10)


@pytest.mark.parametrize("stretch", [0.5, 0.8, 1.3, 2.5])
def test_mooney_rivlin_in_uniaxial_extension_is_exact(stretch: float) -> None:
    """True stress of a bar, (l^2 - 1/l) (2 C_1 + 2 C_2/l) with 2 (C_1 + C_2) the shear modulus."""
    zz, _, rr, _ = MooneyRivlin(0.1, c=0.4).stress((stretch**2, 0.0, 1 / stretch, 1 / stretch))
    assert zz - rr == pytest.approx((stretch**2 - 1 / stretch) * (0.6 + 0.4 / stretch) / 0.1, rel=1e-13)


def test_tension_at_the_wall_is_that_of_a_hookean_polymer() -> None:
    liquid, beta, Ca_e = single(OldroydB(), DE, XI), 0.4, 0.02
    exact = 2 * (1 - XI) * DE * WALL_RATE**2 * beta * Ca_e
    assert tension(liquid, (0.1, beta), (Ca_e, Ca_e)) == pytest.approx(exact, rel=1e-9)
    assert tension(liquid, (beta,), (0.0,)) == tension(Liquid(Newtonian()), (beta,), (Ca_e,)) == 0
    assert list(beyond_tension(liquid, (beta,), (Ca_e / exact * 0.9,))) == []
    (said,) = beyond_tension(liquid, (beta,), (Ca_e / exact * 2,))
    assert " 2 times their modulus" in said


def at(y: float) -> LogConformation:
    """s with half the square of its deviator y, a mean and a hoop component."""
    x = np.sqrt(y)
    return LogConformation.of(ufl.as_vector([0.3 + 0.6 * x, 0.8 * x, 0.3 - 0.6 * x, -0.2]))


def array(block: Expr) -> np.ndarray:
    return np.array([[float(block[i, j]) for j in range(2)] for i in range(2)])


@pytest.mark.parametrize("y", [0.0, 1e-6, 0.2 * SMALL, 0.999 * SMALL, 1.001 * SMALL, 1.0, 9.0])
@pytest.mark.parametrize("sign", [1, -1])
def test_exponential_is_that_of_matrices(y: float, sign: int) -> None:
    s = at(y)
    block, hoop = s.exp(sign)
    assert array(block) == pytest.approx(expm(sign * array(s.block)), rel=1e-11)
    assert float(hoop) == pytest.approx(np.exp(-0.2 * sign), rel=1e-14)


@pytest.mark.parametrize("y", [1e-3, 0.2 * SMALL, 0.999 * SMALL, 1.001 * SMALL, 1.0, 9.0])
def test_stretch_factor_is_its_formula(y: float) -> None:
    x = np.sqrt(y)
    assert float(at(y).y) == pytest.approx(y, rel=1e-14)
    assert float(at(y).stretch_factor) == pytest.approx((x / np.tanh(x) - 1) / y, rel=1e-11)


def test_stretch_factor_without_deviator_is_a_third() -> None:
    assert float(at(0.0).stretch_factor) == pytest.approx(1 / 3, rel=1e-15)
