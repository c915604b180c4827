"""Warnings of meshes, tubes, gaps, time steps and De, by themselves and in the computations that give them."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import pairsim
from pairsim.cases.run_case import Case
from pairsim.computing.case_files import parse_case
from pairsim.computing.problems import problem_of
from pairsim.computing.warnings import (
    ErrorAt,
    beyond_checked,
    coarse_mesh,
    large_errors,
    moves_on,
    near_ends,
    unresolved_stress,
)
from pairsim.questions.registry import QUESTIONS
from pairsim.questions.run.ends import end_of
from pairsim.questions.run.warnings import narrow_gap


def case(**keys: Any) -> Case:
    plain = {"beta": 0.4, "De": 0, "Ca_e": 0.1, "d0": 0.1, "ends": "developed", "length": "auto"}
    return parse_case(QUESTIONS["run"], {**plain, **keys}, "test")


SMALL, LARGE = ErrorAt(0.002, ("d = 0.3",), 0.0, 0.0), ErrorAt(0.03, ("d = 0.1",), 0.0, 0.0)


def told(*errors: ErrorAt, **keys: Any) -> list[str]:
    """Warnings of errors of dU."""
    return [*map(str, large_errors(case(**keys), "dU_error", "the largest |dU|", errors))]


PAIR = case()
MOVED = {"beta": 0.4, "Ca_e": 0, "d": [0.1], "velocity": 1, "flow": 0, "mesh": {"Np": 12}}
MORE_THAN_WANTED = "dU_error is 3 % of the largest |dU| at d = 0.1, more than accuracy: 1%; use a "
COARSE = "is coarser than accuracy: 5% ({}): the error of dU may exceed 5% of its largest value"
FAST = (
    "the particles move on before they have forgotten their start (t_relax): this alone makes dU_error up to 20 % of "
    "the largest |dU|, more than accuracy: 1%, and no mesh reduces it; pairsim run shows how particles that start "
    "there move"
)
WARNINGS = {
    "mesh.Np = 12 " + COARSE.format(20): lambda: coarse_mesh(case(mesh={"Np": 12}), "dU"),
    "mesh.Np = 20 " + COARSE.format(28): lambda: coarse_mesh(case(De=0.5, liquid="oldroyd-b", mesh={"Np": 20}), "dU"),
    "mesh.max_size = 0.2 " + COARSE.format(0.1): lambda: coarse_mesh(case(De=1, mesh={"max_size": 0.2}), "dU"),
    "cell sides on the particles beside a gap of 0.005 are 2.4 times as long as the gap (d0 sets their length): dU "
    "there is accurate to a few per cent only; use shorter ones (--set mesh.Np=60), or pairsim curve "
    "at that d": lambda: narrow_gap(PAIR, 0.005, 0.0118),
    MORE_THAN_WANTED + "finer mesh (--set mesh.Np=60 --set mesh.max_size=0.13)": lambda: told(SMALL, LARGE),
    MORE_THAN_WANTED.replace(" at d = 0.1", "") + "longer tube (--set length=7.35)": lambda: told(
        ErrorAt(0.03, (), 0.02, 0.0)
    ),
    MORE_THAN_WANTED + "longer tube (--set length=7.35)": lambda: told(ErrorAt(0.03, ("d = 0.1",), 0.02, 0.0)),
    MORE_THAN_WANTED + "larger m (--set liquid.m=1e+04)": lambda: told(
        ErrorAt(0.03, ("d = 0.1",), 0.0, 0.02), liquid={"law": "bingham", "Bn": 1}
    ),
    "at d = 0.03 " + FAST: lambda: moves_on(PAIR, ["d = 0.03"], 0.2),
    "at 2 places from d = 0.03 to d = 0.04 " + FAST: lambda: moves_on(PAIR, ["d = 0.03", "d = 0.04"], 0.2),
    "mesh.Np = 12 " + COARSE.format(20).replace("dU", "F"): lambda: coarse_mesh(
        parse_case(QUESTIONS["curve"], MOVED, "test"), "F"
    ),
    "there are 0.9 D_c of tube on each side of the particles, less than 1: the ends affect dU; use a longer tube "
    "(--set length=7.35), or limits.max_gap in a run": lambda: near_ends(PAIR, PAIR.tube_length - 1.8, "dU"),
}


@pytest.mark.parametrize("warning", WARNINGS)
def test_warnings_name_what_is_wrong_where_and_what_helps(warning: str) -> None:
    assert [*map(str, WARNINGS[warning]())] == [warning]


def test_an_error_a_little_above_what_is_wanted_is_not_rounded_to_it() -> None:
    (warning,) = told(ErrorAt(0.010001, ("d = 0.1",), 0.0, 0.0))
    assert warning.startswith("dU_error is 1.0001 % of the largest |dU| at d = 0.1, more than accuracy: 1%")


def test_meshes_that_were_measured_give_no_warning() -> None:
    for keys in ({}, {"accuracy": "5%"}, {"De": 1, "accuracy": "5%"}, {"De": 0.5, "mesh": {"Np": 20}}):
        assert not coarse_mesh(case(**keys), "dU"), keys
    assert not coarse_mesh(case(De=0.5, liquid="oldroyd-b", accuracy="5%"), "dU")
    assert not narrow_gap(case(), 0.02, 0.0118)


def test_unresolved_stress_gives_a_warning_by_accuracy() -> None:
    """With default cells, Oldroyd-B around rigid particles had an error of 3 % of the peak with jumps of 1.7 to 1.9."""
    assert unresolved_stress(case(De=1), 1.7, "dU")
    assert not unresolved_stress(case(De=1), 1.5, "dU")
    assert not unresolved_stress(case(De=1, accuracy="5%"), 1.9, "dU")
    assert unresolved_stress(case(De=1, accuracy="5%"), 2.1, "dU")
    assert unresolved_stress(case(De=1, accuracy="0.1%"), 1.4, "dU")


@pytest.mark.parametrize("change", [1.6001, 1.62, 2.5])
def test_number_that_is_too_large_reads_so(change: float) -> None:
    """A warning that s changes by 1.6, where 1.6 is allowed, would contradict itself."""
    (warning,) = unresolved_stress(case(De=1), change, "dU")
    said, allowed = re.findall(r"(?:by|Above) ([\d.]+)(?= within|,)", warning)
    assert float(said) > float(allowed)
    assert float(said) == pytest.approx(change, rel=0.05)


def test_errors_within_accuracy_give_no_warning() -> None:
    assert not told()
    assert not told(SMALL)
    assert not told(LARGE, accuracy="5%")
    assert not moves_on(case(), [], 0.0)


def test_particles_near_the_ends_are_told_and_at_last_refused() -> None:
    pair = case()  # 2 D_c of tube on each side
    assert not near_ends(pair, pair.cluster, "dU")
    assert near_ends(pair, pair.tube_length - 1.8, "dU")
    problem = problem_of(pair)
    assert end_of(pair, problem, 1.0, [0.2]) is None
    ended = end_of(pair, problem, 1.0, [pair.tube_length - 0.8 - 0.9])
    assert ended is not None
    assert (ended.status, ended.reason) == ("failed", "tube_too_short")
    far = 0.1 + (pair.tube_length - 0.8 - 0.9 - 0.1) * pair.time.end  # at this pace
    assert f"--set length={math.ceil(far + 0.8 + 4)}," in str(ended.message)


@pytest.mark.parametrize(
    ("beta", "De", "ends", "short", "enough"),
    [
        (0.4, 0, "developed", 0.9, 1.1),
        (0.4, 0, "periodic", 0.9, 1.1),
        (0.4, 2, "developed", 1.4, 1.6),
        (0.4, 2, "periodic", 1.9, 2.0),
        (0.2, 2, "developed", 2.4, 2.6),
        (0.2, 2, "periodic", 3.2, 3.3),
    ],
)
def test_short_tube_gives_a_warning(beta: float, De: float, ends: str, short: float, enough: float) -> None:
    def warnings(free: float) -> list[str]:
        pair = case(beta=beta, De=De, ends=ends, length=2 * beta + 0.1 + 2 * free)
        return [*map(str, near_ends(pair, pair.cluster, "dU"))]

    (warning,) = warnings(short)
    assert ("% of the largest |dU|" in warning) == (De > 0)
    assert not warnings(enough)


def test_default_tubes_are_long_enough() -> None:
    for beta in (0.2, 0.4, 0.6):
        for ends in ({"ends": "developed", "length": "auto"}, {"ends": "periodic", "length": None}):
            pair = case(beta=beta, De=2, **ends)
            assert not near_ends(pair, pair.cluster, "dU")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("compute", "place", "ends"),
    [
        (pairsim.run, {"d0": 0.5, "time": {"end": 0.002}, "output": {"fields": False}}, "periodic"),
        (pairsim.curve, {"d": [0.5]}, "developed"),
        (pairsim.critical, {"d": [0.45, 0.5]}, "periodic"),
    ],
    ids=["run", "curve", "critical"],
)
def test_every_computation_tells_of_a_short_tube_and_of_a_De_above_all_that_were_checked(
    compute: Callable[..., pairsim.Result], place: dict[str, Any], ends: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("pairsim.computing.warnings.MOST_DE", 0.01)
    pair = {"beta": 0.4, "De": 0.02, "Ca_e": 0, "length": 2.4, "mesh": {"Np": 8, "max_size": 0.25}}
    warnings = compute(pair, ends=ends, **place).check().warnings
    assert sum("the ends affect dU" in warning for warning in warnings) == 1
    assert sum("De = 0.02 is above 0.01" in warning for warning in warnings) == 1


def test_largest_De_of_all_critical_distances_counts() -> None:
    asked = {"beta": 0.4, "De": 0.5, "Ca_e": 0.01, "d": [0.1, 0.5], "along": {"De": [0.5, 8]}}
    (warning,) = beyond_checked(parse_case(QUESTIONS["critical"], asked, "test"))
    assert "De = 8" in warning
    assert not beyond_checked(parse_case(QUESTIONS["critical"], {**asked, "along": {"De": [0.5, 2]}}, "test"))


@pytest.mark.slow
def test_a_stress_that_cells_do_not_resolve_is_told(capfd: pytest.CaptureFixture[str]) -> None:
    """At the wall of a pipe whose cells are half as large as its radius c changes by more than e^2 within a cell."""
    pipe = {"particles": 0, "De": 10, "ends": "developed", "length": 1, "mesh": {"max_size": 0.25}}
    for end, count in ((0.001, 0), (1, 1)):
        result = pairsim.run(pipe, time={"end": end}, output={"fields": False}, progress=True).check()
        assert len(result.warnings) == count
        assert ("is not resolved" in capfd.readouterr().err) == bool(count)


STEPS = {"beta": 0.4, "De": 0, "Ca_e": 0.1, "d0": 0.1, "ends": "developed", "length": 3, "mesh": {"Np": 8}}
STEPS |= {"output": {"fields": False}}


def about_steps(result: Any) -> list[str]:
    """Warnings of a result about time steps."""
    return [warning for warning in result.check().warnings if "time steps" in warning]


@pytest.mark.parametrize(
    ("setting", "warned"), [pytest.param({"tol": 3e-4}, False, marks=pytest.mark.slow), ({"fixed_step": 0.02}, True)]
)
def test_long_steps_are_reported(setting: dict[str, float], warned: bool, capfd: pytest.CaptureFixture[str]) -> None:
    assert bool(about_steps(pairsim.run(STEPS, time={"end": 0.2, **setting}, progress=True))) == warned
    assert ("time steps may cause" in capfd.readouterr().err) == warned


@pytest.mark.slow
def test_long_steps_before_a_stop_are_reported_after_it(tmp_path: Path) -> None:
    long_steps = STEPS | {"time": {"fixed_step": 0.1, "end": 0.8}}
    whole = pairsim.run(long_steps)
    pairsim.run(long_steps, time={"end": 0.2}, folder=tmp_path).check()
    resumed = pairsim.run(long_steps, folder=tmp_path, resume=True)
    assert about_steps(resumed) == about_steps(whole) != []
