"""YAML files keep the lines of their keys through settings, merging and copies."""

from __future__ import annotations

import copy
import pickle
from pathlib import Path

import pytest
import yaml

from pairsim.config.yaml_file import Place, apply_settings, place_of, read_yaml, yaml_text
from pairsim.results.output import plain
from pairsim.runtime.errors import InputError

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
    assert data["list"][1].places["y"].line == 6
    assert yaml.safe_load(yaml_text(plain(data))) == data


def test_settings_have_their_own_place(tmp_path: Path) -> None:
    data = read_yaml(write(tmp_path, TEXT))
    kept = copy.deepcopy(data)
    apply_settings(data, ("mesh.Np=8", "time.end=3"))
    assert (data["mesh"], data["time"]) == ({"Np": 8, "growth": 0.1}, {"end": 3})
    assert place_of(data, "mesh.Np") == place_of(data, "time.end") == Place("--set", None)
    assert kept["mesh"]["Np"] == 20
    assert place_of(kept, "mesh.Np") == Place(str(tmp_path / "case.yaml"), 3)


def test_anchors_and_merged_groups_work(tmp_path: Path) -> None:
    data = read_yaml(write(tmp_path, "mesh: &coarse\n  Np: 8\n  growth: 0.2\nother:\n  <<: *coarse\n  Np: 10\n"))
    assert data["other"] == {"Np": 10, "growth": 0.2}
    assert (data["other"].places["Np"].line, data["other"].places["growth"].line) == (6, 3)


def test_error_of_several_mistakes_travels_between_processes() -> None:
    second = InputError("case.yaml", "De", True, "must be a number", line=2, entry="cases[1]")
    first = InputError("case.yaml", "beta", [0.4], "must be one", line=1, others=[second])
    again = pickle.loads(pickle.dumps(first))
    assert (
        str(again) == "case.yaml:1: beta: got [0.4]; must be one\ncase.yaml:2: cases[1]: De: got true; must be a number"
    )
    assert [(m.key, m.line) for m in again.mistakes] == [("beta", 1), ("De", 2)]
    assert (again.file, again.value, again.allowed) == ("case.yaml", [0.4], "must be one")


@pytest.mark.parametrize(("text", "line"), [("a: 1\nb: [\n", 3), ("a: 1\n2: 1\n", 2), ("a: &x [*x]\n", 1)])
def test_broken_files_name_the_line(text: str, line: int, tmp_path: Path) -> None:
    with pytest.raises(InputError) as caught:
        read_yaml(write(tmp_path, text))
    assert caught.value.line == line
