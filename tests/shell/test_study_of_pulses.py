"""The study of pulses: its cases are valid, its statements follow from its rows, and its page has what is there."""

from __future__ import annotations

import sys
from typing import Any

import numpy as np
import pandas as pd
import pytest
from support.inputs import ROOT

import pairsim

sys.path.append(str(ROOT / "scripts"))

from book.statements import Judged
from studies.pulses import cases, exact, judgement, tables, volume
from studies.pulses.runs import Run

BEADS_DIFFER = "to and fro the pair moves as equal beads, to 0.005"
FREE = "the drift of a free pair is that at its mean distance, held, within their half-widths"
FINER = "in a Giesekus liquid the finer mesh is inside the half-width of the coarser one"


def runs() -> list[Run]:
    """The runs of the study that are parts of their own."""
    own = (part.compute for part in cases.parts(False))
    return [compute.__self__ for compute in own if isinstance(getattr(compute, "__self__", None), Run)]


def judged(*rows: dict[str, Any]) -> dict[str, Judged]:
    return dict(judgement.statements(table(*rows), []))


def table(*rows: dict[str, Any]) -> pd.DataFrame:
    """Rows of finished parts, whose columns are those that any of them has."""
    same = {"status": "finished", "code": "", "computed": "2026-11-29", "half_width": 1e-5}
    return pd.DataFrame([{"part": f"{i}", **same, **row} for i, row in enumerate(rows)])


def test_its_runs_are_valid_cases_with_known_laws() -> None:
    for run in runs():
        assert pairsim.load(run.case, kind=run.question).n in (0, 2, 3), run.part.name


def test_periods_in_a_liquid_with_a_memory_are_computed_on_two_meshes_but_the_shortest() -> None:
    of_liquid = [run for run in runs() if run.topic == "giesekus" and run.about.get("length") == 6]
    for Ca_e in (0.0, 0.05):
        found = sorted((run.about["period"], run.about["level"]) for run in of_liquid if run.about["Ca_e"] == Ca_e)  # type: ignore[type-var]
        both = [(period, level) for period in (0.5, 2.0, 10.0, 20.0) for level in ("coarse", "fine")]
        assert found == [(0.1, "coarse"), *both]
        assert all(run.case["time"]["end"] >= cases.FADED for run in of_liquid)


def test_the_exact_pressure_drop_begins_with_that_of_the_solvent_and_forgets_its_start() -> None:
    late = np.array([50.3])
    assert exact.gradient(np.array([0.0]), 1.0) == pytest.approx(32 * exact.XI * exact.MEAN)
    assert exact.gradient(late, 1.0) == pytest.approx(exact.gradient(late + exact.PERIOD, 1.0))
    assert exact.gradient(late, 1e-4) == pytest.approx(32 * exact.flow(late), rel=1e-3)


def test_pairs_that_differ_are_judged_beside_equal_ones_of_the_same_period() -> None:
    def found(mean: float) -> str:
        equal = {"topic": "slow", "run": "square 2", "shape": "square", "period": 2.0, "mean": 1e-3}
        other = {"topic": "slow", "run": "square 8", "shape": "square", "period": 8.0, "mean": 2e-3}
        differ = {"topic": "differing", "run": "to and fro 2", "shape": "square", "period": 2.0, "mean": mean}
        return judged(equal, other, differ)[BEADS_DIFFER].verdict

    assert found(1.001e-3) == "holds"
    assert found(1.01e-3) == "does not hold"


def test_a_held_pair_is_judged_beside_a_free_one() -> None:
    row = {"topic": "held", "run": "1 %", "mean": 1e-3, "held_half_width": 2e-5}
    assert judged({**row, "held_mean": 1.02e-3})[FREE].verdict == "holds"
    assert judged({**row, "held_mean": 0.96e-3})[FREE].verdict == "does not hold"


def test_a_finer_mesh_judges_the_half_width_of_a_coarser_one_and_says_which_signs_are_known() -> None:
    row = {"topic": "giesekus", "period": 10.0, "Ca_e": 0.0, "length": 6.0, "change": 0.0}
    coarse = {**row, "level": "coarse", "run": "a", "mean": -1e-4, "half_width": 2e-5}

    def found(mean: float, half_width: float) -> dict[str, Judged]:
        return judged(coarse, {**row, "level": "fine", "run": "b", "mean": mean, "half_width": half_width})

    signs = "the sign of the drift of rigid beads is known at all periods"
    assert found(-1.1e-4, 5e-6)[FINER].verdict == "holds"
    assert found(-1.3e-4, 5e-6)[FINER].verdict == "does not hold"
    assert found(-1e-5, 5e-6)[signs].verdict == "holds"
    assert found(-1e-5, 5e-5)[signs].verdict == "within error"
    shortest = {**coarse, "period": 0.1, "mean": -1e-6}
    assert judged(coarse, {**row, "level": "fine", "mean": -1e-4}, shortest)[signs].verdict == "within error"


def test_the_limit_of_a_sine_is_the_mean_of_steady_flows_once_all_are_there() -> None:
    rows = [
        {"topic": "slow", "run": f"{q}", "shape": "sine", "period": np.inf, "factor": q, "weight": 0.5, "mean": q}
        for q in (0.2, 0.8)
    ]
    assert judgement.slow_limit(judgement.Rows.of(table(*rows)), "sine") == pytest.approx((0.2**2 + 0.8**2) / 2)
    assert np.isnan(judgement.slow_limit(judgement.Rows.of(table(rows[0])), "sine"))


def test_what_rigid_particles_move_by_is_judged_by_the_displaced_volume() -> None:
    row = {"topic": volume.TOPIC, "run": "pair with a mean", "flow_mean": volume.MEAN, "moved": 0.1, "tol": 1e-4}
    text = "with a mean a rigid pair moves as `travel` says for the volume, to 0.001"
    assert judged({**row, "travel": 0.4001, "travel_error": 1e-5})[text].verdict == "holds"
    assert judged({**row, "travel": 0.4010, "travel_error": 1e-5})[text].verdict == "does not hold"


def test_parts_that_have_failed_are_no_answer_of_a_random_waveform() -> None:
    drawn = {"topic": "random", "reason": "end"}
    good, empty = {**drawn, "run": "00", "mean": 1e-3}, {**drawn, "run": "01", "mean": np.nan}
    assert judged(good)["random waveforms end with a drift"].verdict == "holds"
    assert judged(good, empty)["random waveforms end with a drift"].verdict == "does not hold"
    failed = judged(good, {**empty, "status": "failed", "reason": "inverted_cell"})["every part has an answer"]
    assert failed.verdict == "does not hold"
    assert "1 without 1 (inverted_cell)" in failed.numbers


def test_the_page_says_what_is_not_computed_yet() -> None:
    blocks = tables.blocks(table({"topic": "rigid", "run": "sine", "mean": 0.0, "largest": 2e-12}), cases.parts(True))
    assert "| sine | 2e-12 |" in blocks["rigid"]
    assert blocks["giesekus"] == f"{tables.NOTHING}\n"
    assert "1 of" in blocks["made"]
