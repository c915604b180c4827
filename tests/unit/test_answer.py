"""The answer of results in words."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from pairsim.results.answer import Zero, advice, answer_of_critical, answer_of_curve, answer_of_run, with_error
from pairsim.runtime.errors import (
    MeshFailure,
    NewtonFailure,
    NoSteadyState,
    RunFailure,
    TooManySteps,
    WallTime,
    WriteFailure,
)

NUMBERS = {
    (1.567e-3, 4e-6): "(1.567 +- 0.004)e-3",
    (1.567e-3, 1.26e-5): "(1.567 +- 0.013)e-3",
    (0.25023, 0.0081): "0.250 +- 0.008",
    (-1.7e-3, 2e-3): "(-2 +- 2)e-3",
    (1e-5, 3e-4): "(0 +- 3)e-4",
    (12.3456, 0.0961): "12.35 +- 0.10",
    (0.25, None): "0.25",
    (0.25, 0.0): "0.25",
}


@pytest.mark.parametrize(("number", "text"), NUMBERS.items())
def test_a_number_has_the_digits_that_its_error_leaves(number: tuple[float, float | None], text: str) -> None:
    assert with_error(*number) == text


def series(d: list[float], dU: list[float], **more: list[float]) -> dict[str, np.ndarray]:
    t = np.linspace(0.1, 1.0, len(d))
    return {"t": t, **{name: np.array(values) for name, values in {"d": d, "dU": dU, **more}.items()}}


@pytest.mark.parametrize(
    ("d", "dU", "words"),
    [
        ([0.1, 0.12], [1e-2, 2e-2], "The pair separates: from d = 0.1 "),
        ([0.12, 0.1], [-1e-2, -2e-2], "The pair comes closer: "),
        ([0.1, 0.09], [-1e-2, 2e-2], "separates in the end, after moving the other way"),
        ([0.1, 0.12], [1e-2, 1e-12], "rests: dU vanishes within its error"),
    ],
)
def test_a_run_separates_comes_closer_or_rests(d: list[float], dU: list[float], words: str) -> None:
    assert words in answer_of_run(series(d, dU), {"reason": "end"})[0]


def test_a_run_that_ends_in_contact_collides() -> None:
    assert answer_of_run(series([0.1, 0.004], [-1e-2, -1e-2]), {"reason": "contact"})[0].startswith("The pair collides")


def test_a_run_whose_dU_is_below_its_error_has_no_sign() -> None:
    lines = answer_of_run(series([0.1, 0.1], [1e-4, 1e-4], dU_error=[2e-4, 2e-4]), {})
    assert "rests: dU vanishes within its error" in lines[0]
    assert "dU = (+1 +- 2)e-4" in lines[0]


def test_every_gap_of_three_particles_has_its_line() -> None:
    table = {"t": np.array([1.0]), "d_1": np.array([0.1]), "d_2": np.array([0.2])}
    table |= {"dU_1": np.array([1e-2]), "dU_2": np.array([-1e-2]), "D_1": np.array([0.01])}
    lines = answer_of_run(table, {})
    assert [line.split(":")[0] for line in lines] == [
        "Gap 1 separates",
        "Gap 2 comes closer",
        "Taylor parameters at the end",
    ]


@pytest.mark.parametrize(
    ("dU", "zeros", "words"),
    [
        ([-1e-3, 1e-3], [Zero(0.2, False, 0.01)], "comes closer between d = 0.1 and 0.2, separates between"),
        ([1e-3, -1e-3], [Zero(0.2, True)], "separates between d = 0.1 and 0.2, comes closer between"),
        ([1e-3, 2e-3], [], "The pair separates between d = 0.1 and 0.3."),
        ([1e-12, -1e-12], [], "keeps its distance: dU vanishes"),
    ],
)
def test_a_curve_has_regions(dU: list[float], zeros: list[Zero], words: str) -> None:
    table = {"d": np.array([0.1, 0.3]), "dU": np.array(dU), "mesh_error": np.array([1e-5, 1e-5])}
    lines = answer_of_curve(table, zeros, {})
    assert words in lines[0]
    assert all(str(zero) in lines[0] for zero in zeros)


def test_a_case_in_units_has_its_answer_in_units() -> None:
    """D_c 50 um and U_av 10 mm/s: 5 ms, and 10 um/s for dU = 1e-3."""
    record = {"scales": {"length": 50e-6, "velocity": 10e-3, "time": 5e-3}}
    lines = answer_of_run(series([0.1, 0.12], [1e-3, 1.5e-3], dU_error=[1e-5, 1e-5]), record)
    assert lines[1] == "In physical units: from d = 5 um to 6 um in 0.005 s, dU = +15.00 +- 0.10 um/s at the end."
    table = {"d": np.array([0.1, 0.3]), "dU": np.array([-1e-3, 0.5e-3]), "dU_error": np.array([1e-6, 1e-6])}
    lines = answer_of_curve(table, [Zero(0.2, False, 0.01)], record)
    assert lines[1] == "In physical units: it keeps its distance at d = 10.0 +- 0.5 um."
    assert lines[3] == "In physical units: -10.000 +- 0.010 um/s at d = 5 um."
    assert "d = 0.1 to 0.2 (5 to 10 um): " in answer_of_critical([Zero(0.1, False), Zero(0.2, False)], record)[0]


def test_critical_distances_by_kind() -> None:
    lines = answer_of_critical([Zero(0.1, False), Zero(0.2, False), Zero(0.3, True)], {"ends": [{"message": "edge"}]})
    assert lines[0].startswith("2 unstable critical distances, d = 0.1 to 0.2")
    assert lines[1].startswith("1 stable critical distance, d = 0.3")
    assert lines[2] == "A branch ends: edge."
    assert "keeps its sign" in answer_of_critical([], {})[0]


@pytest.mark.parametrize("kind", ["run", "curve", "critical"])
def test_nobody_is_told_to_repeat_what_fails_in_the_same_way(kind: str) -> None:
    """Only a case that is not at fault may succeed when it is repeated."""
    out = Path("out")
    for failure in (
        NoSteadyState("no solution was found", advice="a larger mesh.Np"),
        MeshFailure("a cell of the new mesh is inverted", advice="a larger mesh.Np"),
        NewtonFailure("no convergence", t=0.1, step=3, advice="a larger mesh.Np"),
    ):
        told = advice(kind, "failed", failure.reason, str(failure), out, True)
        assert "try a larger mesh.Np; unchanged, the case fails in the same way" in told
        assert not re.search("--overwrite|--resume", told)
    folded = advice(kind, "failed", NoSteadyState.reason, "the branch has a fold at Ca_e = 0.15", out, True)
    assert folded.startswith("Next: unchanged, the case fails in the same way")
    again = "--resume out" if kind == "run" else "--overwrite"
    full = WriteFailure("No space left on device", advice="freeing disk space, then the same command")
    assert again in advice(kind, "failed", full.reason, str(full), out, True)
    assert again in advice(kind, "failed", "environment", "no C compiler", out, True)
    assert again in advice(kind, "interrupted", "interrupted", "SIGINT", out, True)


@pytest.mark.parametrize("limit", [WallTime, TooManySteps])
def test_run_that_meets_a_limit_goes_on_with_a_larger_one(limit: type[RunFailure]) -> None:
    """With the same limit it would end at once."""
    told = advice("run", "failed", limit.reason, str(limit("reached")), Path("out"), True)
    assert f"--resume out --set limits.{limit.reason}=..." in told
