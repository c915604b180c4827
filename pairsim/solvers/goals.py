"""Goals: what is asked of a solution, such as dU, forces, or the shape of a particle.

A goal is declared once, here. Adjoints (`pairsim.solvers.errors.adjoints`), estimates of errors of quasi-steady
solutions (`pairsim.solvers.errors.estimate`) and of runs (`pairsim.solvers.errors.run_errors`), the adaptation of
meshes (`pairsim.solvers.curves.adaptation`), columns and warnings loop over goals. A new one is another `Goal`, which a
question hands to its branch. It says what its functionals are, or how its values are combined of those of another
goal. Its functions have names, by which goals go from one process to another.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass, field, replace
from enum import Enum
from functools import partial
from typing import TYPE_CHECKING, Literal

import numpy as np

from pairsim.quantities.kinds import FORCE, PURE, STRESS, VELOCITY, Kind
from pairsim.solvers.parameters import DIFFERENCE

if TYPE_CHECKING:
    from pairsim.fem.diagnostics import Observation
    from pairsim.runtime.arrays import Array
    from pairsim.solvers.solution import Solution


class Scale(Enum):
    """What the error of a goal is compared with: `accuracy` is a part of it."""

    LARGEST = "the largest value of all points"
    ITSELF = "the value of the same particle or gap at the same point"
    DISTANCE = "the change of dU over a critical distance, by its slope there: the error is that of the distance"


@dataclass(frozen=True)
class Functional:
    """Functionals of a solution, linearised.

    Attributes:
        rows: Their derivatives by the free unknowns, (k, n_y).
        apart: Length of tube over which the pressure drop of the flow without particles is subtracted [D_c].
    """

    rows: Array
    apart: float = 0.0


@dataclass(frozen=True)
class Goal:
    """A quantity that is asked for: one number, or one for each particle or gap.

    Attributes:
        name: Name of its column; those of its correction and of its half-width follow from it.
        kind: Its kind of quantity.
        value: Its values, from a solution and what is observed of it, corrected where corrections are added, (k,).
        functional: Its functionals at a solution; None if it is combined of another goal.
        reading: Correction of the reported values by a better evaluation of the functionals at the discrete solution,
            (k,); None: nothing.
        beyond_ends: Magnitude of what the tube beyond the ends of a scene would add to its value; None: nothing.
        parent: The goal of whose values it is a combination.
        combination: The coefficients of the combination of n values of the parent, (k, n).
        per: What it has a value for each of.
        scale: What its error is compared with.
        observed: The attribute of an `Observation` that its correction is added to, "" if there is none.
        added: Whether the estimate of its error is added to it where it is trusted.
        left_out_counts: Whether an estimate that is not added is counted once more in the half-width.
        of_others: Least error of the estimate in one value, as a part of the largest one in any value.
        rounding: Rounding of its values, a part of the half-width.
        second_order: Whether the half-width has a term of second order for a single soft particle in a liquid without
            modes.
        scouted: Whether it may vanish at the points that are asked for, so that coarse solutions at other distances
            tell its largest value. It is linear in the free unknowns then.
        everywhere: Whether all cells become smaller for it, never those alone that have most of the scatter: cells far
            from the particles count for a pressure drop, and those that do not resolve the stress for a force.
        creeps: Whether it is creep where unyielded liquid holds particles together, which no cells make more exact.
        order: Power of the cell size with which the cells' part of its error falls; 0: that of velocities.
        of_positions: Whether it is a function of the positions of the material alone, which a run integrates; others
            follow the flow of the moment.
        error: Name of the column of its half-width, if that is not the usual one.
    """

    name: str
    kind: Kind
    value: Callable[[Solution, Observation], Array] = field(compare=False)
    functional: Callable[[Solution], Functional] | None = field(default=None, compare=False)
    reading: Callable[[Solution], Array] | None = field(default=None, compare=False)
    beyond_ends: Callable[[Solution], float] | None = field(default=None, compare=False)
    parent: Goal | None = None
    combination: Callable[[int], Array] | None = field(default=None, compare=False)
    per: Literal["", "particle", "gap"] = ""
    scale: Scale = field(default=Scale.LARGEST, compare=False)
    observed: str = ""
    added: bool = True
    left_out_counts: bool = False
    of_others: float = 0.0
    rounding: float = 0.0
    second_order: bool = False
    scouted: bool = False
    everywhere: bool = False
    creeps: bool = False
    order: float = field(default=0.0, compare=False)
    of_positions: bool = False
    error: str = ""

    @property
    def root(self) -> Goal:
        """The goal whose functionals it has."""
        return self if self.parent is None else self.parent.root

    @property
    def error_column(self) -> str:
        """Name of the column of its half-width, without the suffix of a particle or gap."""
        return self.error or f"{self.name}_error"

    def looked_for_with(self, fixed: Collection[str]) -> bool:
        """Whether its largest value is looked for at other distances; with a fixed `Np` that would decide nothing.

        Args:
            fixed: Settings of the mesh that a case fixes.
        """
        return self.scouted and "Np" not in fixed

    def combined(self, count: int) -> Array:
        """The coefficients of its combination of the `count` functionals of its root, (k, count)."""
        if self.parent is None or self.combination is None:
            return np.eye(count)
        inner = self.parent.combined(count)
        return np.asarray(self.combination(len(inner)) @ inner)

    def functional_at(self, solution: Solution) -> Functional:
        """The functionals of its root at a solution."""
        assert self.root.functional is not None, "a goal that is not combined has functionals"
        return self.root.functional(solution)

    def linear_value(self, solution: Solution) -> Array:
        """Its values at a discrete solution, of a goal that is linear in the free unknowns, (k,)."""
        values = self.functional_at(solution).rows @ solution.y
        return np.asarray(self.combined(len(values)) @ values)

    def read_better(self, solution: Solution) -> Array | None:
        """Correction of its values by a better evaluation of a discrete solution, (k,); None: nothing."""
        if self.root.reading is None:
            return None
        values = self.root.reading(solution)
        return np.asarray(self.combined(len(values)) @ values)


def _unknowns(name: str, solution: Solution) -> Functional:
    """Functionals that are free unknowns themselves: those of a field, none where a scene does not have it."""
    own = solution.constraints.fields.get(name, np.empty(0, np.int64))
    rows = np.zeros((len(own), solution.constraints.size))
    rows[np.arange(len(own)), own] = 1.0
    return Functional(rows)


def _forces(solution: Solution) -> Functional:
    return _unknowns("F", solution)


def _velocities(solution: Solution) -> Functional:
    """Velocities of the particles: unknowns; in runs, in which each node of a soft particle has its own, their means.

    In a run the means are over the nodes, not over the volume; they differ by how fast a shape changes.
    """
    bodies, constraints = solution.scene.bodies, solution.constraints
    if solution.scene.steady:
        return _unknowns("U_p", solution)
    means = np.zeros((len(bodies), solution.scene.h_size))
    for row, body in zip(means, bodies, strict=True):
        axial = row[body.start : body.start + body.size : 2]
        axial[:] = 1 / len(axial)
    return Functional((constraints.V.T @ means.T).T)


def _of_shape(
    measure: Callable[[Array], Callable[[Array], float]], solution: Solution, *, alone: bool = True
) -> Functional:
    """A measure of the shapes of soft particles.

    Args:
        measure: Makes it, a function of the outline, for shapes near a given outline.
        solution: The solution.
        alone: Whether it is that of a particle on its own; otherwise of every particle, with no derivatives for rigid
            ones.
    """
    bodies = solution.scene.bodies
    if alone and (len(bodies) != 1 or bodies[0].phase is None):
        return Functional(np.zeros((0, solution.constraints.size)))
    by_position = np.zeros((len(bodies), solution.scene.h_size))
    for row, body in zip(by_position, bodies, strict=True):
        if body.phase is not None:
            by_node = _by_node(measure, body.outline_points(solution.h), body.outline.radius)
            for (node, component), value in np.ndenumerate(by_node):
                row[body.start + 2 * body.nodes[node] + component] = value
    return Functional(solution.g * np.asarray((solution.constraints.M.T @ by_position.T).T))


def _by_node(measure: Callable[[Array], Callable[[Array], float]], outline: Array, radius: float) -> Array:
    """Derivatives of a measure of an outline by the positions of its nodes, of the shape of the outline."""
    of_outline, step, found = measure(outline), DIFFERENCE * radius, np.empty_like(outline)
    for at, value in np.ndenumerate(outline):
        ends = []
        for change in (step, -step):
            outline[at] = value + change
            ends.append(of_outline(outline))
        outline[at] = value
        found[at] = (ends[0] - ends[1]) / (2 * step)
    return found


def _taylor_parameter(_: Array) -> Callable[[Array], float]:
    from pairsim.fem.diagnostics import taylor_parameter

    return taylor_parameter


def _deformation_of_hull(outline: Array) -> Callable[[Array], float]:
    """Deformation of the convex hull, whose points stay the same under small changes."""
    from pairsim.fem.diagnostics import hull, measure, polygon

    convex = hull(polygon(outline))
    return lambda changed: measure(polygon(changed)[convex])[1]


def _polygons_of_hull(solution: Solution) -> Array:
    """Error of the deformation by polygons, extrapolated: it falls with the square of the length of their sides."""
    from pairsim.fem.diagnostics import POINTS, hull, measure, polygon

    found = []
    for body in solution.scene.bodies if len(solution.scene.bodies) == 1 else ():
        if body.phase is not None:
            outline = body.outline_points(solution.h)
            polygons = polygon(outline), polygon(outline, points=POINTS[::2])
            fine, coarse = (measure(each[hull(each)])[1] for each in polygons)
            found.append((fine - coarse) / 3)
    return np.array(found)


def _value_of_hull(solution: Solution, _: Observation) -> Array:
    from pairsim.fem.diagnostics import contour

    return np.array([contour(solution.scene.bodies[0].outline_points(solution.h)).deformation_hull])


def _pressure_drop(solution: Solution) -> Functional:
    """The pressure drop read off inside the tube, whose adjoint is smooth."""
    from pairsim.solvers.pressure_drop import InnerDrop

    drop = InnerDrop.of(solution)
    return Functional(np.asarray(solution.constraints.N.T @ drop.row)[None], drop.apart)


def _inner_pressure_drop(solution: Solution) -> Array:
    """The pressure drop read off inside the tube, less that at its ends."""
    from pairsim.solvers.pressure_drop import InnerDrop

    return np.array([InnerDrop.of(solution).value - solution.scene.scalar_terms.pressure_drop(solution.x)])


def _outside_pressure_drop(solution: Solution) -> float:
    """What the tube beyond the ends would add to the pressure drop."""
    from pairsim.solvers.pressure_drop import beyond_the_ends

    return beyond_the_ends(solution)


def _observed(name: str, _: Solution, observation: Observation) -> Array:
    """The values of an attribute of what is observed."""
    return np.atleast_1d(getattr(observation, name))


def _differences(count: int) -> Array:
    """The coefficients of the differences of neighbours, (count - 1, count)."""
    return np.asarray(np.diff(np.eye(count), axis=0))


# Rounding of a relative velocity [U_av]: equal rigid spheres in a Newtonian liquid, whose dU is 0, have up to 5e-15 on
# 24 meshes.
ROUNDING = 1e-13
# Least part of what is left in one gap of that in another: the estimate of a single gap may vanish by chance. Chosen.
OF_OTHER_GAPS = 0.1

# Of errors of shapes in the cell size: a part of what cancels between liquid and particle is left, which falls no
# faster. Measured on six shapes with six meshes each (docs/explanation/decisions.md).
ORDER_OF_SHAPES = 2.0

U = Goal("U", VELOCITY, partial(_observed, "U"), _velocities, per="particle", observed="U", second_order=True)
"""Velocities of the particles."""
dU = Goal(
    "dU",
    VELOCITY,
    partial(_observed, "dU"),
    parent=U,
    combination=_differences,
    per="gap",
    of_others=OF_OTHER_GAPS,
    rounding=ROUNDING,
    scouted=True,
    creeps=True,
)
"""Velocities of the particles relative to their upstream neighbours."""
CRITICAL = replace(dU, scale=Scale.DISTANCE)
"""dU where it is asked for the distance at which it vanishes."""
F = Goal(
    "F",
    FORCE,
    partial(_observed, "F"),
    _forces,
    per="particle",
    scale=Scale.ITSELF,
    observed="F",
    everywhere=True,
)
"""Forces that move the particles at a prescribed velocity."""
D = Goal(
    "D",
    PURE,
    partial(_observed, "D"),
    partial(_of_shape, _taylor_parameter),
    added=False,
    left_out_counts=True,
    order=ORDER_OF_SHAPES,
    of_positions=True,
)
"""Taylor's parameter of a single soft particle."""
# An estimate of a shape tells the size of its error, and may have the wrong sign: what counts for a particle is no less
# than for the others. Without this 4 of 30 values of a soft pair (20 cells on a half-circle) were up to 2.4 half-widths
# off.
OF_OTHER_SHAPES = 1.0
D_OF_EACH = replace(
    D, functional=partial(_of_shape, _taylor_parameter, alone=False), per="particle", of_others=OF_OTHER_SHAPES
)
"""Taylor's parameters of all particles."""
DEFORMATION = Goal(
    "deformation_hull",
    PURE,
    _value_of_hull,
    partial(_of_shape, _deformation_of_hull),
    _polygons_of_hull,
    added=False,
    left_out_counts=True,
    order=ORDER_OF_SHAPES,
    error="deformation_error",
)
"""Deformation of the convex hull of a single soft particle."""
DP_PLUS = Goal(
    "dp_plus",
    STRESS,
    partial(_observed, "dp_plus"),
    _pressure_drop,
    _inner_pressure_drop,
    _outside_pressure_drop,
    observed="dp",
    left_out_counts=True,
    everywhere=True,
)
"""The pressure drop that the particles cause."""

GOALS = (U, dU, F, D, DEFORMATION, DP_PLUS)
"""The goals of every estimate; they have no values where a scene lacks what they measure."""
DECIDING = (F, dU)
"""The first of these that has values decides whether estimates are trusted."""
DP_PLUS_IN_TIME = replace(DP_PLUS, added=False)
"""The pressure drop that the particles cause in a run, which estimates are not added to."""
IN_TIME = (dU, U, D_OF_EACH, DP_PLUS_IN_TIME)
"""The goals whose errors are known in runs."""
