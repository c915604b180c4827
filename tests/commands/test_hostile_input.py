"""Input that no one types by accident: each ends with one short message and exit code 2, and writes nothing.

What a file or a command line may contain at most is documented with `pairsim.config.yaml_file` and
`pairsim.config.values`. `test_fuzz.py` looks for more of the kind.
"""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest
from support.fuzz import BOMB

from pairsim.cli.app import main
from pairsim.commands import COMMANDS
from pairsim.config.values import FOLLOWED
from pairsim.inputs.case_files import read_case
from pairsim.physics.liquids import single
from pairsim.physics.liquids.giesekus import Giesekus
from pairsim.physics.pipe import Pipe
from pairsim.results.physical_table import table_of
from pairsim.runtime.errors import InputError
from pairsim.runtime.text import as_typed, printable
from pairsim.sweeps.grid import read_grid

RUN = "beta: 0.4\nDe: 0\nCa_e: 0.1\nd0: 0.1\n"
SWEEP = "base: {beta: 0.4, De: 0, Ca_e: 0.1}\ngrid:\n  d0: [0.1, 0.2]\n"
STUDY = "base: {beta: 0.4, De: 0, Ca_e: 0.1, d0: 0.1}\ndiscretisations:\n  - {mesh.Np: 1}\n  - {mesh.Np: 20}\n"
DRY = ("run", "case.yaml", "--dry-run")
GRID = ("sweep", "case.yaml", "--dry-run")
LONGEST = 500  # characters of a message about one mistake


@dataclass(frozen=True)
class Hostile:
    """A file, the arguments of a command, and what the message contains."""

    text: str
    arguments: tuple[str, ...]
    expected: str


def run(more: str, expected: str) -> Hostile:
    return Hostile(RUN + more, DRY, expected)


def changed(old: str, new: str, expected: str) -> Hostile:
    return Hostile(RUN.replace(old, new), DRY, expected)


def setting(text: str, expected: str) -> Hostile:
    return Hostile(RUN, (*DRY, "--set", text), expected)


def sweep(text: str, expected: str, *arguments: str) -> Hostile:
    return Hostile(text, arguments or GRID, expected)


def line(expected: str, *arguments: str) -> Hostile:
    return Hostile(RUN, arguments, expected)


DEEP = "at most 20 groups and lists within each other"
HOSTILE = {
    "deep lists": run("x: " + "[" * 3000, f"case.yaml: must be valid YAML: must have {DEEP}"),
    "deep groups": run("x: " + "{a: " * 3000, DEEP),
    "deep groups by aliases": run(
        "".join(f"a{i}: &a{i} [*a{i - 1}]\n" if i else "a0: &a0 [1]\n" for i in range(99)), DEEP
    ),
    "a group within itself": run("mesh: &m {Np: *m}\n", DEEP),
    "a list within itself": changed("0.4", "&b [*b]", f"case.yaml:1: must be valid YAML: must have {DEEP}"),
    "alias bomb": Hostile(BOMB + RUN.replace("0.4", "*a8"), DRY, "at most 250000 keys and values"),
    "many keys": run("".join(f"key{i}: 1\n" for i in range(2000)), "key0: got 1; unknown key"),
    "large file": run("# " + "x" * 2_000_000, "case.yaml: must be a file of at most 2 MB"),
    "tag of a boolean": run("name: !!bool maybe\n", "must not have tags such as 'tag:yaml.org,2002:bool'"),
    "tag of a time": run("name: !!timestamp x\n", "must not have tags"),
    "tag of an object": run("name: !!python/object/apply:os.system [touch executed]\n", "must not have tags"),
    "surrogate in a key": run(
        '"\\uD800": 1\n', "case.yaml:5: must be valid YAML: text must not have control characters"
    ),
    "surrogate in a setting": setting("\udcff=1", "--set: got '\\udcff=1'; must be key=value on one line"),
    "null character in a name": sweep(
        'name: "a\\0b"\n' + SWEEP, "such as \\x00", "sweep", "case.yaml", "--emit", "slurm"
    ),
    "null character in a path": sweep(SWEEP.replace("{beta: 0.4, De: 0, Ca_e: 0.1}", '"a\\0b"'), "such as \\x00"),
    "control characters in a key": run('"a\\nb\\e[31mc": 1\n', "such as \\n\\x1b"),
    "control characters in a file": changed("0.4", "\x07", "case.yaml:1: must be valid YAML: the character \\x07"),
    "control characters in a setting": setting("a\nb=1", "--set: got 'a\\nb=1'"),
    "control characters in the name of a file": line("a\\nb\\x1b[31m.yaml: no such file", "run", "a\nb\x1b[31m.yaml"),
    "400 digits": changed(
        "0.4", "4" * 400, "beta: got 4444444444444444444…4444444444444444444; must be a finite number"
    ),
    "400 digits of a count": run(
        f"mesh: {{gap_cells: {'4' * 400}}}\n", "must be a whole number at least 0 and at most 1000"
    ),
    "5000 digits": run("particles: " + "4" * 5000, "must be a whole number at least 0 and at most 50"),
    "400 digits in a range": sweep(
        SWEEP.replace("[0.1, 0.2]", f"{{start: 1, stop: {'9' * 400}, num: 3}}"), "start and stop must be finite numbers"
    ),
    "400 digits in an exclusion": sweep(SWEEP + f"exclude: [{{d0: {'9' * 400}}}]\n", "must match at least one entry"),
    "many values in ranges": sweep(
        SWEEP + "".join(f"  k{i}: {{start: 1, stop: 2, num: 100000}}\n" for i in range(20)), "at most 1000000 values"
    ),
    "smallest cell": run(
        "mesh: {max_size: 1e-300}\n", "mesh.max_size: got 1e-300; must be a finite number at least 0.0001"
    ),
    "smallest diameter": changed("0.4", "1e-300", "beta: got 1e-300; must be a finite number at least 0.001"),
    "cell of a wrong diameter": Hostile(
        "beta: 1e-154\nDe: 1\nCa_e: 0.1\nd0: 0.1\n", DRY, "case.yaml:1: beta: got 1e-154"
    ),
    "smallest De": changed("De: 0", "De: 1e-30", "De: got 1e-30; must be 0, or a finite number from 1e-06 to 10000"),
    "narrow rows": run("mesh: {rows: 1e-9}\n", "mesh.rows: got 1e-09; must be 0, or a finite number from 0.05"),
    "shortest tube": Hostile("De: 0\nparticles: 0\nlength: 1e-300\n", DRY, "length: got 1e-300; must be"),
    "latest end": sweep(SWEEP, "--set: every case: time.end: got 1e+308", *GRID, "--set", "time.end=1e308"),
    "De to follow": Hostile(
        "beta: 0.4\nDe: 1\nCa_e: 0.1\nalong: {De: [1e-300]}\n",
        ("critical", "case.yaml", "--dry-run"),
        "along: got 1e-300; must be values of De from 1e-06 to 10000",
    ),
    "many cells": run("mesh: {wall_cells: 99999999999999999999999}\n", "at least 0 and at most 1000"),
    "octal number": run(
        "mesh: {Np: 010}\n", "got '010'; must be a whole number at least 6 and at most 1000; numbers are written as 90"
    ),
    "sexagesimal number": run(
        "limits: {wall_time: 1:30}\n",
        "got '1:30'; must be a finite number at least 0.001 and at most 1e+09; numbers are written as 90",
    ),
    "hexadecimal number": run(
        "mesh: {Np: 0x10}\n",
        "got '0x10'; must be a whole number at least 6 and at most 1000; numbers are written as 90",
    ),
    "decimal comma": changed("0.4", "0,4", "numbers are written as 90, 0.4 or 1e-3"),
    "pipe": line("pipe: must be a file, but is a pipe or a device", "run", "pipe", "--dry-run"),
    "endless device": line("/dev/zero: must be a file, but is a pipe or a device", "run", "/dev/zero", "--dry-run"),
    "pipe as case of a schema": line("pipe: must be a file, but is a pipe", "schema", "run", "--case", "pipe"),
    "long name of a file": line(
        "must be a path of at most 4000 bytes, each name in it of at most 200", "run", "a" * 300
    ),
    "long name of a folder": line("each name in it of at most 200", *DRY, "-o", "a" * 300),
    "path that is not UTF-8": line("path: got '\\udcff'; must be a path in UTF-8", *DRY, "-o", "\udcff"),
    "long name of a case": run("name: " + "漢" * 100 + "\n", "at most 100 letters (200 bytes)"),
    "long name of a sweep": sweep(f"name: {'漢' * 100}\n" + SWEEP, "a name for a folder: at most 200 bytes"),
    "base outside": sweep(
        "base: ../base.yaml\n" + SWEEP.partition("\n")[2], "base: got '../base.yaml'; must be a file in the folder"
    ),
    "case outside": sweep(
        SWEEP + "cases: [/etc/passwd]\n", "cases[0]: got '/etc/passwd'; must be a file in the folder"
    ),
    "long value": changed("0.4", "x" * 1_000_000, "must be a finite number"),
    "long list": changed("0.4", f"[{'2, ' * 5_000}]", "case.yaml:1: beta[0]: got 2"),
    "long key": run("? " + "x" * 100_000 + "\n: 1\n", "unknown key"),
    "digits of a shard": line("--shard: got", *GRID, "--shard", f"1/{'9' * 5000}"),
    "digits of a time": line("--walltime: got", *GRID, "--walltime", f"{'9' * 5000}:00"),
    "large quantity": line(
        "must be from 1e-30 to 1e+30 m",
        "units",
        "--tube",
        "1e300 m",
        *["--particle", "1m", "--viscosity", "1Pa.s", "--flow", "1ul/s"],
    ),
    "400 digits of a quantity": run(
        f"physical: {{tube: {'4' * 400}, viscosity: 1 Pa.s, flow_rate: 1 ul/s}}\n", "has no unit; must be a length"
    ),
    "power of a unit": line(
        "must be from",
        "units",
        "--tube",
        "1 m*(m/mm)**99999",
        *["--particle", "1m", "--viscosity", "1Pa.s", "--flow", "1ul/s"],
    ),
    "discretisation": Hostile(STUDY, ("study", "case.yaml"), "case.yaml:3: discretisations[0]: mesh.Np: got 1"),
}


@pytest.fixture
def complaint(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> Callable[..., str]:
    """Runs a command in a folder with case.yaml and a pipe; returns what it says on stderr."""

    def run(hostile: Hostile) -> str:
        monkeypatch.chdir(tmp_path)
        (tmp_path / "case.yaml").write_text(hostile.text)
        os.mkfifo(tmp_path / "pipe")
        monkeypatch.setattr(sys, "argv", ["pairsim", *hostile.arguments])
        with pytest.raises(SystemExit) as end:
            main()
        said = capsys.readouterr()
        assert end.value.code == 2, said
        assert sorted(path.name for path in tmp_path.iterdir()) == ["case.yaml", "pipe"]
        assert said.out == ""
        return said.err

    return run


@pytest.mark.parametrize("name", HOSTILE)
def test_ends_with_one_short_message(name: str, complaint: Callable[..., str]) -> None:
    message = complaint(HOSTILE[name])
    assert HOSTILE[name].expected in message
    first, *rest = message.splitlines()
    assert first.startswith(("pairsim: ", "pairsim units: "))
    assert all(len(each) < LONGEST for each in (first, *rest))
    assert len(rest) <= (int(first.split()[1]) if first.endswith("mistakes:") else 0)


def test_grid_takes_a_file_whose_name_no_case_can_have(tmp_path: Path) -> None:
    (tmp_path / "my case.yaml").write_text(RUN)
    (tmp_path / "grid.yaml").write_text("cases: [my case.yaml]\n")
    (case,) = read_grid(tmp_path / "grid.yaml").cases
    assert case.folder.startswith("beta0.4-")


@pytest.mark.parametrize("name", ["2020-13-45", "2026-01-15", "010", "yes", "on"])
def test_dates_and_words_are_text(name: str, tmp_path: Path) -> None:
    path = tmp_path / "case.yaml"
    path.write_text(RUN + f"name: {name}\n")
    assert read_case(COMMANDS["run"], path).name == name


def test_message_lists_twenty_mistakes_and_counts_the_others(tmp_path: Path) -> None:
    path = tmp_path / "case.yaml"
    path.write_text(RUN + "".join(f"key{i}: 1\n" for i in range(100)))
    with pytest.raises(InputError) as caught:
        read_case(COMMANDS["run"], path)
    lines = str(caught.value).splitlines()
    assert len(caught.value.mistakes) == 100
    assert len(lines) == 21
    assert lines[-1] == "and 80 more mistakes"


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ("t,null\n", "series.csv: got 'null'; must be a column of `pairsim`"),
        ("t,dU\n0,x\n", "series.csv: must have numbers in its rows (could not convert string to float: 'x')"),
        ("", "series.csv: cannot be read"),
    ],
)
def test_damaged_table_is_refused(table: str, message: str, tmp_path: Path) -> None:
    (tmp_path / "series.csv").write_text(table)
    scales = {"length": 1e-3, "velocity": 1.0, "stress": 1.0, "time": 1.0}
    (tmp_path / "run.json").write_text(json.dumps({"kind": "run", "scales": scales}))
    with pytest.raises(InputError) as caught:
        table_of(tmp_path, "series", physical=True)
    assert message in str(caught.value)


@pytest.mark.parametrize("number", [*FOLLOWED["De"], 1.0])
def test_flow_without_particles_exists_over_the_whole_range_of_De(number: float) -> None:
    pipe = Pipe(single(Giesekus(), De=number))
    assert pipe.until(0.01)(0.01).gradient > 0
    assert pipe.steady().gradient > 0


@pytest.mark.parametrize("launched", [0, 1])
def test_processes_that_do_not_see_each_other_complain_once(
    launched: int, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "case.yaml").write_text(RUN)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PMI_SIZE", "2")
    monkeypatch.setenv("PMI_RANK", str(launched))
    monkeypatch.setattr(sys, "argv", ["pairsim", "run", "case.yaml", "-o", "out"])
    with pytest.raises(SystemExit) as end:
        main()
    assert end.value.code == 2
    assert capsys.readouterr().err.count("do not see each other") == 1 - launched


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (True, "true"),
        (0.34 + 1e-17, "0.34"),
        pytest.param(10**5000, "a number of more than 4300 digits", id="digits"),
        ({"a": [1] * 20}, "{a: [1, 1, 1, 1, 1, 1, 1, 1, …]}"),
        ([[[[[1]]]]], "[[[[[…]]]]]"),
        ("a\nb", "'a\\nb'"),
    ],
)
def test_values_are_shown_shortened(value: object, text: str) -> None:
    assert as_typed(value) == text


def test_texts_are_shown_on_one_line() -> None:
    assert printable("a\x1b[31m\ud800b\n") == "a\\x1b[31m\\ud800b\\n"
    assert printable("abcdefgh", 5) == "ab…gh"
