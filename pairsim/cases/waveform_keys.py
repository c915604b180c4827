"""The group `waveform` of a run: a flow that varies in time, in numbers or in quantities with units."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field, ValidationError, WithJsonSchema

from pairsim.cases import values
from pairsim.cases.keys import Key, Keys
from pairsim.cases.mistakes import Mistake, missing
from pairsim.cases.physical import BLOCK
from pairsim.cases.placed_keys import place_of
from pairsim.cases.quantity_text import QUANTITY, rounded, si
from pairsim.cases.yaml_file import Content
from pairsim.physics.waveform import SHAPES, Waveform, table
from pairsim.quantities.kinds import FLOW_RATE as OF_FLOW
from pairsim.quantities.kinds import TIME
from pairsim.quantities.measurable import Measurable
from pairsim.quantities.scales import Scales, mean_velocity
from pairsim.runtime.plain import Plain

GROUP = "waveform"
TABLE = "table"
PERIOD = Measurable("period", TIME, "period", "100 ms")
FLOW = Measurable("flow", OF_FLOW, "flow rate", "2 ul/min")
Shape = Literal["sine", "square", "triangle", "ramp", "table"]
OF_TIMES = "period", "times"
OF_FLOWS = "mean", "amplitude", "flows"
OF_SHAPE, OF_TABLE = ("period", "amplitude"), ("times", "flows")


def _quantity(number: Any, of: Measurable) -> Any:
    """The type of a value that is a number, or a quantity with its unit."""
    schema = {"anyOf": [{"type": "number"}, {"type": "string", "examples": [of.example]}]}
    return Annotated[number | str, WithJsonSchema(schema)]


if TYPE_CHECKING:  # their types depend on values that mypy does not know
    type Time = float | str
    type Flow = float | str
    type PastTime = float | str
else:
    Time = _quantity(values.Time, PERIOD)
    Flow = _quantity(Annotated[values.Number, Field(ge=-1e3, le=1e3)], FLOW)
    PastTime = _quantity(values.Number, PERIOD)


class WaveformOptions(Keys):
    """A flow that varies in time."""

    shape: Annotated[Shape, Key(r"\mathrm{waveform}", caption=11)] = Field(
        "sine",
        description="sine: mean + amplitude sin(2 pi t/period); square: mean + amplitude, then mean - amplitude; "
        "triangle: up from the mean, down and back; ramp: once from mean - amplitude to mean + amplitude, then "
        "constant; table: linear between times",
    )
    period: Annotated[Time | None, Key("T", r"D_c/U_{av}", caption=12)] = Field(
        None, description="period, or the duration of a ramp [D_c/U_av]; or a time with its unit"
    )
    mean: Annotated[Flow, Key(r"\bar{Q}", "U_{av}", caption=13)] = Field(
        0.0, description="mean of the flow [U_av]; or a flow rate with its unit"
    )
    amplitude: Annotated[Flow | None, Key(r"\hat{Q}", "U_{av}", caption=14)] = Field(
        None, description="largest difference from the mean [U_av]; or a flow rate with its unit"
    )
    table: str | None = Field(
        None,
        description="CSV file with a column of times and one of flow rates, such as the log of a pump, with units in "
        "the headings; it is read once: case.yaml of the results has times and flows instead",
    )
    times: tuple[PastTime, ...] = Field(
        (), max_length=values.MOST_VALUES, description="times of a table, the first of which is t = 0 [D_c/U_av]"
    )
    flows: tuple[Flow, ...] = Field(
        (), max_length=values.MOST_VALUES, description="flow at these times [U_av]; or flow rates with their units"
    )

    @property
    def _given(self) -> dict[str, tuple[Any, ...]]:
        """The values of the keys that belong to the shape, of those that are given."""
        keys = OF_TABLE if self.shape == TABLE else ("period", "mean", "amplitude")
        found = {key: getattr(self, key) for key in keys}
        return {key: each if isinstance(each, tuple) else (each,) for key, each in found.items() if each is not None}

    @property
    def _needed(self) -> tuple[str, ...]:
        """The keys that must be given with the shape."""
        return OF_TABLE if self.shape == TABLE else OF_SHAPE

    @property
    def in_units(self) -> bool:
        """Whether flows have units."""
        return any(isinstance(value, str) for key in OF_FLOWS for value in self._given.get(key, ()))

    def mistakes(self, scaled: bool) -> Iterator[Mistake]:
        """Yield the mistakes in it; `scaled` is whether the case has a `physical` block."""
        other = OF_SHAPE if self.shape == TABLE else OF_TABLE
        idle = [key for key in other if getattr(self, key) not in (None, ())]
        absent = [key for key in self._needed if getattr(self, key) in (None, ())]
        for key in absent:
            also = f", or a file in {GROUP}.table" if self.shape == TABLE else ""
            yield missing(f"{GROUP}.{key}", f"must be given with shape: {self.shape}{also}")
        for key in idle:
            yield Mistake(f"{GROUP}.{key}", getattr(self, key), f"must be left out with shape: {self.shape}")
        if absent or idle:
            return
        yield from self._check_units(scaled) or self._check_flow()

    def _check_units(self, scaled: bool) -> list[Mistake]:
        """The mistakes in units; in a table only the first one."""
        found, flows = list[Mistake](), self.in_units
        for key, given in self._given.items():
            of = PERIOD if key in OF_TIMES else FLOW
            for i, value in enumerate(given):
                place = f"{GROUP}.{key}" + (f"[{i}]" if self.shape == TABLE else "")
                if isinstance(value, str):
                    if not scaled:
                        found.append(Mistake(place, value, f"must be a number: units need the block `{BLOCK}`"))
                        continue
                    try:
                        number = _in_si(value, of)
                    except ValueError as error:
                        found.append(Mistake(place, value, str(error)))
                        continue
                    if key == "period" and number <= 0:
                        found.append(Mistake(place, value, "must be above 0"))
                elif flows and key in OF_FLOWS and value != 0:
                    found.append(Mistake(place, value, f"must be {FLOW.kind.words} with its unit, like the others"))
        return found[:1] if self.shape == TABLE else found

    def _check_flow(self) -> list[Mistake]:
        """The mistake of invalid times in a table, or of a flow that is always 0; empty if there is neither."""
        try:
            found = self._in(1.0, 1.0, _in_si)
        except ValueError as error:
            return [Mistake(f"{GROUP}.times", None, str(error))]
        if not found.largest:
            key, value = ("flows", None) if self.shape == TABLE else ("amplitude", self.amplitude)
            return [Mistake(f"{GROUP}.{key}", value, "must not be 0: the liquid would always be at rest")]
        return []

    def _in(self, flow: float, time: float, text: Any) -> Waveform:
        """The waveform, in which texts are converted by `text(value, kind of quantity)` and divided by a unit.

        These units are `flow` and `time`; numbers are taken unchanged. ValueError if a value is missing or invalid.
        """

        def number(key: str, value: Any) -> float:
            if not isinstance(value, str):
                return float(value)
            of, unit = (PERIOD, time) if key in OF_TIMES else (FLOW, flow)
            return float(text(value, of)) / unit

        numbers = {key: [number(key, each) for each in given] for key, given in self._given.items()}
        if any(key not in numbers for key in self._needed):
            raise ValueError(f"must have {' and '.join(self._needed)}")
        if self.shape == TABLE:
            return table(numbers["times"], numbers["flows"])
        return SHAPES[self.shape](*(numbers[key][0] for key in ("period", "mean", "amplitude")))

    def waveform(self, scales: Scales | None) -> Waveform:
        """The mean velocity of the liquid [U_av] over time [D_c/U_av].

        Raises:
            ValueError: The keys have mistakes.
        """
        if scales is None:
            return self._in(1.0, 1.0, _no_units)
        return self._in(scales.velocity / mean_velocity(1.0, scales.length), scales.time, _in_si)

    @property
    def mean_size(self) -> float | None:
        """The mean of |Q| over a cycle [m^3/s]; None if flows have no units, or there are mistakes."""
        if not self.in_units or any(self.mistakes(scaled=True)):
            return None
        return self._in(1.0, 1.0, _in_si).mean_size

    @classmethod
    def with_table(cls, content: Content) -> dict[str, Plain]:
        """The content of a case file, in which the table that its waveform names is replaced by times and flows.

        The path of the table is relative to the folder of the case file.

        Raises:
            ValueError: The table cannot be read, or is not one of times and flow rates.
        """
        group = content.get(GROUP)
        named = group.get(TABLE) if isinstance(group, Mapping) else None
        if not isinstance(group, Mapping) or not isinstance(named, str):
            return dict(content)
        from pairsim.cases.pump_log import read_pump_log  # loads pandas

        place = place_of(content, f"{GROUP}.{TABLE}")
        path = Path(place.file).parent / named if place is not None else Path(named)
        try:
            times, flows = read_pump_log(path)
        except OSError as error:
            raise ValueError(f"must be a readable file: {error.strerror}") from None
        kept = {key: value for key, value in group.items() if key != TABLE}
        return {**content, GROUP: {"shape": TABLE, **kept, "times": times, "flows": flows}}

    @property
    def written(self) -> dict[str, Plain]:
        """Its keys in a resolved case."""
        return {"shape": self.shape, **{key: value[0] for key, value in self._given.items()}} | (
            {key: list(value) for key, value in self._given.items()} if self.shape == TABLE else {}
        )

    @classmethod
    def in_case(cls, case: Content) -> WaveformOptions | None:
        """The waveform of a case, valid or not; None where there is none."""
        with suppress(ValidationError):
            return cls.model_validate(case[GROUP]) if isinstance(case.get(GROUP), Mapping) else None
        return None


def _in_si(value: str, of: Measurable) -> float:
    """A quantity of either sign, or 0, in its SI unit; ValueError for others."""
    match = QUANTITY.fullmatch(value.strip())
    if match is None:
        return si(value, of)
    return rounded(float(match[1]) * si(f"1 {match[2]}", of))


def _no_units(value: str, of: Measurable) -> float:
    raise ValueError("needs the units of a physical block")
