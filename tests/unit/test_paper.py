"""scripts/paper: its figures, the judgement of statements, and one small figure from end to end."""

from __future__ import annotations

import itertools
import re
import subprocess
import sys
from collections import Counter
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from support.inputs import ROOT

from pairsim.inputs.case_files import read_case
from pairsim.questions import QUESTIONS
from pairsim.sweeps.grid import Grid, read_grid

sys.path.append(str(ROOT / "scripts"))  # the modules of a script lie beside it

import paper
from book import cases, pages
from paper_statements import deviations, judged

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
        assert {case.estimate.duration for case in cases} == {"seconds"}


def test_all_figures_have_what_they_show() -> None:
    assert list(paper.FIGURES) == [f"fig{number:02d}" for number in range(2, 18) if number != 5]
    assert all((paper.FOLDER / f"{name}.yaml").is_file() for name in paper.needed(paper.KNOWN))
    for name in paper.computations(["fig02"]):
        assert read_case(QUESTIONS["run"], paper.FOLDER / f"{name}.yaml").mesh.Np >= 20


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


@pytest.mark.slow
def test_what_is_to_do_is_listed(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "argv", ["paper", "fig14", "--quick", "--dry-run", "-o", str(tmp_path / "results")])
    assert paper.main() == 0
    said = re.findall(r"^(?:fig.*|\d+ cases)", capfd.readouterr().out, re.MULTILINE)
    assert said == ["fig14/curves", "2 cases", "fig09/curves", "20 cases"]
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("statement", [each for _, each in paper.STATEMENTS], ids=lambda each: str(each["says"]))
def test_statements_without_results_are_not_computed(statement: dict[str, str], tmp_path: Path) -> None:
    """Which shows that their expressions are valid, as far as their first result."""
    nothing = cases.Cases(tmp_path, paper.computations(paper.KNOWN))
    assert statement.keys() <= {"says", "check", "again", "in_time"}
    for key in statement.keys() - {"says"}:
        assert judged(statement[key], nothing)[0] == "not computed"


def test_parameters_are_matched(tmp_path: Path) -> None:
    def case(beta: list[float]) -> cases.Case:
        (tmp_path / "case.yaml").write_text(f"{{beta: {beta}, De: 1, accuracy: 1%, mesh: {{Np: 28}}}}")
        return cases.Case(SimpleNamespace(folder=tmp_path, kind="curve"))

    wanted = {"beta": 0.4, "De": [0.5, 1.0], "mesh.Np": 28, "accuracy": "1%"}
    assert cases.matches(case([0.4, 0.4]).parameters, wanted)
    assert not cases.matches(case([0.4, 0.2]).parameters, wanted)
    assert not cases.matches(case([0.4, 0.4]).parameters, wanted | {"De": 2})
    assert len(list(cases.grouped([case([0.4, 0.4])], {"beta": 0.4, "De": 1}))) == 1
    with pytest.raises(cases.NotComputed, match=r"0\.5"):
        list(cases.grouped([case([0.4, 0.4])], {"De": [1, 0.5]}))


def test_verdicts_of_other_computations_are_named_where_they_differ() -> None:
    def again(finer: str, periodic: str, in_time: str) -> str:
        return paper.again(pd.Series({"verdict": "holds", "finer": finer, "periodic": periodic, "transients": in_time}))

    assert again("holds", "holds", "holds") == "the same"
    assert again("holds", "holds", "") == "the same; in time: not judged"
    assert again("holds", "within error", "holds") == "the same; periodic ends: within error"
    assert again("", "", "") == "not judged"


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
    (off,) = {len(deviations(case.frame(0.1))) for case in cases.Cases(tmp_path, []).of("fig04/runs")}
    assert off == 1
    assert "| the paper says |" in (tmp_path / "statements.md").read_text()
