"""Studies of accuracy, error bars, hard cases and other codes: what is wrong in their results is found."""

from __future__ import annotations

import sys
from pathlib import Path
from types import SimpleNamespace

import pandas as pd
import pytest
from support.inputs import ROOT

from pairsim.cases.accuracy import SETTINGS
from pairsim.cases.yaml_file import read_yaml
from pairsim.sweeps.grid import grid_from

sys.path.append(str(ROOT / "scripts"))

from book.study import Part, Unavailable, study_of
from studies.codes import judgement as codes
from studies.codes.parts import OWN, PEER, with_spread
from studies.codes.parts import parts as meshes_of_codes
from studies.error_bars import judgement as error_bars
from studies.error_bars.parts import CASES, by_meshes, cases, in_time, read
from studies.hard import judgement as hard
from studies.hard.parts import CASES as HARD
from studies.hard.parts import FILES, grid
from studies.hard.parts import parts as hard_cases


@pytest.mark.slow
def test_hard_cases_are_valid_and_all_different() -> None:
    counts = {name: len(grid(name).cases) for name in FILES}
    assert counts == {name: len(read_yaml(HARD / f"{name}.yaml")["cases"]) for name in counts}
    assert sum(counts.values()) == len(hard_cases(False)) == 140


@pytest.mark.parametrize(("kind", "count"), [pytest.param("scenes", 90, marks=pytest.mark.slow), ("runs", 15)])
def test_scenes_of_error_bars_are_valid(kind: str, count: int) -> None:
    content, scenes, meshes = read(kind)
    found = [case for name, scene in scenes.items() for case in cases(name, scene, meshes)]
    assert len(grid_from(CASES / f"{kind}.yaml", content | {"cases": found}).cases) == count


def hard_results(**changes: object) -> pd.DataFrame:
    row = {"part": "run", "file": "run", "outcome": "failed", "reason": "mesh_failed", "finite": True}
    return pd.DataFrame([row | changes])


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"reason": "crashed"}, "every case is answered, or ends for a documented reason"),
        ({"finite": False}, "all numbers are finite"),
    ],
)
def test_a_hard_case_that_crashes_or_has_numbers_that_are_not_finite_is_found(
    changes: dict[str, object], text: str
) -> None:
    parts = study_of("hard").parts(True)
    assert hard.statements(hard_results(), parts)[text].verdict == "holds"
    assert hard.statements(hard_results(**changes), parts)[text].verdict == "does not hold"


def errors(error: float, known: float, half_width: float, kind: str = "runs") -> pd.DataFrame:
    row = {"part": "a", "kind": kind, "scene": "a", "law": "newtonian", "De": 0.0, "peak": 1e-2, "ended": None}
    return pd.DataFrame([row | {"half_width": half_width, "error": error, "known": known}])


@pytest.mark.parametrize(
    ("table", "verdict"),
    [
        (errors(1e-4, 1e-5, 2e-4), "inside"),
        (errors(3e-4, 1e-5, 2e-4), "outside"),
        (errors(3e-4, 1e-4, 2e-4), "undecided"),
        (errors(3e-4, 1e-4, 2e-4, "scenes"), "undecided"),
        (errors(3e-4, 1e-5, 2e-4, "scenes"), "outside"),
        (errors(1e-6, 1e-9, 5e-7, "scenes"), "negligible"),
    ],
)
def test_an_error_is_judged_where_it_is_known(table: pd.DataFrame, verdict: str) -> None:
    assert error_bars.judged(table)["verdict"].tolist() == [verdict]


def test_half_widths_that_are_too_small_are_found() -> None:
    parts = study_of("error_bars").parts(True)
    text = "runs: at least 95 % of quantities of runs are inside their half-widths"
    assert error_bars.statements(errors(1e-4, 1e-5, 2e-4), parts)[text].verdict == "holds"
    assert error_bars.statements(errors(3e-4, 1e-5, 2e-4), parts)[text].verdict == "does not hold"


def test_all_quantities_of_runs_are_compared_with_a_finer_run_at_the_times_that_are_judged() -> None:
    def run(error: float, **values: float) -> SimpleNamespace:
        columns = {"U_L": 2.0, "D_L": 0.1, "D_T": 0.0} | values
        errors = {"dU_error": error, "U_error_L": error, "D_error_L": error, "D_error_T": 0.0}
        return SimpleNamespace(table=pd.DataFrame([{"t": t, "dU": t, **columns, **errors} for t in (0.1, 0.5, 1.0)]))

    found = list(in_time({"5": run(0.2, U_L=1.9), "truth": run(0.1)}, [0.5, 1.0]))
    assert [(row["quantity"], row["name"], row["t"]) for row in found] == [
        (quantity, name, t) for quantity, name in (("dU", "dU"), ("U", "U_L"), ("D", "D_L")) for t in (0.5, 1.0)
    ]
    assert [row["error"] for row in found] == pytest.approx([0, 0, 0.1, 0.1, 0, 0])
    assert {(row["half_width"], row["known"]) for row in found} == {(0.2, 0.1)}


def test_dU_on_given_meshes_is_compared_with_the_mean_of_two_finer_ones() -> None:
    def curve(*values: float) -> SimpleNamespace:
        gaps = {f"dU_held_{i}": value for i, value in enumerate(values, 1)}
        errors = {f"{name}_{i}": error for i in (1, 2) for name, error in (("dU_error", 0.3), ("ends_error", 0.1))}
        return SimpleNamespace(table=pd.DataFrame([gaps | errors]))

    meshes = {"coarse": curve(1.0, 2.0), "peak": curve(5.0, -6.0), "truth.1": curve(1.1, 2.0)}
    found = list(by_meshes(meshes | {"truth.2": curve(1.2, 2.1)}, 2))
    assert [(row["mesh"], row["name"], row["peak"]) for row in found] == [("coarse", "dU_1", 5), ("coarse", "dU_2", 6)]
    assert [row["error"] for row in found] == pytest.approx([0.15, 0.05])
    assert [row["known"] for row in found] == pytest.approx([0.1, 0.1])
    assert [row["half_width"] for row in found] == pytest.approx([0.2, 0.2])


def accuracy_results() -> tuple[pd.DataFrame, list[Part]]:
    """A row of a curve on the cells of 1%, and one of a run beside its curve, as the study of accuracy has them."""
    cells = SETTINGS["1%"].in_time["thinning"]
    curve = {"kind": "curve", "study": "curve-De1", "cells": "graded", "Np": cells.Np, "percent": 0.3}
    curve |= {"max_size": cells.largest(0.4), "reference": False, "unknowns": 1e4, "seconds": 10.0}
    run = {"kind": "moving", "dU of the run": 1e-3, "its dU_error": 2e-6, "dU": 1.001e-3, "dU_error": 3e-6}
    table = pd.DataFrame([{"part": "a", **curve}, {"part": "b", **run}]).assign(ended=None)
    return table, list(study_of("accuracy").parts(False))


def test_larger_errors_of_a_curve_are_found() -> None:
    study, text = study_of("accuracy"), "a curve on the cells of 1% in viscoelastic liquids is off by less"
    table, parts = accuracy_results()
    assert study.statements(table, parts)[text].verdict == "holds"
    assert study.statements(table.assign(percent=20 * table["percent"]), parts)[text].verdict == "does not hold"


def test_a_run_that_does_not_end_on_its_curve_is_found() -> None:
    study, text = study_of("accuracy"), "a run ends on the curve of its case, within the half-widths of both"
    table, parts = accuracy_results()
    assert study.statements(table, parts)[text].verdict == "holds"
    moved = table.assign(**{"dU of the run": 1.01 * table["dU of the run"]})
    assert study.statements(moved, parts)[text].verdict == "does not hold"


def test_a_code_that_is_not_installed_is_named(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("PYOOMPH", str(tmp_path / "python"))
    part = next(each for each in meshes_of_codes(False) if each.name == "80 cells")
    with pytest.raises(Unavailable, match="needs pyoomph"):
        part.compute(tmp_path / "part")


@pytest.mark.parametrize(("spread", "verdict"), [(None, "holds"), (0.05, "holds"), (0.4, "within error")])
def test_times_of_codes_differ_if_their_repetitions_do(spread: float | None, verdict: str) -> None:
    row = {"what": "point", "tol": 0.0, "cells": 20, "error": 0.01, "set_up": 0.0, "part": "20 cells"}
    times = pd.DataFrame([row | {"by": OWN, "seconds": 1.0}, row | {"by": PEER, "seconds": 2.0}])
    results = times if spread is None else times.assign(spread=spread)
    statement = "a point with an error of 0.02 % takes less time than with pyoomph"
    assert codes.statements(results, [])[statement].verdict == verdict


def test_the_spread_of_repetitions_is_stored_with_their_median() -> None:
    row = {"what": "point", "by": OWN, "tol": 0.0, "dU": 0.007, "set_up": 1.0}
    (found,) = with_spread(pd.DataFrame([row | {"seconds": each} for each in (4.0, 3.0, 5.5)])).to_dict("records")
    assert (found["seconds"], found["set_up"], found["spread"]) == (4.0, 1.0, 0.25)
    (once,) = with_spread(pd.DataFrame([row | {"seconds": 4.0}])).to_dict("records")
    assert pd.isna(once["spread"])
