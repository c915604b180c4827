"""The range of dU over draws of uncertain inputs, and the inputs that stand on axes in place of De or Ca_e."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from pairsim.cases.experiment import Experiment, follows_in
from pairsim.cases.quantity_text import as_given, unit_in
from pairsim.quantities.kinds import VELOCITY
from pairsim.quantities.scales import Scales
from pairsim.record.record import Record
from pairsim.record.run_entries import DRAWN
from pairsim.runtime.arrays import Array, Flags
from pairsim.solvers.curves.interpolant import hermite, slopes_of

COVERED = 0.95  # fraction of the draws of the inputs that a range holds
MANY = 1e-3  # fraction of the draws beyond an end of the atlas from which this end is named; chosen
FINE = 2000  # number of distances at which the signs of the ends of a range are examined; chosen


def quantity_for(experiment: Experiment, name: str, scales: Scales) -> tuple[str, str, Callable[[Any], Any]]:
    """The quantity from which De or Ca_e, `name`, of a case follows.

    Returns:
        Its key, its unit as given, and the function from values of the number to values of the quantity in this unit.
    """
    able = [each.quantity for each in follows_in(experiment.laws) if name in each.keys]
    of = min(able, key=lambda each: each.key not in experiment.given)
    given = experiment.given.get(of.key, of.example)
    unit = as_given(str(given[0] if isinstance(given, list) else given))[1]
    one = of.number(unit_in(of.unit, unit), scales)
    return of.key, unit, lambda values: (values / one) ** (-1.0 if of.inverse else 1.0)


@dataclass(frozen=True)
class DrawnRange:
    """The range of dU that holds most draws of the inputs, at fixed physical distances.

    It holds the fraction `COVERED` of all draws. Draws outside of the atlas count as outside of the range; if they are
    too many for that, it holds `COVERED` of the others.
    """

    d: Array  # distances [D_c], ascending, shape (n,)
    least: Array  # lower end of the range [um/s], shape (n,)
    largest: Array  # upper end of the range [um/s], shape (n,)
    outside: Array  # fraction of the draws that are outside of the atlas, shape (n,)
    beyond: str  # the ends of the atlas that many of these are beyond, such as "Ca_e above 0.1"
    missing: str  # numbers that change from draw to draw, but of which the atlas has only one value

    @classmethod
    def of(cls, record: Record) -> Self | None:
        """The range in the run.json of a curve; None if there is none."""
        if (entry := DRAWN.of(record)) is None:
            return None
        arrays = {name: np.asarray(entry[name], dtype=float) for name in ("d", "least", "largest", "outside")}
        return cls(**arrays, beyond=entry["beyond"], missing=entry["missing"])

    def _at(self, values: Array, d: Array | float) -> Array:
        x = np.log(self.d)
        return hermite(x, values, slopes_of(values, x))(np.log(d))

    def words(self, d: float) -> str:
        """The range at a distance [D_c], such as -14.0 to -9.1 um/s."""
        least, largest = (float(self._at(each, d)) for each in (self.least, self.largest))
        size = 10.0 ** (2 - math.floor(math.log10(largest - least))) if largest > least else 1e3  # 3 digits of width
        digits = max(round(math.log10(size)), 0)
        ends = math.floor(least * size) / size, math.ceil(largest * size) / size  # outwards: draws crowd at an extremum
        return f"{ends[0]:+.{digits}f} to {ends[1]:+.{digits}f} {VELOCITY.physical}"

    def outside_at(self, d: float) -> str:
        """Words on the fraction of draws outside of the atlas at a distance [D_c], and what it means; "" if it is 0."""
        part = float(np.interp(np.log(d), np.log(self.d), self.outside))
        if not part:
            return ""
        at_end = "d beyond its ends" if part > self.outside.min() + MANY else ""
        beyond = " or ".join(filter(None, (self.beyond, at_end)))
        means = (
            "count as outside this range" if part < 1 - COVERED else "are not known: the range is that of the others"
        )
        return f"{100 * part:.2g} % of the draws are outside the atlas{beyond and f', {beyond},'} and {means}"

    def holds_both_signs(self, d: Array) -> Flags:
        """Whether the range holds 0 at distances [D_c], of their shape."""
        return np.asarray((self._at(self.least, d) <= 0) & (self._at(self.largest, d) >= 0))

    def around(self, zero: float) -> tuple[float, float]:
        """The interval around a zero of dU in which zeros of the draws lie: there the range holds both signs [D_c]."""
        d = np.geomspace(self.d[0], self.d[-1], FINE)
        unsure = self.holds_both_signs(d)
        at = int(np.abs(np.log(d / zero)).argmin())
        below, above = np.flatnonzero(~unsure[:at]), np.flatnonzero(~unsure[at + 1 :])
        return float(d[below[-1] + 1] if len(below) else d[0]), float(d[at + above[0]] if len(above) else d[-1])
