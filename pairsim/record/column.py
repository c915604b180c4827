"""What a column of a table is, and the names of the columns of every gap or particle."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from enum import Enum
from typing import Any

from pairsim.quantities.kinds import PURE, Kind

GAP, PARTICLE, MODE, ENTRY = "gap", "particle", "mode", "entry"
WORDS: dict[str, dict[str, str]] = {
    "": {"": ""},
    GAP: {"": "the pair", "_i": "particles i and i+1"},
    PARTICLE: {
        "_L": "the leading (downstream) particle",
        "_T": "the trailing (upstream) particle",
        "_i": "particle i (counted from upstream)",
    },
    MODE: {"_i": "mode i (the one that grows most, or decays most slowly, is the first)"},
    ENTRY: {"_i": "particle i, the first digit, per displacement of particle j, the second one (from upstream)"},
}
"""What there are columns of by their suffixes: those of a pair, and `_i` in larger rows."""
SUFFIX = "_[0-9]+|_[LT]|"


class Shown(Enum):
    """Where a column is shown to readers who have not asked for all columns."""

    ALWAYS = "always"  # in every table
    USUALLY = "usually"  # but in tables of relative velocities, which say most by a few columns
    ON_REQUEST = "on request"  # nowhere: it is of interest to whoever judges the numerics


@dataclass(frozen=True)
class Column:
    """A quantity in tables: with one column, one for each gap, particle or mode, or one for each two particles."""

    name: str
    symbol: str  # symbol of the paper (TeX); `{_}`, in a subscript `{,}`, stands for the suffix
    meaning: str  # `{_}` stands for the suffix, `{of}` for the gap or particle
    unit: Kind = PURE
    of: str = ""  # what it has a column for each of: `GAP`, `PARTICLE`, `MODE`, or `ENTRY` of a matrix of particles
    shown: Shown = Shown.USUALLY
    whole: bool = False  # whether its values are whole numbers
    unknown: bool = False  # whether a value may be unknown, nan in the file
    value: Callable[[Any], Any] | None = None  # makes it of what the computation of its question has found
    half_width: str = ""  # the name of the column of the half-widths of its intervals, if there is one

    def with_suffix(self, suffix: str) -> Column:
        """The column that this quantity has for one gap or particle.

        Raises:
            KeyError: It has no column with this suffix.
        """
        number = suffix.removeprefix("_")
        subscript, words = (f"_{{{number}}}", "_i") if number.isdecimal() else (suffix, suffix)
        symbol = self.symbol.replace("{_}", subscript).replace("{,}", suffix.replace("_", ","))
        meaning = self.meaning.replace("{_}", suffix).replace("{of}", WORDS[self.of][words])
        return replace(self, name=self.name + suffix, symbol=symbol, meaning=meaning)

    def suffixes(self, n: int) -> list[str]:
        """The suffixes of its columns in tables of `n` particles, from upstream; see the function `suffixes`."""
        return suffixes(self.of, n)

    def named(self, n: int) -> list[str]:
        """The names of its columns in tables of `n` particles: of a pair, the leading one comes first."""
        return [self.name + suffix for suffix in self.suffixes(n)[:: -1 if n == 2 and self.of == PARTICLE else 1]]


class Columns(Iterable[Column]):
    """The columns that a table may have; of several with one name the last one counts.

    A file need not have all of them: which ones depends on the case.
    """

    def __init__(self, *groups: Column | Iterable[Column]) -> None:
        every = (each for group in groups for each in ([group] if isinstance(group, Column) else group))
        self._columns: Mapping[str, Column] = {each.name: each for each in every}

    def __iter__(self) -> Iterator[Column]:
        return iter(self._columns.values())

    def __len__(self) -> int:
        return len(self._columns)

    def column(self, name: str) -> Column:
        """The column of a name in a header, with its number filled in: `column("D_3").symbol == "D_{3}"`.

        Raises:
            KeyError: There is no such column.
        """
        found, suffix = self._split(name)
        return found.with_suffix(suffix)

    def _split(self, name: str) -> tuple[Column, str]:
        """The quantity that a name in a header is of, and its suffix."""
        if (alone := self._columns.get(name)) is not None and not alone.of:
            return alone, ""
        suffix = name[len(re.sub(f"({SUFFIX})$", "", name, count=1)) :]
        found = self._columns[name.removesuffix(suffix)]
        if not found.of:  # a name of its own, such as t_L, is none of t
            raise KeyError(name)
        return found, suffix

    def half_width(self, name: str) -> str:
        """The column of the half-widths of a column of this name, "" if there is none: `dU_error_1` of `dU_1`."""
        try:
            column, suffix = self._split(name)
        except KeyError:
            return ""
        return self.half_width_of(column, suffix)

    def half_width_of(self, column: Column, suffix: str) -> str:
        """The column of the half-widths of a quantity for a gap or particle, "" if there is none.

        Half-widths that all gaps or particles share have no suffix."""
        declared = self._columns.get(column.half_width)
        return column.half_width and column.half_width + (suffix if declared is None or declared.of else "")

    def get(self, name: str) -> Column | None:
        """The column of a name in a header, as `column`; None if the table does not declare it."""
        try:
            return self.column(name)
        except KeyError:
            return None

    def named(self, n: int) -> list[str]:
        """The names of all columns in tables of `n` particles, in order."""
        return names_of(n, *self)

    @property
    def own(self) -> Columns:
        """The columns whose values are functions of what the computation of their question has found."""
        return Columns(each for each in self if each.value is not None)

    def own_row(self, n: int, found: Any) -> dict[str, float]:
        """The values of the columns `own` in tables of `n` particles, by name, from what the computation has found."""
        return table_row(n, {each: each.value(found) for each in self.own if each.value is not None})


def suffixes(of: str, n: int) -> list[str]:
    """The suffixes of the columns of every gap, particle, mode or entry of a matrix, from upstream.

    Args:
        of: `GAP`, `PARTICLE`, `MODE`, `ENTRY`, or "" for a quantity with one column.
        n: Number of particles; of entries at most 9.

    Returns:
        "" for the gap of a pair, "_T" and "_L" for its particles; "_1", "_2", ... for those of other rows, and for
        modes; "_11", "_12", ... for the entries of a matrix row by row.
    """
    if not of:
        return [""]
    if of == ENTRY:
        return [f"_{i}{j}" for i in range(1, n + 1) for j in range(1, n + 1)]
    if n == 2 and of != MODE:
        return [""] if of == GAP else ["_T", "_L"]
    return [f"_{i}" for i in range(1, n + (of != GAP))]


def suffixes_in(names: Iterable[str], column: Column) -> list[str]:
    """The suffixes that the names of a column have among these names, in their order."""
    pattern = re.compile(f"{column.name}({SUFFIX})")
    return [name.removeprefix(column.name) for name in names if pattern.fullmatch(name)]


def names_of(n: int, *columns: Column) -> list[str]:
    """The names of columns in tables of `n` particles: of a pair, the leading one comes first."""
    return [name for column in columns for name in column.named(n)]


def table_row(n: int, values: Mapping[Column, Any]) -> dict[str, float]:
    """A row of a table of `n` particles by the names of its columns.

    Each column has a number, one for each of the n - 1 gaps or the n particles from upstream or the n modes, or one for
    each of the n^2 entries of a matrix, row by row.

    Raises:
        ValueError: A column has fewer or more values.
    """
    row: dict[str, float] = {}
    for column, value in values.items():
        entries = value if column.of else (value,)
        names = (column.name + suffix for suffix in column.suffixes(n))
        row |= {name: float(entry) for name, entry in zip(names, entries, strict=True)}
    return row
