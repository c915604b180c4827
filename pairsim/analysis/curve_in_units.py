"""A master curve whose distances, velocities and times are quantities of pint, such as 15 um and 6.2 um/s."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from pairsim.analysis.travel import Travel
from pairsim.analysis.zeros import Zero
from pairsim.cases.unit_registry import quantity
from pairsim.quantities.kinds import LENGTH, POSITION, TIME, VELOCITY
from pairsim.quantities.scales import Scales
from pairsim.solvers.curves.interpolant import Peak

if TYPE_CHECKING:
    from pairsim.analysis.master_curve import Curve


@dataclass(frozen=True)
class TravelInUnits:
    """Time and length of tube between two distances as quantities; as text the answer of `pairsim travel`.

    Attributes:
        numbers: The same as numbers in D_c and D_c/U_av, with the meaning of each attribute.
        scales: The units of the case.
    """

    numbers: Travel
    scales: Scales

    def __str__(self) -> str:
        return str(self.numbers)

    @property
    def start(self) -> Any:
        """First distance."""
        return quantity(LENGTH, self.numbers.start, self.scales)

    @property
    def stop(self) -> Any:
        """Last distance."""
        return quantity(LENGTH, self.numbers.stop, self.scales)

    @property
    def time(self) -> Any:
        """How long it takes."""
        return quantity(TIME, self.numbers.time, self.scales)

    @property
    def time_error(self) -> Any:
        """Half-width of the time."""
        return quantity(TIME, self.numbers.time_error, self.scales)

    @property
    def time_inputs(self) -> Any:
        """Half-width of the time due to those of the inputs; None if inputs have none, or a part is not known."""
        return quantity(TIME, self.numbers.time_inputs, self.scales)

    @property
    def length(self) -> Any:
        """How far the pair travels along the tube."""
        return quantity(POSITION, self.numbers.length, self.scales)

    @property
    def length_error(self) -> Any:
        """Half-width of the length."""
        return quantity(POSITION, self.numbers.length_error, self.scales)

    @property
    def length_inputs(self) -> Any:
        """Half-width of the length due to those of the inputs; None as for `time_inputs`."""
        return quantity(POSITION, self.numbers.length_inputs, self.scales)

    @property
    def forgotten(self) -> Any:
        """Distance from which a pair that starts at the first one follows the curve; None where it is not known."""
        return quantity(LENGTH, self.numbers.forgotten, self.scales)

    @property
    def start_error(self) -> Any:
        """By how much a start from rest may change the time; None where it is not known."""
        return quantity(TIME, self.numbers.start_error, self.scales)


@dataclass(frozen=True)
class CurveInUnits:
    """A curve that answers with quantities, whether it is asked with them or with numbers [D_c].

    Attributes:
        curve: The same in numbers.
        scales: The units of its case.
    """

    curve: Curve
    scales: Scales

    def __call__(self, d: Any, gap: int = 1) -> tuple[Any, Any]:
        """dU and the half-width of its interval, as a call of `Curve` returns them."""
        dU, half_width = self.curve.numbers(d, gap)
        return quantity(VELOCITY, dU, self.scales), quantity(VELOCITY, half_width, self.scales)

    def inputs_half_width(self, d: Any) -> Any:
        """The half-width of dU due to those of the inputs; see `Curve.inputs_half_width`."""
        return quantity(VELOCITY, self.curve.by_inputs.half_widths(self.curve.places(d)), self.scales)

    @property
    def peak(self) -> Peak:
        """The largest |dU|, its place, and the half-widths of both."""
        peak = self.curve.peak
        d, d_error = (quantity(LENGTH, each, self.scales) for each in (peak.d, peak.d_error))
        dU, error = (quantity(VELOCITY, each, self.scales) for each in (peak.dU, peak.error))
        return Peak(d, dU, error, d_error)

    @property
    def zeros(self) -> list[Zero]:
        """The distances at which dU vanishes, ascending, with their half-widths."""
        return [
            Zero(quantity(LENGTH, zero.d, self.scales), zero.stable, quantity(LENGTH, zero.error, self.scales))
            for zero in self.curve.zeros
        ]

    def travel(self, start: Any, stop: Any) -> TravelInUnits:
        """Time and length of tube between two distances."""
        return TravelInUnits(self.curve.travel_in_numbers(start, stop), self.scales)
