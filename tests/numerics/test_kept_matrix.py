"""When Newton's matrix is kept, and when it is assembled and factorised again."""

from __future__ import annotations

import numpy as np
import pytest

from pairsim.solvers.nonlinear.renewal import KeptMatrix, MatrixPolicy


def test_a_matrix_serves_while_its_policy_says_so() -> None:
    policy = MatrixPolicy(slow=0.15, other_step=0.5, far=1e-3)
    assert not policy.serves_step(np.inf)
    assert policy.serves_step(1.5)
    assert not policy.serves_step(1.6)
    matrix = KeptMatrix(policy)
    matrix.begin_solve(1.0)
    assert matrix.due
    matrix.made(1.0)
    assert matrix.error_left(1, 1e-2) == pytest.approx(1e-2)  # the square of a step, one at most
    matrix.go_on()
    assert matrix.due
    matrix.made(1.0)
    assert matrix.error_left(2, 1e-4) == pytest.approx(1e-6)
    matrix.go_on()
    assert not matrix.due
    assert matrix.error_left(3, 1e-5) == pytest.approx(1e-5 * 0.1 / 0.9)  # a geometric series
    matrix.go_on()
    assert not matrix.due
    matrix.error_left(4, 2e-6)
    matrix.go_on()
    assert matrix.due
