"""Input errors name place, value and what is allowed, and end with exit code 2 without a traceback."""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest

from pairsim.cli.app import main

RUN = "beta: 0.4\nDe: 0\nCa_e: 0.1\nd0: 0.1\n"
CURVE = "beta: 0.4\nDe: 0.5\nCa_e: 0.1\nd: [0.1, 0.3]\n"
CRITICAL = "beta: 0.4\nDe: 0.5\nCa_e: 0.1\nalong: {Ca_e: [0.05, 0.1]}\n"
SWEEP = "base: {beta: 0.4, De: 0, Ca_e: 0.1}\ngrid:\n  d0: [0.1, 0.2]\n"
STUDY = "base: {beta: 0.4, De: 0, Ca_e: 0.1, d0: 0.1}\ndiscretisations:\n  - {mesh.Np: 10}\n  - {mesh.Np: 20}\n"


@dataclass(frozen=True)
class Wrong:
    """A file, the arguments of a command, and what its error message must contain."""

    text: str
    arguments: str
    expected: tuple[str, ...]


def run(text: str, *expected: str) -> Wrong:
    return Wrong(text, "run case.yaml", expected)


def curve(text: str, *expected: str) -> Wrong:
    return Wrong(text, "curve case.yaml", expected)


def critical(text: str, *expected: str) -> Wrong:
    return Wrong(text, "critical case.yaml", expected)


def sweep(text: str, *expected: str) -> Wrong:
    return Wrong(text, "sweep case.yaml", expected)


def study(text: str, *expected: str) -> Wrong:
    return Wrong(text, "study case.yaml", expected)


def line(arguments: str, *expected: str) -> Wrong:
    return Wrong(RUN, arguments, expected)


MISTAKES = {
    "number out of range": run(RUN.replace("0.4", "1.2"), "case.yaml:1: beta: got 1.2; must be", "at most 0.999"),
    "word for a number": run(RUN.replace("De: 0", "De: high"), "case.yaml:2: De: got 'high'; must be 0, or a finite"),
    "boolean for a number": run(RUN.replace("0.1\nd0", "true\nd0"), "case.yaml:3: Ca_e: got true; must be"),
    "entry of a list": run(RUN.replace("0.4", "[0.4, -1]"), "case.yaml:1: beta[1]: got -1; must be", "0.001"),
    "misspelt key": run(RUN + "lenght: 3\n", "case.yaml:5: lenght: got 3; unknown key; did you mean length?"),
    "key without its group": run(RUN + "end: 3\n", "case.yaml:5: end: got 3; unknown key; did you mean time.end?"),
    "another one": run(RUN + "Np: 20\n", "Np: got 20; unknown key; did you mean mesh.Np?"),
    "key in the wrong group": run(RUN + "mesh: {end: 2}\n", "mesh.end: got 2; unknown key; did you mean time.end?"),
    "point in a key": run(
        RUN + "mesh.Np: 20\n", "case.yaml:5: mesh.Np: got 20; unknown key; write it in its group, as mesh: {"
    ),
    "unknown key and inconsistent length": run(
        RUN + "kappa: 2\nlength: 1\n",
        "2 mistakes:",
        "case.yaml:5: kappa: got 2; unknown key; allowed:",
        "case.yaml:6: length",
    ),
    "entry of a range of values": critical(
        CRITICAL.replace("0.1]", "-1]"), "case.yaml:4: along.Ca_e[1]: got -1; must be a finite number above 0\n"
    ),
    "fields of a curve without distances": curve(
        CURVE.replace("d: [0.1, 0.3]", "fields: [0.1]"), "case.yaml: d: is missing; must be a list"
    ),
    "soft particles that are moved": curve(
        CURVE + "velocity: 1\n", "case.yaml:5: velocity: got 1; must be left out: only rigid particles (Ca_e: 0)"
    ),
    "liquid at rest without anything that moves": curve(
        CURVE.replace("Ca_e: 0.1", "Ca_e: 0") + "velocity: 0\nflow: 0\n", "case.yaml:6: flow: got 0; must be 1: nothing"
    ),
    "half a flow": curve(CURVE + "flow: 0.5\n", "case.yaml:5: flow: got 0.5; must be 0 or 1"),
    "velocity in a run": run(RUN + "velocity: 1\n", "case.yaml:5: velocity: got 1; unknown key"),
    "units of another kind": run(
        "physical: {tube: 50 um, viscosity: 1 Pa.s,\n  flow_rate: 3 mm}\nCa_e: 0\nbeta: 0.4\nd0: 0.1\n",
        "case.yaml:2: physical.flow_rate: got '3 mm'; has the unit mm; must be a flow rate",
    ),
    "units and a number": run(
        "physical: {tube: 50 um, viscosity: 1 Pa.s, flow_rate: 1 ul/min, relaxation: 2 ms}\n" + RUN,
        "case.yaml:3: De: got 0; must be left out, or be 0.3395 as given",
    ),
    "capital letters": run(RUN + "mesh:\n  NP: 20\n", "case.yaml:6: mesh.NP: ", "did you mean mesh.Np?"),
    "key unlike any other": run(RUN + "gravity: 9.81\n", "gravity: got 9.81; unknown key; allowed: beta, De,"),
    "missing number": run(RUN.replace("d0: 0.1\n", ""), "case.yaml: d0: is missing; must be a number\n"),
    "group that is a number": run(RUN + "time: 3\n", "case.yaml:5: time: got 3; must be a group of keys; allowed: end"),
    "law's missing parameter": run(
        RUN.replace("De: 0", "De: 1\nliquid: fene-p"), "L2: is missing; must be given with liquid: fene-p"
    ),
    "another law's parameter": run(
        RUN.replace("De: 0", "De: 1\nliquid: oldroyd-b\nalpha: 0.2"), "case.yaml:4: alpha: got 0.2; must be left out"
    ),
    "short tube": run(RUN + "length: 1\n", "case.yaml:5: length: got 1; must be at least 1.9"),
    "list of another length": run(RUN.replace("0.4", "[0.4, 0.3, 0.2]"), "beta: got [0.4, 0.3, 0.2]; must be", "of 2"),
    "steps beyond the end": run(RUN + "time: {end: 1.0e-4}\n", "time.first_step: got 0.0005; must be at most"),
    "coarse mesh": run(RUN + "mesh:\n  growth: 0.2\n  Np: 2\n", "case.yaml:7: mesh.Np: got 2; must be", "at least 6"),
    "mesh too large for memory": run(
        RUN + "mesh: {max_size: 0.001, growth: 0.01}\n", "case.yaml:5: mesh: must give at most 2e+07"
    ),
    "several at once": run(
        "beta: 2\nDe: -1\nlenght: 3\nmesh: {Np: 2}\n",
        *("6 mistakes:", "case.yaml:1: beta: ", "case.yaml:2: De: ", "case.yaml:3: lenght: ", "case.yaml:4: mesh.Np: "),
        *("case.yaml: d0: is missing", "case.yaml: Ca_e: is missing"),
    ),
    "several inconsistent keys": run(
        RUN + "length: 1\nlimits: {min_gap: 0.2}\noutput: {times: [5]}\n",
        *("3 mistakes:", "case.yaml:5: length: ", "case.yaml:6: limits.min_gap: ", "case.yaml:7: output.times: "),
    ),
    "repeated key": run(RUN + "beta: 0.3\n", "case.yaml:5: must be valid YAML: key 'beta' must be given only once"),
    "broken YAML": run("beta: [0.4\nDe: 0\n", "case.yaml:2: must be valid YAML"),
    "empty file": run("", "case.yaml: must contain keys and values"),
    "case of curve": run(CURVE, "but this is one for `pairsim curve` or `pairsim critical` (it has d)"),
    "case of critical": run(CRITICAL, "this is one for `pairsim critical` or `pairsim shape` (it has along)"),
    "case of run": curve(RUN, "must be a file for `pairsim curve`, but this is one for `pairsim run` (it has d0)"),
    "grid given to run": run(SWEEP, "this is one for `pairsim sweep` (it has base, grid)"),
    "study given to sweep": sweep(STUDY, "this is one for `pairsim study` (it has discretisations)"),
    "case given to sweep": sweep(RUN, "this is one for `pairsim run`"),
    "curve without distances": curve(CURVE.replace("d: [0.1, 0.3]\n", ""), "case.yaml: d: is missing; must be a list"),
    "invalid range": curve(CURVE.replace("[0.1, 0.3]", "{start: 0}"), "case.yaml:4: d: got {start: 0}; must be"),
    "fields outside the curve": curve(CURVE + "fields: [0.9]\n", "case.yaml:5: fields: got 0.9; must be between"),
    "critical distances of three": critical(CRITICAL + "particles: 3\n", "particles: got 3; must be 2"),
    "unknown parameter to follow": critical(
        CRITICAL.replace("{Ca_e", "{beta"), "case.yaml:4: along: ", "must be Ca_e or De"
    ),
    "misspelt section": sweep(
        SWEEP + "exlude: []\n", "case.yaml:4: exlude: got []; unknown key; did you mean exclude?"
    ),
    "wrong entry": sweep(SWEEP.replace("0.2]", "-2]"), "case.yaml:3: entry d0 = -2: d0: got -2; must be"),
    "wrong base, reported once": sweep(SWEEP.replace("0.4", "4"), "case.yaml:1: every case: beta: got 4; must be"),
    "incomplete range": sweep(
        SWEEP.replace("[0.1, 0.2]", "{start: 1, stop: 2}"), "case.yaml:3: grid.d0: ", "num is missing"
    ),
    "study of one": study(STUDY.replace("  - {mesh.Np: 20}\n", ""), "case.yaml:2: discretisations: ", "two or more"),
    "study's misspelt key": study(
        STUDY + "repeet: 2\n", "case.yaml:5: repeet: got 2; unknown key; did you mean repeat?"
    ),
    "all of a sweep": sweep(
        "command: fly\nbase: {beta: 4, De: 0, mesh: {NP: 3}}\nexlude: []\ngrid:\n  d0: [0.1, -0.2]\n"
        "  mesh.growth: {start: 0.1, stop: 0.2}\nzip: {De: [0, 1], xi: [0.1]}\n"
        "cases:\n  - {Ca_e: 1}\n  - 7\n  - nowhere.yaml\nexclude:\n  - {}\n  - {De: {min: low}}\n",
        "11 mistakes:",
        "case.yaml:1: command: got 'fly'; must be run, curve, critical or shape",
        "case.yaml:2: every case: mesh.NP: got 3; unknown key; did you mean mesh.Np?",
        "case.yaml:2: every case: beta: got 4; must be",
        "case.yaml:3: exlude: got []; unknown key; did you mean exclude?",
        "case.yaml:5: entry d0 = -0.2, De = 0, xi = 0.1: d0: got -0.2; must be",
        "case.yaml:6: grid.mesh.growth: got {start: 0.1, stop: 0.2}; must have start, stop and num; num is missing",
        "case.yaml:7: zip: must have the same number of values for all keys; De has 2, xi has 1",
        "case.yaml:8: cases[1]: got 7; must be keys with their values, or the path of a case file",
        "case.yaml:8: cases[2]: got 'nowhere.yaml'; no such file",
        "case.yaml:14: exclude[1].De: got {min: 'low'}; must have numbers for min and max",
    ),
    "all of a study": study(
        "base: {beta: 0.4, De: 0, Ca_e: 0.1, d0: 0.1}\nrepeet: 2\nrepeat: 1.5\nat: [1, -1]\nexact: x\n"
        "reference: best\nquantity: 3\ndiscretisations:\n  - {command: fly}\n  - {mesh.Np: 2, repeat: 0}\n",
        "9 mistakes:",
        "case.yaml:2: repeet: got 2; unknown key; did you mean repeat?",
        "case.yaml:3: repeat: got 1.5; must be a whole number at least 1 and at most 100",
        "case.yaml:4: at[1]: got -1; must be a finite number above 0",
        "case.yaml:5: exact: got 'x'; must be a finite number, or a list of these",
        "case.yaml:6: reference: got 'best'; must be finest, or a whole number",
        "case.yaml:7: quantity: got 3; must be the name of a column, or d_cr",
        "case.yaml:9: discretisations[0].command: got 'fly'; must be run or curve",
        "case.yaml:10: discretisations[1].repeat: got 0; must be a whole number",
        "case.yaml:10: discretisations[1]: mesh.Np: got 2; must be",
    ),
    "study without discretisations": study(
        "base: {beta: 0.4}\nat: 1\n", "case.yaml: discretisations: is missing; must be a list of two or more"
    ),
    "setting without a value": line("run case.yaml --set mesh.Np", "--set: got 'mesh.Np'; must be key=value"),
    "wrong setting": line("run case.yaml --set mesh.Np=2", "--set: mesh.Np: got 2; must be a whole number at least 6"),
    "setting through a number": line(
        "run case.yaml --set beta.x=1", "--set: beta.x: got '1'; must be a key within a group, but beta"
    ),
    "no such file": line("run nowhere.yaml", "nowhere.yaml: no such file"),
    "folder for a file": line("run folder", "folder: must be a file"),
    "folder in use": line("run case.yaml -o full", "full: -o: ", "--overwrite"),
    "contradicting options": line(
        "run case.yaml --resume full --overwrite", "--overwrite: must be left out with --resume"
    ),
    "mesh of another format": line("mesh case.yaml -o mesh.stl", "mesh.stl: -o: got '.stl'; must be a name ending in"),
    "picture of nothing": line("plot nowhere", "nowhere: no such folder"),
    "picture of a file": line("plot case.yaml", "case.yaml: must be a folder of results"),
    "picture of an empty folder": line("plot folder", "folder: must be a folder of results, but is empty"),
    "picture of something else": line("plot full", "full: must be a folder of results, but has none"),
    "picture of the folder above": line("plot .", "must be a folder of results", "results in its folders ran"),
    "colours of a run": line("plot ran --group Ca_e", "--group: got 'Ca_e'; must be left out", "ran holds a run"),
    "status of nothing": line("status nowhere", "nowhere: no such folder"),
    "status of something else": line("status full", "full: must be a folder of results, but has none"),
    "case into a missing folder": line(
        "units --tube 50um --particle 20um --viscosity 1Pa.s --flow 1ul/min -o nowhere/case.yaml",
        "nowhere/case.yaml: -o: must be a writable file (No such file or directory)",
    ),
    "travel time of a run": line("travel ran --from 0.1 --to 0.2", "ran: must be a folder of `pairsim curve`, not"),
    "name with a folder": line("init ../x", "NAME: got '../x'; must be a name of letters"),
    "setting without a case": line("schema run --set De=1", "--set: must be used with --case"),
    "unknown time": line("sweep grid.yaml --walltime soon", "--walltime: got 'soon'; must be seconds, H:MM"),
    "unknown shard": line("sweep grid.yaml --shard 3/2", "--shard: got '3/2'; must be part/parts"),
}


@pytest.fixture
def complaint(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Callable[..., str]:
    """Runs a command that must end with exit code 2 without writing, next to some folders; returns its stderr."""
    monkeypatch.chdir(tmp_path)
    for name, file in (("folder", ""), ("full", "notes.txt"), ("ran", "run.json"), ("ran", "series.csv")):
        (tmp_path / name).mkdir(exist_ok=True)
        if file:
            (tmp_path / name / file).write_text(json.dumps({"status": "finished"}))
    (tmp_path / "grid.yaml").write_text(SWEEP)

    def run(text: str, arguments: str) -> str:
        (tmp_path / "case.yaml").write_text(text)
        before = sorted(path for path in tmp_path.rglob("*") if not path.name.startswith("."))
        monkeypatch.setattr(sys, "argv", ["pairsim", *arguments.split()])
        with pytest.raises(SystemExit) as end:
            main()
        assert end.value.code == 2
        assert sorted(path for path in tmp_path.rglob("*") if not path.name.startswith(".")) == before
        said = capsys.readouterr()
        assert said.out == "" or arguments.startswith("units")
        assert "Traceback" not in said.err
        return said.err

    return run


@pytest.mark.parametrize("name", MISTAKES)
def test_message_names_place_value_and_what_is_allowed(name: str, complaint: Callable[..., str]) -> None:
    wrong = MISTAKES[name]
    message = complaint(wrong.text, wrong.arguments)
    assert re.match(r"pairsim( \w+)?: (?!pairsim)", message)
    for part in wrong.expected:
        assert message.count(part) == 1, message


def test_mistakes_are_listed_in_the_order_of_the_file(complaint: Callable[..., str]) -> None:
    message = complaint("De: x\nmesh: {Np: 1}\nbeta: 7\nends: open\n", "run case.yaml")
    assert re.findall(r"case\.yaml:(\d)", message) == ["1", "2", "3", "4"]
