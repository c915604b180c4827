"""Goals: quantities of interest of a solution, such as dU, forces, or the shape of a particle.

A goal is declared once, here. Adjoints (`pairsim.solvers.errors.adjoints`), error estimates of quasi-steady solutions
(`pairsim.solvers.errors.estimate`) and of runs (`pairsim.solvers.errors.run_errors`), the adaptation of meshes
(`pairsim.solvers.curves.adaptation`), columns and warnings loop over goals. A new one is another `Goal`, which a
question hands to its branch. It declares its functionals, or how its values are linear combinations of those of another
goal. Its functions have names, not lambdas, so that goals can be sent from one process to another.
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
    """What the error of a goal is compared with: `accuracy` is the error relative to this."""

    LARGEST = "the largest value of all points"
    ITSELF = "the value of the same particle or gap at the same point"
    DISTANCE = "the change of dU over a critical distance, by its slope there: the error is that of the distance"


@dataclass(frozen=True)
class Functional:
    """Functionals of a solution, linearised there.

    Attributes:
        rows: Their derivatives with respect to the free unknowns, (k, n_y).
        apart: Length of tube over which the pressure drop of the flow without particles is subtracted [D_c].
    """

    rows: Array
    apart: float = 0.0


@dataclass(frozen=True)
class Goal:
    """A quantity of interest: one number, or one for each particle or gap.

    Attributes:
        name: Name of its column, from which the names of the columns of its correction and half-width follow.
        kind: Its kind of quantity.
        value: Returns its values, (k,), from a solution and the observation of it, which contains corrections where
            they are added.
        functional: Returns its functionals at a solution; None for a combination of the values of another goal.
        reading: Returns a correction of the reported values, (k,), from a better evaluation of the functionals at the
            discrete solution; None: there is none.
        beyond_ends: Returns the magnitude of what the tube beyond the ends of a scene would add to its value; None:
            nothing.
        parent: The goal of whose values it is a linear combination; None for a goal with functionals.
        combination: Returns the coefficients of the combination, (k, n), of n values of the parent.
        per: Whether it has a value for each particle or for each gap; "" for a single value.
        scale: What its error is compared with.
        observed: The attribute of an `Observation` to which its correction is added; "" if there is none.
        added: Whether the estimate of its error is added to its value where the estimate is trusted.
        left_out_counts: Whether the magnitude of an estimate that is not added counts once more in the half-width.
        of_others: Lower bound on the error of the estimate of one value, relative to the largest such error of all
            values.
        rounding: Rounding error of its values, a part of the half-width.
        second_order: Whether the half-width of a single soft particle in a liquid without a memory has a term of second
            order.
        scouted: Whether its largest value is looked for on coarse cells at other distances, as it may vanish at the
            points of a case. It must then be linear in the free unknowns.
        everywhere: Whether in general all cells become smaller for it, not only those with most of the scatter: cells
            far from the particles matter to a pressure drop, and those that do not resolve the stress to a force. An
            exception is made where one such round would not do (`AdaptiveBranch`).
        creeps: Whether it is mere creep where unyielded liquid holds particles together, so that finer cells do not
            make it more accurate.
        order: Order of convergence, in the cell size, of the cells' part of its error; 0: that of velocities.
        of_positions: Whether it depends on the positions of the material alone, which a run integrates, so that its
            error accumulates; other goals follow the instantaneous flow.
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
        """The goal with the functionals: itself, or the first ancestor."""
        return self if self.parent is None else self.parent.root

    @property
    def error_column(self) -> str:
        """Name of the column of its half-width, without the suffix of a particle or gap."""
        return self.error or f"{self.name}_error"

    def looked_for_with(self, fixed: Collection[str]) -> bool:
        """Whether its largest value is looked for at other distances; with a fixed `Np` no mesh would depend on it.

        Args:
            fixed: Settings of the mesh that a case fixes.
        """
        return self.scouted and "Np" not in fixed

    def combined(self, count: int) -> Array:
        """Coefficients of its values as combinations of the `count` functionals of its root, (k, count)."""
        if self.parent is None or self.combination is None:
            return np.eye(count)
        inner = self.parent.combined(count)
        return np.asarray(self.combination(len(inner)) @ inner)

    def functional_at(self, solution: Solution) -> Functional:
        """The functionals of its root at a solution."""
        assert self.root.functional is not None, "a goal that is not combined has functionals"
        return self.root.functional(solution)

    def linear_value(self, solution: Solution) -> Array:
        """Its values at a discrete solution, (k,), if it is linear in the free unknowns."""
        values = self.functional_at(solution).rows @ solution.y
        return np.asarray(self.combined(len(values)) @ values)

    def read_better(self, solution: Solution) -> Array | None:
        """Correction of its values by a better evaluation of a discrete solution, (k,); None: there is none."""
        if self.root.reading is None:
            return None
        values = self.root.reading(solution)
        return np.asarray(self.combined(len(values)) @ values)


def _unknowns(name: str, solution: Solution) -> Functional:
    """Functionals that are the free unknowns of a field themselves; none where a scene does not have the field."""
    own = solution.constraints.fields.get(name, np.empty(0, np.int64))
    rows = np.zeros((len(own), solution.constraints.size))
    rows[np.arange(len(own)), own] = 1.0
    return Functional(rows)


def _forces(solution: Solution) -> Functional:
    return _unknowns("F", solution)


def _velocities(solution: Solution) -> Functional:
    """Velocities of the particles: unknowns of quasi-steady scenes; in runs, mean velocities of the nodes of each one.

    Means over the nodes differ from those over the volume of a particle while its shape changes.
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
        measure: Takes an outline, and returns the measure as a function of outlines near to it.
        solution: The solution.
        alone: Whether the measure is that of a single soft particle, and there are no functionals in other scenes;
            otherwise it is that of each particle, and its derivatives are zero for rigid ones.
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
    """Derivatives of a measure with respect to the nodal coordinates of an outline, of the shape of `outline`."""
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
    """The deformation of the convex hull, for small changes that leave the same nodes on the hull."""
    from pairsim.fem.diagnostics import hull, measure, polygon

    convex = hull(polygon(outline))
    return lambda changed: measure(polygon(changed)[convex])[1]


def _polygons_of_hull(solution: Solution) -> Array:
    """Correction of the deformation for the polygons that replace the outline, by Richardson extrapolation, (k,).

    The error of a polygon falls with the square of the length of its sides.
    """
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
    """The pressure drop evaluated inside the tube, whose adjoint is smooth."""
    from pairsim.solvers.pressure_drop import InnerDrop

    drop = InnerDrop.of(solution)
    return Functional(np.asarray(solution.constraints.N.T @ drop.row)[None], drop.apart)


def _inner_pressure_drop(solution: Solution) -> Array:
    """The pressure drop evaluated inside the tube minus that at its ends."""
    from pairsim.solvers.pressure_drop import InnerDrop

    return np.array([InnerDrop.of(solution).value - solution.scene.scalar_terms.pressure_drop(solution.x)])


def _outside_pressure_drop(solution: Solution) -> float:
    """What the tube beyond the ends would add to the pressure drop."""
    from pairsim.solvers.pressure_drop import beyond_the_ends

    return beyond_the_ends(solution)


def _observed(name: str, _: Solution, observation: Observation) -> Array:
    """The values of an attribute of an observation."""
    return np.atleast_1d(getattr(observation, name))


def _differences(count: int) -> Array:
    """The coefficients of the differences of neighbours, (count - 1, count)."""
    return np.asarray(np.diff(np.eye(count), axis=0))


# Rounding error of a relative velocity [U_av]: up to 5e-15 on 24 meshes for equal rigid spheres in a Newtonian liquid,
# whose dU is 0.
ROUNDING = 1e-13
# Lower bound on the error of the estimate in one gap, relative to the largest one in any gap: the estimate of a single
# gap may vanish by chance. Chosen.
OF_OTHER_GAPS = 0.1

# Order of convergence of errors of shapes in the cell size: the errors of liquid and particle do not cancel completely,
# and the rest falls no faster. Measured on six shapes with six meshes each (docs/explanation/decisions.md).
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
"""dU where the quantity of interest is the distance at which it vanishes."""
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
# The estimate of a shape gives the size of its error, but may have the wrong sign: every particle is given the largest
# estimate of all. Without this 4 of 30 values of a soft pair (20 cells on a half-circle) were off by up to 2.4
# half-widths.
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
"""The additional pressure drop that the particles cause."""

GOALS = (U, dU, F, D, DEFORMATION, DP_PLUS)
"""The goals of every estimate; they have no values in scenes without the particles, gaps or forces they belong to."""
DECIDING = (F, dU)
"""The first of these that has values in a scene decides whether estimates are trusted there."""
DP_PLUS_IN_TIME = replace(DP_PLUS, added=False)
"""The additional pressure drop in a run, to which no estimate is added."""
IN_TIME = (dU, U, D_OF_EACH, DP_PLUS_IN_TIME)
"""The goals whose errors are estimated in runs."""
