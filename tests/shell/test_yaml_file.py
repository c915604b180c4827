"""YAML files keep the lines of their keys through settings, merging and copies."""

from __future__ import annotations

import copy
import math
import pickle
from itertools import pairwise
from pathlib import Path

import pytest
import yaml

from pairsim.cases.keys import groups_of
from pairsim.cases.placed_keys import Place, place_of
from pairsim.cases.run_case import Case
from pairsim.cases.yaml_file import apply_settings, read_yaml, yaml_text
from pairsim.record.folder import plain
from pairsim.runtime.errors import InputError

GROUPS = groups_of(Case)
TEXT = "a: 1\nmesh:\n  Np: 20\n  growth: 1e-1\nlist: [{x: 1},\n  {y: 2}]\n"


def write(folder: Path, text: str) -> Path:
    path = folder / "case.yaml"
    path.write_text(text)
    return path


def test_keys_know_their_lines(tmp_path: Path) -> None:
    path = write(tmp_path, TEXT)
    data = read_yaml(path)
    assert data == {"a": 1, "mesh": {"Np": 20, "growth": 0.1}, "list": [{"x": 1}, {"y": 2}]}
    lines = {"a": 1, "mesh": 2, "mesh.Np": 3, "mesh.growth[0]": 4, "mesh.other": 2}
    lines |= {"list[1]": 6, "list[1].y": 6, "list[1].other": 6, "list[7]": 5}
    for key, line in lines.items():
        assert place_of(data, key) == Place(str(path), line)
    assert place_of(data, "b") is None
    assert yaml.safe_load(yaml_text(plain(data))) == data


def test_settings_have_their_own_place(tmp_path: Path) -> None:
    data = read_yaml(write(tmp_path, TEXT))
    kept = copy.deepcopy(data)
    apply_settings(data, ("mesh.Np=8", "time.end=3"), GROUPS)
    assert (data["mesh"], data["time"]) == ({"Np": 8, "growth": 0.1}, {"end": 3})
    assert place_of(data, "mesh.Np") == place_of(data, "time.end") == Place("--set", None)
    assert kept["mesh"]["Np"] == 20
    assert place_of(kept, "mesh.Np") == Place(str(tmp_path / "case.yaml"), 3)


def test_anchors_and_merged_groups_work(tmp_path: Path) -> None:
    data = read_yaml(write(tmp_path, "mesh: &coarse\n  Np: 8\n  growth: 0.2\nother:\n  <<: *coarse\n  Np: 10\n"))
    assert data["other"] == {"Np": 10, "growth": 0.2}
    lines = [place_of(data, f"other.{key}") for key in ("Np", "growth")]
    assert [place and place.line for place in lines] == [6, 3]


def test_error_of_several_mistakes_travels_between_processes() -> None:
    second = InputError("case.yaml", "De", True, "must be a number", line=2, entry="cases[1]")
    first = InputError("case.yaml", "beta", [0.4], "must be one", line=1, others=[second])
    again = pickle.loads(pickle.dumps(first))
    assert (
        str(again) == "case.yaml:1: beta: got [0.4]; must be one\ncase.yaml:2: cases[1]: De: got true; must be a number"
    )
    assert [(m.key, m.line) for m in again.mistakes] == [("beta", 1), ("De", 2)]
    assert (again.file, again.value, again.allowed) == ("case.yaml", [0.4], "must be one")


@pytest.mark.parametrize(
    ("text", "value"),
    [("1e-3", 0.001), (".5", 0.5), ("-.inf", -math.inf), ("True", True), ("~", None)]
    + [(text, text) for text in ("1:30", "0,4", "yes", "2020-01-01")],
)
def test_scalars_are_those_of_yaml_1_2_but_dates_are_text(text: str, value: object, tmp_path: Path) -> None:
    read = read_yaml(write(tmp_path, f"x: {text}\n"))["x"]
    assert (type(read), read) == (type(value), value)


def test_aliases_are_copies(tmp_path: Path) -> None:
    data = read_yaml(
        write(tmp_path, "base: &a {Np: 8}\nmesh: *a\nother: {<<: [{growth: 1}, *a, {Np: 9}], x: &a 2}\ny: *a\n")
    )
    apply_settings(data, ("mesh.Np=20",), GROUPS)
    assert data == {"base": {"Np": 8}, "mesh": {"Np": 20}, "other": {"growth": 1, "Np": 8, "x": 2}, "y": 2}


def test_written_files_are_read_alike_by_yaml_1_1_and_1_2(tmp_path: Path) -> None:
    texts = ["010", "1:30", "1e5", "2020-01-01", "yes", "~", "<<", "µm", "", "a: b", "x" * 200]
    content = {
        "texts": texts,
        "numbers": [1e-5, 1e17, math.inf, -0.5, 10**30],
        "on": {"z": True, "a": None},
        "empty": [],
    }
    for blocks in (False, True):
        text = yaml_text(content, blocks)
        assert read_yaml(write(tmp_path, text)) == yaml.safe_load(text) == content
    assert list(read_yaml(write(tmp_path, text))) == list(content)


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("a: 1\nb: [\n", 3),
        ("a: 1\n2: 1\n", 2),
        ("a: 1\na: 2\n", 2),
        ("a:\n\tb: 1\n", 2),
        ("a: 1\n---\nb: 2\n", 2),
        ("a:\n  <<: 3\n", 2),
        ("a: 1\nb: !<tag:x> 2\n", 2),
        *((f"a: 1\nb: {value}\n", 2) for value in ("!!bool maybe", "!!int x", "!!int ''", "!!float ''", "!!null x")),
        *((f"a: 1\nb: !!{tag}\n", 2) for tag in ("binary aGk=", "set {x, y}", "omap [x: 1]", "pairs [x: 1]", "map 3")),
        ("a: 1\nb: !!python/object/apply:os.getcwd []\n", 2),
        ("a: 1\n!!int b: 1\n", 2),
        ("a: 1\nb: " + "9" * 5000 + "\n", 2),
        ("a: 1\nb: 0x" + "f" * 5000 + "\n", 2),
        ('a: 1\nb: "\\0"\n', 2),
        ('a: 1\nb: "\\ud800"\n', 2),
        ("a: 1\nb: &b [*b]\n", 2),
        ("a: 1\nb: &b {c: {d: *b}}\n", 2),
        ("a: 1\nb: &b {<<: *b}\n", 2),
        ("a: 1\nb: *c\n", 2),
    ],
)
def test_broken_files_name_the_line(text: str, line: int, tmp_path: Path) -> None:
    with pytest.raises(InputError) as caught:
        read_yaml(write(tmp_path, text))
    assert caught.value.line == line


LIST, GROUP = "a: &a [1, 1, 1]", "a: &a {x: 1, y: 1, z: 1}"
REPEATED = "[*{0}, *{0}, *{0}]", "{{x: *{0}, y: *{0}, z: *{0}}}", "{{<<: [*{0}, *{0}, *{0}]}}"


@pytest.mark.parametrize(("first", "repeated"), [(LIST, REPEATED[0]), (GROUP, REPEATED[1]), (GROUP, REPEATED[2])])
def test_aliases_that_multiply_are_counted_and_not_written_out(first: str, repeated: str, tmp_path: Path) -> None:
    letters = "abcdefghijklmnopqrstuvwxyz"
    lines = [f"{new}: &{new} {repeated.format(old)}" for old, new in pairwise(letters)]
    with pytest.raises(
        InputError, match=r"it has [\d,]+ values and keys, with those that aliases repeat; [\d,]+ are allowed"
    ):
        read_yaml(write(tmp_path, "\n".join([first, *lines, ""])))
    assert len(read_yaml(write(tmp_path, "\n".join([first, *lines[:5], ""])))) == 6


def test_files_that_are_nested_without_end_are_refused(tmp_path: Path) -> None:
    for text in ("a: " + "[" * 5000, "a: " + "{x: " * 5000, "".join(" " * i + "a:\n" for i in range(2000))):
        with pytest.raises(InputError, match="nested too deeply"):
            read_yaml(write(tmp_path, text))


def test_settings_are_read_alike() -> None:
    with pytest.raises(InputError, match="--set: beta: got '!!bool maybe'; must be valid YAML: 'maybe' cannot be read"):
        apply_settings({}, ("beta=!!bool maybe",), GROUPS)


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-le", "utf-32", "latin-1"])
def test_other_encodings_than_utf_8_are_refused(encoding: str, tmp_path: Path) -> None:
    (path := tmp_path / "case.yaml").write_bytes("name: é\n".encode(encoding))
    with pytest.raises(InputError, match="must be valid YAML in UTF-8"):
        read_yaml(path)
    path.write_bytes("name: é\n".encode("utf-8-sig"))
    assert read_yaml(path) == {"name": "é"}
