"""How a pair moves once the start-up of its run has decayed, from run.json, and whether it has decayed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pairsim.analysis.pair_motion import FORGOTTEN
from pairsim.record.record import Record
from pairsim.record.run_entries import SETTLED

NOTHING = 1e-9  # |dU| of particles that keep their distance [U_av]; chosen


@dataclass(frozen=True)
class Settled:
    """The quasi-steady motion of one gap at the last distances of a run."""

    dU: float  # relative velocity once the start-up has decayed [U_av]
    error: float  # half-width of its interval
    t_relax: float  # slowest decay time of a disturbance [D_c/U_av]
    from_rest: bool  # whether the run started from rest
    accuracy: float  # error wanted, as a part of |dU|
    creeps: bool = False  # whether disturbances decay only by creep of unyielded liquid, set by its regularisation
    arrested: bool = False  # whether unyielded liquid holds the particles together

    @staticmethod
    def of(record: Record, gap: int) -> Settled | None:
        """The entry of run.json for a gap, counted from 0; None if there is no quasi-steady solution."""
        entry = SETTLED.of(record) or {}
        if "dU" not in entry:
            return None
        from_rest, accuracy = entry["start"] == "rest", entry["accuracy"]
        of_yielding = entry.get("creeps", False), entry.get("held_together", False)
        return Settled(entry["dU"][gap], entry["dU_error"][gap], entry["t_relax"], from_rest, accuracy, *of_yielding)

    def own(self, error: float | None) -> float:
        """Half-width of dU at the end of a run [U_av]: `error`, or without it that of dU here, on the same cells."""
        return max(self.error, self.accuracy * abs(self.dU)) if error is None else error

    def allowed(self, error: float | None) -> float:
        """Largest difference from dU of a run that the half-widths of both explain [U_av]; `error` as in `own`."""
        return max(self.error + self.own(error), NOTHING)

    def decayed(self, t: float, dU: float, error: float | None) -> bool:
        """Whether the start-up has decayed at the end of a run.

        Args:
            t: Time [D_c/U_av].
            dU: Relative velocity then [U_av].
            error: Half-width of its interval, None if it was not estimated.
        """
        return t >= self.least_end and abs(dU - self.dU) <= self.allowed(error)

    @property
    def least_end(self) -> float:
        """Time before which a run from rest counts as starting up [D_c/U_av]; 0 of other runs."""
        return FORGOTTEN * self.t_relax if self.from_rest else 0.0

    def end_needed(self, t: float, dU: float, error: float | None) -> float:
        """A `time.end` at which the start-up will have decayed, to two digits; see `decayed`."""
        excess = max(abs(dU - self.dU) / self.allowed(error), 1.0)
        end = max(t + self.t_relax * np.log(2 * excess), self.least_end)
        scale = 10.0 ** (np.floor(np.log10(end)) - 1)
        return float(scale * np.ceil(end / scale))
