"""Quasi-steady solutions of short rows of equal particles, of which the model of long ones is made."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from pairsim.fem import diagnostics
from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import NoSteadyState
from pairsim.solvers.curves.branch import Branch
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.problems import SteadyProblem
from pairsim.solvers.steady.ends import Ended
from pairsim.solvers.steady.first_solution import first_scene


@dataclass(frozen=True)
class ShortRow:
    """A solution of a row of N particles.

    Attributes:
        gaps: Distances between facing surfaces from upstream [D_c], shape (N-1,).
        U: Velocities on the slow manifold [U_av], shape (N,).
        U_slopes: Derivatives of the velocities by every distance, shape (N, N-1).
        lengths: What the distance between the centres of neighbours exceeds that of their surfaces by; for a single
            particle, its length [D_c], shape (N-1,) or (1,).
        length_slopes: Their derivatives, shape (N-1, N-1).
        dU_error: Largest half-width of a relative velocity [U_av].
    """

    gaps: Array
    U: Array
    U_slopes: Array
    lengths: Array
    length_slopes: Array
    dU_error: float


def short_rows(problem: SteadyProblem, start: Parameters, places: Sequence[tuple[float, ...]]) -> Iterator[ShortRow]:
    """Solve a row at several places.

    Args:
        problem: Of all rows.
        start: Materials.
        places: Distances of each, in the order in which they are solved [D_c].

    Raises:
        NoSteadyState: There is no quasi-steady state at one of them, or it was not found.
        MeshFailure: A mesh could not be generated.
    """
    first = Parameters(places[0], start.solids, start.liquid)
    scene = first_scene(problem, first)
    if isinstance(scene, Ended):
        raise scene.failure
    branch = Branch(scene)
    try:
        for place in places:
            yield _at(branch, Parameters(place, start.solids, start.liquid))
    finally:
        branch.close()


def _at(branch: Branch, parameters: Parameters) -> ShortRow:
    point = branch.at(parameters)
    if not np.isfinite(point.dU_errors).all():
        raise NoSteadyState("the errors of a short row are not known")
    solver = branch.solver
    (h, _), gaps = solver.state(), np.array(point.gaps)
    poles = [body.outline_points(h)[[0, -1], 0] for body in solver.bodies]
    lengths = np.diff(diagnostics.centres(solver.bodies, h)) - gaps if gaps.size else -np.diff(poles[0])
    length_slopes = point.motion.centres_by_gaps - np.eye(len(gaps))
    error = float(point.dU_errors.max(initial=0.0))
    return ShortRow(gaps, point.observation.U, point.velocity_slopes, lengths, length_slopes, error)
