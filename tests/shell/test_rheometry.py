"""Liquids fitted to what a rheometer measures: known liquids come back from data with noise."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from support.commands import Pairsim

from pairsim.api.rheometer import keys_of, read_measured, sentences
from pairsim.physics.homogeneous import moduli, steady_shear
from pairsim.physics.liquids import Liquid, Newtonian
from pairsim.physics.liquids.carreau import Carreau
from pairsim.physics.liquids.giesekus import Giesekus
from pairsim.physics.rheometry import Fit, Measured, described, fits
from pairsim.runtime.arrays import Array

RATES = np.logspace(-2, 3, 26)
NOISE = 0.02
EXPERIMENT = ("--tube", "50um", "--particle", "20um", "--flow", "1ul/min", "--modulus", "5kPa")


def noisy(values: Array, seed: int) -> Array:
    return np.asarray(values * np.exp(NOISE * np.random.default_rng(seed).standard_normal(len(values))))


def flow_curve(liquid: Liquid, eta_0: float, **more: Array) -> Measured:
    viscosity, N1 = steady_shear(liquid, RATES)
    normal = noisy(eta_0 * N1, 2) if liquid.modes else np.full(len(RATES), np.nan)
    return Measured(RATES, noisy(eta_0 * viscosity, 1), normal, **more)


def holds(fit: Fit, **numbers: float) -> bool:
    return all(fit.numbers[name].least <= value <= fit.numbers[name].most for name, value in numbers.items())


def test_a_carreau_liquid_comes_back() -> None:
    data = flow_curve(Liquid(Carreau(n=0.45, Cu=0.8)), 0.7)
    best, second, *_ = fits(data)
    assert best.law is Carreau
    assert holds(best, eta_0=0.7, n=0.45, Cu=0.8)
    assert described(best, data)
    assert not described(second, data)


@pytest.mark.slow
def test_a_liquid_of_three_modes_comes_back() -> None:
    modes = tuple(Giesekus(alpha=0.3, time=t, weight=w) for t, w in ((1.0, 0.5), (0.1, 0.3), (0.01, 0.2)))
    liquid, eta_0 = Liquid(Newtonian(), 0.05, 2.0, modes), 3.0
    storage, loss = moduli(liquid, RATES)
    more = {"frequency": RATES, "storage": noisy(eta_0 * storage, 3), "loss": noisy(eta_0 * loss, 4)}
    data = flow_curve(liquid, eta_0, **more)
    (best,) = fits(data, ["giesekus"])
    assert len(best.liquid.modes) == 3
    assert holds(best, eta_0=3.0, De=2.0, xi=0.05, ratio_1=0.1, ratio_2=0.1, weight_1=0.6, weight_2=0.4, alpha=0.3)
    quantities, block = keys_of(best)
    assert quantities.keys() == {"viscosity", "relaxation", "solvent"}
    assert [mode["law"] for mode in block["modes"]] == ["giesekus"] * 3


def test_a_curve_that_no_law_describes_is_told_to_be_one() -> None:
    data = Measured(RATES, noisy(np.exp(np.sin(1.5 * np.log(RATES))), 1), np.full(len(RATES), np.nan))
    found = fits(data)
    assert "no law tried describes these data" in sentences(found, data)[-1]


def test_a_file_becomes_a_case(pairsim: Pairsim, tmp_path: Path) -> None:
    data = flow_curve(Liquid(Carreau(n=0.45, Cu=0.8)), 0.7)
    rows = "".join(f"{rate:g},{1e3 * eta:g}\n" for rate, eta in zip(data.rate, data.viscosity, strict=True))
    (tmp_path / "flow.csv").write_text(f"shear rate [1/s],viscosity [mPa.s]\n{rows}")
    assert read_measured(tmp_path / "flow.csv", None)[0].viscosity == pytest.approx(data.viscosity, rel=1e-5)
    done = pairsim("units", "--rheology", "flow.csv", *EXPERIMENT, "-o", "case.yaml")
    assert done.returncode == 0
    assert "fit: Carreau-Yasuda: eta_0 [Pa.s] = 0.7" in done.stdout
    assert (tmp_path / "case-fit.png").stat().st_size > 10_000
    assert pairsim("run", "case.yaml", "--dry-run").returncode == 0


def test_a_pressure_gives_the_mean_velocity(pairsim: Pairsim, tmp_path: Path) -> None:
    """U = dp D^2/(32 eta L), and for a power law (dp D/(4 K L))^(1/n) D n/(2 (3 n + 1))."""
    bead = ("--tube", "50um", "--particle", "20um", "--modulus", "1kPa", "--pressure", "20kPa", "--over", "5cm")
    done = pairsim("units", *bead, "--viscosity", "50mPa.s", "-o", "case.yaml")
    assert "velocity: 0.000625 m/s" in (tmp_path / "case.yaml").read_text()
    assert "100 1/s" in done.stdout
    assert "4 kPa/cm" in done.stdout
    thinning = ("--liquid", "power-law", "--n", "0.5", "--consistency", "0.5Pa.s^0.5")
    pairsim("units", *bead, *thinning, "-o", "case.yaml", "--overwrite")
    text = next(line for line in (tmp_path / "case.yaml").read_text().splitlines() if "velocity" in line)
    assert float(text.split()[1]) == pytest.approx((20e3 * 50e-6 / (4 * 0.5 * 0.05)) ** 2 * 50e-6 * 0.5 / 5, rel=1e-6)
    for more, said in (((), "must be given with --over"), (("--pressure", "1kPa"), "must be left out")):
        wrong = pairsim("units", *bead[:6], "--over", "5cm", "--viscosity", "1Pa.s", "--flow", "1ul/min", *more)
        assert wrong.returncode == 2
        assert said in wrong.stderr
