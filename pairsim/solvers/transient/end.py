"""Where a run is heading: the quasi-steady solution at its last distances."""

from __future__ import annotations

from pairsim.solvers.curves.branch import Branch, Point
from pairsim.solvers.problems import Problem
from pairsim.solvers.transient.start import steady_scene


def settled(problem: Problem, gaps: tuple[float, ...]) -> Point:
    """The quasi-steady solution of a run's scene on its cells.

    Args:
        problem: The problem of the run.
        gaps: Distances [D_c], N-1 values.

    Raises:
        NoSteadyState: There is none, or it was not found.
        MeshFailure: A mesh could not be generated.
    """
    steady, parameters = steady_scene(problem, gaps)
    branch = Branch(steady, parameters)
    try:
        return branch.at(parameters)
    finally:
        branch.close()
