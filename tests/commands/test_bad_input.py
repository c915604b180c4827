"""Bad input ends with exit code 2 and one message that names file, key and what is allowed; nothing is written."""

from __future__ import annotations

from pathlib import Path

import pytest
from support.commands import Pairsim
from typer.testing import CliRunner

from pairsim.cli.app import app
from pairsim.commands import COMMANDS
from pairsim.inputs.case_files import read_case
from pairsim.runtime.errors import InputError

GOOD = "beta: 0.4\nDe: 0\nCa_e: 0.1\nd0: 0.1\n"

BAD = {
    "misspelt key": (GOOD + "lenght: 3\n", "lenght", "did you mean length"),
    "misspelt key in a group": (GOOD + "mesh: {NP: 20}\n", "mesh.NP", "Np"),
    "unknown key": (GOOD + "gravity: 9.81\n", "gravity", "allowed: beta, De, Ca_e, name"),
    "missing De": ("beta: 0.4\nCa_e: 0.1\nd0: 0.1\n", "De", "missing"),
    "missing beta": ("De: 0\nCa_e: 0.1\nd0: 0.1\n", "beta", "missing"),
    "missing Ca_e": ("beta: 0.4\nDe: 0\nd0: 0.1\n", "Ca_e", "missing"),
    "missing d0": ("beta: 0.4\nDe: 0\nCa_e: 0.1\n", "d0", "missing"),
    "word for a number": (GOOD.replace("0.4", "wide"), "beta", "at least 0.001 and at most 0.999"),
    "text for a number": (GOOD.replace("0.4", "'0.4'"), "beta", "number"),
    "true for a number": (GOOD.replace("Ca_e: 0.1", "Ca_e: true"), "Ca_e", "number"),
    "nan": (GOOD.replace("0.4", ".nan"), "beta", "finite"),
    "infinity": (GOOD.replace("Ca_e: 0.1", "Ca_e: .inf"), "Ca_e", "finite"),
    "beta of one": (GOOD.replace("0.4", "1.0"), "beta", "at most 0.999"),
    "beta of zero": (GOOD.replace("0.4", "0"), "beta", "at least 0.001"),
    "d0 of zero": (GOOD.replace("d0: 0.1", "d0: 0"), "d0", "at least 0.0001"),
    "negative d0": (GOOD.replace("d0: 0.1", "d0: -0.1"), "d0", "at least 0.0001"),
    "negative Ca_e": (GOOD.replace("Ca_e: 0.1", "Ca_e: -1e-3"), "Ca_e", "must be 0, or a finite number from 1e-06"),
    "negative De": (GOOD.replace("De: 0", "De: -1"), "De", "must be 0, or a finite number from 1e-06"),
    "newtonian with De": (GOOD.replace("De: 0", "De: 1\nliquid: newtonian"), "liquid", "De: 0"),
    "unknown liquid": (GOOD + "liquid: water\n", "liquid", "giesekus"),
    "parameter of another law": (
        GOOD.replace("De: 0", "De: 1\nliquid: oldroyd-b\nalpha: 0.2"),
        "alpha",
        "is a parameter of giesekus",
    ),
    "missing parameter of a law": (GOOD.replace("De: 0", "De: 1\nliquid: fene-p"), "L2", "must be given with liquid"),
    "short FENE-P": (GOOD.replace("De: 0", "De: 1\nliquid: fene-p\nL2: 3"), "L2", "above 3"),
    "no solvent": (GOOD.replace("De: 0", "De: 1\nxi: 0"), "xi", "above 0"),
    "number too large for a float": (GOOD.replace("0.4", "1" + "0" * 399), "beta", "finite"),
    "name that leaves the folder": (GOOD + "name: ..\n", "name", "letters"),
    "too many outputs": (GOOD + "output: {every: 1e-9}\n", "output.every", "at least"),
    "max_step below first_step": (GOOD + "time: {max_step: 1e-5}\n", "time.max_step", "time.first_step"),
    "wrong length of a list": (GOOD.replace("0.4", "[0.4, 0.3, 0.2]"), "beta", "list of 2"),
    "wrong number of gaps": (GOOD.replace("d0: 0.1", "d0: [0.1, 0.2]"), "d0", "gaps"),
    "bad entry of a list": (GOOD.replace("0.4", "[0.4, -1]"), "beta[1]", "at least 0.001"),
    "short tube": (GOOD + "length: 1.0\n", "length", "at least 1.9"),
    "auto with periodic ends": (GOOD + "length: auto\n", "length", "developed"),
    "unknown ends": (GOOD + "ends: open\n", "ends", "periodic or developed"),
    "accuracy out of range": (GOOD + "accuracy: 30%\n", "accuracy", "another percentage from 0.01% to 20%"),
    "accuracy without a percent sign": (GOOD + "accuracy: 0.5\n", "accuracy", "another percentage from 0.01% to 20%"),
    "fraction of a particle": (GOOD + "particles: 1.5\n", "particles", "whole number"),
    "coarse mesh": (GOOD + "mesh: {Np: 2}\n", "mesh.Np", "at least 6"),
    "number for a group": (GOOD + "time: 3\n", "time", "end, tol"),
    "negative end": (GOOD + "time: {end: -1}\n", "time.end", "at least 1e-09"),
    "late output": (GOOD + "output: {times: [5]}\n", "output.times", "time.end"),
    "yes for true": (GOOD + "output: {fields: 'yes'}\n", "output.fields", "true or false"),
    "max_gap below d0": (GOOD + "limits: {max_gap: 0.05}\n", "limits.max_gap", "above the initial distance"),
    "min_gap above d0": (GOOD + "limits: {min_gap: 0.2}\n", "limits.min_gap", "below the initial distance"),
    "name with a slash": (GOOD + "name: ../x\n", "name", "letters"),
    "key given twice": (GOOD + "beta: 0.3\n", "case.yaml:5: ", "only once"),
    "broken YAML": ("beta: [0.4\nDe: 0\n", "case.yaml:2: ", "must be valid YAML"),
    "a list": ("- 1\n- 2\n", "", "keys and values"),
    "empty file": ("", "", "keys and values"),
    "mesh too large for memory": (GOOD + "mesh: {max_size: 0.001, growth: 0.01}\n", "mesh", "at most 2e+07 unknowns"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_case_is_refused(name: str, tmp_path: Path) -> None:
    text, key, allowed = BAD[name]
    path = tmp_path / "case.yaml"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        read_case(COMMANDS["run"], path)
    message = str(caught.value)
    assert str(path) in message
    assert key in message
    assert allowed in message


@pytest.mark.parametrize("name", ["misspelt key", "nan", "broken YAML", "empty file"])
def test_command_ends_with_2_and_writes_nothing(name: str, tmp_path: Path, pairsim: Pairsim) -> None:
    text, key, allowed = BAD[name]
    (tmp_path / "case.yaml").write_text(text)
    result = pairsim("run", "case.yaml")
    assert result.returncode == 2
    assert "case.yaml" in result.stderr
    assert key in result.stderr
    assert allowed in result.stderr
    assert "Traceback" not in result.stderr
    assert [p.name for p in tmp_path.iterdir()] == ["case.yaml"]


def test_missing_file_is_named(pairsim: Pairsim) -> None:
    result = pairsim("run", "nowhere.yaml")
    assert result.returncode == 2
    assert "nowhere.yaml: no such file" in result.stderr
    assert "Traceback" not in result.stderr


@pytest.mark.parametrize("ranks", [0, pytest.param(2, marks=pytest.mark.slow)])
def test_existing_folder_is_left_alone(ranks: int, tmp_path: Path, pairsim: Pairsim) -> None:
    (tmp_path / "case.yaml").write_text(GOOD)
    out = tmp_path / "out"
    out.mkdir()
    (out / "series.csv").write_text("precious")
    result = pairsim("run", "case.yaml", "-o", "out", ranks=ranks)
    assert result.returncode == 2
    assert result.stderr.count("--overwrite") == 1
    assert "Traceback" not in result.stderr
    assert (out / "series.csv").read_text() == "precious"
    assert [p.name for p in out.iterdir()] == ["series.csv"]


@pytest.mark.parametrize("arguments", [["run"], ["run", "a", "b"], ["fly"], ["run", "a", "--fast"]])
def test_usage_errors_end_with_2(arguments: list[str]) -> None:
    assert CliRunner().invoke(app, arguments).exit_code == 2


def test_settings_are_checked_like_the_file(tmp_path: Path) -> None:
    path = tmp_path / "case.yaml"
    path.write_text(GOOD)
    assert read_case(COMMANDS["run"], path, ("mesh.Np=20", "Ca_e=[0.1, 0]")).mesh.Np == 20
    for setting, key in (("mesh.Np=2", "mesh.Np"), ("mesh.Np", "mesh.Np"), ("beta.x=1", "beta")):
        with pytest.raises(InputError, match=key):
            read_case(COMMANDS["run"], path, (setting,))
