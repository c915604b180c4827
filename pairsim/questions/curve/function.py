"""The relative velocity of a master curve as a function of the distance."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from pairsim.results.columns import suffixes_in
from pairsim.results.curve_table import curve_of
from pairsim.results.scales import scales_in
from pairsim.results.travel import distance_on
from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import InputError
from pairsim.solvers.curves.interpolant import CurveInterpolant, Peak, Region


class Curve:
    """dU as a function of the distance: a cubic Hermite interpolant over log d, with an interval.

    It is that of curve.csv, with the known zeros of a pair, and the units in run.json.
    """

    def __init__(
        self, columns: Mapping[str, Array], zeros: Sequence[float] = (), record: Mapping[str, Any] | None = None
    ) -> None:
        self._columns, self._zeros, self._record = columns, zeros, record or {}

    def of(self, gap: int = 1) -> CurveInterpolant:
        """The interpolant of a gap.

        Raises:
            InputError: There is no such gap, or no curve over a single distance.
        """
        found = curve_of(self._columns, dict(enumerate(suffixes_in(self._columns, "dU"), 1)).get(gap, f"_{gap}"))
        if found is None:
            allowed = "must be a gap of a curve with at least two points over a single distance"
            raise InputError("curve", "gap", gap, allowed)
        return found

    def __call__(self, d: Any, gap: int = 1) -> tuple[Any, Any]:
        """The interpolated dU, and the half-width of its interval: the errors at the points, and between them.

        Args:
            d: Distance or array of distances of any shape: numbers [D_c], or texts with a unit such as "5um".
            gap: Number of the gap, counted from upstream.

        Returns:
            dU and its half-width [U_av]: numbers if `d` is one, else arrays of the shape of `d`.

        Raises:
            InputError: A distance is outside the curve, or there is no curve over a single distance.
        """
        found, places = self.of(gap), np.asarray(d)
        if places.dtype.kind == "U":
            lengths = [distance_on(found, str(each), "d", scales_in(self._record), "curve") for each in places.flat]
            places = np.reshape(lengths, places.shape)
        places = places.astype(float)
        low, high = found.d[[0, -1]]
        outside = places[~((places >= low) & (places <= high))]
        if outside.size:
            allowed = f"must be from {low:g} to {high:g}, the ends of the curve"
            raise InputError("curve", "d", float(outside.flat[0]), allowed)
        values = found.values(places), found.half_widths(places)
        return (float(values[0]), float(values[1])) if places.ndim == 0 else values

    @property
    def peak(self) -> Peak:
        """The largest |dU|, its place, and the half-widths of both."""
        return self.of().peak

    @property
    def regions(self) -> list[Region]:
        """Where the pair separates, comes closer, or may do either."""
        return self.of().regions(self._zeros)
