"""Half-widths of the rates, from the same rates on larger cells."""

from __future__ import annotations

import numpy as np

from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import MeshFailure, NoSteadyState
from pairsim.solvers.focus.rates import Disturbance, disturb
from pairsim.solvers.steady.first_solution import coarser, try_from_other_mesh
from pairsim.solvers.steady.scene import SteadySolver

LARGER = (2**0.5, 2.0)  # factors of the cells; chosen
SHARES = (1.0, 0.5)  # of the differences to the rates on them that are taken as half-width; chosen
FLOOR = 1e-3  # half-width at least, of the largest rate, as both differences may be small by chance; chosen
LEAST = 0.2  # part of the largest half-width that each rate of a row has at least, as differences may vanish; chosen


def half_widths(steady: SteadySolver, found: Disturbance) -> Array:
    """Half-widths of the rates by cells, of the axisymmetric solution and of its disturbances, shape (N, N).

    Two meshes guard against differences that happen to be small. Where one has no solution the other one has to do;
    infinite where neither has.

    Args:
        steady: The scene, at the solution.
        found: Its disturbance.
    """
    widths = list[Array]()
    for factor, share in zip(LARGER, SHARES, strict=True):
        if (rates := _rates_on_larger_cells(steady, factor)) is not None:
            widths.append(share * np.abs(found.rates - rates))
    if not widths:
        return np.full(found.rates.shape, np.inf)
    widest = np.max(widths, axis=0)
    least = max(LEAST * widest.max(), FLOOR * np.abs(found.rates).max())
    return np.asarray(np.maximum(widest, least))


def _rates_on_larger_cells(steady: SteadySolver, factor: float) -> Array | None:
    """The rates on cells larger by a factor, None where there is no solution."""
    try:
        other = SteadySolver(coarser(steady.problem, factor), steady.parameters)
    except MeshFailure:
        return None
    try:
        return disturb(other).rates if try_from_other_mesh(other, steady.parameters, steady) else None
    except NoSteadyState:
        return None
    finally:
        other.close()
