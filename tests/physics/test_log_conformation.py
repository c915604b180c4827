"""Functions of the log-conformation in UFL at single values: formulas, and the series that replace them near zero."""

from __future__ import annotations

import numpy as np
import pytest
import ufl
from scipy.linalg import expm

from pairsim.physics.kinematics import Expr
from pairsim.physics.log_conformation import SMALL, LogConformation


def at(y: float) -> LogConformation:
    """s with half the square of its deviator y, a mean and a hoop component."""
    x = np.sqrt(y)
    return LogConformation.of(ufl.as_vector([0.3 + 0.6 * x, 0.8 * x, 0.3 - 0.6 * x, -0.2]))


def array(block: Expr) -> np.ndarray:
    return np.array([[float(block[i, j]) for j in range(2)] for i in range(2)])


@pytest.mark.parametrize("y", [0.0, 1e-6, 0.2 * SMALL, 0.999 * SMALL, 1.001 * SMALL, 1.0, 9.0])
@pytest.mark.parametrize("sign", [1, -1])
def test_exponential_is_that_of_matrices(y: float, sign: int) -> None:
    s = at(y)
    block, hoop = s.exp(sign)
    assert array(block) == pytest.approx(expm(sign * array(s.block)), rel=1e-11)
    assert float(hoop) == pytest.approx(np.exp(-0.2 * sign), rel=1e-14)


@pytest.mark.parametrize("y", [1e-3, 0.2 * SMALL, 0.999 * SMALL, 1.001 * SMALL, 1.0, 9.0])
def test_stretch_factor_is_its_formula(y: float) -> None:
    x = np.sqrt(y)
    assert float(at(y).y) == pytest.approx(y, rel=1e-14)
    assert float(at(y).stretch_factor) == pytest.approx((x / np.tanh(x) - 1) / y, rel=1e-11)


def test_stretch_factor_without_deviator_is_a_third() -> None:
    assert float(at(0.0).stretch_factor) == pytest.approx(1 / 3, rel=1e-15)
