"""A master curve: dU as a function of the distance, however it was found, and what follows from it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from pairsim.analysis.curve_in_units import CurveInUnits, TravelInUnits
from pairsim.analysis.input_parts import InputParts, dU_by
from pairsim.analysis.input_ranges import DrawnRange
from pairsim.analysis.pair_motion import Memory, Motion
from pairsim.analysis.rows_of_points import point_row
from pairsim.analysis.travel import Travel, distance_on, travel, way_between
from pairsim.analysis.unequal_pairs import PairsThatDiffer, PairsTravel
from pairsim.analysis.zeros import Zero, zeros_in
from pairsim.cases.inputs import Input
from pairsim.cases.unit_registry import as_texts, has_unit
from pairsim.quantities.kinds import VELOCITY
from pairsim.quantities.scales import Scales
from pairsim.record.column import Columns
from pairsim.record.columns import (
    BRIDGE,
    BY_DIFFERENCE,
    CREEP,
    CURVE_COLUMNS,
    D_ERROR,
    DISTANCE,
    DU,
    DU_DISCRETE,
    DU_ERROR,
    DU_HALF,
    DU_HELD,
    DU_INPUTS,
    DU_SPREAD,
    EQUILIBRIA_COLUMNS,
    SEPARATE,
    SLOPE,
    STABLE,
)
from pairsim.record.record import Record
from pairsim.record.table import Table
from pairsim.record.table_files import read_table
from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import Argument, InputError
from pairsim.solvers.curves.arrest import arrested
from pairsim.solvers.curves.interpolant import NEGLIGIBLE_DU, CurveInterpolant, Peak, Region

if TYPE_CHECKING:
    from pairsim.solvers.curves.point import Point

CLOSE = 1e-9  # relative difference of distances that is rounding; chosen


class Curve:
    """dU as a function of the distance: a cubic Hermite interpolant over log d, with an interval.

    Its points are those of curve.csv in ascending distance. Gaps are named by the suffixes of their columns: "" of a
    pair, "_1", "_2", ... of more particles.

    Args:
        table: The columns of curve.csv, shape (points,) each; a `Table` keeps the declarations of its columns.
        equilibria: The known zeros, the columns of equilibria.csv; None: those of the interpolant.
        record: The record of the computation, which has the units and the inputs of the case.
        source: What error messages name as the place of the error.
    """

    def __init__(
        self,
        table: Mapping[str, Array],
        equilibria: Mapping[str, Array] | None = None,
        record: Record | None = None,
        source: str = "curve",
    ) -> None:
        self.table = table if isinstance(table, Table) and len(table.declared) else Table(table, CURVE_COLUMNS)
        self.record, self.source = record if record is not None else Record(), source
        self._known = None if equilibria is None else Table(equilibria, EQUILIBRIA_COLUMNS)
        self._interpolants: dict[str, CurveInterpolant | None] = {}

    @classmethod
    def of_points(cls, points: Sequence[Point]) -> Self:
        """The curve of quasi-steady solutions in ascending distance."""
        return cls(Table.of_rows(map(point_row, points)))

    @classmethod
    def read(cls, folder: Path, *, missing_ok: bool = False) -> Self:
        """The curve of a folder of results.

        Args:
            folder: The folder.
            missing_ok: Whether a folder without curve.csv has a curve without points.

        Raises:
            InputError: A table cannot be read.
        """
        table = read_table(folder / "curve.csv", missing_ok=missing_ok)
        zeros = read_table(folder / "equilibria.csv", missing_ok=True)
        return cls(table, zeros, Record.read(folder), str(folder))

    def __reduce__(self) -> Any:
        """Pickled by its points and zeros."""
        known = None if self._known is None else dict(self._known)
        return type(self), (dict(self.table), known, self.record, self.source)

    def __repr__(self) -> str:
        return f"<curve of {self.table.rows} points, {self.source}>"

    @property
    def gaps(self) -> list[str]:
        """The suffixes of the gaps, from upstream; none with a single particle."""
        return self.table.gaps

    @property
    def scales(self) -> Scales | None:
        """The units of the case; None without a `physical` block."""
        return self.record.scales

    @property
    def steady(self) -> bool:
        """Whether it is the curve of a pair in quasi-steady states, and not one of runs from rest after a time."""
        return self.table.has(DU_HELD) and self.table.has(DU)

    def named(self, source: str, record: Record | None = None) -> Curve:
        """The same curve with another name in messages and, if given, another record."""
        known = vars(self).get("equilibria", self._known)  # if they were found already
        found = Curve(self.table, known, record if record is not None else self.record, source)
        found._interpolants = self._interpolants
        return found

    def converted(self, scales: Scales | None) -> Curve:
        """The curve in um and um/s, by the scales of an experiment; unchanged without these."""
        zeros = None if self._known is None else self._known.converted(scales)
        return Curve(self.table.converted(scales), zeros, self.record, self.source)

    def interpolant(self, gap: str = "") -> CurveInterpolant | None:
        """dU of a gap over the distance; None unless there are at least two points, over a single distance.

        A curve from rest has no computed slopes: they follow from neighbouring points.
        """
        if gap not in self._interpolants:
            self._interpolants[gap] = self._interpolated(gap)
        return self._interpolants[gap]

    def _interpolated(self, gap: str) -> CurveInterpolant | None:
        table, slope = self.table, self.table.known(SLOPE, gap)
        if (slope is None and table.known(DU_HALF, gap) is None) or table.rows < 2:
            return None
        d, dU, error = table[table.varied(gap)], table.of(DU, gap), table.of(DU_ERROR, gap)
        discrete, zero = table.known(DU_DISCRETE, gap), np.zeros_like(d)
        discrete, slope = (zero if each is None else each for each in (discrete, slope))
        if np.abs(dU).max() < NEGLIGIBLE_DU:  # slopes are known to the tolerance of a solve, which exceeds this
            slope = zero
        return CurveInterpolant(*(np.asarray(each, dtype=float) for each in (d, dU, discrete, slope, error)))

    def of(self, gap: int = 1) -> CurveInterpolant:
        """The interpolant of a gap by its number, counted from upstream.

        Raises:
            InputError: There is no such gap, or no curve over a single distance.
        """
        found = self.interpolant(self.gaps[gap - 1]) if 0 < gap <= len(self.gaps) else None
        if found is None:
            allowed = "must be a gap of a curve with at least two points over a single distance"
            raise InputError("curve", "gap", gap, allowed)
        return found

    def __call__(self, d: Any, gap: int = 1) -> tuple[Any, Any]:
        """The interpolated dU, and the half-width of its interval, by the errors at the points and between them.

        Args:
            d: Distance or array of distances of any shape: numbers [D_c], texts with a unit such as "5um", or
                quantities of pint.
            gap: Number of the gap, counted from upstream.

        Returns:
            dU and its half-width [U_av]: numbers if `d` is one, else arrays of the shape of `d`. Quantities of pint
            where the distances have a unit.

        Raises:
            InputError: A distance is outside the curve, or there is no curve over a single distance.
        """
        return self.in_units(d, gap) if has_unit(as_texts(d)) else self.numbers(d, gap)

    def numbers(self, d: Any, gap: int = 1) -> tuple[Any, Any]:
        """dU and its half-width at distances, always as numbers [U_av]."""
        found, places = self.of(gap), self.places(d, gap)
        values = found.values(places), found.half_widths(places)
        return (float(values[0]), float(values[1])) if places.ndim == 0 else values

    def places(self, d: Any, gap: int = 1) -> Array:
        """Distances of any shape on the curve of a gap [D_c], which are given as for a call.

        Raises:
            InputError: One is outside the curve, or there is no curve over a single distance.
        """
        found, places = self.of(gap), np.asarray(as_texts(d))
        if places.dtype.kind == "U":
            lengths = [distance_on(found, str(each), "d", self.scales, "curve") for each in places.flat]
            places = np.reshape(lengths, places.shape)
        places = places.astype(float)
        low, high = found.d[[0, -1]]
        outside = places[~((places >= low) & (places <= high))]
        if outside.size:
            allowed = f"must be from {low:g} to {high:g}, the ends of the curve"
            raise InputError("curve", "d", float(outside.flat[0]), allowed)
        return places

    @property
    def in_units(self) -> CurveInUnits:
        """The same curve, which answers with quantities of pint, also its peak and its zeros.

        Raises:
            InputError: The case has no `physical` block.
        """
        return CurveInUnits(self, self.record.scales_of(self.source))

    def inputs_half_width(self, d: Any) -> Any:
        """The half-width of dU due to those of the inputs: to first order, at fixed physical distances.

        It is no part of the half-width that a call returns; inputs are taken to be independent.

        Args:
            d: Distances as for a call.

        Returns:
            Half-widths in the form of a call; 0 if no input has one, infinite if the effect of one is not known.

        Raises:
            InputError: A distance is outside the curve, or there is no curve over a single distance.
        """
        if has_unit(as_texts(d)):
            return self.in_units.inputs_half_width(d)
        found = self.by_inputs.half_widths(self.places(d))
        return float(found) if found.ndim == 0 else found

    def distance(self, given: Any, argument: str = "d") -> float:
        """A distance on the curve [D_c]: a number [D_c], a text with a unit such as "5um", or a quantity of pint.

        Raises:
            InputError: It is neither a number nor a length, the case has no units, or it is outside the curve; the
                message names the argument.
        """
        return distance_on(self.of(), given, argument, self.scales, self.source)

    def at(self, places: Sequence[Any]) -> Table:
        """The columns d, dU and dU_error at any distances, each given as for `distance`.

        Where inputs have half-widths with known effects, a column dU_inputs follows; where particles differ, the
        standard deviation of dU among pairs, and the fraction of them that separates.

        Raises:
            InputError: It is no curve over a single distance, or a distance is outside of it.
        """
        found: dict[str, Array] = {}
        for gap in self.gaps:
            if (curve := self.interpolant(gap)) is None:
                break
            d = np.array([distance_on(curve, each, "at", self.scales, self.source) for each in places])
            error = DU_ERROR.with_suffix(gap).name
            found |= {self.table.varied(gap).name: d, DU.name + gap: curve.values(d), error: curve.half_widths(d)}
        if not found:
            allowed = "goes with a curve of at least two points over a single distance"
            raise InputError(self.source, Argument("at"), None, allowed)
        if self.by_inputs.known:
            found[DU_INPUTS.name] = self.by_inputs.half_widths(found[DISTANCE.name])
        if self.unequal is not None:
            d = found[DISTANCE.name]
            found |= {DU_SPREAD.name: self.unequal.deviations(d), SEPARATE.name: self.unequal.separate(d)}
        return Table(found, Columns(self.table.declared, DU_INPUTS, DU_SPREAD, SEPARATE))

    def peak_of(self, gap: str) -> Peak:
        """The largest |dU| of a gap: that of its interpolant or, without one, of its points."""
        if (curve := self.interpolant(gap)) is not None:
            return curve.peak
        d, dU, error = self.table[self.table.varied(gap)], self.table.of(DU, gap), self.table.of(DU_ERROR, gap)
        largest = int(np.argmax(np.abs(dU)))
        return Peak(float(d[largest]), float(dU[largest]), float(error[largest]), 0.0)

    @cached_property
    def peak(self) -> Peak:
        """The largest |dU|, its place, and the half-widths of both; in a row those of its first gap."""
        return self.peak_of(self.gaps[0]) if self.gaps else self.of().peak

    @cached_property
    def equilibria(self) -> Table:
        """The zeros with their half-widths, as in equilibria.csv: known ones, or those of the interpolant."""
        if self._known is not None:
            return self._known
        curve, table = self.interpolant(), self.table
        d = np.array(curve.zeros if curve is not None else [])
        slopes = table[SLOPE] if table.has(SLOPE) else np.gradient(table[DU], table[DISTANCE])
        slope = np.interp(d, table[DISTANCE], slopes)
        half = curve.half_widths(d) if curve is not None else d
        found = {DISTANCE: d, STABLE: slope < 0, SLOPE: slope, D_ERROR: half / np.abs(slope)}
        return Table({column.name: values for column, values in found.items()}, EQUILIBRIA_COLUMNS)

    @cached_property
    def zeros(self) -> list[Zero]:
        """The distances at which dU vanishes, ascending."""
        return zeros_in(self.equilibria)

    @cached_property
    def regions(self) -> list[Region]:
        """Where the pair separates, comes closer, or may do either; none if dU vanishes at every distance.

        With more than two particles it is those of the first gap.
        """
        peak, curve = self.peak, self.interpolant(self.gaps[0])
        if abs(peak.dU) < NEGLIGIBLE_DU:
            return []
        if curve is None:
            return [Region(peak.d, peak.d, int(np.sign(peak.dU)) if abs(peak.dU) > peak.error else 0)]
        return curve.regions([zero.d for zero in self.zeros])

    @cached_property
    def arrested(self) -> list[Region]:
        """The regions in which unyielded liquid holds the pair together at every point."""
        if not self.table.has(CREEP):
            return []
        d, held = self.table[DISTANCE], arrested(*(self.table[each] for each in (DU, DU_ERROR, BRIDGE, CREEP)))
        found = []
        for each in self.regions:
            here = (each.start * (1 - CLOSE) <= d) & (d <= each.stop * (1 + CLOSE))
            if not each.sign and here.any() and held[here].all():
                found.append(each)
        return found

    @cached_property
    def motion(self) -> Motion | None:
        """How the pair moves at each distance; None with fewer than two points, or if the table does not tell it."""
        curve = self.interpolant()
        return None if curve is None else Motion.of(self.table, curve)

    def memory(self, start: float) -> Memory | None:
        """How a pair that starts at a distance [D_c] forgets its start; None if the decay times are not known."""
        return None if self.motion is None else self.motion.memory(start)

    def forgotten(self, start: float) -> float | None:
        """The distance of `Memory.forgotten`, None if the decay times are not known."""
        memory = self.memory(start)
        return None if memory is None else memory.forgotten

    def travel(self, start: Any, stop: Any) -> Travel | TravelInUnits:
        """Time and length of tube in which the pair moves from one distance to another.

        Args:
            start: First distance: a number [D_c], a text with a unit such as "5um", or a quantity of pint.
            stop: Last distance.

        Returns:
            Time, length and half-widths: as numbers, or as quantities of pint where both distances have a unit.

        Raises:
            InputError: The curve is not that of a pair, a distance is outside the curve, there is a zero of dU between
                the distances or there may be one, or the pair moves in the other direction.
        """
        both = [as_texts(start), as_texts(stop)]
        return self.in_units.travel(*both) if has_unit(both) else self.travel_in_numbers(*both)

    def travel_in_numbers(self, start: float | str, stop: float | str) -> Travel:
        """The travel from one distance to another one, always as numbers [D_c, D_c/U_av]."""
        if self.motion is None:
            allowed = "must be the curve of a pair in steady states, with at least two points"
            raise InputError(self.source, "", None, allowed)
        return travel(self.motion, as_texts(start), as_texts(stop), self.source, self.scales, self.by_inputs)

    def travel_of_pairs(self, start: Any, stop: Any) -> PairsTravel | None:
        """Which pairs move from one distance to another where particles differ, and within which length of tube.

        Distances are given as for `travel`. None where all particles are equal.

        Raises:
            InputError: A distance is outside the curve.
        """
        if self.unequal is None or self.motion is None:
            return None
        begin, end = self.distance(start, "start"), self.distance(stop, "stop")
        return self.unequal.travel(begin, end, way_between(self.motion, begin, end), self.scales)

    def interpolated(self, values: Array, d: float) -> float:
        """Values at the points of a pair, shape (points,), interpolated to a distance [D_c], linearly in log d."""
        return float(np.interp(np.log(d), np.log(self.table[DISTANCE]), values))

    @property
    def by_difference(self) -> Array | None:
        """Derivative of dU by the difference of the diameters over their mean, (points,); None where not known."""
        return self.table.known(BY_DIFFERENCE)

    def change_by(self, one: Input) -> Array | None:
        """Derivative of dU by the logarithm of an input, or by an input that is a percentage [um/s], (points,).

        It is taken at fixed physical distances. None if the input changes numbers for which there are no derivatives.
        """
        change = dU_by(self.table, one)
        return None if change is None else VELOCITY.factor(self.scales) * change

    @cached_property
    def by_inputs(self) -> InputParts:
        """What the half-widths of the inputs change, at fixed physical distances [U_av]."""
        return InputParts.of(self.table, self.record.inputs)

    @cached_property
    def unequal(self) -> PairsThatDiffer | None:
        """Pairs of particles that differ; None if all are equal, or if no effect of their differences is known."""
        return PairsThatDiffer.of(self.table, self.interpolant() if self.steady else None, self.record)

    @cached_property
    def drawn(self) -> DrawnRange | None:
        """The range of dU over draws of the inputs; None but for answers of an atlas whose inputs have half-widths."""
        return DrawnRange.of(self.record)
