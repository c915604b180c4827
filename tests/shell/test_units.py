"""The physical block: dimensionless numbers by their definitions, and input errors."""

from __future__ import annotations

import re
import shlex
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from typer.testing import CliRunner

from pairsim.cases.quantities import LENGTH, quantity_range, si
from pairsim.cli.app import app
from pairsim.computing import QUESTIONS
from pairsim.computing.case_files import parse_case, read_case, read_with
from pairsim.physics.liquids.viscous import ZERO_SHEAR
from pairsim.physics.scales import Scales, mean_velocity
from pairsim.runtime.errors import InputError
from pairsim.sweeps.grid import read_grid

PAGE = (Path(__file__).parents[2] / "docs" / "how-to" / "units.md").read_text()
BENCH: dict[str, Any] = {
    **{"tube": "50 um", "particle": "20 um", "flow_rate": "1 ul/min", "modulus": "5 kPa"},
    **{"viscosity": "1 Pa.s", "relaxation": "2 ms", "distance": "5 um", "end": "50 ms"},
}


def bench(**changes: Any) -> dict[str, Any]:
    """The block with changes; None leaves a key out."""
    return {"physical": {key: value for key, value in (BENCH | changes).items() if value is not None}}


def test_scales_follow_their_definitions() -> None:
    scales = Scales(length=2e-3, velocity=4e-3, viscosity=0.5)
    assert (scales.time, scales.stress) == pytest.approx((0.5, 1.0))
    assert scales.reynolds(1000) == pytest.approx(1000 * 4e-3 * 2e-3 / 0.5)
    assert mean_velocity(np.pi * 1e-6, 2e-3) == pytest.approx(1.0)  # Q over pi R^2


def test_block_becomes_the_numbers_worked_by_hand() -> None:
    case = parse_case(QUESTIONS["run"], bench(solvent="90 mPa.s"), "test")
    U, D = 1e-9 / 60 * 4 / (np.pi * 50e-6**2), 50e-6
    expected = (0.4, 2e-3 * U / D, 1.0 * U / (D * 5e3), 0.09, 0.1, 50e-3 * U / D)
    assert (case.beta, case.De, case.Ca_e, case.xi, case.d0, case.time.end) == pytest.approx(expected, rel=1e-12)
    assert case.physical is not None
    assert case.resolved()["physical"] == bench(solvent="90 mPa.s")["physical"]


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
    one, other = (parse_case(QUESTIONS["run"], bench(**words), "test") for words in (changes, same))
    for name in ("beta", "De", "Ca_e", "d0"):
        assert getattr(one, name) == pytest.approx(getattr(other, name), rel=1e-12)


def test_lists_have_one_value_for_each_particle_and_gap() -> None:
    block = bench(particle=["20 um", "15 um", "20 um"], modulus=["5 kPa", "1 kPa", "5 kPa"], distance=["5 um", "10 um"])
    case = parse_case(QUESTIONS["run"], {**block, "particles": 3}, "test")
    assert case.beta == pytest.approx((0.4, 0.3, 0.4))
    assert case.gaps == pytest.approx((0.1, 0.2))
    assert case.Ca_es[1] == pytest.approx(5 * case.Ca_es[0])


def test_curves_and_critical_distances_take_the_block_too() -> None:
    block = bench(distance={"start": "5 um", "stop": "20 um", "num": 3}, end=None)
    assert parse_case(QUESTIONS["curve"], block, "test").places == [pytest.approx((d,)) for d in (0.1, 0.2, 0.4)]
    critical = parse_case(
        QUESTIONS["critical"], {**bench(distance=["1 um", "40 um"], end=None), "along": {"De": [0.5, 1]}}, "test"
    )
    assert critical.d == pytest.approx((0.02, 0.8))


def test_numbers_have_no_digits_of_rounding() -> None:
    """17 um over 50 um is .33999999999999997 in double precision."""
    assert parse_case(QUESTIONS["run"], bench(distance="17 um"), "test").d0 == 0.34


def test_without_relaxation_time_the_liquid_is_newtonian_and_rigid_particles_need_no_modulus() -> None:
    case = parse_case(QUESTIONS["run"], {**bench(relaxation=None, modulus=None), "Ca_e": 0}, "test")
    assert (case.De, case.Ca_e) == (0, 0)


def test_number_that_agrees_with_the_physical_block_may_stand_beside_it() -> None:
    case = parse_case(QUESTIONS["run"], bench(), "test")
    assert parse_case(QUESTIONS["run"], {**bench(), "De": case.De, "beta": 0.4}, "test") == case


def test_case_of_a_folder_can_be_read_and_changed(tmp_path: Path) -> None:
    path = tmp_path / "case.yaml"
    case = parse_case(QUESTIONS["run"], bench(), "test")
    path.write_text(yaml.safe_dump(case.resolved()))
    assert read_case(QUESTIONS["run"], path) == read_case(QUESTIONS["run"], path, ("physical.tube=50um",)).model_copy(
        update={"physical": case.physical}
    )
    faster = read_case(QUESTIONS["run"], path, ("physical.flow_rate=2 ul/min",))
    assert (faster.De, faster.Ca_e) == pytest.approx((2 * case.De, 2 * case.Ca_e))
    assert not {"De", "beta", "d0"} & read_with(path, ()).keys()


def test_swept_flow_rate_moves_De_and_Ca_e_together(tmp_path: Path) -> None:
    (tmp_path / "base.yaml").write_text(yaml.safe_dump(bench(end=None)))
    (tmp_path / "grid.yaml").write_text(
        "base: base.yaml\ngrid:\n  physical.flow_rate: {start: 1 ul/min, stop: 4 ul/min, num: 3, spacing: log}\n"
    )
    grid = read_grid(tmp_path / "grid.yaml")
    De, Ca_e = ([case.parameters[name] for case in grid.cases] for name in ("De", "Ca_e"))
    assert [value / De[0] for value in De] == pytest.approx([1, 2, 4])
    assert [value / Ca_e[0] for value in Ca_e] == pytest.approx([1, 2, 4])
    assert [case.parameters["physical.flow_rate"] for case in grid.cases] == ["1 μl/min", "2 μl/min", "4 μl/min"]
    assert set(grid.varying) == {"physical.flow_rate", "De", "Ca_e"}


def test_ranges_of_quantities_may_change_their_unit() -> None:
    assert [si(text, LENGTH) for text in quantity_range({"start": "1 um", "stop": "0.01 mm", "num": 4}, 10)] == (
        pytest.approx([1e-6, 4e-6, 7e-6, 1e-5])
    )
    with pytest.raises(ValueError, match="same kind"):
        quantity_range({"start": "1 um", "stop": "1 s", "num": 2}, 10)


@pytest.mark.parametrize("text", ["1 Pa.s", "1 Pa*s", "1 Pa s", "1000 mPa·s", "10 P"])
def test_products_of_units_as_they_are_written(text: str) -> None:
    assert si(text, ZERO_SHEAR) == pytest.approx(1.0)


EXAMPLES = re.findall(r"^pairsim units .*viscosity \S+(?: --relaxation \S+ --liquid \S+)?$", PAGE, re.MULTILINE)
BY_HAND = re.findall(r"^\| [a-z][^|]*((?:\| [\d.e-]+ ){6})\|$", PAGE, re.MULTILINE)


def test_page_has_three_examples() -> None:
    assert len(EXAMPLES) == len(BY_HAND) == 3


@pytest.mark.parametrize("i", range(3))
def test_examples_of_the_page_are_those_worked_by_hand(i: int, tmp_path: Path) -> None:
    result = CliRunner().invoke(app, [*shlex.split(EXAMPLES[i])[1:], "-o", str(tmp_path / "case.yaml")])
    assert result.exit_code == 0, result.output
    printed = {
        line.split()[0]: float(line.split()[1]) for line in result.output.splitlines()[:10] if "beta^2" not in line
    }
    U, time, beta, De, Ca_e, Re = (float(value) for value in BY_HAND[i].split("|")[1:])
    found = tuple(printed[name] for name in ("velocity", "time", "beta", "De", "Ca_e", "Re"))
    assert found == pytest.approx((U, time, beta, De, Ca_e, Re), rel=5e-3)
    case = read_case(QUESTIONS["run"], tmp_path / "case.yaml")
    assert (case.beta, case.De, case.Ca_e) == pytest.approx((beta, De, Ca_e), rel=1e-3)


UNITS = ["units", "--tube", "50um", "--particle", "20um", "--viscosity", "1Pa.s"]


def test_units_prints_the_defaults_used() -> None:
    shown = CliRunner().invoke(app, [*UNITS, "--flow", "1ul/min"]).output
    taken = re.findall("default used: (.*)", shown)
    words = ("liquid is Newtonian", "particles are rigid", "d0 = 0.1", "end time: 2", "density: 1000 kg/m^3")
    assert all(word in default for word, default in zip(words, taken, strict=True))
    given = [
        "--relaxation",
        "2ms",
        "--liquid",
        "giesekus",
        "--modulus",
        "5kPa",
        "--distance",
        "5um",
        "--end",
        "1s",
        "--density",
        "1g/ml",
    ]
    shown = CliRunner().invoke(app, [*UNITS, "--flow", "1ul/min", *given, "--solvent", "0.1Pa.s"]).output
    assert re.findall("default used: (.*)", shown) == ["liquid.alpha = 0.2"]


def test_units_asks_for_the_law_of_an_elastic_liquid() -> None:
    asked = CliRunner().invoke(app, [*UNITS, "--flow", "1ul/min", "--relaxation", "2ms"])
    assert isinstance(asked.exception, InputError)
    assert "--liquid: must be given with --relaxation: fene-p, giesekus" in str(asked.exception)


@pytest.mark.parametrize(
    ("words", "warned"),
    [
        (["--flow", "1ul/min", "--modulus", "5kPa"], ()),
        (["--flow", "1ul/min", "--modulus", "1kPa"], ()),
        (["--flow", "1ul/min"], ("only inertia",)),
        (
            ["--flow", "1ul/min", "--relaxation", "0.2s", "--liquid", "giesekus"],
            ("is above 2, the largest at which dU was compared",),
        ),
        (["--flow", "1ml/min", "--modulus", "5MPa"], ("inertia may change",)),
    ],
)
def test_units_warns_of_what_the_model_leaves_out(words: list[str], warned: tuple[str, ...]) -> None:
    shown = CliRunner().invoke(app, [*UNITS, *words]).output
    assert shown.count("warning: ") == len(warned)
    assert all(warning in shown for warning in warned)


@pytest.mark.parametrize(
    ("words", "kind", "distances"),
    [
        (["--kind", "curve"], "curve", (0.02, 0.8)),
        (["--kind", "curve", "--distance", "2um", "--distance", "20um"], "curve", (0.04, 0.4)),
        (["--kind", "critical", "--distance", "2um", "--distance", "20um"], "critical", (0.04, 0.4)),
        (
            ["--distance", "5um", "--distance", "10um", "--particle", "15um", "--particle", "10um"],
            "run",
            (0.1, 0.2),
        ),
    ],
)
def test_units_writes_a_case_of_each_command(
    words: list[str], kind: str, distances: tuple[float, float], tmp_path: Path
) -> None:
    path = tmp_path / "case.yaml"
    given = [*UNITS, "--flow", "1ul/min", "--modulus", "5kPa", *words]
    result = CliRunner().invoke(app, [*given, "-o", str(path)])
    assert result.exit_code == 0, result.output
    assert result.output.endswith(f"next: pairsim {kind} {path} --dry-run\n")
    assert f"\nd{'0' * (kind == 'run')} " in result.output
    case = read_case(QUESTIONS[kind], path)
    found = case.d0 if kind == "run" else case.d
    assert (np.min(found), np.max(found)) == pytest.approx(distances)
    assert (case.name, case.ends, case.length) == ("case", "developed", "auto")
    assert re.search(r"^  tube: 50um +# inner diameter of the tube D_c$", path.read_text(), re.MULTILINE)


def test_units_writes_a_case_only_when_asked_and_replaces_none(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert CliRunner().invoke(app, [*UNITS, "--flow", "1ul/min"]).exit_code == 0
    assert list(tmp_path.iterdir()) == []
    words = [*UNITS, "--flow", "1ul/min", "-o", "case.yaml"]
    assert CliRunner().invoke(app, words).exit_code == 0
    assert read_case(QUESTIONS["run"], tmp_path / "case.yaml").Ca_e == 0
    refused = CliRunner().invoke(app, words)
    assert isinstance(refused.exception, InputError)
    assert CliRunner().invoke(app, [*words, "--overwrite"]).exit_code == 0
