"""How much work the parts of a train are, of which progress is a part.

The unit is a quasi-steady solution of a bead alone, 0.1 to 0.2 s on one core. A short row of N beads is N^2 of them;
the other parts are what they took beside these, of rows in a Newtonian and in two Giesekus liquids.
"""

from __future__ import annotations

from pairsim.questions.train import TrainCase
from pairsim.solvers.rows.short_rows import LEAST, MOST, TRAINS, places_of

TRANSITION = 120.0  # the distance at which trains change
MESHES = (20.0, 20.0, 45.0)  # growth rates on two meshes, and on each further one
TRAIN = 12.0  # of one of the trains to which the model of long rows is fitted
MODEL = 10.0  # this model
BEAD = 0.15  # motion and half-widths of a bead of a long row
CHANGES = 0.01  # how one distance of a row changes with another
AUDITED = 6  # beads of the rows on the way that are solved to know the error; chosen
MOST_PROPAGATED = 50  # beads of a row whose changes are followed; chosen


def of_short_row(beads: int) -> float:
    """The work of a short row."""
    return float(beads**2)


def of_rows() -> float:
    """The work of all short rows and trains of the model of long rows."""
    rows = (of_short_row(count) * len(places_of(count, LEAST)) for count in range(1, MOST + 1))
    return sum(rows) + TRAIN * len(TRAINS)


def of_motion(beads: int) -> float:
    """The work of the motion of a long row and its half-widths, with the model that it takes."""
    return MODEL + BEAD * beads


def of_audits(beads: int) -> float:
    """The work of the rows that are solved to know the error of the model."""
    return 2 * of_short_row(min(beads, AUDITED))


def of_case(case: TrainCase) -> float:
    """All the work of a train at most: fewer meshes may do."""
    work = sum(MESHES) + (TRANSITION if case.train.transition is not None else 0.0)
    if not (beads := case.beads):
        return work
    changes = CHANGES * beads**2 if beads <= MOST_PROPAGATED else 0.0
    return work + of_rows() + of_motion(beads) + of_audits(beads) + changes
