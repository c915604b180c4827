"""`pairsim units`: the numbers of an experiment on the command line, and the case file that it writes."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import numpy as np
import pytest
from support.inputs import ROOT
from typer.testing import CliRunner

from pairsim.app.command_line import app, command_of
from pairsim.cases.physical import KEYS
from pairsim.computing.case_files import read_case
from pairsim.physics import liquids, solids
from pairsim.physics.liquids.power_law import PowerLaw
from pairsim.physics.liquids.viscous import ViscousLaw
from pairsim.questions.registry import QUESTIONS
from pairsim.runtime.errors import InputError


def units(words: str) -> str:
    """What `pairsim units` prints of beads of 20 um."""
    result = CliRunner().invoke(app, ["units", "--tube", "50um", "--particle", "20um", *words.split()])
    if isinstance(result.exception, InputError):
        raise result.exception
    assert result.exit_code == 0, result.output
    return result.output


FLOW = "--viscosity 1Pa.s --flow 1ul/min"
PAGE = (ROOT / "docs" / "how-to" / "units.md").read_text()
EXAMPLES = re.findall(r"^pairsim units .*viscosity \S+(?: --relaxation \S+ --liquid \S+)?$", PAGE, re.MULTILINE)
BY_HAND = re.findall(r"^\| [a-z][^|]*((?:\| [\d.e-]+ ){6})\|$", PAGE, re.MULTILINE)


@pytest.mark.parametrize("i", range(3))
def test_examples_of_the_page_are_those_worked_by_hand(i: int, tmp_path: Path) -> None:
    assert len(EXAMPLES) == len(BY_HAND) == 3
    result = CliRunner().invoke(app, [*shlex.split(EXAMPLES[i])[1:], "-o", str(tmp_path / "case.yaml")])
    assert result.exit_code == 0, result.output
    lines = [line.split() for line in result.output.splitlines()[:10] if "beta^2" not in line]
    printed = {name: float(value) for name, value, *_ in lines}
    velocity, time, beta, De, Ca_e, Re = (float(value) for value in BY_HAND[i].split("|")[1:])
    found = tuple(printed[name] for name in ("velocity", "time", "beta", "De", "Ca_e", "Re"))
    assert found == pytest.approx((velocity, time, beta, De, Ca_e, Re), rel=5e-3)
    written = read_case(QUESTIONS["run"], tmp_path / "case.yaml")
    assert (written.beta, written.De, written.Ca_e) == pytest.approx((beta, De, Ca_e), rel=1e-3)


def test_units_prints_the_defaults_used() -> None:
    taken = re.findall("default used: (.*)", units(FLOW))
    words = (
        "liquid is Newtonian",
        "are rigid",
        "0.1 D_c, 5 um",
        "2 D_c/U_av, 0.01178 s",
        "start: steady",
        "1000 kg/m^3",
    )
    assert all(word in default for word, default in zip(words, taken, strict=True))
    given = (
        "--relaxation 2ms --liquid giesekus --modulus 5kPa --distance 5um --end 1s --density 1g/ml --solvent 0.1Pa.s"
    )
    assert re.findall("default used: (.*)", units(f"{FLOW} {given} --set start=rest")) == ["liquid.alpha = 0.2"]


@pytest.mark.parametrize(
    ("words", "warned"),
    [
        (f"{FLOW} --modulus 1kPa", ()),
        (FLOW, ("only inertia",)),
        (f"{FLOW} --relaxation 0.2s --liquid giesekus", ("is above 2, the largest at which dU was compared",)),
        ("--viscosity 1Pa.s --flow 1ml/min --modulus 5MPa", ("inertia may change",)),
    ],
)
def test_units_warns_of_what_the_model_leaves_out(words: str, warned: tuple[str, ...]) -> None:
    shown = units(words)
    assert shown.count("warning: ") == len(warned)
    assert all(warning in shown for warning in warned)


@pytest.mark.parametrize(
    ("words", "kind", "distances"),
    [
        ("--kind curve", "curve", (0.02, 0.8)),
        ("--kind critical --distance 2um --distance 20um", "critical", (0.04, 0.4)),
        ("--distance 5um --distance 10um --particle 15um --particle 10um", "run", (0.1, 0.2)),
    ],
)
def test_units_writes_a_case_of_each_command(
    words: str, kind: str, distances: tuple[float, float], tmp_path: Path
) -> None:
    path = tmp_path / "case.yaml"
    shown = units(f"{FLOW} --modulus 5kPa {words} -o {path}")
    assert shown.endswith(f"next: pairsim {kind} {path} --dry-run\n")
    written = read_case(QUESTIONS[kind], path)
    found = written.d0 if kind == "run" else written.d
    assert (np.min(found), np.max(found)) == pytest.approx(distances)
    assert (written.name, written.ends, written.length) == ("case", "developed", "auto")
    assert re.search(r"^  tube: 50um +# inner diameter of the tube D_c$", path.read_text(), re.MULTILINE)


def test_units_writes_a_case_of_any_law(tmp_path: Path) -> None:
    path = tmp_path / "case.yaml"
    law = "--liquid power-law --n 0.6 --consistency 0.5Pa.s^0.6 --solid kelvin-voigt --particle-viscosity 1Pa.s"
    units(f"--flow 1ul/min --modulus 5kPa {law} -o {path}")
    assert read_case(QUESTIONS["run"], path).liquid_model.solvent == PowerLaw(n=0.6)


def test_units_has_an_option_for_each_quantity_of_a_law_that_ships_and_its_help_names_these_laws() -> None:
    command = command_of("units")
    options = {parameter.name: parameter.help or "" for parameter in command.params}
    for name, laws in (("liquid", liquids.LAWS), ("solid", solids.LAWS)):
        shipped = [law for law in laws.values() if law.__module__.startswith("pairsim.")]
        quantities = [each.dimension.key for law in shipped for each in law.parameters().values() if each.dimension]
        measured = [law.measured.key for law in shipped if issubclass(law, ViscousLaw)]
        assert {*quantities, *measured} <= options.keys()
        assert {law.name for law in shipped} <= {*re.split(r"[:,.] *", options[name])}


def test_units_has_an_option_for_each_key_of_the_block() -> None:
    shown = units("--velocity 8mm/s --viscosity 1Pa.s --kind train --spacing 30um --contact 50nm --set row.beads=9")
    assert "length              50 um" in shown
    command = command_of("units")
    assert KEYS.keys() <= {parameter.name for parameter in command.params}


@pytest.mark.parametrize("law", ["bingham --plastic-viscosity 1Pa.s", "herschel-bulkley --n 1 --consistency 1Pa.s^1"])
def test_units_takes_a_yield_stress(law: str) -> None:
    shown = units(f"--flow 1ul/min --modulus 5kPa --yield-stress 5Pa --liquid {law}")
    found = re.search(r"^liquid.Bn +([\d.]+) ", shown, re.MULTILINE)
    assert found is not None
    assert float(found[1]) == pytest.approx(5 / 169.765, rel=1e-3), "over eta_0 U_av/D_c"


def test_units_writes_a_case_only_when_asked_and_replaces_none(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    units(FLOW)
    assert list(tmp_path.iterdir()) == []
    units(f"{FLOW} -o case.yaml")
    assert read_case(QUESTIONS["run"], tmp_path / "case.yaml").Ca_e == 0
    with pytest.raises(InputError):
        units(f"{FLOW} -o case.yaml")
    units(f"{FLOW} -o case.yaml --overwrite")
