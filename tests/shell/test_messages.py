"""Wrong input ends with exit code 2 and a message that names place, value and what is allowed; nothing is written."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import pytest
from support.commands import Pairsim

from pairsim.computing import QUESTIONS
from pairsim.computing.case_files import read_case
from pairsim.computing.schema import json_schema
from pairsim.runtime.errors import InputError
from pairsim.runtime.text import as_typed

RUN = "beta: 0.4\nDe: 0\nCa_e: 0.1\nd0: 0.1\n"
CURVE = "beta: 0.4\nDe: 0.5\nCa_e: 0.1\nd: [0.1, 0.3]\n"
CRITICAL = "beta: 0.4\nDe: 0.5\nCa_e: 0.1\nalong: {Ca_e: [0.05, 0.1]}\n"
SHAPE = "particles: 1\nbeta: 0.4\nDe: 0\nCa_e: 0.1\nalong: [0.1]\n"
SWEEP = "base: {beta: 0.4, De: 0, Ca_e: 0.1}\ngrid:\n  d0: [0.1, 0.2]\n"
BENCH = (
    "physical: {tube: 50 um, particle: 20 um, viscosity: 1 Pa.s, flow_rate: 1 ul/min, modulus: 5 kPa, distance: 5 um}\n"
)
MODES = "{law: giesekus, time: 1, weight: 2}"
PHYSICAL = "physical: {tube: 50 um, viscosity: 1 Pa.s, flow_rate: 1 ul/min}\n"
MISTAKES = {
    "number out of range": (
        "run",
        RUN.replace("0.4", "1.2"),
        "case.yaml:1: beta: got 1.2; must be at most 0.999",
    ),
    "decimal comma": (
        "run",
        RUN.replace("0.4", "0,4"),
        (
            "case.yaml:1: beta: got '0,4'; must be a number, or a list; numbers are written as 90, 0.4 or 1e-3, "
            "without quotes"
        ),
    ),
    "entry of a list": (
        "run",
        RUN.replace("0.4", "[0.4, -1]"),
        "case.yaml:1: beta[1]: got -1; must be at least 0.001",
    ),
    "number between 0 and the least": (
        "run",
        RUN.replace("De: 0", "De: 1e-30"),
        "case.yaml:2: De: got 1e-30; must be 0, or at least 1e-06",
    ),
    "missing number": (
        "run",
        RUN.replace("d0: 0.1\n", ""),
        "case.yaml: d0: is missing; must be a number",
    ),
    "misspelt key": (
        "run",
        RUN + "lenght: 3\n",
        "case.yaml:5: lenght: got 3; unknown key; did you mean length?",
    ),
    "key unlike any other": (
        "run",
        RUN + "gravity: 9.81\n",
        (
            "case.yaml:5: gravity: got 9.81; unknown key; pairsim computes spheres on the axis of a round tube, "
            "without inertia and gravity (docs/explanation/limits.md)"
        ),
    ),
    "key without its group": (
        "run",
        RUN + "end: 3\n",
        "case.yaml:5: end: got 3; unknown key; did you mean time.end?",
    ),
    "dotted key": (
        "run",
        RUN + "mesh.Np: 20\n",
        "case.yaml:5: mesh.Np: got 20; unknown key; write it in its group, as mesh: {Np: 20}",
    ),
    "group that is a number": (
        "run",
        RUN + "time: 3\n",
        "case.yaml:5: time: got 3; must be keys with their values",
    ),
    "several at once": (
        "run",
        "beta: 2\nDe: -1\nlenght: 3\nmesh: {Np: 2}\n",
        (
            "case.yaml:1: beta: got 2; must be at most 0.999\n"
            "case.yaml:2: De: got -1; must be at least 0\n"
            "case.yaml:3: lenght: got 3; unknown key; did you mean length?\n"
            "case.yaml:4: mesh.Np: got 2; must be at least 6\n"
            "case.yaml: Ca_e: is missing; must be a number or a list of 2\n"
            "case.yaml: d0: is missing; must be a number"
        ),
    ),
    "inconsistent keys": (
        "run",
        RUN + "length: 1\nlimits: {min_gap: 0.2}\noutput: {times: [5]}\n",
        (
            "case.yaml:5: length: got 1; must be at least 1.9: 0.9 for the particles and 0.5 at each end\n"
            "case.yaml:6: limits.min_gap: got 0.2; must be below the initial distance 0.1\n"
            "case.yaml:7: output.times: got 5; must be at most time.end = 2"
        ),
    ),
    "unknown key beside inconsistent ones": (
        "run",
        RUN + "kappa: 2\nlength: 1\n",
        (
            "case.yaml:5: kappa: got 2; unknown key; allowed: beta, De, Ca_e, name, particles, xi, liquid, solid,"
            " length, ends, accuracy, mesh, physical, d0, start, dU_error, time, limits, output\n"
            "case.yaml:6: length: got 1; must be at least 1.9: 0.9 for the particles and 0.5 at each end"
        ),
    ),
    "mesh too large for memory": (
        "run",
        RUN + "mesh: {max_size: 0.0003, growth: 0.01}\n",
        "case.yaml:5: mesh: must give at most 2e+07 unknowns; mesh, length and beta give about 3e+08",
    ),
    "name that leaves the folder": (
        "run",
        RUN + "name: ..\n",
        (
            "case.yaml:5: name: got '..'; must be a word of at most 100 letters, digits and . _ + -, not "
            "beginning with one of . + -"
        ),
    ),
    "accuracy without a percent sign": (
        "run",
        RUN + "accuracy: 0.5\n",
        "case.yaml:5: accuracy: got 0.5; must be a percentage from 0.01% to 20%",
    ),
    "unknown law": (
        "run",
        RUN + "liquid: water\n",
        (
            "case.yaml:5: liquid: got 'water'; must be 'newtonian', 'carreau', 'fene-p', 'giesekus', 'oldroyd-b',"
            " 'power-law', 'ptt-linear', 'ptt-exp' or 'white-metzner', or a group with law and its parameters"
            "; --laws FILE adds laws of your own"
        ),
    ),
    "law without its parameter": (
        "run",
        RUN.replace("De: 0", "De: 1\nliquid: fene-p"),
        "case.yaml:3: liquid.L2: is missing; must be given with liquid: {law: fene-p, L2: ...}",
    ),
    "parameter of another law": (
        "run",
        RUN.replace("De: 0", "De: 1\nliquid: oldroyd-b\nalpha: 0.2"),
        (
            "case.yaml:4: alpha: got 0.2; unknown key; it is a parameter of the law: write liquid: {law: "
            "giesekus, alpha: 0.2}; liquid.alpha in grids and after --set"
        ),
    ),
    "key of another law in a block": (
        "run",
        RUN.replace("De: 0", "liquid: {law: power-law, n: 0.5, Cu: 1}"),
        "case.yaml:2: liquid.Cu: got 1; unknown key; allowed: law, n",
    ),
    "liquid without De": (
        "run",
        RUN.replace("De: 0", "liquid: giesekus"),
        "case.yaml: De: is missing; must be given with liquid: giesekus",
    ),
    "De of a viscous liquid": (
        "run",
        RUN.replace("De: 0", "De: 1\nliquid: {law: power-law, n: 0.5}"),
        (
            "case.yaml:3: liquid: got 'power-law'; has no memory: leave out De (or physical.relaxation), or name "
            "a viscoelastic law"
        ),
    ),
    "parameters of modes": (
        "run",
        RUN.replace("De: 0", f"De: 1\nliquid: {{law: modes, modes: [{MODES}, {{law: fene-p, L2: 1, weight: 1}}]}}"),
        (
            "case.yaml:3: liquid.modes[1].L2: got 1; must be above 3\n"
            "case.yaml:3: liquid.modes[1].time: is missing; must be given in liquid.modes[1]"
        ),
    ),
    "parameter of one solid": (
        "run",
        RUN + "solid: [neo-hookean, {law: kelvin-voigt, eta: soft}]\n",
        "case.yaml:5: solid[1].eta: got 'soft'; must be a number",
    ),
    "unit of another kind": (
        "run",
        PHYSICAL.replace("1 ul/min", "3 mm") + "Ca_e: 0\nbeta: 0.4\nd0: 0.1\n",
        (
            "case.yaml:1: physical.flow_rate: got '3 mm'; has the unit mm; must be a flow rate above 0 with its "
            "unit, such as 1 ul/min"
        ),
    ),
    "number without its unit": (
        "run",
        BENCH.replace("50 um", "50"),
        (
            "case.yaml:1: physical.tube: got 50; is not a number with a unit; must be a length above 0 with its "
            "unit, such as 50 um"
        ),
    ),
    "unknown unit": (
        "run",
        BENCH.replace("50 um", "50 foos"),
        (
            "case.yaml:1: physical.tube: got '50 foos'; has the unknown unit foos; must be a length above 0 with "
            "its unit, such as 50 um"
        ),
    ),
    "quantity of one particle": (
        "run",
        BENCH.replace("20 um", "[20 um, 1 s]"),
        (
            "case.yaml:1: physical.particle[1]: got '1 s'; has the unit s; must be a length above 0 with its "
            "unit, such as 20 um"
        ),
    ),
    "number of a quantity out of range": (
        "run",
        BENCH.replace("20 um", "60 um"),
        ("case.yaml:1: physical.particle: got '60 um'; in a tube of 50 um that is beta = 1.2; must be at most 0.999"),
    ),
    "number out of range by its quantity": (
        "run",
        BENCH.replace("5 um}", "1 nm}"),
        ("case.yaml:1: physical.distance: got '1 nm'; in a tube of 50 um that is d0 = 2e-05; must be at least 0.0001"),
    ),
    "quantity in place of a number": (
        "run",
        RUN.replace("d0: 0.1", "d0: 5um"),
        "case.yaml:4: d0: got '5um'; must be a number, or a list; with a unit it is physical.distance",
    ),
    "several relaxation times": (
        "run",
        BENCH.replace("}", ", relaxation: [1 ms, 2 ms]}"),
        (
            "case.yaml:1: physical.relaxation: got ['1 ms', '2 ms']; is a list; must be a time above 0 with its "
            "unit, such as 2 ms; several relaxation times are modes, liquid: {law: modes, modes: [...]}"
        ),
    ),
    "misspelt quantity": (
        "run",
        BENCH.replace("flow_rate", "flowrate"),
        "case.yaml:1: physical.flowrate: got '1 ul/min'; unknown key; did you mean physical.flow_rate?",
    ),
    "quantity that is missing": (
        "run",
        BENCH.replace(", flow_rate: 1 ul/min", ""),
        "case.yaml:1: physical.flow_rate: is missing; must be given, or else physical.velocity",
    ),
    "number that a quantity would give": (
        "run",
        BENCH.replace(", modulus: 5 kPa", ""),
        "case.yaml: Ca_e: is missing; must be a number or a list of 2, or be given by physical.modulus",
    ),
    "number that contradicts a quantity": (
        "run",
        BENCH.replace("}", ", relaxation: 2 ms}") + "De: 0.5\n",
        "case.yaml:2: De: got 0.5; must be left out, or be 0.3395 as given by physical.relaxation",
    ),
    "quantity of another command": (
        "curve",
        BENCH.replace("}", ", end: 1 s}"),
        "case.yaml:1: physical.end: must be left out: this kind of case has no time.end",
    ),
    "case of another command": (
        "run",
        CURVE,
        (
            "case.yaml: must be a file for `pairsim run`, but this is one for `pairsim curve` or `pairsim "
            "critical` (it has d); in its place d0: 0.1"
        ),
    ),
    "grid": (
        "run",
        SWEEP,
        "case.yaml: must be a file for `pairsim run`, but this is one for `pairsim sweep` (it has base, grid)",
    ),
    "soft particles that are moved": (
        "curve",
        CURVE + "velocity: 1\n",
        "case.yaml:5: velocity: got 1; must be left out: only rigid particles (Ca_e: 0) can be moved",
    ),
    "invalid range": (
        "curve",
        CURVE.replace("[0.1, 0.3]", "{start: 0}"),
        (
            "case.yaml:4: d: got {start: 0}; must be a list, or {start, stop, num, spacing: log or linear} with "
            "start and stop above 0 and num from 2 to 10000"
        ),
    ),
    "fields outside the curve": (
        "curve",
        CURVE + "fields: [0.9]\n",
        "case.yaml:5: fields: got 0.9; must be between the smallest and the largest d, 0.1 and 0.3",
    ),
    "unknown parameter to follow": (
        "critical",
        CRITICAL.replace("{Ca_e", "{beta"),
        (
            "case.yaml:4: along: got {beta: [0.05, 0.1]}; must be Ca_e or De with its values, such as along: "
            "{Ca_e: [0.05, 0.1]}"
        ),
    ),
    "key that varies twice": (
        "sweep",
        SWEEP + "zip: {d0: [0.1]}\n",
        "case.yaml:4: zip.d0: must occur only once in grid and zip",
    ),
    "wrong entry of a grid": (
        "sweep",
        SWEEP.replace("0.2]", "-2]"),
        "case.yaml:3: entry d0 = -2: d0: got -2; must be at least 0.0001",
    ),
    "base that is no file": (
        "sweep",
        "base: nowhere.yaml\ngrid: {d0: [0.1]}\n",
        "case.yaml:1: base: got 'nowhere.yaml'; no such file",
    ),
    "all of a sweep": (
        "sweep",
        (
            "command: fly\n"
            "base: {beta: 4, De: 0, mesh: {NP: 3}}\n"
            "exlude: []\n"
            "grid:\n"
            "  d0: [0.1, -0.2]\n"
            "  mesh.growth: {start: 0.1, stop: 0.2}\n"
            "zip: {De: [0, 1], xi: [0.1]}\n"
            "cases:\n"
            "  - {Ca_e: 1}\n"
            "  - 7\n"
            "  - nowhere.yaml\n"
            "exclude:\n"
            "  - {}\n"
            "  - {De: {min: low}}\n"
        ),
        (
            "case.yaml:1: command: got 'fly'; must be 'run', 'curve', 'critical' or 'shape'\n"
            "case.yaml:2: every case: beta: got 4; must be at most 0.999\n"
            "case.yaml:2: every case: mesh.NP: got 3; unknown key; did you mean mesh.Np?\n"
            "case.yaml:3: exlude: got []; unknown key; did you mean exclude?\n"
            "case.yaml:5: entry d0 = -0.2, De = 0, xi = 0.1: d0: got -0.2; must be at least 0.0001\n"
            "case.yaml:6: grid.mesh.growth: got {start: 0.1, stop: 0.2}; must have start, stop and num; num is "
            "missing\n"
            "case.yaml:7: zip: must have the same number of values for all keys; De has 2, xi has 1\n"
            "case.yaml:8: cases[1]: got 7; must be keys with their values, or text\n"
            "case.yaml:8: cases[2]: got 'nowhere.yaml'; no such file\n"
            "case.yaml:12: exclude[0]: got {}; must have at least 1 item, not 0\n"
            "case.yaml:14: exclude[1].De: got {min: 'low'}; must have numbers for min and max"
        ),
    ),
    "repeated key": (
        "run",
        RUN + "beta: 0.3\n",
        'case.yaml:5: must be valid YAML: found duplicate key "beta" with value "0.3" (original value: "0.4")',
    ),
    "tag of an object": (
        "run",
        RUN + "name: !!python/object/apply:os.system [touch executed]\n",
        (
            "case.yaml:5: must be valid YAML: tags such as tag:yaml.org,2002:python/object/apply:os.system are "
            "not allowed"
        ),
    ),
}
"""By what is wrong: the command, the text of its case.yaml, and the mistakes that it names."""
LINES = {
    "no such file": ("run nowhere.yaml", "pairsim: nowhere.yaml: no such file"),
    "folder for a file": ("run folder", "pairsim: folder: must be a file that can be read: Is a directory"),
    "folder in use": (
        "run case.yaml -o full",
        "pairsim: full: -o: must be a new or empty folder, unless --overwrite replaces the results in it",
    ),
    "contradicting options": (
        "run case.yaml --resume full --overwrite",
        "pairsim run: --overwrite: must be left out with --resume, which gives the folder",
    ),
    "setting without a value": (
        "run case.yaml --set mesh.Np",
        "pairsim: --set: got 'mesh.Np'; must be key=value on one line, such as mesh.Np=20",
    ),
    "wrong setting": ("run case.yaml --set mesh.Np=2", "pairsim: --set: mesh.Np: got 2; must be at least 6"),
    "setting through a number": (
        "run case.yaml --set beta.x=1",
        "pairsim: --set: beta.x: got '1'; must be a key within a group, but beta is not a group of keys",
    ),
    "picture of an empty folder": ("plot folder", "pairsim: folder: must be a folder of results, but is empty"),
    "travel time of a run": (
        "travel ran --from 0.1 --to 0.2",
        "pairsim: ran: must be a folder of `pairsim curve`, not of `pairsim run`",
    ),
    "quantity without a unit": (
        "units --tube 50 --particle 20um --viscosity 1Pa.s --flow 1ul/min",
        (
            "pairsim units: --tube: got '50'; is not a number with a unit; must be a length above 0 with its "
            "unit, such as 50 um"
        ),
    ),
    "option that is missing": (
        "units --tube 50um --particle 20um --viscosity 1Pa.s --solvent 3Pa.s",
        (
            "pairsim: 2 mistakes:\n"
            "  pairsim units: --flow: is missing; must be given, or else --velocity\n"
            "  pairsim units: --solvent: got '3Pa.s'; must be at most --viscosity = 1Pa.s, which includes it"
        ),
    ),
    "option of another law": (
        "units --tube 50um --particle 20um --viscosity 1Pa.s --flow 1ul/min --n 0.6",
        (
            "pairsim units: --n: got 0.6; must be left out, or be given with --liquid carreau or --liquid power-"
            "law or --liquid white-metzner"
        ),
    ),
    "name of no file": (
        "init ../x",
        "pairsim init: NAME: got '../x'; must be a name of letters, digits and . _ + -, without a folder",
    ),
    "file that exists": ("init case", "pairsim: case.yaml: NAME: must be another name: the file exists"),
    "mesh of another format": (
        "mesh case.yaml -o mesh.stl",
        "pairsim: mesh.stl: -o: got '.stl'; must be a name ending in .msh, .vtu or .xdmf",
    ),
    "picture of a file": (
        "plot case.yaml",
        "pairsim: case.yaml: must be a folder of results, such as runs/quickstart, but is a file",
    ),
    "picture of the folder above": (
        "plot .",
        (
            "pairsim: .: must be a folder of results, but has no run.json, sweep.json or study.csv; there are "
            "results in its folders ran"
        ),
    ),
}
"""By what is wrong: the arguments of a command, and what it says."""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with a case, and folders that are empty, hold something else, and hold a run."""
    for name, file in (("folder", ""), ("full", "notes.txt"), ("ran", "run.json"), ("ran", "series.csv")):
        (tmp_path / name).mkdir(exist_ok=True)
        if file:
            (tmp_path / name / file).write_text(json.dumps({"kind": "run", "status": "finished"}))
    return tmp_path


def message(folder: Path, pairsim: Pairsim, text: str, arguments: str) -> str:
    """What a command says that must end with exit code 2, and write nothing."""
    (folder / "case.yaml").write_text(text)
    before = sorted(folder.rglob("*"))
    done = pairsim(*arguments.split())
    assert (done.returncode, done.stdout) == (2, "")
    assert sorted(folder.rglob("*")) == before
    assert (folder / "case.yaml").read_text() == text
    return done.stderr.removesuffix("\n")


@pytest.mark.parametrize("name", MISTAKES)
def test_message_names_line_key_value_and_what_is_allowed(name: str, folder: Path, pairsim: Pairsim) -> None:
    command, text, mistakes = MISTAKES[name]
    said = message(folder, pairsim, text, f"{command} case.yaml")
    assert [line.removeprefix("pairsim: ").strip() for line in said.splitlines()][-mistakes.count("\n") - 1 :] == (
        mistakes.splitlines()
    )


@pytest.mark.parametrize("name", LINES)
def test_message_on_a_command_line(name: str, folder: Path, pairsim: Pairsim) -> None:
    arguments, said = LINES[name]
    assert message(folder, pairsim, RUN, arguments) == said


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
