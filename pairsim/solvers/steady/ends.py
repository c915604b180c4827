"""Where and why a branch of steady states ends.

Towards a fold the decay rate 1/tau_0 of the shapes (`shape_time`) tends to zero: its square is linear in the parameter,
and vanishes at the fold. On a compressed surface short waves become neutrally stable, at a stretch that does not depend
on their length (`pairsim.fem.surface`). Both are seen in the last solutions before a continuation stops; no solution
beyond the end is needed.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from types import MappingProxyType

import numpy as np

from pairsim.fem.diagnostics import taylor_parameter
from pairsim.fem.surface import UNSTABLE, least_compression
from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import BranchEnd, BudgetSpent, NoSteadyState
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.steady.relaxation import shape_time
from pairsim.solvers.steady.scene import Snapshot, SteadySolver

LAST = 4  # number of solutions before the end from which it is estimated; chosen
SLOWED_DOWN = 0.6  # largest ratio of the last one of their decay rates to the fastest one before a fold; chosen
FARTHEST_FOLD = 3.0  # largest distance of a fold from the last solution, over the largest step between these; chosen
# Compression at which waves as long as the cells were found to be neutral, relative to that of an ideal surface.
MARGIN = 1.25


@dataclass(frozen=True)
class EstimatedEnd:
    """The end of a branch of steady states, as estimated from the last solutions of a continuation.

    Attributes:
        kind: "fold", or "wrinkles" where the surface of a particle is compressed too much.
        at: Its place, as a fraction of the way from the start of the continuation to the target.
        error: Error of this place.
    """

    kind: str
    at: float
    error: float


@dataclass(frozen=True)
class Passed:
    """A solution that a continuation has passed.

    Attributes:
        parameters: Its parameters.
        U: Velocities of the particles at held distances [U_av], shape (N,).
        D: Taylor parameters, shape (N,).
    """

    parameters: Parameters
    U: Array
    D: Array

    @classmethod
    def of(cls, steady: SteadySolver) -> Passed:
        """The present solution of a scene."""
        h, _ = steady.state()
        shapes = [taylor_parameter(body.outline_points(h)) for body in steady.bodies]
        return cls(steady.parameters, steady.y[steady.constraints.fields["U_p"]], np.array(shapes))


@dataclass(frozen=True)
class Ended:
    """The outcome of a continuation that has stopped before the target.

    Attributes:
        failure: The reason, as an error that is raised where a solution is needed (`arrived`).
        kind: What ends the branch, "fold" or "wrinkles"; empty where no end was found.
        on_mesh: Parameters at the end by name, each with its error, on the mesh at hand; empty where no end was found.
        at: The same with errors that include the differences between meshes.
        way: The solutions passed, in order.
        last: The scene at the last of them, which may be closed; None where there is none.
    """

    failure: NoSteadyState
    kind: str = ""
    on_mesh: Mapping[str, tuple[float, float]] = MappingProxyType({})
    at: Mapping[str, tuple[float, float]] = MappingProxyType({})
    way: Sequence[Passed] = ()
    last: SteadySolver | None = None

    @property
    def proven(self) -> bool:
        """Whether the branch certainly ends before the target, whatever the mesh."""
        return isinstance(self.failure, BranchEnd)


def arrived[T](found: T | Ended) -> T:
    """The result of a continuation, if it has reached its target.

    Raises:
        NoSteadyState: It has stopped before; this is the `failure` of an `Ended`.
    """
    if isinstance(found, Ended):
        raise found.failure
    return found


class SpentOnTheWay(BudgetSpent):
    """The time given to a command is over before a continuation has reached its target.

    Attributes:
        way: The solutions passed, in order.
    """

    way: Sequence[Passed] = ()


def end_after(steady: SteadySolver, trail: Sequence[tuple[float, Snapshot]]) -> EstimatedEnd | None:
    """The end of the branch, estimated from the last solutions; None if they do not approach one.

    Args:
        steady: The scene; it is left at the last solution.
        trail: The last solutions of a continuation that has stopped, in order, each with its place as a fraction of the
            way to the target.
    """
    rates = []
    for tau, snapshot in trail:
        steady.recall(snapshot)
        try:
            rates.append((tau, 1 / shape_time(steady.linearise())[0]))
        except NoSteadyState:  # the matrix is singular there
            rates.append((tau, 0.0))
    tau, step = rates[-1][0], max((b[0] - a[0] for a, b in pairwise(rates)), default=0.0)
    fold = _fold(rates)
    if fold is not None and fold[0] - tau < FARTHEST_FOLD * step:
        return EstimatedEnd("fold", *fold)
    if least_compression(steady.bodies, steady.state()[0]) < MARGIN * UNSTABLE:
        return EstimatedEnd("wrinkles", tau, step)
    return None


def _fold(rates: Sequence[tuple[float, float]]) -> tuple[float, float] | None:
    """Place at which the extrapolated square of decay rates vanishes, and its error; None if rates do not fall enough.

    Args:
        rates: Places, as fractions of the way, and decay rates there [U_av/D_c], in order.
    """
    tau, rate = np.array(rates).T
    if len(rates) < 3 or rate[-1] > SLOWED_DOWN * rate.max() or rate[-1] > rate[-2]:
        return None
    places = []
    for count in (2, 3):
        slope, value = np.polyfit(tau[-count:] - tau[-1], rate[-count:] ** 2, 1)
        places.append(tau[-1] - value / slope if slope < 0 else np.inf)
    found = max(float(min(places)), float(tau[-1]))
    spread = abs(places[0] - places[1])
    spread = spread if np.isfinite(spread) else tau[-1] - tau[-2]
    return found, float(spread + found - tau[-1])
