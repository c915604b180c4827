"""The units that pictures are drawn in: those of the tables, or of the experiment that a case was given by."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from pairsim.analysis.input_ranges import quantity_for
from pairsim.cases.physical import BLOCK
from pairsim.plots.labels import parameter_label
from pairsim.plots.parameters import ShownCase
from pairsim.quantities.kinds import Kind
from pairsim.quantities.scales import Scales
from pairsim.record.column import Column
from pairsim.record.record import scales_for
from pairsim.runtime.arrays import Array


@dataclass(frozen=True)
class Units:
    """The units of a picture: those of an experiment; without scales the dimensionless ones of the tables."""

    scales: Scales | None = None

    @staticmethod
    def of(directory: Path, physical: bool | None) -> Units:
        """The units for the folder of a case; arguments and errors are those of `scales_for`."""
        return Units.of_all([directory], physical)[0]

    @staticmethod
    def of_all(directories: Sequence[Path], physical: bool | None) -> list[Units]:
        """The units for each of several folders in one picture, dimensionless if one of them is."""
        found = scales_for(directories, physical)
        return [Units(each) for each in found] or [Units()] * len(directories)

    def factor(self, unit: Kind) -> float:
        """Factor from a unit of the tables to the one that is drawn."""
        return unit.factor(self.scales)

    def name(self, unit: Kind) -> str:
        """The unit that is drawn for one of the tables (TeX)."""
        if self.scales is None or not unit.physical:
            return f"${unit.tex or '-'}$"
        return unit.physical.replace("um", "µm").replace("^2", "$^2$")

    def followed(self, case: ShownCase, number: Column, values: Array) -> tuple[str, Array]:
        """Axis label and values of a parameter; in an experiment those of the quantity from which it follows."""
        if self.scales is None or case.experiment is None:
            return self.axis_label([number]), values
        key, unit, value_of = quantity_for(case.experiment, number.name, self.scales)
        return parameter_label(f"{BLOCK}.{key}", unit), value_of(values)

    def axis_label(self, columns: Sequence[Column], more: str = "") -> str:
        """Axis label of some columns, which share their unit, with more words between symbols and unit."""
        symbols = ", ".join(f"${each.symbol}$" for each in columns[:3]) + (", ..." if len(columns) > 3 else "")
        return f"{symbols}{more}  [{self.name(columns[0].unit)}]"
