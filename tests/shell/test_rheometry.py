"""Liquids fitted to what a rheometer measures: known liquids come back from data with noise."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import t as student
from support.commands import Pairsim

import pairsim
from pairsim.lab.rheometer.law_fits import Fit, Number, described, each_fit, fits
from pairsim.lab.rheometer.measured import Measured
from pairsim.lab.rheometer.rheology_of_case import _Key, keys_of, sentences
from pairsim.physics.homogeneous import moduli, steady_shear
from pairsim.physics.liquids import ConformationLaw, Liquid, Newtonian
from pairsim.physics.liquids.carreau import Carreau
from pairsim.physics.liquids.fene_p import FeneP
from pairsim.physics.liquids.giesekus import Giesekus
from pairsim.physics.liquids.oldroyd_b import OldroydB
from pairsim.physics.liquids.white_metzner import WhiteMetzner
from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import InputError

RATES = np.logspace(-2, 3, 16)
NOISE = 0.02
GIESEKUS = Liquid(Newtonian(), 0.025, 0.08, (Giesekus(alpha=0.15),))
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
    assert holds(best, eta_0=3.0, De=2.0, xi=0.05, time_2=0.1, time_3=0.01, weight_2=0.6, weight_3=0.4, alpha=0.3)
    quantities, block, intervals = keys_of(best)
    assert re.fullmatch(r"0\.08\d+ to 0\.1\d+", intervals["time_2"])
    assert quantities.keys() == {"viscosity", "relaxation", "solvent"}
    assert [mode["law"] for mode in block["modes"]] == ["giesekus"] * 3


@pytest.mark.slow
def test_ends_of_an_interval_are_as_improbable_as_they_are_said_to_be() -> None:
    """Also where another number, here the solvent's viscosity, is hardly determined."""
    parts = tuple(Giesekus(alpha=0.25, time=t, weight=w / 1.75) for t, w in ((1.0, 1.0), (0.1, 0.5), (0.01, 0.25)))
    liquid, rate, frequency = (
        Liquid(Newtonian(), 0.15, 0.5, parts),
        np.geomspace(0.01, 1e3, 26),
        np.geomspace(0.1, 200, 21),
    )
    exact = (steady_shear(liquid, rate)[0], *moduli(liquid, frequency))
    viscosity, storage, loss = np.split(noisy(5 * np.concatenate(exact), 1), (26, 47))
    data = Measured(rate, viscosity, np.empty(0), frequency, storage, loss)
    _, before, best, *_ = each_fit(data, ["white-metzner"])
    free = data.count - len(best.numbers)
    quantile = student.ppf(0.975, free)
    for end in (best.numbers["n"].least, best.numbers["n"].most):
        held = Fit(best.law, 3, data, {"n": end}, before)
        assert free * ((held.deviation / best.deviation) ** 2 - 1) == pytest.approx(quantile**2, rel=0.1)


@pytest.mark.long
@pytest.mark.parametrize("mode", [Giesekus(alpha=0.2), WhiteMetzner(n=0.5, Cu=0.3)])
def test_intervals_hold_the_numbers_of_the_liquid_in_nineteen_of_twenty_draws(mode: ConformationLaw) -> None:
    """Of forty draws of a flow curve and moduli: at least nine tenths, which by chance are fewer once in a thousand."""
    liquid, frequency = Liquid(Newtonian(), 0.05, 0.1, (mode,)), np.geomspace(0.1, 200, 21)
    exact = np.concatenate([steady_shear(liquid, RATES)[0], *moduli(liquid, frequency)])
    truth = {"eta_0": 1.0, "De": 0.1, "xi": 0.05, **mode.numbers}
    held = list[bool]()
    for seed in range(40):
        viscosity, storage, loss = np.split(noisy(exact, seed), (16, 37))
        fit = Fit(type(mode), 1, Measured(RATES, viscosity, np.empty(0), frequency, storage, loss), {})
        held += [holds(fit, **{name: value}) for name, value in truth.items()]
    assert sum(held) >= 0.9 * len(held)


def test_a_curve_that_no_law_describes_is_told_to_be_one() -> None:
    data = Measured(RATES, noisy(np.exp(np.sin(1.5 * np.log(RATES))), 1), np.full(len(RATES), np.nan))
    assert "no law tried describes these data" in " ".join(sentences(fits(data), data))


@pytest.mark.parametrize(("longest", "part", "warned"), [(1e3, 0.99, True), (30.0, 0.99, False), (0.1, 0.5, False)])
def test_a_relaxation_time_that_data_do_not_show_is_told(longest: float, part: float, warned: bool) -> None:
    """Moduli from 0.1 rad/s on show that there is a time beside 0.05 s: not how long where it is 1000 s, but 30 s."""
    frequency = np.geomspace(0.1, 100, 21)
    weights = ((1.0, part), (0.05 / longest, 1 - part))
    liquid = Liquid(Newtonian(), 0.01, longest, tuple(OldroydB(time=t, weight=w) for t, w in weights))
    storage, loss = moduli(liquid, frequency)
    none = np.empty(0)
    data = Measured(none, none, none, frequency, noisy(storage, 3), noisy(loss, 4))
    said = " ".join(sentences(fits(data, ["oldroyd-b"]), data, chosen=True))
    assert ("poorly determined, and longer than these data can show, which begin at 0.1 1/s" in said) == warned, said


@pytest.mark.parametrize(("ratio", "warned"), [(1.0, False), (0.8, True)])
def test_a_flow_curve_and_moduli_of_two_liquids_are_told(ratio: float, warned: bool) -> None:
    """The same liquid, and moduli of a thinner one."""
    storage, loss = moduli(GIESEKUS, RATES)
    more = {"frequency": RATES, "storage": noisy(ratio * storage, 3), "loss": noisy(ratio * loss, 4)}
    data = flow_curve(GIESEKUS, 1.0, **more)
    said = " ".join(sentences(fits(data, ["giesekus"]), data, chosen=True))
    assert ("the files do not agree: the viscosity at rest is" in said) == warned, said


@pytest.mark.parametrize("points", [6, 8, 11, 25])
def test_a_yield_stress_is_told_however_few_points_there_are(points: int) -> None:
    rates = np.geomspace(1e-2, 1e3, points)
    data = Measured(rates, 1 + 10 / rates, np.full(points, np.nan))
    assert "this liquid yields: below a stress of 10 Pa" in " ".join(sentences(fits(data), data))
    said = " ".join(sentences(fits(data, ["carreau"]), data, chosen=True))
    assert "Carreau-Yasuda, the only law tried, does not describe these data: it is off by" in said
    assert "these data yield: --liquid bingham describes them" in said


@pytest.mark.parametrize("eta_p", [0.02, 0.8])
def test_a_bingham_liquid_becomes_a_case_with_its_yield_stress_in_pascal(eta_p: float, tmp_path: Path) -> None:
    """Over seven decades of rates, so that eta_p is far below the largest viscosity."""
    rates = np.geomspace(1e-4, 1e3, 22)
    rows = zip(rates, noisy(eta_p + 5 / rates, 3), strict=True)
    (tmp_path / "flow.csv").write_text("rate [1/s],eta [Pa.s]\n" + "".join(f"{x:g},{y:g}\n" for x, y in rows))
    found = pairsim.units(rheology=tmp_path / "flow.csv", tube="2mm", particle="800um", velocity="10mm/s")
    assert found.fit is not None
    assert holds(found.fit.fit, eta_0=eta_p, Bn=5 / eta_p)
    law = found.case.liquid_model.solvent
    assert law.name == "bingham"
    assert law.yield_stress == pytest.approx(5 * 2e-3 / (eta_p * 10e-3), rel=0.05)
    assert law.numbers["m"] == 1000
    written = tmp_path / "case.yaml"
    written.write_text(found.case_file("case"))
    assert pairsim.load(written).liquid_model == found.case.liquid_model


def test_a_herschel_bulkley_liquid_becomes_a_case(tmp_path: Path) -> None:
    rates = np.geomspace(1e-2, 1e3, 25)
    rows = zip(rates, noisy((3 + 1.5 * rates**0.5) / rates, 3), strict=True)
    (tmp_path / "flow.csv").write_text("rate [1/s],eta [Pa.s]\n" + "".join(f"{x:g},{y:g}\n" for x, y in rows))
    found = pairsim.units(rheology=tmp_path / "flow.csv", tube="2mm", particle="800um", velocity="10mm/s")
    assert found.fit is not None
    assert holds(found.fit.fit, eta_0=1.5, Bn=2.0, n=0.5)
    law = found.case.liquid_model.solvent
    assert law.name == "herschel-bulkley"
    assert law.yield_stress == pytest.approx(3 / (1.5 * 5**0.5), rel=0.1), "tau_y/(K (U_av/D_c)^n), U_av/D_c 5/s"
    held = fits(found.fit.data, ["herschel-bulkley"], {"yield_stress": 3.0})[0]
    assert held.liquid.solvent.yield_stress * held.eta_0 == pytest.approx(3.0)


def test_six_points_of_a_carreau_liquid_are_described() -> None:
    rates = np.geomspace(1e-2, 1e3, 6)
    eta = 0.7 * steady_shear(Liquid(Carreau(n=0.45, Cu=0.8)), rates)[0]
    for seed in range(5):
        data = Measured(rates, noisy(eta, seed), np.full(6, np.nan))
        assert described(fits(data)[0], data)


MODULI = moduli(GIESEKUS, RATES)
SPECTRUM = Measured(frequency=RATES, storage=noisy(0.04 * MODULI[0], 3), loss=noisy(0.04 * MODULI[1], 4))


def test_a_number_at_a_bound_that_is_excluded_is_one_of_a_case() -> None:
    """A chain hardly longer than at rest: L^2 must be above 3, also as it is rounded in a case."""
    liquid = Liquid(Newtonian(), 0.05, 1.0, (FeneP(L2=3.0003),))
    found = Fit(FeneP, 1, flow_curve(liquid, 1.0), {})
    _, block, _ = keys_of(found)
    assert 3.0 < block["L2"] < 3.2


def test_what_moduli_do_not_determine_is_said() -> None:
    best, *_ = found = fits(SPECTRUM, ["giesekus"])
    assert holds(best, eta_0=0.04, De=0.08, xi=0.025)
    assert best.numbers["alpha"].most == np.inf
    said = " ".join(sentences(found, SPECTRUM, chosen=True))
    assert "alpha = 0.2 (not determined by these data)" in said
    assert "moduli do not show how the viscosity falls with the rate" in said
    either = fits(SPECTRUM, ["oldroyd-b", "giesekus"])
    taken = "Oldroyd-B is taken, and Giesekus fits as well: --liquid giesekus chooses one"
    assert taken in " ".join(sentences(either, SPECTRUM))


@pytest.mark.slow
def test_a_solvent_that_normal_stresses_do_not_show_has_an_upper_limit_or_is_held() -> None:
    data = flow_curve(GIESEKUS, 0.04)
    (free,) = fits(data, ["giesekus"])
    assert free.numbers["xi"].most < 0.1
    (held,) = found = fits(data, ["giesekus"], {"solvent": 1e-3})
    assert held.numbers["xi"].given
    assert held.liquid.xi * held.eta_0 == pytest.approx(1e-3)
    assert holds(held, eta_0=0.04, De=0.08, alpha=0.15)
    assert "solvent = 1 mPa.s (given)" in sentences(found, data)[0]


def test_a_viscosity_alone_takes_a_time_that_is_known() -> None:
    viscous = flow_curve(Liquid(Carreau(n=0.45, Cu=0.8)), 0.7)
    assert "De = 0 is assumed" in " ".join(sentences(fits(viscous), viscous))
    elastic = Measured(RATES, noisy(0.04 * steady_shear(GIESEKUS, RATES)[0], 1), np.full(len(RATES), np.nan))
    (best,) = found = fits(elastic, ["giesekus"], {"relaxation": 0.08, "solvent": 1e-3})
    assert "no elasticity was measured" not in " ".join(sentences(found, elastic))
    assert best.liquid.De == 0.08
    assert holds(best, eta_0=0.04, alpha=0.15)


@pytest.mark.parametrize("seed", range(4))
def test_a_noisy_power_law_becomes_a_case(seed: int, tmp_path: Path) -> None:
    rows = zip(RATES, noisy(0.4 * RATES**-0.4, seed), strict=True)
    (tmp_path / "flow.csv").write_text("rate [1/s],eta [Pa.s]\n" + "".join(f"{x:g},{y:g}\n" for x, y in rows))
    found = pairsim.units(rheology=tmp_path / "flow.csv", tube="50um", particle="20um", flow_rate="1ul/min")
    written = tmp_path / "case.yaml"
    written.write_text(found.case_file("case"))
    assert pairsim.load(written).liquid_model == found.case.liquid_model


def test_a_file_becomes_a_case(pairsim: Pairsim, tmp_path: Path) -> None:
    data = flow_curve(Liquid(Carreau(n=0.45, Cu=0.8)), 0.7)
    rows = "".join(f"{rate:g},{1e3 * eta:g}\n" for rate, eta in zip(data.rate, data.viscosity, strict=True))
    (tmp_path / "flow.csv").write_text(f"shear rate [1/s],viscosity [mPa.s]\n{rows}")
    done = pairsim("units", "--rheology", "flow.csv", *EXPERIMENT, "-o", "case.yaml")
    assert done.returncode == 0
    assert "read: flow.csv: 16 points, 0.01 to 1000 1/s, viscosity in mPa.s (column 2" in done.stdout
    assert "fit: Carreau-Yasuda: viscosity = 0.7" in done.stdout
    assert "1/s, and those at the particles are beyond the data, which end at 1000 1/s" in done.stdout
    assert (tmp_path / "case-fit.png").stat().st_size > 10_000
    case = (tmp_path / "case.yaml").read_text()
    assert re.search(r"viscosity: 0\.\d+ \+- 0\.0\d+ Pa\.s # zero-shear viscosity (?!.*95 %).*\n", case)
    assert re.search(r"'n': 0\.4\d+ +# flow index .*|'n': 0\.4\d+ +# 95 %: 0\.4\d+ to 0\.4\d+\n", case)
    assert "# the viscosity alone does not show" in case
    assert pairsim("run", "case.yaml", "--dry-run").returncode == 0


def test_a_shear_stress_that_falls_with_the_rate_is_told(pairsim: Pairsim) -> None:
    flow = (
        "--tube",
        "50um",
        "--particle",
        "20um",
        "--velocity",
        "1mm/s",
        "--viscosity",
        "1Pa.s",
        "--solvent",
        "1mPa.s",
    )
    liquid = ("--relaxation", "50ms", "--liquid", "giesekus", "--alpha")
    assert "the shear stress falls with the shear rate from" in pairsim("units", *flow, *liquid, "0.9").stdout
    assert "the shear stress falls" not in pairsim("units", *flow, *liquid, "0.2").stdout


@pytest.mark.slow
def test_a_pressure_gives_the_mean_velocity(pairsim: Pairsim, tmp_path: Path) -> None:
    """U = dp D^2/(32 eta L), and for a power law (dp D/(4 K L))^(1/n) D n/(2 (3 n + 1))."""
    bead = ("--tube", "50um", "--particle", "20um", "--modulus", "1kPa", "--pressure", "20kPa", "--over", "5cm")
    done = pairsim("units", *bead, "--viscosity", "50mPa.s", "-o", "case.yaml")
    assert "velocity: 0.625 mm/s" in (tmp_path / "case.yaml").read_text()
    assert "100 1/s" in done.stdout
    assert "4 kPa/cm" in done.stdout
    thinning = ("--liquid", "power-law", "--n", "0.5", "--consistency", "0.5Pa.s^0.5")
    pairsim("units", *bead, *thinning, "-o", "case.yaml", "--overwrite")
    text = next(line for line in (tmp_path / "case.yaml").read_text().splitlines() if "velocity" in line)
    assert float(text.split()[1]) == pytest.approx((20e3 * 50e-6 / (4 * 0.5 * 0.05)) ** 2 * 50e-3 * 0.5 / 5, rel=1e-6)
    for more, said in (((), "must be given with --over"), (("--pressure", "1kPa"), "must be left out")):
        wrong = pairsim("units", *bead[:6], "--over", "5cm", "--viscosity", "1Pa.s", "--flow", "1ul/min", *more)
        assert wrong.returncode == 2
        assert said in wrong.stderr


def test_a_half_width_of_three_digits_is_written_without_an_exponent() -> None:
    key = _Key("relaxation", 113.9, "ms", 1e3)
    assert key.with_half_width(Number(0.1139, 0.0725, 0.2143)) == "113.9 +- 100 ms"
    assert key.with_half_width(Number(0.1139, 0.1121, 0.115)) == "113.9 +- 1.8 ms"


def test_half_widths_of_a_pressure_are_in_the_mean_velocity() -> None:
    """Of a power law, U is proportional to (dp/L)^(1/n); the case file says what the velocity is from."""
    bead = {"tube": "50um", "particle": "20um", "modulus": "1kPa", "pressure": "20 +- 0.6 kPa", "over": "5 cm +- 4 %"}
    for liquid, n in (({"viscosity": "50mPa.s"}, 1.0), ({"consistency": "0.5Pa.s^0.5"}, 0.5)):
        law = {} if n == 1 else {"liquid": {"law": "power-law", "n": n}}
        found = pairsim.units(**bead, **liquid, **law)
        value, half_width = re.findall(r"\d[\d.e-]*", found.written["physical"]["velocity"])
        assert float(half_width) / float(value) == pytest.approx(0.05 / n, rel=2e-3)
        assert "# mean velocity of the liquid U_av, from 20 +- 0.6 kPa over 5 cm +- 4 %" in found.case_file("case")


@pytest.mark.parametrize(("pressure", "over"), [("20", "5cm"), ("20 foo", "5cm"), ("20kPa", "5 s"), ("20kPa", "-5cm")])
def test_a_pressure_or_length_that_is_none_is_refused(pressure: str, over: str) -> None:
    bead = {"tube": "50um", "particle": "20um", "viscosity": "1Pa.s"}
    with pytest.raises(InputError, match=r"must be a (pressure|length) above 0 with its unit"):
        pairsim.units(**bead, pressure=pressure, over=over)
