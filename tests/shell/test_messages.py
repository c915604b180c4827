"""Wrong input ends with exit code 2 and a message that names place, value and what is allowed; nothing is written."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from ruamel.yaml import YAML
from ruamel.yaml.scalarstring import LiteralScalarString
from support.commands import Pairsim

import pairsim as library
from pairsim.computing.case_files import read_case
from pairsim.computing.schema import json_schema
from pairsim.questions.registry import NAMES, QUESTIONS
from pairsim.runtime.errors import InputError
from pairsim.runtime.text import as_typed

TABLE = Path(__file__).with_name("mistakes.yaml")
LISTED = f"{', '.join(f'{name!r}' for name in NAMES[:-1])} or {NAMES[-1]!r}"
"""How messages list the questions; the table has QUESTIONS in its place."""
MISTAKES: list[dict[str, Any]] = YAML().load(TABLE)
RUN = "beta: 0.4\nDe: 0\nCa_e: 0.1\nd0: 0.1\n"
CURVE = "beta: 0.4\nDe: 0.5\nCa_e: 0.1\nd: [0.1, 0.3]\n"
CRITICAL = "beta: 0.4\nDe: 0.5\nCa_e: 0.1\nalong: {Ca_e: [0.05, 0.1]}\n"
SHAPE = "particles: 1\nbeta: 0.4\nDe: 0\nCa_e: 0.1\nalong: [0.1]\n"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with folders in it that hold something else, a run, and a curve."""
    files = {"full/notes.txt": "", "ran/series.csv": "", "curved/curve.csv": ""}
    files |= {f"{name}/run.json": json.dumps({"kind": kind}) for name, kind in (("ran", "run"), ("curved", "curve"))}
    for file, text in files.items():
        (tmp_path / file).parent.mkdir(exist_ok=True)
        (tmp_path / file).write_text(text)
    return tmp_path


@pytest.fixture(scope="module")
def rewrite(request: pytest.FixtureRequest) -> Iterator[bool]:
    """Whether the table is written anew in place of being compared."""
    asked = request.config.getoption("rewrite_messages")
    yield asked
    if asked:
        yaml = YAML()
        yaml.width = 10_000
        yaml.indent(sequence=2, offset=0)
        yaml.dump(MISTAKES, TABLE)


@pytest.mark.parametrize("mistake", MISTAKES, ids=lambda mistake: mistake["mistake"])
def test_message_names_line_key_value_and_what_is_allowed(
    mistake: dict[str, Any], folder: Path, pairsim: Pairsim, rewrite: bool
) -> None:
    (folder / "case.yaml").write_text(mistake.get("case", RUN))
    if "rheology" in mistake:
        (folder / "flow.csv").write_text(mistake["rheology"])
    before = {path: path.is_file() and path.read_text() for path in folder.rglob("*")}
    done = pairsim(*mistake["pairsim"].split())
    assert (done.returncode, done.stdout) == (2, "")
    assert {path: path.is_file() and path.read_text() for path in folder.rglob("*")} == before
    said = done.stderr.replace(f"{folder}/", "").replace(LISTED, "QUESTIONS")
    if rewrite:
        mistake["says"] = LiteralScalarString(said)
    assert said == mistake["says"]


@pytest.mark.parametrize(
    ("command", "function", "says"),
    [
        (
            "run case.yaml -o full",
            lambda: library.run("case.yaml", folder="full"),
            "full: {folder|-o}: must be a new or empty folder; {`overwrite`|--overwrite} replaces the results in it",
        ),
        (
            "plot ran --format bmp",
            lambda: library.plot("ran", formats="bmp"),
            "{formats|--format}: got 'bmp'; must be one or more of png, pdf, svg",
        ),
        (
            "plot ran --format pdf --animate",
            lambda: library.plot("ran", formats="pdf", animate=True),
            "{formats|--format}: got 'pdf'; must be left out with {`animate`|--animate}, which makes a GIF",
        ),
        (
            "plot ran curved --field N1 -o out",
            lambda: library.plot("ran", "curved", field="N1", out="out"),
            "pairsim plot: {field|--field}: got 'N1'; must be left out with several folders",
        ),
        (
            "run case.yaml --budget 5um",
            lambda: library.run("case.yaml", budget="5um"),
            "{budget|--budget}: got '5um'; has the unit μm; must be a time above 0 with its unit, such as 10 min",
        ),
        (
            "units --tube 50um --particle 20um --viscosity 1Pa.s --pressure 2kPa",
            lambda: library.units(tube="50um", particle="20um", viscosity="1Pa.s", pressure="2kPa"),
            "pairsim units: {over|--over}: must be given with {`pressure`|--pressure}, such as "
            "{`pressure`|--pressure} 20kPa {`over`|--over} 5cm",
        ),
        (
            "units --tube 50um --particle 20um --flow 1ul/min --carrier water --celsius 23",
            lambda: library.units(tube="50um", particle="20um", flow_rate="1ul/min", carrier="water"),
            "{carrier|--carrier}: got 'water'; must be 0.49% MC-PBS",
        ),
    ],
)
def test_functions_name_their_arguments_and_commands_their_options(
    command: str,
    function: Callable[[], Any],
    says: str,
    folder: Path,
    monkeypatch: pytest.MonkeyPatch,
    pairsim: Pairsim,
) -> None:
    monkeypatch.chdir(folder)
    Path("case.yaml").write_text(RUN)
    with pytest.raises(InputError) as caught:
        function()
    assert re.sub(r"\{(.+?)\|.+?\}", r"\1", says) in str(caught.value)
    done = pairsim(*command.split())
    assert done.returncode == 2
    assert re.sub(r"\{.+?\|(.+?)\}", r"\1", says) in done.stderr


@pytest.mark.parametrize("words", [["run"], ["run", "a", "b"], ["fly"], ["run", "a", "--fast"]])
def test_usage_errors_end_with_2(words: list[str], pairsim: Pairsim) -> None:
    done = pairsim(*words)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith("Usage: ")


def numbers(command: str) -> Iterator[tuple[str, float, float]]:
    """Keys whose values are numbers, or may be, with their limits; those of groups are dotted."""
    schema = json.loads(json_schema(command, QUESTIONS[command].model))
    parts = {"": schema} | {
        f"{name}.": schema["$defs"][each["$ref"].rpartition("/")[2]]
        for name, each in schema["properties"].items()
        if "$ref" in each
    }
    for group, part in parts.items():
        for name, each in part["properties"].items():
            alternatives = each.get("anyOf", ())
            for value in (each, *alternatives, *(inner for other in alternatives for inner in other.get("oneOf", ()))):
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
