"""Quantities with units: the numbers that they become, `pairsim units`, tables and travel times of a computed case."""

from __future__ import annotations

import csv
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pint
import pytest
import yaml
from support.commands import Pairsim

import pairsim as api
from pairsim.cases.conversion import forget_numbers
from pairsim.cases.inputs import inputs_of
from pairsim.cases.physical import QUANTITIES
from pairsim.cases.quantity_text import A_LENGTH, COMMON, measured, quantity_range, si
from pairsim.cases.run_case import Case
from pairsim.cases.values import Range
from pairsim.cases.yaml_file import read_yaml
from pairsim.computing.case_files import parse_case, read_case
from pairsim.physics.liquids.viscous import ZERO_SHEAR
from pairsim.physics.solids.kelvin_voigt import KelvinVoigt
from pairsim.physics.solids.solid import MODULUS
from pairsim.quantities.measurable import Measurable, a_time
from pairsim.quantities.scales import Scales, mean_velocity
from pairsim.questions.registry import QUESTIONS
from pairsim.record.table_files import read_table
from pairsim.runtime.errors import InputError
from pairsim.sweeps.grid import read_grid

BENCH: dict[str, Any] = {
    **{"tube": "50 um", "particle": "20 um", "flow_rate": "1 ul/min", "modulus": "5 kPa"},
    **{"viscosity": "1 Pa.s", "relaxation": "2 ms", "distance": "5 um", "end": "50 ms"},
}
U, D = 1e-9 / 60 * 4 / (np.pi * 50e-6**2), 50e-6
RATE = U / D  # [1/s]


def bench(**changes: Any) -> dict[str, Any]:
    """The block with changes; None leaves a key out."""
    return {"physical": {key: value for key, value in (BENCH | changes).items() if value is not None}}


def case(block: dict[str, Any], **keys: Any) -> Case:
    return parse_case(QUESTIONS["run"], block | keys, "test")


def viscous(**changes: Any) -> dict[str, Any]:
    """The block of a liquid without memory."""
    return bench(**{"relaxation": None, **changes})


def test_scales_follow_their_definitions() -> None:
    scales = Scales(length=2e-3, velocity=4e-3, viscosity=0.5)
    assert (scales.time, scales.stress) == pytest.approx((0.5, 1.0))
    assert scales.reynolds(1000) == pytest.approx(1000 * 4e-3 * 2e-3 / 0.5)
    assert mean_velocity(np.pi * 1e-6, 2e-3) == pytest.approx(1.0)  # Q over pi R^2


def test_block_becomes_the_numbers_worked_by_hand() -> None:
    found = case(bench(solvent="90 mPa.s"))
    expected = (0.4, 2e-3 * RATE, RATE / 5e3, 0.09, 0.1, 50e-3 * RATE)
    assert (found.beta, found.De, found.Ca_e, found.xi, found.d0, found.time.end) == pytest.approx(expected, rel=1e-12)
    assert found.resolved()["physical"] == bench(solvent="90 mPa.s")["physical"]
    assert case(bench(), De=case(bench()).De, beta=0.4) == case(bench()), "numbers that agree may stand beside it"


def test_a_run_of_an_experiment_begins_quasi_steady_and_its_end_is_set_in_either_unit(tmp_path: Path) -> None:
    assert (case(bench()).start, case(bench(), start="rest").start) == ("steady", "rest")
    file = tmp_path / "case.yaml"
    for end, setting, seconds in (("50 ms", "time.end=4", 4 / RATE), (None, "physical.end=20ms", 20e-3)):
        content = bench(end=end) | ({} if end else {"time": {"end": 9.0}})
        file.write_text(yaml.safe_dump(content | {"ends": "developed", "length": "auto"}))
        found = read_case(QUESTIONS["run"], file, (setting,))
        assert found.time.end / RATE == pytest.approx(seconds)


@pytest.mark.parametrize(
    ("changes", "same"),
    [
        ({"modulus": None, "young": "15 kPa"}, {}),
        ({"flow_rate": "60 nl/min"}, {"flow_rate": "1e-12 m^3/s"}),
        ({"flow_rate": None, "velocity": "8.488263631567756 mm/s"}, {}),
        ({"viscosity": "1000 cP", "tube": "0.05 mm", "particle": "20 µm"}, {"viscosity": "1 Pa s"}),
    ],
)
def test_equivalent_inputs_give_the_same_numbers(changes: dict[str, Any], same: dict[str, Any]) -> None:
    one, other = case(bench(**changes)), case(bench(**same))
    for name in ("beta", "De", "Ca_e", "d0"):
        assert getattr(one, name) == pytest.approx(getattr(other, name), rel=1e-12)


def test_lists_have_one_value_for_each_particle_and_gap() -> None:
    block = bench(particle=["20 um", "15 um", "20 um"], modulus=["5 kPa", "1 kPa", "5 kPa"], distance=["5 um", "10 um"])
    three = case(block, particles=3)
    assert three.beta == pytest.approx((0.4, 0.3, 0.4))
    assert three.gaps == pytest.approx((0.1, 0.2))
    assert three.Ca_es[1] == pytest.approx(5 * three.Ca_es[0])


def test_curves_and_critical_distances_take_the_block_too() -> None:
    block = bench(distance={"start": "5 um", "stop": "20 um", "num": 3}, end=None)
    assert parse_case(QUESTIONS["curve"], block, "test").places == [pytest.approx((d,)) for d in (0.1, 0.2, 0.4)]
    block = bench(distance=["1 um", "40 um"], end=None)
    critical = parse_case(QUESTIONS["critical"], block | {"along": {"De": [0.5, 1]}}, "test")
    assert critical.d == pytest.approx((0.02, 0.8))


@pytest.mark.parametrize(("along", "heading", "given"), [("De", "relaxation [ms]", 2.0), ("Ca_e", "young [kPa]", 30.0)])
def test_what_is_followed_is_in_units_of_the_experiment(along: str, heading: str, given: float, tmp_path: Path) -> None:
    """Twice De is twice the relaxation time, and twice Ca_e half the modulus that the block has."""
    block = bench(modulus=None, young="30 kPa", distance=["1 um", "40 um"], end=None)
    plain = parse_case(QUESTIONS["critical"], block, "test")
    numbers = [factor * getattr(plain, along) for factor in (1.0, 2.0, 4.0)]
    (tmp_path / "case.yaml").write_text(yaml.safe_dump(block | {"along": {along: numbers[1:]}}))
    assert plain.scales is not None
    scales = {name: getattr(plain.scales, name) for name in ("length", "velocity", "time", "stress")}
    (tmp_path / "run.json").write_text(json.dumps({"kind": "critical", "status": "finished", "scales": scales}))
    rows = "".join(f"wanted,0.2,0.01,false,1,{number},0.1\n" for number in numbers)
    (tmp_path / "critical.csv").write_text(f"kind,d_cr,d_error,stable,branch,{along},parameter_error\n{rows}")
    table = api.open(tmp_path).frame(physical=True)
    name, _, unit = heading.partition(" ")
    assert table.attrs["units"][name] == unit.strip("[]")
    assert table[name].to_numpy() == pytest.approx(given * np.array([1, 2, 4]) ** (1.0 if along == "De" else -1.0))
    assert len(api.plot(tmp_path)) == 1


def test_numbers_have_no_digits_of_rounding() -> None:
    """17 um over 50 um is .33999999999999997 in double precision."""
    assert case(bench(distance="17 um")).d0 == 0.34


def test_what_is_left_out_is_newtonian_and_rigid() -> None:
    rigid = case(viscous(modulus=None), Ca_e=0)
    assert (rigid.De, rigid.Ca_e) == (0, 0)


def test_a_consistency_gives_the_unit_of_viscosity() -> None:
    thin = case(viscous(viscosity=None, consistency="0.5 Pa.s^0.6"), liquid={"law": "power-law", "n": 0.6})
    assert thin.scales is not None
    assert thin.scales.viscosity == pytest.approx(0.5 * RATE**-0.4)
    assert thin.Ca_e == pytest.approx(0.5 * RATE**0.6 / 5e3)


def test_quantities_of_laws_become_their_numbers() -> None:
    block = viscous(viscosity="2 Pa.s", time_constant="20 ms", viscosity_inf="20 mPa.s", particle_viscosity="4 Pa.s")
    thin = case(block, liquid={"law": "carreau", "n": 0.5}, solid="kelvin-voigt")
    assert thin.liquid_model.solvent.numbers == pytest.approx({"n": 0.5, "Cu": 0.02 * RATE, "a": 2.0, "eta_inf": 0.01})
    assert thin.solid_models[0] == KelvinVoigt(pytest.approx(2 * RATE / 5e3), eta=2.0)
    assert parse_case(QUESTIONS["run"], thin.resolved(), "test").resolved() == thin.resolved()


def test_a_time_constant_is_that_of_every_mode() -> None:
    modes = [
        {"law": "white-metzner", "n": 0.5, "weight": 1, "time": 1},
        {"law": "white-metzner", "n": 0.6, "weight": 2, "time": 0.1},
    ]
    model = case(bench(time_constant="20 ms"), liquid={"law": "modes", "modes": modes}).liquid_model
    assert [mode.numbers["Cu"] for mode in model.modes] == pytest.approx([0.02 * RATE] * 2)
    found = api.units(**BENCH, liquid={"law": "modes", "modes": [each | {"Cu": 1.0} for each in modes]})
    of_modes = {name: value for name, value, _ in found.numbers if name in ("time", "weight")}
    assert of_modes == {"time": "1, 0.1", "weight": "0.3333, 0.6667"}
    with_solvent = {"law": "white-metzner", "n": 0.5, "solvent": {"law": "carreau", "n": 0.5}}
    with pytest.raises(InputError, match=r"it could be any of liquid.Cu and liquid.solvent.Cu, which must be given"):
        case(bench(time_constant="20 ms"), liquid=with_solvent)


def test_a_solvent_has_its_own_viscosity_at_rest() -> None:
    """eta_inf is over that, not over eta_0: the stress of the solvent is xi eta(gamma)."""
    liquid = {"law": "oldroyd-b", "solvent": {"law": "carreau", "n": 0.5, "Cu": 1}}
    model = case(bench(solvent="0.1 Pa.s", viscosity_inf="1 mPa.s"), liquid=liquid).liquid_model
    assert (model.xi, model.solvent.numbers["eta_inf"]) == pytest.approx((0.1, 0.01))


def test_case_of_a_folder_can_be_read_and_changed(tmp_path: Path) -> None:
    path, plain = tmp_path / "case.yaml", case(bench())
    path.write_text(yaml.safe_dump(plain.resolved()))
    assert read_case(QUESTIONS["run"], path).resolved() == plain.resolved()
    faster = read_case(QUESTIONS["run"], path, ("physical.flow_rate=2 ul/min",))
    assert (faster.De, faster.Ca_e) == pytest.approx((2 * plain.De, 2 * plain.Ca_e))
    data = read_yaml(path)
    forget_numbers(data)
    assert not {"De", "beta", "d0"} & data.keys()


def test_swept_flow_rate_moves_De_and_Ca_e_together(tmp_path: Path) -> None:
    rates = "{start: 1 ul/min, stop: 4 ul/min, num: 3, spacing: log}"
    (tmp_path / "base.yaml").write_text(yaml.safe_dump(bench(end=None)))
    (tmp_path / "grid.yaml").write_text(f"base: base.yaml\ngrid:\n  physical.flow_rate: {rates}\n")
    grid = read_grid(tmp_path / "grid.yaml")
    for name in ("De", "Ca_e"):
        values = [each.parameters[name] for each in grid.cases]
        assert [value / values[0] for value in values] == pytest.approx([1, 2, 4])
    assert [each.parameters["physical.flow_rate"] for each in grid.cases] == ["1 μl/min", "2 μl/min", "4 μl/min"]
    assert set(grid.varying) == {"physical.flow_rate", "De", "Ca_e"}


def test_ranges_of_quantities_may_change_their_unit() -> None:
    texts = quantity_range(Range(start="1 um", stop="0.01 mm", num=4, spacing="linear"))
    assert [si(text, A_LENGTH) for text in texts] == pytest.approx([1e-6, 4e-6, 7e-6, 1e-5])
    with pytest.raises(ValueError, match="same kind"):
        quantity_range(Range(start="1 um", stop="1 s", num=2))


def test_common_units_are_those_of_pint() -> None:
    registry = pint.UnitRegistry()
    for of, units in COMMON.items():
        for unit, size in units.items():
            assert size == registry.Quantity(1.0, unit.replace(".", "*")).to(of).magnitude, unit


A_TIME, A_VELOCITY, A_FLOW = a_time("t", "time"), QUANTITIES["velocity"], QUANTITIES["flow_rate"]
PRINT = "is a unit of screens and print, not of what a camera sees"


@pytest.mark.parametrize(
    ("text", "kind", "wrong"),
    [(f"250 {unit}", A_LENGTH, PRINT) for unit in ("px", "pixel", "dot", "point", "pp", "bp", "pica", "kpx")]
    + [
        ("5 pc", A_LENGTH, "stands for parsec"),
        ("5 li", A_LENGTH, "stands for link"),
        ("5 Mm", A_LENGTH, "stands for megameter"),
        ("5 Min", A_LENGTH, "stands for megainch"),
        ("5 Ms", A_TIME, "stands for megasecond"),
        ("5 ma", A_TIME, "stands for milliyear"),
        ("5 fps", A_VELOCITY, "stands for foot per second"),
        ("5 px/s", A_VELOCITY, PRINT),
        ("5 pt/min", A_FLOW, "stands for pint"),
        ("5 sv", A_FLOW, "stands for sverdrup"),
    ],
)
def test_words_that_mean_something_else_at_a_bench_are_no_units(text: str, kind: Measurable, wrong: str) -> None:
    """Pint takes px for 1/96 inch, pp for a printer's point, fps for feet per second, ma for thousandths of years."""
    with pytest.raises(ValueError, match=wrong):
        si(text, kind)


def test_units_that_a_bench_uses_stay() -> None:
    for text, length in (("1 micron", 1e-6), ("1 mil_length", 2.54e-5), ("1 Å", 1e-10), ("2 thou", 5.08e-5)):
        assert si(text, A_LENGTH) == pytest.approx(length)
    for text, time in (("1 us", 1e-6), ("2 ks", 2e3), ("1 h", 3600.0), ("1 week", 604800.0)):
        assert si(text, A_TIME) == pytest.approx(time)
    for text, flow in (("60 cc/min", 1e-6), ("1 mm^3/s", 1e-9), ("1 uL/hr", 1e-9 / 3600)):
        assert si(text, A_FLOW) == pytest.approx(flow)


@pytest.mark.parametrize(
    "text",
    ["1.5 +- 0.3 kPa", "1.5+-.3kPa", "1.5 kPa +/- 300 Pa", "(1.5 ± 0.3) kPa", "1.5 kPa ± 20 %", "1500 Pa +- 0.3 kPa"],
)
def test_half_widths_as_they_are_written(text: str) -> None:
    assert measured(text, MODULUS) == pytest.approx((1500.0, 300.0))


@pytest.mark.parametrize("text", ["1.5 +- 0.3", "1.5 kPa +-", "1.5 kPa +- 2 s", "1.5 +- 1.6 kPa", "1.5 +- x kPa"])
def test_half_widths_that_say_nothing_are_refused(text: str) -> None:
    with pytest.raises(ValueError, match=r"must (be|have)"):
        measured(text, MODULUS)


def test_inputs_know_what_the_numbers_change_by() -> None:
    """De = lambda U/D, Ca_e = eta U/(D G), U = 4Q/(pi D^2); lists and distances have no half-widths."""
    given = bench(modulus="5 +- 1 kPa", tube="50 um +- 2 %")
    made = case(given, liquid="giesekus")
    found = {each.key: each for each in inputs_of(made)}
    half_widths = {key: each.half_width for key, each in found.items() if each.half_width}
    assert half_widths == pytest.approx({"modulus": 1, "tube": 1})
    assert found["modulus"].changes["Ca_e"] == pytest.approx(-made.Ca_e, rel=1e-5)
    assert found["modulus"].changes["De"] == found["modulus"].changes["length"] == 0
    changes = {"Ca_e": -3 * made.Ca_e, "De": -3 * made.De, "beta": -made.beta, "length": 1, "velocity": -2}
    assert found["tube"].changes == pytest.approx(changes, rel=1e-5)
    for key, value in (("distance", "5 um +- 1 um"), ("particle", ["20 +- 1 um", "20 um"])):
        with pytest.raises(InputError, match=r"without \+-"):
            case(bench(**{key: value}), liquid="giesekus")


def test_products_of_units_as_they_are_written() -> None:
    for text in ("1 Pa.s", "1 Pa*s", "1 Pa s", "1000 mPa·s", "1 Pa⋅s", "1 Pa•s", "10 P", "1 N.s.m-2", "1 N s/m2"):
        assert si(text, ZERO_SHEAR) == pytest.approx(1.0), text


def test_powers_of_units_need_no_mark() -> None:
    for text, of, size in (
        ("1000 kg/m3", QUANTITIES["density"], 1000.0),
        ("1 g/cm3", QUANTITIES["density"], 1000.0),
        ("1 mm3/s", A_FLOW, 1e-9),
        ("60 cm3 min-1", A_FLOW, 1e-6),
        ("5 N/m2", MODULUS, 5.0),
        ("1 cmH2O", MODULUS, 98.0665),  # whose 2 is part of its name
    ):
        assert si(text, of) == pytest.approx(size), text


BEADS = "physical: {{tube: 1 mm, particle: 0.4 mm, velocity: 5 mm/s, young: 1.5 kPa, viscosity: 10 Pa.s, {}}}\n"
MESH = "ends: developed\nlength: auto\nmesh: {Np: 20}\n"
RUN = (
    BEADS.format("distance: 90 um, end: 20 s")
    + MESH
    + "start: rest\nlimits: {max_gap: 0.16}\noutput: {fields: false}\n"
)
CURVE = BEADS.format("distance: {start: 80 um, stop: 180 um, num: 3}") + MESH


def header_and_rows(text: str) -> tuple[list[str], np.ndarray]:
    header, *rows = csv.reader(text.splitlines())
    return header, np.array(rows, dtype=float)


@pytest.mark.slow
def test_run_and_curve_in_units(tmp_path: Path, pairsim: Pairsim) -> None:
    api.run(yaml.safe_load(RUN), folder=tmp_path / "run").check()
    curve = api.curve(yaml.safe_load(CURVE), folder=tmp_path / "curve").check()

    kept = yaml.safe_load((tmp_path / "run" / "case.yaml").read_text())
    assert kept["physical"] == yaml.safe_load(RUN)["physical"]
    assert (kept["beta"], kept["Ca_e"], kept["d0"], kept["time"]["end"]) == pytest.approx((0.4, 0.1, 0.09, 100))
    scales = json.loads((tmp_path / "run" / "run.json").read_text())["scales"]
    assert scales == {
        **{"length": pytest.approx(1e-3), "time": pytest.approx(0.2), "velocity": pytest.approx(5e-3)},
        **{"stress": pytest.approx(50), "units": "m, s, m/s, Pa"},
    }

    plain, converted = (header_and_rows(pairsim("table", "run", *more).stdout) for more in (["--dimensionless"], []))
    assert plain[0] == ["t [D_c/U_av]", "d [D_c]", "dU [U_av]", "U_L [U_av]", "U_T [U_av]"]
    assert converted[0] == ["t [s]", "d [um]", "dU [um/s]", "U_L [um/s]", "U_T [um/s]"]
    assert converted[1] == pytest.approx(plain[1] * [0.2, 1e3, 5e3, 5e3, 5e3])
    whole, _ = header_and_rows(pairsim("table", "run", "--all").stdout)
    assert whole[:8] == [*converted[0], "D_L", "D_T", "dp [Pa]"]
    assert pairsim("table", "curve", "equilibria", "-o", "zeros.csv").returncode == 0
    assert (tmp_path / "zeros.csv").read_text().startswith("d [um],d_error [um],stable,slope [1/s],peak")

    way = pairsim("travel", "curve", "--from", "110um", "--to", "0.15")
    assert way.returncode == 0, way.stderr
    quick = curve.travel(0.11, 0.15)
    assert way.stdout.startswith("from d = 110 um to 150 um: ")
    seconds, mm = map(float, re.findall(r"([\d.]+) \+- [\d.]+ (?:s and|mm of)", way.stdout))
    assert (seconds, mm) == pytest.approx((0.2 * quick.time, quick.length), rel=1e-3)

    # The run passes the same distances after its transient; the meshes with N_p 20 differ by 2 %.
    series = read_table(tmp_path / "run" / "series.csv")
    grows = slice(int(np.argmin(series["d"])), None)
    U = (series["U_L"] + series["U_T"]) / 2
    moved = np.concatenate([[0.0], np.cumsum(np.diff(series["t"]) * (U[1:] + U[:-1]) / 2)])
    for values, expected in ((series["t"], quick.time), (moved, quick.length)):
        start, stop = np.interp([0.11, 0.15], series["d"][grows], values[grows])
        assert expected == pytest.approx(stop - start, rel=0.02)
