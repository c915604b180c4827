"""Which parameter the colour of a line shows, which its style, which the panel that it lies in."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from pairsim.plots.labels import WIDE, equation, shown, symbol
from pairsim.plots.style import COLOURS, LINES, MARKERS, ORDERED
from pairsim.runtime.errors import InputError

MOST_PANELS = 6


def hashable(value: Any) -> Hashable:
    """A value of a parameter as a key of a mapping."""
    return (
        tuple(map(hashable, value)) if isinstance(value, list) else shown(value) if isinstance(value, dict) else value
    )


def is_number(value: Any) -> bool:
    """Whether it has a place on an axis."""
    return isinstance(value, int | float) and not isinstance(value, bool)


@dataclass(frozen=True)
class Encoding:
    """How the values of parameters are distinguished; a key of "" stands for nothing.

    Attributes:
        colour, line, panel: The keys.
        values: Values of each key, in ascending or the given order.
        untold: Keys that vary and are not distinguished, as there are too many.
    """

    colour: str
    line: str
    panel: str
    values: Mapping[str, tuple[Hashable, ...]]
    untold: tuple[str, ...] = ()

    @staticmethod
    def of(
        cases: Sequence[Mapping[str, Any]], keys: Sequence[str], group: str | None = None, panels: str | None = None
    ) -> Encoding:
        """Share the keys out: the first one chooses colours.

        Args:
            cases: The parameters of each case.
            keys: Those that vary.
            group: The one that chooses colours instead.
            panels: The one whose values have a panel each; by default one that styles do not suffice for.

        Raises:
            InputError: `group` or `panels` does not vary, or both are the same.
        """
        for option, wanted in (("--group", group), ("--panels", panels)):
            if wanted is not None and wanted not in keys:
                allowed = f"must be a parameter that varies: {', '.join(keys) or 'none does'}"
                raise InputError(option, "", wanted, allowed)
        if group is not None and group == panels:
            raise InputError("--panels", "", panels, "must be another parameter than that of --group")
        values = {key: _values([case.get(key) for case in cases]) for key in keys}
        rest = [key for key in keys if len(values[key]) > 1]
        first = group or next((key for key in rest if key != panels), "")
        others = sorted((key for key in rest if key != first), key=lambda key: len(values[key]))
        line = next((key for key in others if len(values[key]) <= len(LINES) and key != panels), "")
        panel = panels or next((key for key in others if key != line and len(values[key]) <= MOST_PANELS), "")
        untold = tuple(key for key in others if key not in (line, panel))
        return Encoding(first, line, panel, values, untold)

    @property
    def _many(self) -> bool:
        """Whether colours are those of a scale and not those of a legend."""
        return len(self.values.get(self.colour, ())) > len(COLOURS)

    def _scale(self) -> ScalarMappable:
        values: Any = self.values[self.colour]
        if not all(map(is_number, values)):
            return ScalarMappable(Normalize(0, len(values) - 1), ORDERED)
        low, high = min(values), max(values)
        norm = LogNorm(low, high) if low > 0 and high / low >= WIDE else Normalize(low, high)
        return ScalarMappable(norm, ORDERED)

    def _place(self, key: str, case: Mapping[str, Any]) -> int:
        return self.values[key].index(hashable(case.get(key))) if key else 0

    def colour_of(self, case: Mapping[str, Any]) -> Any:
        """Colour of a case."""
        place = self._place(self.colour, case)
        if not self._many:
            return COLOURS[place]
        value: Any = self.values[self.colour][place]
        scale = self._scale()
        return scale.cmap(scale.norm(np.asarray(value if is_number(value) else place)))

    def line_of(self, case: Mapping[str, Any]) -> Any:
        """Line style of a case."""
        return LINES[self._place(self.line, case)]

    def marker_of(self, case: Mapping[str, Any]) -> str:
        """Marker of a case's points: a dot where it shows no parameter."""
        return MARKERS[self._place(self.line, case)] if self.line else "."

    @property
    def panels(self) -> tuple[Hashable, ...]:
        """Values that have a panel each; one None without such a parameter."""
        return self.values[self.panel] if self.panel else (None,)

    def inside(self, case: Mapping[str, Any], value: Hashable) -> bool:
        """Whether a case lies in the panel of a value."""
        return not self.panel or hashable(case.get(self.panel)) == value

    def handles(self, *, lines: bool = True, points: bool = False) -> list[Line2D]:
        """Entries of the legend; what is drawn has lines, points or both."""
        plain: dict[str, Any] = {} if lines else {"linestyle": "", "marker": "o"}
        entries = []
        if self.colour and not self._many:
            for value, colour in zip(self.values[self.colour], COLOURS, strict=False):
                entries.append(Line2D([], [], color=colour, label=equation(self.colour, value), **plain))
        if self.line:
            for value, style, marker in zip(self.values[self.line], LINES, MARKERS, strict=False):
                label = equation(self.line, value)
                look: dict[str, Any] = {"linestyle": style if lines else "", "marker": marker if points else ""}
                entries.append(Line2D([], [], color="0.2", label=label, **look))
        return entries

    def bar(self, figure: Figure, axes: list[Axes]) -> None:
        """A colour bar where a legend would be too long."""
        if self._many:
            bar = figure.colorbar(self._scale(), ax=axes, label=symbol(self.colour), aspect=30)
            if not all(map(is_number, self.values[self.colour])):
                bar.set_ticks(range(len(self.values[self.colour])), labels=[str(v) for v in self.values[self.colour]])


def _values(found: list[Any]) -> tuple[Hashable, ...]:
    values = list(dict.fromkeys(map(hashable, found)))
    return tuple(sorted(values) if all(map(is_number, values)) else values)  # type: ignore[type-var]
