"""A manufactured solution of the viscoelastic liquid on a moving mesh: orders of convergence in space and in time."""

from __future__ import annotations

import numpy as np
import pytest
from studies.manufactured.fields import Flow
from studies.manufactured.run import errors


def check(coarse: dict[str, float], fine: dict[str, float], expected: dict[str, float], bounds: list[float]) -> None:
    """Half the size: each order is at most .2 below the expected one, and the errors are below their bounds."""
    observed = {name: round(float(np.log2(coarse[name] / fine[name])), 3) for name in expected}
    assert all(observed[name] > order - 0.2 for name, order in expected.items()), observed
    assert all(fine[name] < bound for name, bound in zip(expected, bounds, strict=True)), fine


@pytest.mark.parametrize(
    ("flow", "n", "bounds"),
    [
        ("general", 4, [1.8e-4, 3.8e-3, 6e-4]),
        pytest.param("parabolic", 4, [7e-7, 1e-5, 7.5e-5], marks=pytest.mark.slow),
        pytest.param("general", 8, [2.3e-5, 9e-4, 1.1e-4], marks=pytest.mark.slow),
        pytest.param("parabolic", 8, [5e-8, 1.3e-6, 1.3e-5], marks=pytest.mark.slow),
        pytest.param("general", 16, [2.9e-6, 2.3e-4, 2e-5], marks=pytest.mark.long),
    ],
)
def test_orders_in_space(flow: Flow, n: int, bounds: list[float]) -> None:
    """u, p and s on n and 2 n cells across the radius.

    s is driven by grad u, whose error is of order two: in the general flow its order falls towards that (2.7, 2.5,
    2.3). In the parabolic flow the discrete spaces hold u and p: the error is that of s itself, of order 2.5 with SUPG.
    """
    times = list(np.linspace(0.0, 0.2, 17))
    expected = {"u": 3.0, "p": 2.0, "s": 2.0 if flow == "general" else 2.5}
    check(errors(flow, n, times), errors(flow, 2 * n, times), expected, bounds)


@pytest.mark.slow
def test_order_in_time() -> None:
    """Three in all fields, with steps that grow and shrink by 1.4 in turn."""

    def in_steps(count: int) -> dict[str, float]:
        steps = np.tile([1.0, 1.4], count // 2)
        times = 0.5 * np.concatenate([[0.0], np.cumsum(steps)]) / steps.sum()
        return errors("general", 4, list(times), discrete=True)

    check(in_steps(24), in_steps(48), {"u": 3.0, "p": 3.0, "s": 3.0}, [4.5e-8, 1.5e-6, 1.8e-6])
