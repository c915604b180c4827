"""Wrong input ends with exit code 2 and one message that names place, value and what is allowed; nothing is written.

The messages are those of `__snapshots__`. `pytest tests/commands/test_messages.py --snapshot-update` renews them; the
difference shows which have changed.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from pathlib import Path

import pytest
from support.commands import Pairsim
from syrupy.assertion import SnapshotAssertion

from pairsim.inputs.case_files import read_case
from pairsim.inputs.schema import json_schema
from pairsim.questions import QUESTIONS
from pairsim.runtime.errors import InputError
from pairsim.runtime.text import as_typed

RUN = "beta: 0.4\nDe: 0\nCa_e: 0.1\nd0: 0.1\n"
CURVE = "beta: 0.4\nDe: 0.5\nCa_e: 0.1\nd: [0.1, 0.3]\n"
CRITICAL = "beta: 0.4\nDe: 0.5\nCa_e: 0.1\nalong: {Ca_e: [0.05, 0.1]}\n"
SHAPE = "particles: 1\nbeta: 0.4\nDe: 0\nCa_e: 0.1\nalong: [0.1]\n"
SWEEP = "base: {beta: 0.4, De: 0, Ca_e: 0.1}\ngrid:\n  d0: [0.1, 0.2]\n"
STUDY = "base: {beta: 0.4, De: 0, Ca_e: 0.1, d0: 0.1}\ndiscretisations:\n  - {mesh.Np: 10}\n  - {mesh.Np: 20}\n"
BENCH = (
    "physical: {tube: 50 um, particle: 20 um, viscosity: 1 Pa.s, flow_rate: 1 ul/min, modulus: 5 kPa, distance: 5 um}\n"
)
MODES = "{law: giesekus, time: 1, weight: 2}"
PHYSICAL = "physical: {tube: 50 um, viscosity: 1 Pa.s, flow_rate: 1 ul/min}\n"
LONGEST = 500  # characters of a line about one mistake
Wrong = tuple[str, str]
"""The text of case.yaml and the arguments of a command."""

CASE_FILES: dict[str, Wrong] = {
    "number out of range": (RUN.replace("0.4", "1.2"), "run"),
    "word for a number": (RUN.replace("De: 0", "De: high"), "run"),
    "text for a number": (RUN.replace("0.4", "'0.4'"), "run"),
    "not a number": (RUN.replace("0.4", ".nan"), "run"),
    "decimal comma": (RUN.replace("0.4", "0,4"), "run"),
    "entry of a list": (RUN.replace("0.4", "[0.4, -1]"), "run"),
    "list of another length": (RUN.replace("0.4", "[0.4, 0.3, 0.2]"), "run"),
    "missing number": (RUN.replace("d0: 0.1\n", ""), "run"),
    "misspelt key": (RUN + "lenght: 3\n", "run"),
    "key unlike any other": (RUN + "gravity: 9.81\n", "run"),
    "key without its group": (RUN + "end: 3\n", "run"),
    "key in the wrong group": (RUN + "mesh: {end: 2}\n", "run"),
    "dotted key": (RUN + "mesh.Np: 20\n", "run"),
    "group that is a number": (RUN + "time: 3\n", "run"),
    "several at once": ("beta: 2\nDe: -1\nlenght: 3\nmesh: {Np: 2}\n", "run"),
    "inconsistent keys": (RUN + "length: 1\nlimits: {min_gap: 0.2}\noutput: {times: [5]}\n", "run"),
    "law without its parameter": (RUN.replace("De: 0", "De: 1\nliquid: fene-p"), "run"),
    "parameter of another law": (RUN.replace("De: 0", "De: 1\nliquid: oldroyd-b\nalpha: 0.2"), "run"),
    "unknown law": (RUN + "liquid: water\n", "run"),
    "memory in a liquid without one": (RUN.replace("De: 0", "De: 1\nliquid: newtonian"), "run"),
    "unit of another kind": (PHYSICAL.replace("1 ul/min", "3 mm") + "Ca_e: 0\nbeta: 0.4\nd0: 0.1\n", "run"),
    "unit and number": (PHYSICAL.replace("}", ", relaxation: 2 ms}") + RUN, "run"),
    "number without its unit": (BENCH.replace("50 um", "50"), "run"),
    "unknown unit": (BENCH.replace("50 um", "50 foos"), "run"),
    "arithmetic for a quantity": (BENCH.replace("50 um", "9**9**9 um"), "run"),
    "quantity of one particle": (BENCH.replace("20 um", "[20 um, 1 s]"), "run"),
    "quantity out of range": (BENCH.replace("5 kPa", "-5 kPa"), "run"),
    "number of a quantity out of range": (BENCH.replace("20 um", "60 um"), "run"),
    "unit without its point": (BENCH.replace("1 Pa.s", "50mPas"), "run"),
    "quantity in place of a number": (RUN.replace("d0: 0.1", "d0: 5um"), "run"),
    "several relaxation times": (BENCH.replace("}", ", relaxation: [1 ms, 2 ms]}"), "run"),
    "quantity of another thing": (BENCH.replace("}", ", bead_viscosity: 1 Pa.s}"), "run"),
    "half a range of quantities": (BENCH.replace("distance: 5 um", "distance: {start: 5 um, stop: 9 um}"), "run"),
    "misspelt quantity": (BENCH.replace("flow_rate", "flowrate"), "run"),
    "quantity given twice": (BENCH.replace("}", ", young: 1 kPa}"), "run"),
    "quantity that contradicts another": (BENCH.replace("}", ", solvent: 2 Pa.s}"), "run"),
    "quantity that is missing": (BENCH.replace(", flow_rate: 1 ul/min", ""), "run"),
    "number that a quantity would give": (BENCH.replace(", modulus: 5 kPa", ""), "run"),
    "number that contradicts a quantity": (BENCH.replace("}", ", relaxation: 2 ms}") + "De: 0.5\n", "run"),
    "quantity of another command": (BENCH.replace("}", ", end: 1 s}"), "curve"),
    "quantities that are no group": (RUN + "physical: 3\n", "run"),
    "law that is no law": (RUN + "liquid: 3\n", "run"),
    "law by its name without its parameter": (RUN.replace("De: 0", "liquid: power-law"), "run"),
    "key of another law in a block": (RUN.replace("De: 0", "liquid: {law: power-law, n: 0.5, Cu: 1}"), "run"),
    "De of a viscous liquid": (RUN.replace("De: 0", "De: 1\nliquid: {law: power-law, n: 0.5}"), "run"),
    "solvent without a polymer": (RUN + "liquid: {law: giesekus, solvent: {law: power-law, n: 0.5}}\n", "run"),
    "parameter of a solvent": (
        RUN.replace("De: 0", "De: 1\nliquid: {law: giesekus, solvent: {law: power-law, n: 9}}"),
        "run",
    ),
    "parameters of modes": (
        RUN.replace("De: 0", f"De: 1\nliquid: {{law: modes, modes: [{MODES}, {{law: fene-p, L2: 1, weight: 1}}]}}"),
        "run",
    ),
    "no modes": (RUN.replace("De: 0", "De: 1\nliquid: {law: modes, modes: []}"), "run"),
    "one solid too many": (RUN + "solid: [neo-hookean, neo-hookean, neo-hookean]\n", "run"),
    "parameter of one solid": (RUN + "solid: [neo-hookean, {law: kelvin-voigt, eta: soft}]\n", "run"),
    "quantity of two laws": (
        BENCH.replace("}", ", relaxation: 2 ms, time_constant: 5 ms}")
        + "liquid: {law: white-metzner, n: 0.5, solvent: {law: carreau, n: 0.5}}\n",
        "run",
    ),
    "quantity of no law": (BENCH.replace("}", ", time_constant: 5 ms}"), "run"),
    "consistency of another law": (
        BENCH.replace("viscosity: 1 Pa.s", "consistency: 1 Pa.s^0.7") + "liquid: {law: power-law, n: 0.6}\n",
        "run",
    ),
    "viscosity for a consistency": (BENCH + "liquid: {law: power-law, n: 0.6}\n", "run"),
    "mesh too large for memory": (RUN + "mesh: {max_size: 0.0003, growth: 0.01}\n", "run"),
    "name that leaves the folder": (RUN + "name: ..\n", "run"),
    "case of another command": (CURVE, "run"),
    "grid": (SWEEP, "run"),
    "soft particles that are moved": (CURVE + "velocity: 1\n", "curve"),
    "invalid range": (CURVE.replace("[0.1, 0.3]", "{start: 0}"), "curve"),
    "fields outside the curve": (CURVE + "fields: [0.9]\n", "curve"),
    "critical distances of three": (CRITICAL + "particles: 3\n", "critical"),
    "unknown parameter to follow": (CRITICAL.replace("{Ca_e", "{beta"), "critical"),
    "shape of a pair": (SHAPE.replace("particles: 1", "particles: 2"), "shape"),
    "shape without values of Ca_e": (SHAPE.replace("along: [0.1]\n", ""), "shape"),
    "shape of a rigid particle": (SHAPE.replace("Ca_e: 0.1", "Ca_e: 0"), "shape"),
    "grid of nothing": (SWEEP.partition("grid")[0], "sweep"),
    "value for a list of values": (SWEEP.replace("[0.1, 0.2]", "0.1"), "sweep"),
    "group for a key of a grid": (SWEEP + "  mesh: {Np: [10, 20]}\n", "sweep"),
    "logarithmic range through 0": (SWEEP + "  Ca_e: {start: 0, stop: 1, num: 3, spacing: log}\n", "sweep"),
    "key that varies twice": (SWEEP + "zip: {d0: [0.1]}\n", "sweep"),
    "base that is no file": ("base: nowhere.yaml\ngrid: {d0: [0.1]}\n", "sweep"),
    "inconsistent entry of a grid": (SWEEP + "  length: [auto]\n", "sweep"),
    "exclusion without effect": (SWEEP + "exclude: [{d0: 0.3}]\n", "sweep"),
    "exclusion of everything": (SWEEP + "exclude: [{d0: {max: 1}}]\n", "sweep"),
    "wrong entry of a grid": (SWEEP.replace("0.2]", "-2]"), "sweep"),
    "all of a sweep": (
        "command: fly\nbase: {beta: 4, De: 0, mesh: {NP: 3}}\nexlude: []\ngrid:\n  d0: [0.1, -0.2]\n"
        "  mesh.growth: {start: 0.1, stop: 0.2}\nzip: {De: [0, 1], xi: [0.1]}\n"
        "cases:\n  - {Ca_e: 1}\n  - 7\n  - nowhere.yaml\nexclude:\n  - {}\n  - {De: {min: low}}\n",
        "sweep",
    ),
    "entry of values to follow": (CRITICAL.replace("0.1]", "-1]"), "critical"),
    "value to follow out of range": (CRITICAL.replace("{Ca_e: [0.05, 0.1]}", "{De: [1e-300]}"), "critical"),
    "true for a number": (RUN.replace("0.1\nd0", "true\nd0"), "run"),
    "number between 0 and the least": (RUN.replace("De: 0", "De: 1e-30"), "run"),
    "step beyond the end": (RUN + "time: {end: 1.0e-4}\n", "run"),
    "unknown key beside inconsistent ones": (RUN + "kappa: 2\nlength: 1\n", "run"),
    "velocity in a run": (RUN + "velocity: 1\n", "run"),
    "fields without distances": (CURVE.replace("d: [0.1", "fields: [0.1"), "curve"),
    "liquid at rest": (CURVE.replace("Ca_e: 0.1", "Ca_e: 0") + "velocity: 0\nflow: 0\n", "curve"),
    "half a flow": (CURVE + "flow: 0.5\n", "curve"),
    "case of critical": (CRITICAL, "run"),
    "case of run": (RUN, "curve"),
    "study given to sweep": (STUDY, "sweep"),
    "case given to sweep": (RUN, "sweep"),
    "study without discretisations": (STUDY.partition("disc")[0] + "at: 1\n", "study"),
    "wrong value in cases": (SWEEP + "cases: [{d0: 0.1, Ca_e: -1}]\n", "sweep"),
    "no values": (SWEEP.replace("[0.1, 0.2]", "[]"), "sweep"),
    "endless range": (SWEEP.replace("[0.1, 0.2]", "{start: 1, stop: .inf, num: 3}"), "sweep"),
    "too many values": (SWEEP + "".join(f"  k{i}: {{start: 1, stop: 2, num: 100000}}\n" for i in range(20)), "sweep"),
    "number out of range by its quantity": (BENCH.replace("5 um}", "1 nm}"), "run"),
    "flow rate and velocity": (BENCH.replace("}", ", velocity: 1 mm/s}"), "run"),
    "quantity beyond all limits": (BENCH.replace("50 um", "1e300 m"), "run"),
    "broken unit": (BENCH.replace("50 um", "5 um**"), "run"),
    "largest step below the first": (RUN + "time: {max_step: 1e-5}\n", "run"),
    "too many outputs": (RUN + "output: {every: 1e-9}\n", "run"),
    "distances of another number of gaps": (RUN.replace("d0: 0.1", "d0: [0.1, 0.2]"), "run"),
    "largest gap below the first": (RUN + "limits: {max_gap: 0.05}\n", "run"),
    "no solvent": (RUN.replace("De: 0", "De: 1\nxi: 0"), "run"),
    "missing De": (RUN.replace("De: 0\n", ""), "run"),
    "fraction of a particle": (RUN + "particles: 1.5\n", "run"),
    "text for true": (RUN + "output: {fields: 'yes'}\n", "run"),
    "unknown ends": (RUN + "ends: open\n", "run"),
    "accuracy without a percent sign": (RUN + "accuracy: 0.5\n", "run"),
    "study of a sweep": (STUDY + "command: sweep\n", "study"),
    "study of curves without distances": ("command: curve\n" + STUDY.replace(", d0: 0.1", ""), "study"),
    "study of one discretisation": (STUDY.rpartition("  - ")[0] + "at: 1\n", "study"),
    "study of the same twice": (STUDY + "  - {mesh.Np: 20}\nat: 1\n", "study"),
    "study with two references": (STUDY + "at: 1\nreference: 1\nexact: 0.1\n", "study"),
    "study without that discretisation": (STUDY + "at: 1\nreference: 4\n", "study"),
    "study with too few exact values": (STUDY + "at: [1, 2]\nexact: 0.1\n", "study"),
    "all of a study": (
        "base: {beta: 0.4, De: 0, Ca_e: 0.1, d0: 0.1}\nrepeet: 2\nrepeat: 1.5\nat: [1, -1]\nexact: x\n"
        "reference: best\nquantity: 3\ndiscretisations:\n  - {command: fly}\n  - {mesh.Np: 2, repeat: 0}\n",
        "study",
    ),
}
YAML_FILES: dict[str, Wrong] = {
    "repeated key": (RUN + "beta: 0.3\n", "run"),
    "unclosed bracket": ("beta: [0.4\nDe: 0\n", "run"),
    "tab": ("mesh:\n\tNp: 8\n", "run"),
    "list": ("- 1\n- 2\n", "run"),
    "empty": ("", "run"),
    "tag of an object": (RUN + "name: !!python/object/apply:os.system [touch executed]\n", "run"),
}
LINES: dict[str, str] = {
    "no such file": "run nowhere.yaml",
    "folder for a file": "run folder",
    "folder in use": "run case.yaml -o full",
    "contradicting options": "run case.yaml --resume full --overwrite",
    "setting without a value": "run case.yaml --set mesh.Np",
    "wrong setting": "run case.yaml --set mesh.Np=2",
    "setting through a number": "run case.yaml --set beta.x=1",
    "picture of an empty folder": "plot folder",
    "picture of something else": "plot full",
    "travel time of a run": "travel ran --from 0.1 --to 0.2",
    "quantity without a unit": "units --tube 50 --particle 20um --viscosity 1Pa.s --flow 1ul/min",
    "unit that is no option": "units --tube 50um --particle 20um --viscosity 1Pa.s --modulus 5 --flow 1ul/min",
    "option that is missing": "units --tube 50um --particle 20um --viscosity 1Pa.s --solvent 3Pa.s",
    "option of another law": "units --tube 50um --particle 20um --viscosity 1Pa.s --flow 1ul/min --n 0.6",
    "name of no file": "init ../x",
    "file that exists": "init case",
    "mesh of another format": "mesh case.yaml -o mesh.stl",
    "picture of a file": "plot case.yaml",
    "picture of the folder above": "plot .",
    "case into a missing folder": (
        "units --tube 50um --particle 20um --viscosity 1Pa.s --flow 1ul/min -o nowhere/case.yaml"
    ),
    "setting without a case": "schema run --set De=1",
}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with a case, a grid, a pipe, and folders that are empty, hold something else, and hold a run."""
    for name, file in (("folder", ""), ("full", "notes.txt"), ("ran", "run.json"), ("ran", "series.csv")):
        (tmp_path / name).mkdir(exist_ok=True)
        if file:
            (tmp_path / name / file).write_text(json.dumps({"kind": "run", "status": "finished"}))
    (tmp_path / "grid.yaml").write_text(SWEEP)
    os.mkfifo(tmp_path / "pipe")
    return tmp_path


def message(folder: Path, pairsim: Pairsim, text: str, arguments: str) -> str:
    """What a command says that must end with exit code 2, and write nothing."""
    (folder / "case.yaml").write_text(text)
    before = sorted(folder.rglob("*"))
    done = pairsim(*arguments.split())
    assert done.returncode == 2
    assert sorted(folder.rglob("*")) == before
    assert (folder / "case.yaml").read_text() == text
    assert done.stdout == ""
    assert done.stderr.startswith("pairsim")
    assert all(len(line) < LONGEST for line in done.stderr.splitlines())
    return done.stderr


@pytest.mark.parametrize("name", CASE_FILES)
def test_message_names_line_key_value_and_what_is_allowed(
    name: str, folder: Path, pairsim: Pairsim, snapshot: SnapshotAssertion
) -> None:
    text, command = CASE_FILES[name]
    assert message(folder, pairsim, text, f"{command} case.yaml") == snapshot


@pytest.mark.parametrize("name", YAML_FILES)
def test_message_on_a_file_that_is_no_case(
    name: str, folder: Path, pairsim: Pairsim, snapshot: SnapshotAssertion
) -> None:
    text, command = YAML_FILES[name]
    assert message(folder, pairsim, text, f"{command} case.yaml") == snapshot


@pytest.mark.parametrize("name", LINES)
def test_message_on_a_command_line(name: str, folder: Path, pairsim: Pairsim, snapshot: SnapshotAssertion) -> None:
    assert message(folder, pairsim, RUN, LINES[name]) == snapshot


@pytest.mark.parametrize("words", [["run"], ["run", "a", "b"], ["fly"], ["run", "a", "--fast"]])
def test_usage_errors_end_with_2(words: list[str], pairsim: Pairsim) -> None:
    done = pairsim(*words)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith("Usage: ")


def numbers(command: str) -> Iterator[tuple[str, float, float]]:
    """Keys whose values are numbers, or may be, with their limits; those of groups are dotted."""
    schema = json.loads(json_schema(command))
    parts = {"": schema} | {
        f"{name}.": schema["$defs"][each["$ref"].rpartition("/")[2]]
        for name, each in schema["properties"].items()
        if "$ref" in each
    }
    for group, part in parts.items():
        for name, each in part["properties"].items():
            for value in (each, *each.get("anyOf", ())):
                if {"minimum", "maximum"} <= value.keys():
                    yield group + name, value["minimum"], value["maximum"]


@pytest.mark.parametrize(
    ("command", "text"), [("run", RUN), ("curve", CURVE), ("critical", CRITICAL), ("shape", SHAPE)]
)
def test_every_number_has_limits_and_is_named_with_them(command: str, text: str, tmp_path: Path) -> None:
    path = tmp_path / "case.yaml"
    path.write_text(text)
    bounded = list(numbers(command))
    assert len(bounded) > 10
    for name, least, most in bounded:
        for value in (least - 0.1, most + 0.1):
            with pytest.raises(InputError) as caught:
                read_case(QUESTIONS[command], path, (f"{name}={value!r}",))
            assert any(each.key == name and each.value == value for each in caught.value.mistakes)


@pytest.mark.parametrize("name", ["2020-13-45", "2026-01-15", "yes", "on"])
def test_dates_and_words_are_text(name: str, tmp_path: Path) -> None:
    path = tmp_path / "case.yaml"
    path.write_text(RUN + f"name: {name}\n")
    assert read_case(QUESTIONS["run"], path).name == name


def test_settings_replace_keys_of_the_file(tmp_path: Path) -> None:
    path = tmp_path / "case.yaml"
    path.write_text(RUN)
    case = read_case(QUESTIONS["run"], path, ("mesh.Np=20", "Ca_e=[0.1, 0]"))
    assert (case.mesh.Np, case.Ca_e) == (20, (0.1, 0))


def test_processes_that_do_not_see_each_other_complain(
    folder: Path, pairsim: Pairsim, monkeypatch: pytest.MonkeyPatch
) -> None:
    (folder / "case.yaml").write_text(RUN)
    monkeypatch.setenv("PMI_SIZE", "2")
    done = pairsim("run", "case.yaml", "-o", "out")
    assert done.returncode == 2
    assert done.stderr.count("2 processes that do not see each other") == 1


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (True, "true"),
        (0.34 + 1e-17, "0.34"),
        ({"a": [1] * 20, "b": None}, "{a: [1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1], b: null}"),
        ("x" * 1000, f"'{'x' * 39}…{'x' * 39}'"),
        ("a\nb", "'a\\nb'"),
    ],
)
def test_values_are_shown_shortened(value: object, text: str) -> None:
    assert as_typed(value) == text
