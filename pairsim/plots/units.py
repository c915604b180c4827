"""The units that pictures are drawn in: those of the tables, or of the experiment that a case was given by."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from pairsim.physics.scales import Scales
from pairsim.results.columns import column, known
from pairsim.results.curve_table import Zero
from pairsim.results.folder import read_record
from pairsim.results.units import LENGTH, Unit, scales_in, scales_of
from pairsim.results.xdmf import FieldFrame
from pairsim.runtime.arrays import Array


@dataclass(frozen=True)
class Units:
    """The units of a picture.

    Attributes:
        scales: Those of the experiment; None for the dimensionless units of the tables.
    """

    scales: Scales | None = None

    @staticmethod
    def of(directory: Path, physical: bool | None) -> Units:
        """The units for a folder.

        Args:
            directory: Folder of a command for one case.
            physical: Whether it is drawn in um, s, um/s and Pa; None if its case has a `physical` block.

        Raises:
            InputError: `physical` is set and the case has no such block.
        """
        record = read_record(directory)
        if physical:
            return Units(scales_of(record, str(directory)))
        return Units(scales_in(record) if physical is None else None)

    def factor(self, unit: Unit) -> float:
        """Factor from a unit of the tables to the one that is drawn."""
        return unit.factor(self.scales)

    def name(self, unit: Unit) -> str:
        """The unit that is drawn for one of the tables (TeX)."""
        if self.scales is None or not unit.physical:
            return f"${unit.tex or '-'}$"
        return unit.physical.replace("um", "µm").replace("^2", "$^2$")

    def table(self, columns: Mapping[str, Array]) -> dict[str, Array]:
        """The columns of a table in the units that are drawn."""
        factors = {name: self.factor(entry.unit) if (entry := known(name)) is not None else 1.0 for name in columns}
        return {name: values * factors[name] if factors[name] != 1 else values for name, values in columns.items()}

    def zeros(self, zeros: Iterable[Zero]) -> tuple[Zero, ...]:
        """Zeros of dU in these units."""
        f = self.factor(LENGTH)
        return tuple(replace(zero, d=f * zero.d, error=zero.error and f * zero.error) for zero in zeros)

    def frame(self, frame: FieldFrame) -> FieldFrame:
        """A frame whose coordinates are in these units; its fields are converted when they are drawn."""
        return replace(frame, points=frame.points * self.factor(LENGTH))

    def axis_label(self, names: list[str], more: str = "") -> str:
        """Axis label of some columns, which share their unit, with more words between symbols and unit."""
        entries = [column(name) for name in names]
        symbols = ", ".join(f"${entry.symbol}$" for entry in entries[:3]) + (", ..." if len(entries) > 3 else "")
        return f"{symbols}{more}  [{self.name(entries[0].unit)}]"
