"""Saramito's laws: a yield stress of the polymer, below which it is elastic."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp
from scipy.optimize import brentq

from pairsim.physics.conformation import magnitude, polymer_stress
from pairsim.physics.homogeneous import conformation_after, extension, rate_of_change, shear, steady_shear, stress_after
from pairsim.physics.liquids import ConformationLaw, Liquid, single
from pairsim.physics.liquids.giesekus import Giesekus
from pairsim.physics.liquids.oldroyd_b import OldroydB
from pairsim.physics.liquids.yielding import Saramito2007, Saramito2009, YieldLaw
from pairsim.physics.pipe import Pipe

DE, XI = 0.5, 0.09
SHARP, OLDROYD = 1e-6, OldroydB()
LAWS = Saramito2007(Bn=1.0, width=SHARP), Saramito2009(Bn=0.5, n=0.5, k=1.5, width=SHARP)


def liquid(law: YieldLaw, of: ConformationLaw = OLDROYD, De: float = DE) -> Liquid:
    return replace(single(of, De, XI), yielding=law)


def stress(law: YieldLaw, alpha: float, L: np.ndarray, end: float, start: np.ndarray | None = None) -> np.ndarray:
    """The stress by the equation in tau itself, in three dimensions and with a sharp kink; alpha of Giesekus."""
    G, n, k = (1 - XI) / DE, getattr(law, "n", 1.0), getattr(law, "k", 1.0)

    def rate(_: float, flat: np.ndarray) -> np.ndarray:
        tau = flat.reshape(3, 3)
        size = np.sqrt(np.sum((tau - np.trace(tau) / 3 * np.eye(3)) ** 2) / 2)
        kappa = max(0.0, (size - law.Bn) / (k * size**n)) ** (1 / n) if size else 0.0
        return (L @ tau + tau @ L.T + G * (L + L.T) - kappa / DE * (tau + alpha / G * tau @ tau)).ravel()

    first = np.zeros(9) if start is None else start.ravel()
    tau = solve_ivp(rate, (0, end), first, "LSODA", rtol=1e-10, atol=1e-12, max_step=end / 500).y[:, -1]
    return np.asarray(tau.reshape(3, 3))


def components(tau: np.ndarray) -> np.ndarray:
    return np.array([tau[0, 0], tau[0, 1], tau[1, 1], tau[2, 2]])


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("alpha", [0.0, 0.2])
@pytest.mark.parametrize("L", [shear(3.0), shear(0.2), extension(0.5)])
def test_the_start_up_is_that_of_the_equation_in_the_stress(law: YieldLaw, alpha: float, L: np.ndarray) -> None:
    of = Giesekus(alpha=alpha) if alpha else OldroydB()
    for end in (0.05, 1.0):
        wanted = components(stress(law, alpha, L, end))
        assert np.abs(stress_after(liquid(law, of), L, end) - wanted).max() < 1e-6 * np.abs(wanted).max()


@pytest.mark.parametrize("law", LAWS)
def test_relaxation_after_shear_stops_at_the_yield_stress(law: YieldLaw) -> None:
    sheared, still = conformation_after(liquid(law), shear(3.0), 1.0), np.zeros((3, 3))

    def rate(_: float, c: np.ndarray) -> np.ndarray:
        return rate_of_change(liquid(law), OldroydB(), c[:, None], still)[:, 0]

    c = solve_ivp(rate, (0, 3.0), sheared, "LSODA", rtol=1e-11, atol=1e-13).y[:, -1]
    found = polymer_stress(liquid(law), c[None])[0]
    wanted = stress(law, 0.0, still, 3.0, stress(law, 0.0, shear(3.0), 1.0))
    size = np.sqrt(np.sum((wanted - np.trace(wanted) / 3 * np.eye(3)) ** 2) / 2)
    assert np.abs(found - components(wanted)).max() < 1e-6 * law.Bn
    assert law.Bn < size < 1.7 * law.Bn  # it decays as exp(-t/De) to Bn, at n = 1/2 as 1/t


def exact_tube(De: float, Bn: float) -> tuple[float, float]:
    """Pressure gradient and plug radius in the tube: sheared liquid has tau_zz = 2 tau_rz^2/G in steady flow."""
    G = (1 - XI) / De

    def size(tau: float) -> float:
        return float(np.sqrt(tau**2 + 4 / 3 * tau**4 / G**2))

    def rate(tau: float) -> float:
        return (1 - Bn / size(tau)) * tau / (1 - XI)

    yields = brentq(lambda tau: size(tau) - Bn, 1e-9, Bn, xtol=1e-14)

    def sheared(total: float) -> float:
        tau = brentq(lambda tau: tau + XI * rate(tau) - total, yields, total, xtol=1e-14)
        return float(total - tau) / XI

    def flow(gradient: float) -> float:
        inner = 2 * yields / gradient
        return quad(lambda r: r**2 * sheared(gradient * r / 2), inner, 0.5, epsabs=1e-12)[0] - 0.25

    gradient = brentq(flow, 30.0, 60.0, xtol=1e-10)
    return gradient, 2 * yields / gradient


@pytest.mark.parametrize(("De", "Bn"), [(0.01, 2.0), (0.1, 1.0), (0.5, 0.2)])
def test_stress_and_plug_in_the_tube(De: float, Bn: float) -> None:
    flow, (gradient, plug) = Pipe(liquid(Saramito2007(Bn=Bn), De=De)).steady(), exact_tube(De, Bn)
    assert flow.gradient == pytest.approx(gradient, rel=1e-5)
    shear_rate = -(flow.gradient * flow.r / 2 + polymer_stress(liquid(Saramito2007(Bn=Bn), De=De), flow.c)[:, 1]) / XI
    still = np.flatnonzero(np.abs(shear_rate) < 1e-3)
    assert flow.r[still[-1]] <= 1.01 * plug <= 1.02 * flow.r[still[-1] + 1]


def test_without_a_yield_stress_the_law_is_that_without_one() -> None:
    plain = stress_after(single(Giesekus(), DE, XI), shear(2.0), 1.0)
    off = [
        np.abs(stress_after(liquid(Saramito2007(Bn=Bn), Giesekus()), shear(2.0), 1.0) - plain).max()
        for Bn in (0.02, 0.01, 0.0)
    ]
    assert np.log2(off[0] / off[1]) == pytest.approx(1.0, abs=0.05)
    assert off[2] < 1e-9


def test_the_law_of_2009_at_n_1_is_that_of_2007() -> None:
    for tau in (0.5, 1.5):
        assert Saramito2009(Bn=1.0, n=1.0).factor(tau) == pytest.approx(Saramito2007(Bn=1.0).factor(tau), rel=1e-14)


def test_steady_shear_is_where_shear_leads() -> None:
    rates, law = np.array([0.5, 5.0]), Saramito2007(Bn=2.0)
    viscosity, N1 = steady_shear(liquid(law), rates)
    for i, rate in enumerate(rates):
        tau = stress_after(liquid(law), shear(rate), 20 / rate + 20 * DE)
        assert viscosity[i] == pytest.approx(XI + tau[1] / rate, rel=1e-8)
        assert N1[i] == pytest.approx(tau[0] - tau[2], rel=1e-8)


def test_the_magnitude_of_the_stress_is_that_of_its_deviator() -> None:
    giesekus = liquid(LAWS[0], Giesekus(alpha=0.2))
    c = np.array([[3.0, 0.7, 0.8, 1.1], [1.0, 0.0, 1.0, 1.0]])
    zz, zr, rr, tt = polymer_stress(giesekus, c).T
    mean = (zz + rr + tt) / 3
    expected = np.sqrt(((zz - mean) ** 2 + (rr - mean) ** 2 + (tt - mean) ** 2 + 2 * zr**2) / 2)
    assert magnitude(giesekus, c) == pytest.approx(expected, rel=1e-6, abs=1e-5)
