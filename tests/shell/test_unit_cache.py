"""Parsed definitions of units in the user's cache: the same units, whatever becomes of the cache."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pint
import pytest

from pairsim.cases.quantity_text import A_LENGTH, MEASURING, si
from pairsim.cases.unit_registry import registry

ANSWER = "from pairsim.cases.quantity_text import A_LENGTH, si; print(si('2 thou', A_LENGTH))"


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The folder of an empty cache, of which this process has read nothing; the current folder is empty, too."""
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    registry.cache_clear()
    yield tmp_path / "cache/pairsim"
    assert not list(Path().iterdir())
    registry.cache_clear()


def files(cache: Path) -> dict[Path, int]:
    return {path: path.stat().st_mtime_ns for path in cache.rglob("*") if path.is_file()}


def test_units_are_parsed_once_for_all_processes_of_a_user(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert si("2 thou", A_LENGTH) == 5.08e-5
    first = files(cache)
    assert first

    def parse_file(*_: object) -> None:
        pytest.fail("definitions are in the cache")

    monkeypatch.setattr("flexparser.Parser.parse_file", parse_file)
    registry.cache_clear()
    assert si("2 thou", A_LENGTH) == 5.08e-5
    assert files(cache) == first


def test_units_of_the_cache_are_those_of_pint() -> None:
    registry()
    registry.cache_clear()
    kept, parsed = registry(), pint.UnitRegistry()
    names = {name for each in MEASURING.values() for name in each} | {"kPa", "mPa*s", "ul/min", "psi", "poise", "dyn"}
    for name in names:
        sizes = [of.Quantity(1.0, name).to_base_units() for of in (kept, parsed)]
        assert sizes[0].magnitude == sizes[1].magnitude, name
        assert f"{sizes[0].units}" == f"{sizes[1].units}", name
    assert kept.get_group("Printer").members == parsed.get_group("Printer").members


def test_a_cache_that_cannot_be_written_is_not_needed(cache: Path) -> None:
    cache.parent.touch()  # a file where the folder would be
    assert si("2 thou", A_LENGTH) == 5.08e-5


def test_a_damaged_cache_is_made_again(cache: Path) -> None:
    registry()
    for path in cache.rglob("*.pickle"):
        path.write_bytes(path.read_bytes()[:100])
    for _ in range(2):
        registry.cache_clear()
        assert si("2 thou", A_LENGTH) == 5.08e-5
    assert min(path.stat().st_size for path in cache.rglob("*.pickle")) > 100


@pytest.mark.slow
def test_processes_that_begin_together_fill_one_cache(cache: Path) -> None:
    command = [sys.executable, "-c", ANSWER]
    processes = [subprocess.Popen(command, env=os.environ, stdout=subprocess.PIPE, text=True) for _ in range(4)]
    assert [process.communicate()[0] for process in processes] == ["5.08e-05\n"] * 4
    assert len(list(cache.iterdir())) == 1
