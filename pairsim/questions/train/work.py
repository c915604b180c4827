"""The work of the parts of a computation of trains, in proportion to which progress is shown.

The unit is a quasi-steady solution of a single bead, 0.1 to 0.2 s on one core. A short row of N beads counts as N^2 of
these; the other parts were measured relative to them, for rows in a Newtonian and in two Giesekus liquids.
"""

from __future__ import annotations

from pairsim.questions.train import TrainCase
from pairsim.solvers.rows.short_rows import LEAST, MOST, TRAINS, places_of

TRANSITION = 120.0  # search for the distance at which trains change
MESHES = (20.0, 20.0, 45.0)  # growth rates on the first two meshes together, and on each of two finer ones
TRAIN = 12.0  # each of the trains to which the model of long rows is fitted
MODEL = 10.0  # fit of this model
BEAD = 0.15  # motion and half-widths of each bead of a long row
CHANGES = 0.01  # derivative of one distance of a row by another one
AUDITED = 6  # beads in the parts of the row that are solved in full to know the error of the model; chosen
MOST_PROPAGATED = 50  # largest number of beads of a row for which these derivatives are computed; chosen


def of_short_row(beads: int) -> float:
    """The work of a short row."""
    return float(beads**2)


def of_rows() -> float:
    """The work of all short rows and trains of the model of long rows."""
    rows = (of_short_row(count) * len(places_of(count, LEAST)) for count in range(1, MOST + 1))
    return sum(rows) + TRAIN * len(TRAINS)


def of_motion(beads: int) -> float:
    """The work of the motion of a long row and its half-widths, and of the fit of its model."""
    return MODEL + BEAD * beads


def of_audits(beads: int) -> float:
    """The work of the rows that are solved to know the error of the model."""
    return 2 * of_short_row(min(beads, AUDITED))


def of_case(case: TrainCase) -> float:
    """The work of a train at most; fewer meshes may be enough."""
    work = sum(MESHES) + (TRANSITION if case.train.transition is not None else 0.0)
    if not (beads := case.beads):
        return work
    changes = CHANGES * beads**2 if beads <= MOST_PROPAGATED else 0.0
    return work + of_rows() + of_motion(beads) + of_audits(beads) + changes
