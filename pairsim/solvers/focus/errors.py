"""Half-widths of the rates, and of their derivatives by the Reynolds number, from computations on larger cells."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import MeshFailure, NoSteadyState
from pairsim.solvers.focus.inertia import by_inertia
from pairsim.solvers.focus.rates import Displacement
from pairsim.solvers.steady.first_solution import coarser, try_from_other_mesh
from pairsim.solvers.steady.scene import SteadySolver

LARGER = (2**0.5, 2.0)  # factors by which cells are larger; chosen
SHARES = (1.0, 0.5)  # fraction of the difference from the rates on these cells that is taken as half-width; chosen
# Derivatives by the Reynolds number are computed on the largest cells only, and the whole difference counts; chosen.
FLOOR = 1e-3  # least half-width relative to the largest rate, as both differences may be small by chance; chosen
LEAST = 0.2  # least half-width of a rate relative to the largest one of the row, as differences may vanish; chosen
TOLERANCE = 1e-5  # of rates on larger cells, relative to the largest rate; chosen, far below `FLOOR`


@dataclass(frozen=True)
class HalfWidths:
    """Half-widths due to the cells, in the axisymmetric solution and its disturbances; infinite if they are not known.

    Attributes:
        rates: Half-widths of the rates [U_av/D_c], shape (N, N).
        by_Re: Half-widths of their derivatives with respect to the Reynolds number, shape (N, N); None if these were
            not asked for.
    """

    rates: Array
    by_Re: Array | None


def half_widths(displacement: Displacement, by_Re: Array | None = None) -> HalfWidths:
    """Half-widths of rates, and of their derivatives with respect to the Reynolds number.

    There are two larger meshes, in case one difference happens to be small; if one has no solution, the other suffices.

    Args:
        displacement: The displaced particles.
        by_Re: Derivatives of the rates with respect to the Reynolds number, shape (N, N); None if their half-widths are
            not wanted.
    """
    rates = displacement.found.rates
    differences, of_inertia = list[Array](), list[Array]()
    for factor, share in zip(LARGER, SHARES, strict=True):
        with _on_larger_cells(displacement.steady, factor) as other:
            if other is None:
                continue
            differences.append(share * np.abs(rates - other.found.rates))
            if by_Re is not None and factor == LARGER[-1] and other.found.converged:
                of_inertia.append(np.abs(by_Re - by_inertia(other).rates))
    return HalfWidths(_widths(differences, rates), None if by_Re is None else _widths(of_inertia, by_Re))


def _widths(differences: list[Array], values: Array) -> Array:
    """Half-widths of values from their differences on other meshes, of the same shape; infinite if there are none."""
    if not differences:
        return np.full(values.shape, np.inf)
    widest = np.max(differences, axis=0)
    return np.asarray(np.maximum(widest, max(LEAST * widest.max(), FLOOR * np.abs(values).max())))


@contextmanager
def _on_larger_cells(steady: SteadySolver, factor: float) -> Iterator[Displacement | None]:
    """Context with the displaced particles on cells larger by a factor; None if no solution is found there."""
    other: SteadySolver | None = None
    displacement: Displacement | None = None
    try:
        try:
            other = SteadySolver(coarser(steady.problem, factor), steady.parameters)
            if try_from_other_mesh(other, steady.parameters, steady):
                displacement = Displacement(other, TOLERANCE)
        except (MeshFailure, NoSteadyState):
            pass
        yield displacement
    finally:
        for each in (displacement, other):
            if each is not None:
                each.close()
