"""scripts/paper: its figures, the judgement of statements, and one small figure from end to end."""

from __future__ import annotations

import itertools
import subprocess
import sys
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
import yaml
from support.inputs import ROOT

from pairsim.commands import COMMANDS
from pairsim.inputs.case_files import read_case
from pairsim.sweeps.grid import Grid, read_grid

sys.path.append(str(ROOT / "scripts"))  # the modules of a script lie beside it

import paper
import paper_results
import paper_statements
from paper_results import CONFIGS, Results, computations, figures

GRIDS = [name for figure in figures() for name in computations(figure) if not name.startswith("fig02/")]
ENDS = ("170mm.pdf", "170mm.png", "85mm.pdf", "85mm.png")
CHECKED = [name for folder in paper_statements.CHECKS for name in computations(folder)]


def grid(name: str, *, quick: bool) -> Grid:
    path = CONFIGS / f"{name}.yaml"
    command = yaml.safe_load(path.read_text()).get("command", "run")
    return read_grid(path, paper.quick_settings(name, command) if quick else ())


@pytest.mark.parametrize("quick", [False, True])
@pytest.mark.parametrize("name", GRIDS + CHECKED)
def test_computations_are_grids(name: str, quick: bool) -> None:
    cases = grid(name, quick=quick).cases
    assert cases
    if quick:  # a CI machine computes each in a minute at most
        assert max(case.estimate.seconds for case in cases) < 60


def test_all_figures_have_what_they_show() -> None:
    known = figures()
    assert list(known) == [f"fig{number:02d}" for number in range(2, 18) if number != 5]
    for figure in known.values():
        assert not [name for name in figure.needs if not (CONFIGS / f"{name}.yaml").is_file()]
    for name in computations("fig02"):
        assert read_case(COMMANDS["run"], CONFIGS / f"{name}.yaml").mesh.Np >= 20


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
    assert paper.main() == 2
    assert "fig99" in capsys.readouterr().err


def test_what_is_to_do_is_listed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    output = tmp_path / "results"
    monkeypatch.setattr(sys, "argv", ["paper", "fig02", "fig14", "--quick", "--dry-run", "-o", str(output)])
    assert paper.main() == 0
    lines = [line.split() for line in capsys.readouterr().out.splitlines()[1:-1]]
    assert {name: (cases, left) for name, cases, left, _ in lines} == {
        "fig14/curves": ("2", "2"),
        "fig09/curves": ("20", "20"),
    }
    assert not output.exists()


@pytest.mark.parametrize(
    ("checks", "verdict"),
    [
        ([(1.0, 0.1), (0.2, 0.1)], "holds"),
        ([(1.0, 0.1), (0.05, 0.1)], "within error"),
        ([(-0.05, 0.1), (1.0, 0.1)], "within error"),
        ([(0.05, 0.1), (-0.2, 0.1)], "does not hold"),
    ],
)
def test_verdicts(checks: list[tuple[float, float]], verdict: str) -> None:
    assert paper_statements.Finding(tuple(checks), "").verdict == verdict


def test_checks_of_sequences() -> None:
    assert paper_statements.rising([1, 2, 4], [0, 0.5, 0.25]) == [(1, 0.5), (2, 0.75)]
    assert paper_statements.falling([1, 2], [0, 0]) == [(-1, 0)]
    assert paper_statements.nearly([1.0, 1.25], 2.0, part=0.25) == (0.25, 0.0)


def test_parameters_are_matched() -> None:
    case = {"beta": [0.4, 0.4], "De": 1, "Ca_e": 0.1, "accuracy": "1%"}
    assert paper_results.matches(case, {"beta": 0.4, "De": [0.5, 1.0], "accuracy": "1%"})
    assert not paper_results.matches(case, {"Ca_e": 0.15})
    assert not paper_results.matches({**case, "beta": [0.4, 0.2]}, {"beta": 0.4})


def test_statements_without_results_are_not_computed(tmp_path: Path) -> None:
    rows = paper_statements.judged(Results(tmp_path))
    assert len(rows) >= 40
    assert {row.verdict for row in rows} == {"not computed"}
    assert {row.statement.figure for row in rows} <= set(figures())


@pytest.mark.slow
def test_two_small_figures_from_end_to_end(tmp_path: Path) -> None:
    """Figs. 2 and 4 on two processes: meshes, two runs with a single particle, pictures in two widths."""
    mpirun = [str(Path(sys.executable).parent / "mpirun"), "-n", "2"]
    script = [sys.executable, str(ROOT / "scripts" / "paper.py"), "fig02", "fig04", "--quick", "-o", str(tmp_path)]
    done = subprocess.run([*mpirun, *script], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert sorted(path.name for path in (tmp_path / "fig02").iterdir()) == ["default.vtu", "paper.vtu"]
    pictures = sorted(path.name for path in (tmp_path / "pictures").iterdir())
    assert pictures == [f"{name}-{end}" for name in ("fig02", "fig04") for end in ENDS]
    (shape,) = {len(paper_statements.deviations(case.frame(0))) for case in Results(tmp_path).cases("fig04/runs")}
    assert shape == 1
    assert "| the paper says |" in (tmp_path / "statements.md").read_text()
