"""Rows of equal particles that `pairsim.train` follows along a tube."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.pictures import drawn_figures

import pairsim
from pairsim.computing.events import Begin, Progress
from pairsim.computing.problems import steady_problem
from pairsim.computing.workers import ALONE
from pairsim.questions.registry import QUESTIONS
from pairsim.questions.train import work
from pairsim.questions.train.row import first_gaps
from pairsim.runtime.monitor import Monitor
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.problems import SteadyProblem
from pairsim.solvers.rows.model import Row
from pairsim.solvers.rows.short_rows import Chain, places_of, short_rows, solved

SOFT = {"beta": 0.4, "De": 0, "Ca_e": 0.1, "length": 6, "mesh": {"Np": 8}}
TRAIN = {"beta": 0.4, "De": 0, "Ca_e": 0.1, "accuracy": "5%", "mesh": {"Np": 8}, "train": {"cell": 4}}


@pytest.fixture(scope="module")
def alone() -> tuple[SteadyProblem, Parameters]:
    case = pairsim.load(SOFT, kind="curve", particles=1)
    return replace(steady_problem(case, np.inf), volume_modulus=False), Parameters((), case.solid_models)


@pytest.fixture(scope="module")
def pairs(alone: tuple[SteadyProblem, Parameters]) -> list[Row]:
    """Few, and of single beads."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("pairsim.solvers.rows.short_rows.COUNTS", {2: 7})
        return [row for chain in short_rows(0.1, 2) for row in chain.solved(*alone)]


@pytest.fixture(autouse=True)
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Rows that other tests have solved are not known."""
    monkeypatch.setattr("pairsim.computing.kept_rows.cache_folder", lambda: tmp_path / "cache")


@pytest.fixture
def follow(pairs: list[Row], monkeypatch: pytest.MonkeyPatch) -> Any:
    """`pairsim.train` with sums of pairs."""
    known = Chain([tuple(row.gaps.tolist()) for row in pairs])
    monkeypatch.setattr("pairsim.questions.train.row.short_rows", lambda *_: iter([known]))
    monkeypatch.setattr("pairsim.questions.train.row.TRAINS", ())
    solved = Chain.solved
    monkeypatch.setattr(Chain, "solved", lambda chain, *of: iter(pairs) if chain is known else solved(chain, *of))
    return lambda **keys: pairsim.train(TRAIN | keys).check()


@pytest.mark.slow
def test_progress_is_a_part_of_all_that_a_row_takes(follow: Any) -> None:
    """Growth rates are a tenth of it, short rows most; here most of these are left out."""
    case = pairsim.load(TRAIN | {"d": [0.15, 0.2], "row": {"tube": 40}}, kind="train")
    begin, *found = [*QUESTIONS["train"].solve(case, monitor=Monitor(), workers=ALONE)]
    assert isinstance(begin, Begin)
    steps = {each.text: each.done for each in found if isinstance(each, Progress)}
    parts = np.array([*steps.values()]) / begin.total
    assert (np.diff(parts) > 0).all()
    assert parts[0] < 0.1
    needed = begin.total - sum(work.MESHES[1:])  # one mesh alone, as its cells are given
    part = (steps["short row 2 of 8"] - steps["short row 1 of 8"]) / begin.total
    assert part == pytest.approx(4 / needed), "of two beads"
    rows = [work.of_short_row(len(place) + 1) for count in range(1, 6) for place in places_of(count, 0.04)]
    assert 0.7 < sum(rows) / begin.total < 0.9
    assert begin.total == work.of_case(case) > steps["rows of 3 are solved"]


@pytest.mark.slow
def test_a_row_with_distances_at_random_is_followed_along_the_tube(
    follow: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    row = {"beads": 60, "spread": 0.4, "seed": 3, "tube": 10}
    train = follow(d=0.3, row=row)
    (spread,) = [line for line in train.findings() if line.startswith("Spread of 59 distances within 10 D_c of tube")]
    table = train.frame("row")
    assert table.shape == (101, 2 + 60 + 3 * 59)
    d, z = (table.filter(regex=f"^{name}_").to_numpy() for name in "dz")
    assert np.diff(z, axis=1) == pytest.approx(d + TRAIN["beta"]), "between centres of undeformed beads"
    assert (z - z[0]).mean(axis=1) == pytest.approx(table["position"])
    case = pairsim.load(TRAIN | {"d": 0.3, "row": row}, kind="train")
    assert d[0] == pytest.approx(first_gaps(case, 0.3), rel=1e-5)
    assert first_gaps(case, 0.3).mean() == pytest.approx(0.3, rel=0.2)
    spreads = [float(each) for each in re.findall(r"(?:from|to) ([\d.]+) %", spread)]
    assert spreads == pytest.approx([100 * each.std() / each.mean() for each in (d[0], d[-1])], rel=0.01)
    assert spreads[0] == pytest.approx(40, rel=0.3)
    assert table["position"].iloc[-1] == pytest.approx(10.0, rel=0.02)
    with drawn_figures(monkeypatch) as figures:
        assert [path.name for path in train.plot(tmp_path)] == ["train.png", "row.png", "kymograph.png"]
    assert all("$d = 0.3$ $D_c$" in figure.get_supxlabel() for figure in figures)


@pytest.mark.slow
def test_short_rows_are_solved_once_for_all_rows_of_a_bead(follow: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever their distances are, and how many beads they have."""
    first = follow(d=[0.15, 0.2], row={"tube": 10})
    monkeypatch.setattr("pairsim.computing.solved_rows.solved_rows", lambda *_: pytest.fail("rows are known"))
    assert follow(d=[0.15, 0.2], row={"tube": 10}).frame("row").equals(first.frame("row"))
    follow(d=[0.25, 0.2, 0.3], row={"tube": 10})


@pytest.mark.slow
def test_a_row_with_given_distances_has_its_error_and_its_propagator(follow: Any) -> None:
    train = follow(d=[0.15, 0.2], row={"tube": 40})
    spread, half_widths, audit, propagator = train.findings()[-4:]
    assert spread.startswith("Spread of 2 distances within 40 D_c of tube: from 14.3 % to ")
    off = re.match(
        r"Error of the model .* 3 neighbours .* in full, is off by at most ([\d.]+) %.* growth rates of the train by",
        audit,
    )
    assert off
    assert 1 < float(off[1]) < 60, "sums of pairs are poor"
    table = train.frame("row")
    of_gaps = [f"{name}_{i}" for name in ("d", "dU", "dU_error") for i in (1, 2)]
    assert list(table) == ["position", "t", "z_1", "z_2", "z_3", *of_gaps]
    assert f"{table[['dU_error_1', 'dU_error_2']].to_numpy().max():.2g}"[:3] in half_widths
    assert (table.iloc[-1] > table.iloc[0])[["d_1", "d_2"]].all(), "soft particles separate"
    singular = np.linalg.svd(train.frame("propagator").to_numpy(), compute_uv=False)
    assert f"become {singular[1]:.3g} to {singular[0]:.3g} times" in propagator
    assert train.table["d"][0] == pytest.approx(0.175, rel=1e-6)


def test_short_rows_are_those_of_a_curve(alone: tuple[SteadyProblem, Parameters]) -> None:
    curve = pairsim.curve(SOFT | {"d": [0.15, 0.25], "max_points": 2}).check().table
    found = {float(row.gaps[0]): row for row in solved(*alone, [(0.25,), (0.15,)])}
    for i, d in enumerate(curve["d"]):
        assert found[d].dU[0] == pytest.approx(curve["dU"][i], rel=1e-6)
        assert 1 + found[d].slopes[0, 0, 1] == pytest.approx(curve["stretch"][i], rel=1e-9)


def test_quantities_of_an_experiment_give_distances_and_the_length_of_tube() -> None:
    physical = {"tube": "50 um", "velocity": "5 mm/s", "viscosity": "1 Pa s", "particle": "20 um", "modulus": "1 kPa"}
    lengths: dict[str, Any] = {"distance": ["5 um", "10 um"], "capillary": "5 cm", "contact": "100 nm"}
    case = pairsim.load({"physical": physical | lengths}, kind="train")
    assert first_gaps(case, 0.15) == pytest.approx([0.1, 0.2])
    assert case.row.tube == pytest.approx(1000)
    assert case.row.min_gap == pytest.approx(0.002)


@pytest.mark.slow
def test_a_pair_is_followed_too(follow: Any) -> None:
    train = follow(d=[0.2], row={"tube": 10})
    change = train.frame("propagator").to_numpy()
    assert change.shape == (1, 1)
    assert f"become {change[0, 0]:.3g} to {change[0, 0]:.3g} times" in train.answer
    assert list(train.frame("row")) == ["position", "t", "z_L", "z_T", "d", "dU", "dU_error"]


@pytest.mark.parametrize(
    ("keys", "wrong"),
    [
        ({"d": [0.001, 0.2]}, "row.min_gap"),
        ({"d": [0.2], "row": {"beads": 5}}, "row.beads"),
        ({"d": 0.2, "row": {"tube": 10}}, "row.beads: is missing"),
        ({"d": []}, "d: got"),
        ({"d": None, "train": {"transition": [0.8, 0.3]}}, "train.transition: .* ascending order"),
    ],
)
def test_what_no_row_can_do_is_refused(keys: dict[str, Any], wrong: str) -> None:
    with pytest.raises(pairsim.InputError, match=wrong):
        pairsim.load(TRAIN | keys, kind="train")
