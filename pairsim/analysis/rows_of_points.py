"""Rows of tables of quasi-steady solutions."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from pairsim.record.column import Column, table_row
from pairsim.record.columns import (
    BRIDGE,
    CA_E,
    CORRECTED,
    CREEP,
    DE,
    DISTANCE,
    DISTORTION,
    DP,
    DP_PLUS,
    DP_PLUS_CORRECTION,
    DP_PLUS_ERROR,
    DU,
    DU_CORRECTION,
    DU_DISCRETE,
    DU_ERROR,
    DU_HELD,
    ENDS_ERROR,
    F_CORRECTION,
    F_ERROR,
    FROM_REST,
    MESHES,
    NEWTON,
    PLUG,
    REGULARISATION_ERROR,
    SENSITIVITIES,
    SLOPE,
    STRETCH,
    T_RELAX,
    TAYLOR,
    TAYLOR_ERROR,
    U_CORRECTION,
    U_ERROR,
    F,
    U,
    observed,
)
from pairsim.solvers import goals

if TYPE_CHECKING:
    from pairsim.runtime.arrays import Array
    from pairsim.solvers.curves.point import Point
    from pairsim.solvers.steady.ends import Passed


CORRECTIONS = {goals.dU: DU_CORRECTION, goals.U: U_CORRECTION, goals.F: F_CORRECTION, goals.DP_PLUS: DP_PLUS_CORRECTION}
"""The columns of the corrections of goals; other goals have none, or columns of their questions."""
HALF_WIDTHS = {
    goals.dU: DU_ERROR,
    goals.U: U_ERROR,
    goals.F: F_ERROR,
    goals.DP_PLUS: DP_PLUS_ERROR,
    goals.D: TAYLOR_ERROR,
}
"""The columns of the half-widths of goals; other goals have columns of their questions."""


def point_row(point: Point) -> dict[str, float]:
    """All values of a quasi-steady solution by the names of their columns."""
    o, estimate = point.observation, point.estimate
    values: dict[Column, Any] = {
        DISTANCE: point.gaps,
        U: o.U,
        DU: o.dU,
        TAYLOR: o.D,
        DP: o.dp,
        DP_PLUS: o.dp_plus,
        NEWTON: point.newton,
        DU_HELD: point.held_dUs,
        STRETCH: point.motion.stretch,
        FROM_REST: point.motion.from_rest,
        DU_DISCRETE: point.discrete.dU,
        F: o.F,
        ENDS_ERROR: estimate[goals.dU].ends_error,
        REGULARISATION_ERROR: estimate[goals.dU].regularisation_error,
        BRIDGE: point.unyielded.bridge,
        CREEP: point.unyielded.creep,
        PLUG: point.unyielded.plug,
        SLOPE: point.slopes,
        **{SENSITIVITIES[name]: change for name, change in point.sensitivities.items()},
        **{column: _of_column(column, estimate[goal].correction) for goal, column in CORRECTIONS.items()},
        **{column: _of_column(column, estimate[goal].half_width) for goal, column in HALF_WIDTHS.items()},
        DU_ERROR: point.dU_errors,
        CORRECTED: estimate.trusted,
        T_RELAX: point.t_relax if np.isfinite(point.t_relax) else np.nan,
        MESHES: point.meshes,
        **observed(o),
        DISTORTION: point.distortion,
    }
    return table_row(
        o.U.size, {column: value for column, value in values.items() if value is not None and np.size(value)}
    )


def _of_column(column: Column, values: Array) -> Array | float:
    """The values of a goal as those of a column: an array where it has a value for each particle or gap."""
    return values if column.of else float(values[0])


def way_row(passed: Passed) -> dict[str, float]:
    """The values of a solution on the way to those wanted; velocities are those at held distances."""
    place, velocities = passed.parameters, passed.U
    parameters = {DE: place.De, CA_E: max(place.Ca_es, default=0.0), DISTANCE: place.gaps}
    return table_row(len(velocities), {**parameters, U: velocities, DU: np.diff(velocities), TAYLOR: passed.D})
