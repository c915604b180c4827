"""Liquids with a yield stress: their regularisation, and pairs that unyielded liquid holds together."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.inputs import ROOT
from support.result_folders import curve_of, curve_table

import pairsim
from pairsim.analysis.time_series import Series
from pairsim.computing.case_files import parse_case
from pairsim.computing.problems import steady_problem
from pairsim.fem.recovery.viscosity_scatter import _beyond_first_order
from pairsim.physics.liquids import Liquid
from pairsim.physics.liquids.bingham import Bingham
from pairsim.physics.liquids.herschel_bulkley import HerschelBulkley
from pairsim.physics.liquids.power_law import PowerLaw
from pairsim.questions.curve.answer import answer_of_curve
from pairsim.questions.registry import QUESTIONS
from pairsim.questions.run.answer import answer_of_run
from pairsim.record.record import Record
from pairsim.solvers.curves.branch import Branch
from pairsim.solvers.goals import dU
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.steady.first_solution import first_scene
from pairsim.solvers.steady.scene import SteadySolver

COARSE = {"ends": "developed", "length": "auto", "accuracy": "5%", "mesh": {"Np": 12, "max_size": 0.15}}
RIGID: dict[str, Any] = COARSE | {"Ca_e": 0, "d": [0.1]}
DRAGGED: dict[str, Any] = COARSE | {"particles": 1, "beta": 0.5, "Ca_e": 0, "velocity": 1, "flow": 0}


def drag(**liquid: Any) -> tuple[float, float]:
    """The force on a dragged sphere over 3 pi beta, and its half-width."""
    row = pairsim.curve(DRAGGED | {"liquid": liquid}).table.iloc[0]
    return row["F_1"] / (1.5 * np.pi), row["F_error_1"] / (1.5 * np.pi)


def test_a_continuation_is_geometric_in_the_regularisation_and_linear_in_all_else() -> None:
    here, there = (Parameters((), (), Liquid(HerschelBulkley(Bn=2.0, n=n, m=m))) for n, m in ((0.7, 0.01), (0.3, 1e4)))
    assert here.towards(there, 0.5).liquid.solvent.numbers == pytest.approx({"Bn": 2.0, "n": 0.5, "m": 10.0})
    assert there.less_regularised(0.1).liquid.solvent == replace(there.liquid.solvent, m=1e3)
    plain = Parameters((), (), Liquid(PowerLaw(n=0.5)))
    assert plain.less_regularised(0.1) == plain


@pytest.mark.slow
def test_drag_in_a_weak_bingham_liquid_tends_to_the_newtonian_one() -> None:
    """As Bn^1, with the dissipation of the yield stress in the Newtonian flow as slope, but for a higher order."""
    K = [drag(law="bingham", Bn=Bn)[0] for Bn in (0.0, 0.01, 0.02)]
    assert K[0] == pytest.approx(5.9475, rel=2e-3), "Haberman and Sayre 1958"
    assert math.log2((K[2] - K[0]) / (K[1] - K[0])) == pytest.approx(1.0, abs=0.05)


@pytest.mark.slow
def test_drag_on_coarse_cells_is_within_its_half_width() -> None:
    """With Bn D_p/D_c = 10; 20.773 +- 0.008 on cells five times smaller (docs/how-to/yield-stress.md)."""
    K, error = drag(law="bingham", Bn=20)
    assert abs(K - 20.773) < error < 0.05 * K


@pytest.mark.slow
def test_the_regularisation_is_a_part_of_the_half_width() -> None:
    """The derivatives of dU by ln m by the adjoint are those of differences; m is small, and what it does large."""
    case = parse_case(
        QUESTIONS["curve"], RIGID | {"beta": [0.4, 0.3], "liquid": {"law": "bingham", "Bn": 1, "m": 3}}, ""
    )
    wanted = Parameters((0.1,), case.solid_models, case.liquid_model)
    scene = first_scene(steady_problem(case, 0.1), wanted)
    assert isinstance(scene, SteadySolver)
    branch = Branch(scene)
    at, *ends = (branch.at(wanted.less_regularised(factor)) for factor in (1.0, math.exp(0.02), math.exp(-0.02)))
    branch.close()
    slope = (ends[0].discrete.dU - ends[1].discrete.dU) / 0.04
    slopes = [end.estimate[dU].by_regularisation[0] for end in ends]
    first, second = at.estimate[dU].by_regularisation
    assert first == pytest.approx(slope, rel=2e-3)
    assert second == pytest.approx((slopes[0] - slopes[1]) / 0.04, rel=1e-2)
    assert (at.estimate[dU].half_width > abs(slope)).all()


@pytest.mark.slow
def test_the_half_width_holds_where_results_do_not_go_as_1_over_m_yet() -> None:
    """The gap is about to be held by unyielded liquid: between m = 30 and 100 dU rises, before it falls."""
    case = {"beta": 0.4, "De": 0, "Ca_e": 0.05, "d": [0.1732], **COARSE, "mesh": {"Np": 20, "max_size": 0.12}}
    law = {"law": "herschel-bulkley", "n": 0.6, "Bn": 0.5}
    known, rough = (pairsim.curve(case, liquid={**law, "m": m}).table.iloc[0] for m in (1e4, 100))
    left = abs(rough["dU_discrete"] - known["dU_discrete"])
    assert left < rough["regularisation_error"] < 2 * left
    assert known["regularisation_error"] < 0.1 * left


def test_unyielded_liquid_holds_a_pair_together() -> None:
    """The shipped example: dU is of the sign of separation, and falls as 1/m."""
    result = pairsim.curve(ROOT / "configs" / "yield_stress.yaml", **RIGID, fields=[0.1])
    (z, r, _), yielding = result.fields(0.1).points.T, result.fields(0.1)["yielding"]
    between = (r < 0.9 * result.table["bridge"][0]) & (z > 0.02) & (z < 0.08)  # the gap is at z from 0 to .1
    assert between.sum() > 10
    assert (yielding[between] < 1).all()
    assert yielding.max() > 2.5, "at the wall"
    answer, row = str(result.answer).splitlines()[0], result.table.iloc[0]
    assert answer.startswith(
        "Unyielded liquid holds it together at d = 0.1: dU there is mere creep due to the regularisation"
    )
    assert row["dU"] > 0
    assert row["creep"] == pytest.approx(1, abs=0.15)
    assert 0.1 < row["bridge"] < 0.2
    assert row["regularisation_error"] > row["dU"] / 2
    assert row["plug"] == pytest.approx(0.17124, rel=1e-4), "Buckingham and Reiner"
    adaptation = result.record["adaptation"]
    assert adaptation["reached"] == pytest.approx(row["dU_error"] / adaptation["reference_dU"])
    assert (adaptation["kept"], adaptation["held_together"]) == (False, ["d = 0.1"])


@pytest.mark.slow
def test_cells_are_not_refined_for_a_pair_that_is_held_together() -> None:
    """Its dU is creep, of which any error is a large part."""
    plain = {key: value for key, value in RIGID.items() if key != "mesh"}
    result = pairsim.curve(plain | {"beta": [0.4, 0.3], "liquid": {"law": "bingham", "Bn": 5}})
    assert str(result.answer).startswith("Unyielded liquid holds it together")
    assert [mesh["rounds"] for mesh in result.record["adaptation"]["meshes"]] == [0]


def test_a_pair_that_yielding_liquid_surrounds_is_not_held() -> None:
    (answer, *_), row = pair(beta=[0.4, 0.3], liquid={"law": "bingham", "Bn": 0.5})
    assert answer == "The pair separates at d = 0.1."
    assert row["bridge"] == 0
    assert np.isnan(row["creep"])


@pytest.mark.slow
def test_equal_rigid_spheres_keep_their_distance() -> None:
    """The stress is odd in the velocity: what is reversed in time and space is the same flow."""
    (answer, *_), row = pair(beta=0.4, liquid={"law": "bingham", "Bn": 5})
    assert answer == "The pair keeps its distance: dU vanishes at every d."
    assert abs(row["dU"]) < 1e-10


def pair(**keys: Any) -> tuple[list[str], Any]:
    result = pairsim.curve(RIGID | keys)
    return str(result.answer).splitlines(), result.table.iloc[0]


HOLDS = {"bridge": 0.1, "creep": 1.0}
NOT_HELD = {
    "an ordinary zero in a plug": {"bridge": 0.1, "creep": 0.05},
    "a zero that m moves": {"bridge": 0.1, "creep": np.nan},
    "liquid yields on the axis": {"bridge": 0.0, "creep": 1.0},
}


@pytest.mark.parametrize("table", [HOLDS, *NOT_HELD.values()], ids=["held", *NOT_HELD])
def test_only_creep_across_a_bridge_is_told_as_holding(table: dict[str, float]) -> None:
    d = np.geomspace(0.1, 0.3, 3)
    columns = {name: np.full(3, value) for name, value in (table | {"dU_error": 2e-5}).items()}
    words = answer_of_curve(curve_of(curve_table(d, np.array([1e-5, 1.2e-5, 1e-5]), 0 * d, **columns)))[0]
    assert words.startswith("Unyielded liquid holds" if table is HOLDS else "Not decided")


def test_a_run_advises_no_time_that_only_creep_would_take() -> None:
    series = {"t": np.array([0.0, 2.0]), "d": np.array([0.1, 0.1]), "dU": np.array([0.0, 3e-3])}
    steady = {"dU": [1e-3], "dU_error": [1e-4], "t_relax": 60.0, "start": "rest", "accuracy": 0.01}
    (line,) = answer_of_run(Series(series, Record({"settled": steady})))
    assert "time.end" in line
    (line,) = answer_of_run(Series(series, Record({"settled": steady | {"creeps": True}})))
    assert "time.end" not in line
    assert "this decays only by creep due to the regularisation (t_relax = 60, which grows as m)" in line
    (line,) = answer_of_run(Series(series, Record({"settled": steady | {"held_together": True}})))
    assert line.startswith("The pair comes to be held together by unyielded liquid")


def test_one_point_off_the_lock_leaves_the_region_undecided() -> None:
    d = np.geomspace(0.1, 0.3, 3)
    columns = {"dU_error": np.full(3, 2e-5), "bridge": np.array([0.1, 0.1, 0.0]), "creep": np.array([1, 1, np.nan])}
    words = answer_of_curve(curve_of(curve_table(d, np.full(3, 1e-5), 0 * d, **columns)))[0]
    assert words.startswith("Not decided between d = 0.1 and 0.3")


def test_what_is_beyond_the_first_order_is_no_more_than_the_whole_change_of_the_stress() -> None:
    """Linearised below the yield stress, the change is that of a viscosity of 2000."""
    law, rng = Bingham(Bn=2.0), np.random.default_rng(0)
    e, more = (scale * rng.standard_normal((200, 3, 4)) for scale in (1e-3, 0.1))

    def stress(e: np.ndarray) -> np.ndarray:
        return 2 * law.viscosity(2 * (e**2).sum(-1) + 1e-12)[..., None] * e

    left, change = (np.sqrt((x**2).sum(-1)) for x in (_beyond_first_order(law, e, more), stress(e + more) - stress(e)))
    assert (left <= change * (1 + 1e-9)).all()
    assert left.mean() > 0.3 * change.mean()


@pytest.mark.slow
def test_half_widths_of_runs_contain_what_rounding_off_the_kink_does() -> None:
    """At m = 3 a rigid pair is faster by far more than what cells and steps leave."""
    case = COARSE | {"beta": [0.4, 0.3], "Ca_e": 0, "d0": 0.1, "dU_error": True, "time": {"end": 0.01}}
    round_, sharp = (
        pairsim.run(case | {"liquid": {"law": "bingham", "Bn": 1, "m": m}}).table.iloc[-1] for m in (3, 1000)
    )
    off = abs(round_["dU_discrete"] - sharp["dU"])
    assert off > 5 * sharp["dU_error"]
    assert round_["dU_error"] > abs(round_["dU"] - sharp["dU"])


@pytest.mark.slow
def test_the_error_of_a_soft_pair_in_liquid_that_yields_does_not_grow_from_step_to_step() -> None:
    """The error is at most 1e-4; estimates that each began with the last one grew to 16 times dU."""
    case = COARSE | {"beta": 0.4, "Ca_e": 0.05, "d0": 0.2, "start": "rest", "dU_error": True}
    case |= {"liquid": {"law": "bingham", "Bn": 5}, "time": {"fixed_step": 0.01, "end": 0.1}}
    rows = pairsim.run(case).table
    assert (np.abs(rows["dU"] - rows["dU_discrete"]) < 0.5 * np.abs(rows["dU_discrete"]).max()).all()
    assert abs(rows["dU"].iloc[-1] - -1.231e-3) < rows["dU_error"].iloc[-1]  # on N_p 36


def test_a_law_of_a_users_own_may_name_its_regularisation() -> None:
    law = Bingham(Bn=1.0)
    assert Liquid(law).regularisation == "solvent.m"
    assert Liquid(PowerLaw(n=0.5)).regularisation == ""


@pytest.mark.slow
def test_a_run_says_within_which_radius_nothing_yields_between_particles() -> None:
    """Of a polymer: at first nothing has yielded, in a weak liquid all has soon."""
    case = COARSE | {"beta": 0.4, "De": 0.5, "Ca_e": 0, "d0": 0.4, "time": {"end": 0.05}}
    radii = {}
    for Bn in (1e-3, 50.0):
        liquid = {"law": "oldroyd-b", "yielding": {"law": "saramito-2007", "Bn": Bn}}
        run = pairsim.run(case | {"liquid": liquid})
        radii[Bn] = run.table["bridge"].iloc[-1]
        assert any("no liquid yields along d within" in line for line in run.findings()) == (radii[Bn] > 0)
    assert radii == {1e-3: 0.0, 50.0: 0.5}


@pytest.mark.slow  # of compilation, with an empty cache
def test_fields_of_a_yield_law_without_a_yield_stress_have_no_yield_surface(tmp_path: Path) -> None:
    """Its stress over the yield stress is no number, and is left out."""
    case = COARSE | {"beta": 0.4, "De": 0.5, "Ca_e": 0, "d0": 0.4, "time": {"end": 1e-3}}
    case |= {"length": 3, "mesh": {"Np": 6, "max_size": 0.3}}
    liquid = {"law": "oldroyd-b", "yielding": {"law": "saramito-2007", "Bn": 0.0}}
    run = pairsim.run(case | {"liquid": liquid}, folder=tmp_path / "run")
    assert run.status == "finished"
    fields = run.fields(1e-3).point_data
    assert "tr_c" in fields
    assert "yielding" not in fields


@pytest.mark.long  # a minute
def test_a_branch_that_ends_below_a_yield_stress_is_left() -> None:
    """New meshes past its end are tried through rounder kinks, which take no rounder ones on their way."""
    case = COARSE | {"beta": 0.4, "Ca_e": 0.1, "d": [0.1], "mesh": {"Np": 8, "max_size": 0.2}}
    result = pairsim.curve({**case, "liquid": {"law": "bingham", "Bn": 10, "m": 1e5}}, budget="8 min")
    assert (result.status, result.reason) == ("failed", "not_resolved")
    assert "steady states end at Ca_e = 0.09" in result.message
