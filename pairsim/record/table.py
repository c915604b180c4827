"""A table of results: its columns as arrays, looked up by their declaration or by name."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import numpy as np

from pairsim.quantities.scales import Scales
from pairsim.record.column import Column, Columns, suffixes_in
from pairsim.record.columns import DISTANCE, DU
from pairsim.runtime.arrays import Array

NOTHING_DECLARED = Columns()
type Cell = float | str | bool | None
"""A value in a row of a table: a number (whole if it is a count), a text, a truth value, or None if it is empty."""


class Table(Mapping[str, Array]):
    """Columns of shape (rows,) by their names: `table["dU_2"]`, `table[DU]` of a pair, `table.of(DU, "_2")`.

    The gaps of a table are the suffixes of its columns of dU: "" of a pair, "_1", "_2", ... of more particles, from
    upstream.

    Args:
        columns: The arrays by name.
        declared: The columns that such a table may have, with their symbols, meanings and units.
    """

    def __init__(self, columns: Mapping[str, Array] | None = None, declared: Columns = NOTHING_DECLARED) -> None:
        self._arrays, self.declared = dict(columns or {}), declared

    @classmethod
    def of_rows(cls, rows: Iterable[Mapping[str, Cell]], declared: Columns = NOTHING_DECLARED) -> Table:
        """The table with these rows, which must all have the same names."""
        listed = list(rows)
        return cls({name: np.array([row[name] for row in listed]) for name in (listed[0] if listed else ())}, declared)

    def __getitem__(self, column: str | Column) -> Array:
        return self._arrays[column if isinstance(column, str) else column.name]

    def __contains__(self, name: object) -> bool:
        return name in self._arrays

    def __iter__(self) -> Iterator[str]:
        return iter(self._arrays)

    def __len__(self) -> int:
        return len(self._arrays)

    def __or__(self, more: Mapping[str, Array]) -> Table:
        return Table(self._arrays | dict(more), self.declared)

    def __repr__(self) -> str:
        return f"<table of {self.rows} rows: {', '.join(self)}>"

    @property
    def rows(self) -> int:
        """The number of rows."""
        return len(next(iter(self._arrays.values()), ()))

    def of(self, column: Column, suffix: str) -> Array:
        """The column of a gap or particle.

        Raises:
            KeyError: The table does not have it.
        """
        return self._arrays[column.name + suffix]

    def known(self, column: Column, suffix: str = "") -> Array | None:
        """The column of a gap or particle; None where the table does not have it."""
        return self._arrays.get(column.name + suffix)

    def has(self, column: Column, suffix: str = "") -> bool:
        """Whether the table has the column of a gap or particle."""
        return column.name + suffix in self._arrays

    def half_widths(self, column: Column, suffix: str = "") -> Array | None:
        """Half-widths of the intervals of a column; None where the table does not have them."""
        return self._arrays.get(self.declared.half_width_of(column, suffix))

    def suffixes(self, column: Column) -> list[str]:
        """The suffixes of a quantity's columns in the table, such as "_1" and "_2", in the order of the file."""
        return suffixes_in(self, column)

    def each(self, column: Column) -> dict[str, Array]:
        """The columns of all gaps or particles by their names, in the order of the file."""
        return {name: self[name] for name in (column.name + suffix for suffix in self.suffixes(column))}

    @property
    def gaps(self) -> list[str]:
        """The suffixes of the gaps, which are those of dU."""
        return self.suffixes(DU)

    def varied(self, gap: str = "") -> Column:
        """The distance over which dU of a gap is a curve: the only one that varies, or else that of the gap itself."""
        moving = [suffix for suffix in self.suffixes(DISTANCE) if np.ptp(self.of(DISTANCE, suffix)) > 0]
        return DISTANCE.with_suffix(moving[0] if len(moving) == 1 else gap)

    def where(self, wanted: Any) -> Table:
        """The table with the rows that `wanted` selects: a mask, a slice, or the numbers of rows."""
        return Table({name: values[wanted] for name, values in self.items()}, self.declared)

    def converted(self, scales: Scales | None) -> Table:
        """The table in um, s, um/s and Pa, by the scales of an experiment; unchanged if these are None."""
        factors = {name: each.unit.factor(scales) for name in self if (each := self.declared.get(name)) is not None}
        changed = {name: self[name] * factor for name, factor in factors.items() if factor != 1}
        return self | changed

    def records(self) -> list[dict[str, Cell]]:
        """Its rows, each by the names of the columns."""
        return [dict(zip(self, row, strict=True)) for row in zip(*self.values(), strict=True)]
