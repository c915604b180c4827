"""scripts/paper: its figures, the judgement of statements, and one small figure from end to end."""

from __future__ import annotations

import itertools
import subprocess
import sys
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from support.inputs import ROOT

from pairsim.commands import COMMANDS
from pairsim.inputs.case_files import read_case
from pairsim.sweeps.grid import Grid, read_grid

sys.path.append(str(ROOT / "scripts"))  # the modules of a script lie beside it

import paper
from book import cases, fields, pages
from paper_statements import judged

GRIDS = [name for name in paper.computations(paper.FIGURES) if not name.startswith("fig02/")]
CHECKED = paper.computations(paper.CHECKS)


def grid(name: str, *, quick: bool) -> Grid:
    _, path, *settings = paper.words(name, quick)
    return read_grid(Path(path), tuple(settings[1::2]))


@pytest.mark.parametrize("quick", [False, True])
@pytest.mark.parametrize("name", GRIDS + CHECKED)
def test_computations_are_grids(name: str, quick: bool) -> None:
    cases = grid(name, quick=quick).cases
    assert cases
    if quick:  # a CI machine computes each in a minute at most
        assert max(case.estimate.seconds for case in cases) < 60


def test_all_figures_have_what_they_show() -> None:
    assert list(paper.FIGURES) == [f"fig{number:02d}" for number in range(2, 18) if number != 5]
    assert all((paper.FOLDER / f"{name}.yaml").is_file() for name in paper.needed(paper.KNOWN))
    for name in paper.computations(["fig02"]):
        assert read_case(COMMANDS["run"], paper.FOLDER / f"{name}.yaml").mesh.Np >= 20


def test_each_curve_has_a_transient_and_six_have_three() -> None:
    def parameters(name: str) -> list[tuple[float, ...]]:
        return [
            tuple(np.ravel(case.resolved[key])[0] for key in ("beta", "De", "Ca_e"))
            for case in grid(name, quick=False).cases
        ]

    curves = list(
        itertools.chain(*(parameters(name) for name in GRIDS if name.endswith("/curves") and "14" not in name))
    )
    markers = Counter(itertools.chain(*(parameters(name) for name in GRIDS if name.endswith("/markers"))))
    assert set(curves) == set(markers)
    assert sum(count == 3 for count in markers.values()) >= 6


def test_a_figure_that_is_unknown_is_named(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "argv", ["paper", "fig99"])
    with pytest.raises(SystemExit) as ended:
        paper.main()
    assert ended.value.code == 2
    assert "fig99" in capsys.readouterr().err


@pytest.mark.parametrize("statement", [each for _, each in paper.STATEMENTS], ids=lambda each: str(each["says"]))
def test_statements_without_results_are_not_computed(statement: dict[str, str], tmp_path: Path) -> None:
    """Which shows that their expressions are valid, as far as their first result."""
    nothing = cases.Cases(tmp_path, paper.computations(paper.KNOWN))
    for key in ("check", "in_time"):
        assert judged(statement.get(key, statement["check"]), nothing)[0] == "not computed"


def test_parameters_are_matched() -> None:
    case = {"beta": [0.4, 0.4], "De": 1, "Ca_e": 0.1, "accuracy": "1%"}
    assert cases.matches(case, {"beta": 0.4, "De": [0.5, 1.0], "accuracy": "1%"})
    assert not cases.matches(case, {"Ca_e": 0.15})
    assert not cases.matches({**case, "beta": [0.4, 0.2]}, {"beta": 0.4})


def test_page_is_that_of_the_stored_results() -> None:
    text = paper.PAGE.read_text()
    assert pages.marks(text) == set(paper.blocks())
    assert pages.filled(text, paper.blocks()) == text, "written by scripts/paper --page"
    stored = pages.stored("paper")["statements"]
    known = [(figure, each["says"]) for figure, each in paper.STATEMENTS]
    assert list(zip(stored["figure"], stored["the paper says"], strict=True)) == known


@pytest.mark.slow
def test_two_small_figures_from_end_to_end(tmp_path: Path) -> None:
    """Figs. 2 and 4: meshes, two runs with a single particle, pictures in two widths."""
    script = [sys.executable, str(ROOT / "scripts" / "paper.py"), "fig02", "fig04", "--quick", "-o", str(tmp_path)]
    done = subprocess.run([*script, "--workers", "2"], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert sorted(path.name for path in (tmp_path / "fig02").iterdir()) == ["default.vtu", "paper.vtu"]
    pictures = {path.name for path in (tmp_path / "pictures").iterdir()}
    ends = ("85mm.pdf", "85mm.png", "170mm.pdf", "170mm.png")
    assert pictures == {f"{name}-{end}" for name in ("fig02", "fig04") for end in ends}
    (off,) = {len(fields.deviations(case.result.fields(0.1))) for case in cases.Cases(tmp_path, []).of("fig04/runs")}
    assert off == 1
    assert "| the paper says |" in (tmp_path / "statements.md").read_text()
