"""Which parameter is shown by the colour of a line, which by its style, and which by the panel that it lies in."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.typing import ColorType

from pairsim.plots.labels import equation, parameter_label, symbol
from pairsim.plots.parameters import Parameters, measured
from pairsim.plots.style import COLOURS, LINES, MARKERS, ORDERED, WIDE, Look, colour_bar
from pairsim.runtime.errors import Argument, InputError

MOST_PANELS = 6
MOST_LINES = 12  # in one panel, if another key can have panels instead


def check_group(group: str | None, keys: Sequence[str]) -> None:
    """Refuse a key for the colours, if one is asked for, that is not among those that vary, by an InputError."""
    if group is not None and group not in keys:
        raise InputError(
            Argument("group"), "", group, f"must be a parameter that varies: {', '.join(keys) or 'none does'}"
        )


@dataclass(frozen=True)
class Encoding:
    """How the values of parameters are distinguished; an empty key means that none is shown in this way."""

    colour: str = ""  # key that the colour shows
    line: str = ""  # key that line style and marker show
    panel: str = ""  # key whose values have panels of their own
    values: Mapping[str, tuple[Hashable, ...]] = field(default_factory=dict)  # of each key, ascending or in order
    untold: tuple[str, ...] = ()  # keys that vary but are not distinguished, as there are too many

    @staticmethod
    def of(cases: Sequence[Parameters], keys: Sequence[str], group: str | None = None) -> Encoding:
        """Assign colours, styles and panels to keys that vary; colours show `group`, or else the key with most values.

        The next key has styles or, where one panel would have too many lines, panels.

        Raises:
            InputError: `group` does not vary.
        """
        check_group(group, keys)
        values = {key: _values(case.get(key) for case in cases) for key in keys}
        rest = [key for key in keys if len(values[key]) > 1]
        first = group or max(rest, key=lambda key: len(values[key]), default="")
        others = sorted((key for key in rest if key != first), key=lambda key: len(values[key]))
        crowded = len(cases) > MOST_LINES and len(others) == 1 and len(values[others[0]]) <= MOST_PANELS
        line = next((key for key in others if len(values[key]) <= len(LINES) and not crowded), "")
        panel = next((key for key in others if key != line and len(values[key]) <= MOST_PANELS), "")
        untold = tuple(key for key in others if key not in (line, panel))
        return Encoding(first, line, panel, values, untold)

    @cached_property
    def _scale(self) -> tuple[list[float], str, ScalarMappable] | None:
        """Places of the values on a scale of colours, their unit, and the scale; None where a legend is used."""
        values = self.values.get(self.colour, ())
        if len(values) <= len(COLOURS):
            return None
        numbers, unit = measured(values) or ([*range(len(values))], "")
        wide = min(numbers) > 0 and max(numbers) / min(numbers) >= WIDE
        return numbers, unit, ScalarMappable((LogNorm if wide else Normalize)(min(numbers), max(numbers)), ORDERED)

    def place(self, key: str, case: Parameters) -> int:
        """Index of the value that a case has for a key, such as `panel`; 0 for an empty key."""
        return self.values[key].index(case.get(key)) if key else 0

    def look(self, case: Parameters) -> Look:
        """Colour, line style and marker of a case; a dot where markers show no parameter."""
        place, style = self.place(self.colour, case), self.place(self.line, case)
        colour: ColorType = COLOURS[place % len(COLOURS)]
        if self._scale is not None:
            numbers, _, scale = self._scale
            colour = scale.to_rgba(np.array(numbers))[place]
        return {"color": colour, "linestyle": LINES[style], "marker": MARKERS[style] if self.line else "."}

    @property
    def titles(self) -> list[str]:
        """The titles of the panels; one without words where no parameter has panels."""
        return [equation(self.panel, value) for value in self.values[self.panel]] if self.panel else [""]

    def handles(self, *, lines: bool = True, points: bool = False) -> list[Line2D]:
        """Entries of the legend; what is drawn has lines, points or both."""
        looks: list[tuple[str, Look]] = []
        if self._scale is None:
            for value, colour in zip(self.values.get(self.colour, ()), COLOURS, strict=False):
                plain: Look = {"linestyle": "-"} if lines else {"linestyle": "", "marker": "o"}
                looks.append((equation(self.colour, value), {"color": colour, **plain}))
        for value, style, marker in zip(self.values.get(self.line, ()), LINES, MARKERS, strict=False):
            own: Look = {"linestyle": style if lines else "", "marker": marker if points else ""}
            looks.append((equation(self.line, value), {"color": "0.2", **own}))
        return [Line2D([], [], label=label, **look) for label, look in looks]

    def bar(self, figure: Figure, axes: list[Axes]) -> None:
        """Draw a colour bar where a legend would be too long."""
        if self._scale is not None:
            numbers, unit, scale = self._scale
            label = parameter_label(self.colour, unit) if unit else symbol(self.colour)
            bar = colour_bar(figure, scale, ax=axes, label=label, aspect=30)
            if measured(self.values[self.colour]) is None:
                bar.set_ticks(numbers, labels=[str(value) for value in self.values[self.colour]])


def _values(found: Iterable[Hashable]) -> tuple[Hashable, ...]:
    values = list(dict.fromkeys(found))
    known = measured(values)
    return tuple(values) if known is None else tuple(value for _, value in sorted(zip(known[0], values, strict=True)))
