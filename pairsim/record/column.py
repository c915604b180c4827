"""The declaration of a column of a table, and the names that it has for each gap or particle."""

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
"""What a column belongs to, in words, by its suffix: those of a pair, and `_i` for the number i in other tables."""
SUFFIX = "_[0-9]+|_[LT]|"


class Shown(Enum):
    """Where a column is shown to readers who have not asked for all columns."""

    ALWAYS = "always"  # in every table
    USUALLY = "usually"  # except in tables of relative velocities, in which a few columns say most
    ON_REQUEST = "on request"  # in none: it only serves to judge the numerics


@dataclass(frozen=True)
class Column:
    """A quantity in tables: with one column, one per gap, particle or mode, or one per entry of a matrix."""

    name: str
    symbol: str  # symbol of the paper (TeX); `{_}`, in a subscript `{,}`, stands for the suffix
    meaning: str  # `{_}` stands for the suffix, `{of}` for the gap or particle
    unit: Kind = PURE
    of: str = ""  # it has one column per `GAP`, `PARTICLE`, `MODE`, or `ENTRY` of a matrix; "" for a single column
    shown: Shown = Shown.USUALLY
    whole: bool = False  # whether its values are whole numbers
    unknown: bool = False  # whether a value may be unknown, nan in the file
    value: Callable[[Any], Any] | None = None  # computes it from what its question has found; None: the question does
    half_width: str = ""  # the name of the column with the half-widths of its intervals; "" if there is none

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
        """The names of its columns in tables of `n` particles; in those of a pair the leading particle comes first."""
        return [self.name + suffix for suffix in self.suffixes(n)[:: -1 if n == 2 and self.of == PARTICLE else 1]]


class Columns(Iterable[Column]):
    """The columns that a table may have; if several have the same name, the last one counts.

    Which of them a file has depends on the case.
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
        """The quantity to which a name in a header belongs, and the suffix of the name; KeyError if there is none."""
        if (alone := self._columns.get(name)) is not None and not alone.of:
            return alone, ""
        suffix = name[len(re.sub(f"({SUFFIX})$", "", name, count=1)) :]
        found = self._columns[name.removesuffix(suffix)]
        if not found.of:  # t, for instance, has a single column: t_L does not belong to it
            raise KeyError(name)
        return found, suffix

    def half_width(self, name: str) -> str:
        """The name of the column with the half-widths of a column, such as `dU_error_1` for `dU_1`; "" if none."""
        try:
            column, suffix = self._split(name)
        except KeyError:
            return ""
        return self.half_width_of(column, suffix)

    def half_width_of(self, column: Column, suffix: str) -> str:
        """The name of the column with the half-widths of a quantity for one gap or particle, "" if there is none.

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
        """The columns with a `value`, the function that computes them."""
        return Columns(each for each in self if each.value is not None)

    def own_row(self, n: int, found: Any) -> dict[str, float]:
        """The values of the columns `own` in a table of `n` particles, by name; `value` is called with `found`."""
        return table_row(n, {each: each.value(found) for each in self.own if each.value is not None})


def suffixes(of: str, n: int) -> list[str]:
    """The suffixes of the columns of all gaps, particles, modes or entries of a matrix, from upstream.

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
    """The suffixes with which a column occurs among these names, in their order."""
    pattern = re.compile(f"{column.name}({SUFFIX})")
    return [name.removeprefix(column.name) for name in names if pattern.fullmatch(name)]


def names_of(n: int, *columns: Column) -> list[str]:
    """The names of columns in tables of `n` particles; in those of a pair the leading particle comes first."""
    return [name for column in columns for name in column.named(n)]


def table_row(n: int, values: Mapping[Column, Any]) -> dict[str, float]:
    """A row of a table of `n` particles: its values by the names of its columns.

    Args:
        n: Number of particles.
        values: For each quantity its value, or a sequence of values: of the n - 1 gaps or n particles from upstream,
            of the n modes, or of the n^2 entries of a matrix, row by row.

    Raises:
        ValueError: A sequence has fewer or more values than the quantity has columns.
    """
    row: dict[str, float] = {}
    for column, value in values.items():
        entries = value if column.of else (value,)
        names = (column.name + suffix for suffix in column.suffixes(n))
        row |= {name: float(entry) for name, entry in zip(names, entries, strict=True)}
    return row
