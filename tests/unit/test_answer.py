"""The answer of results in words."""

from __future__ import annotations

import numpy as np
import pytest

from pairsim.results.answer import Zero, answer_of_critical, answer_of_curve, with_error
from pairsim.results.run_answer import answer_of_run

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
