"""First steps: example files, their keys, completion, and the estimated size and duration of a case."""

from __future__ import annotations

import json
import re
from functools import cache
from pathlib import Path
from typing import Any

import jsonschema
import pytest
import yaml
from typer.testing import CliRunner

import pairsim as api
from pairsim.app.command_line import app
from pairsim.cases.estimate import Estimate
from pairsim.cases.identity import default_folder
from pairsim.cases.kinds_of_cases import has_example
from pairsim.computing.case_files import read_case
from pairsim.computing.schema import schema_rows
from pairsim.questions.registry import QUESTIONS
from pairsim.sweeps.files import FILES
from pairsim.sweeps.grid import read_grid

CONFIGS = Path(__file__).parents[2] / "configs"
KINDS = tuple(kind for kind in FILES if has_example(kind))


@cache
def validator(command: str) -> Any:
    """A validator by the JSON schema of a command, as it prints it."""
    schema = json.loads(say("schema", command, "--json"))
    jsonschema.Draft202012Validator.check_schema(schema)
    return jsonschema.Draft202012Validator(schema)


def say(*words: str) -> str:
    result = CliRunner().invoke(app, list(words))
    assert result.exit_code == 0, result.exception
    return result.output


@pytest.mark.parametrize("kind", KINDS)
def test_example_of_each_kind_is_a_case_that_can_be_computed(
    kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    said = say("init", "beads", "--kind", kind)
    assert said.splitlines()[0] == "beads.yaml"
    text = (tmp_path / "beads.yaml").read_text()
    assert text.startswith("# ")
    assert "{{" not in text
    assert f"pairsim {kind} beads.yaml" in text
    shown = say(kind, "beads.yaml", "--dry-run")
    if kind != "sweep":
        size = r"^runs/beads\S*: about [\d,]+ unknowns, \d+ (s|min) to \d+ (s|min) on one core$"
        assert re.search(size, shown, re.MULTILINE), shown
    assert [path.name for path in tmp_path.iterdir()] == ["beads.yaml"]


def test_keys_of_an_example_that_are_commented_out_are_right(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    found = set[str]()
    for kind in KINDS:
        say("init", kind, "--kind", kind)
        text = (tmp_path / f"{kind}.yaml").read_text()
        for key, rest in re.findall(r"^# (\w+): ([^#\n]*)", text, re.MULTILINE):
            found.add(key)
            assert key in FILES[kind].model_fields, key
            own = yaml.safe_load(text) | {key: yaml.safe_load(rest)}
            if key == "physical":
                own = {name: value for name, value in own.items() if name not in ("beta", "De", "Ca_e", "d0")}
            (tmp_path / "changed.yaml").write_text(yaml.safe_dump(own))
            if kind == "sweep":
                assert read_grid(tmp_path / "changed.yaml").cases
            else:
                read_case(QUESTIONS[kind], tmp_path / "changed.yaml")
    assert "physical" in found


@pytest.mark.parametrize("command", FILES)
def test_schema_lists_every_kind_of_file(command: str) -> None:
    shown = say("schema", command)
    for key, allowed, _, meaning in schema_rows(FILES[command]):
        assert key in shown
        assert allowed
        assert meaning
    keys, schema = {row[0] for row in schema_rows(FILES[command])}, validator(command).schema
    groups = {name: each["$ref"].rpartition("/")[2] for name, each in schema["properties"].items() if "$ref" in each}
    assert {f"{name}.{key}" for name, of in groups.items() for key in schema["$defs"][of]["properties"]} <= keys
    assert schema["properties"].keys() == {key.partition(".")[0] for key in keys}


@pytest.mark.parametrize("path", sorted(CONFIGS.glob("*.yaml")), ids=lambda path: path.stem)
def test_shipped_files_pass_the_json_schema_of_their_command(path: Path) -> None:
    content = yaml.safe_load(path.read_text())
    command = path.stem if path.stem in FILES else "curve" if "d" in content else "run"
    validator(command).validate(content)
    assert not validator(command).is_valid({**content, "lenght": 3})


def test_json_schema_takes_units_in_place_of_numbers() -> None:
    run = validator("run")
    run.validate({"physical": {"tube": "50 um", "viscosity": "1 Pa.s", "flow_rate": "1 ul/min"}})
    for wrong in ({"physical": {"viscosity": "1 Pa.s"}}, {"De": -1}, {"name": "../x"}):
        assert not run.is_valid(wrong)


def test_dry_run_names_keys_without_effect(tmp_path: Path) -> None:
    (tmp_path / "case.yaml").write_text("beta: 0.4\nDe: 0\nCa_e: 0.1\nd0: 0.1\nxi: 0.1\n")
    assert "note: xi has no effect" in say("run", str(tmp_path / "case.yaml"), "--dry-run")


def test_user_of_a_large_case_is_told_beforehand() -> None:
    """As progress begins with the first step or point, after the mesh and a factorisation."""
    assert Estimate(100_000, 300.0).notes == []
    assert Estimate(1_000_000, 7000.0).notes == ["about 1,000,000 unknowns, 40 min to 5 h on one core"]


GIESEKUS = {"law": "giesekus", "alpha": 0.2}
WHOLE = {"ends": "developed", "length": "auto", "d": {"start": 0.02, "stop": 2, "num": 9}}


@pytest.mark.parametrize(
    ("command", "case", "seconds"),
    [
        ("run", "quickstart", 5),
        ("run", "viscoelastic", 21),
        ("run", "triplet", 7),
        ("curve", "curve", 22),
        ("curve", "yield_stress", 22),
        ("critical", "critical", 180),
        ("train", "train", 7),
        ("curve", {"beta": 0.4, "De": 0, "Ca_e": 0.034}, 6.4),
        ("curve", {"beta": 0.4, "De": 0.34, "Ca_e": 0.034, "xi": 0.037, "liquid": GIESEKUS | {"alpha": 0.071}}, 42),
        ("curve", {"beta": 0.29, "De": 0.34, "Ca_e": 0.034, "liquid": GIESEKUS}, 36),
        ("curve", {"beta": 0.4, "De": 1.05, "Ca_e": 0.034, "liquid": GIESEKUS}, 34),
        ("curve", {"beta": 0.4, "De": 2, "Ca_e": 0.034, "liquid": GIESEKUS}, 32),
    ],
)
def test_a_case_takes_what_its_estimate_says(command: str, case: str | dict[str, Any], seconds: float) -> None:
    """Processor times with one thread; configs/README.md has those of its files."""
    given = CONFIGS / f"{case}.yaml" if isinstance(case, str) else case | WHOLE
    estimate = QUESTIONS[command].estimate(api.load(given, kind=command))
    assert estimate.seconds / estimate.within <= seconds <= estimate.seconds * estimate.within


def test_default_folders_of_different_cases_differ(tmp_path: Path) -> None:
    """Beta, De, Ca_e and d0 are in the slug; mesh, steps and units are not."""
    text = "beta: 0.4\nDe: 0\nCa_e: 0.1\nd0: 0.1\n"
    (tmp_path / "case.yaml").write_text(text)
    settings = [(), ("mesh.Np=20",), ("time.end=3",), ("ends=periodic",), ("particles=3",)]
    cases = [read_case(QUESTIONS["run"], tmp_path / "case.yaml", each) for each in settings]
    folders = [default_folder("run", case) for case in cases]
    assert len(set(folders)) == len(folders)
    assert len({case.slug for case in cases}) == 2
    assert default_folder("run", read_case(QUESTIONS["run"], tmp_path / "case.yaml", ("d0=[0.1]",))) == folders[0]
    named = read_case(QUESTIONS["run"], tmp_path / "case.yaml", ("name=mine",))
    assert default_folder("run", named, "case") == Path("runs/mine")
    assert default_folder("run", cases[0], "case").name == f"case-{folders[0].name.rpartition('-')[2]}"


def test_a_sweep_finds_its_folders_by_the_same_hash(tmp_path: Path) -> None:
    (tmp_path / "grid.yaml").write_text("base: {beta: 0.4, De: 0, Ca_e: 0.1}\ngrid: {d0: [0.1, 0.2]}\n")
    (tmp_path / "case.yaml").write_text("beta: 0.4\nDe: 0\nCa_e: 0.1\nd0: 0.2\n")
    folder = read_grid(tmp_path / "grid.yaml").cases[1].folder
    assert default_folder("run", read_case(QUESTIONS["run"], tmp_path / "case.yaml")).name == folder
