"""Iterations of Newton's method end where they converge, and where they cannot; no scene is needed for that."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np
import pytest

from pairsim.runtime.fenicsx import PETSc
from pairsim.solvers.nonlinear.convergence import LOST, Convergence
from pairsim.solvers.nonlinear.jacobian_lagging import LaggedMatrix, MatrixPolicy

END = PETSc.SNES.ConvergedReason
TOLERANCE, MOST = 1e-6, 6


def ended(residuals: Sequence[float], steps: Sequence[float], *, steps_may_grow: bool = False) -> tuple[int, str, int]:
    """PETSc's reason, that in words, and the number of iterations, of residuals and relative steps of the velocity."""
    matrix = LaggedMatrix(MatrixPolicy())
    test = Convergence(TOLERANCE, MOST, matrix, steps_may_grow=steps_may_grow)
    matrix.begin_solve(1.0)
    code = test.test(0, residuals[0], dict)
    iteration = 0
    while code == END.ITERATING:
        matrix.made(1.0)
        iteration += 1
        code = test.test(iteration, residuals[iteration], partial(dict, u=steps[iteration - 1]))
    return code, test.reason, iteration


def test_steps_that_shrink_with_their_square_converge() -> None:
    residuals, steps = [1.0, 1e-1, 1e-2, 1e-4, 1e-8], [1e-1, 1e-2, 1e-4, 1e-8]
    assert ended(residuals, steps) == (END.CONVERGED_SNORM_RELATIVE, "converged", 4)


@pytest.mark.parametrize("residual", [np.nan, np.inf])
def test_a_residual_that_is_no_number_ends_them_at_once(residual: float) -> None:
    lost = END.DIVERGED_FUNCTION_NANORINF, "the residual is not finite"
    assert ended([residual], []) == (*lost, 0)
    assert ended([1.0, residual], [1e-2]) == (*lost, 1)


def test_a_residual_that_grows_beyond_what_ever_converged_ends_them() -> None:
    assert ended([1.0, 0.9 * LOST, 1.1 * LOST], [0.5, 0.4]) == (
        END.DIVERGED_DTOL,
        "the residual grows without bound",
        2,
    )


def test_steps_that_grow_end_them_unless_a_line_search_has_shortened_them() -> None:
    residuals, steps = [1.0] * (MOST + 1), [0.05, 0.15, 0.04, 0.02, 0.02, 0.02]
    assert ended(residuals, steps) == (END.DIVERGED_DTOL, "the steps grow", 2)
    without = END.DIVERGED_MAX_IT, f"no convergence in {MOST} iterations"
    assert ended(residuals, steps, steps_may_grow=True) == (*without, MOST)


def test_pressures_may_grow_while_velocities_do_not() -> None:
    matrix = LaggedMatrix(MatrixPolicy())
    test = Convergence(TOLERANCE, MOST, matrix)
    matrix.begin_solve(1.0)
    test.test(0, 1.0, dict)
    for iteration, pressure in ((1, 0.2), (2, 2.0)):
        matrix.made(1.0)
        assert test.test(iteration, 1.0, partial(dict, u=1e-2, p_f=pressure)) == END.ITERATING
