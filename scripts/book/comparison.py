"""Tables of values beside their references, and the statements that they are as close to these as is allowed.

frame = pd.DataFrame({"beta": [0.2, 0.4], "U_1": [1.9468, 1.7908], "exact": [1.94677814, 1.79081169]})
table = Table(frame.set_index("beta"), [Column("U", "U_1", to="exact", allowed=1e-6, source="exact multipoles")])
table.shown()        # beta, U, reference, difference in %
table.statements()   # {"U differs by at most 0.0001 % from exact multipoles": ...}
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import inf

import numpy as np
import pandas as pd

from book import pages
from book.statements import Judged
from pairsim.quantities.text import with_error

PLUS_MINUS = "\N{NO-BREAK SPACE}±\N{NO-BREAK SPACE}"


@dataclass(frozen=True)
class Column:
    """A column of a table on a page.

    Attributes:
        name: Its heading.
        value: The column of the frame that has its values; empty for that of its name.
        error: The column of their half-widths; empty where there are none.
        to: The column of the references, or one number for all rows; empty if there are none.
        allowed: The largest difference relative to the reference, absolute where this is 0; or the column that has it.
        source: Where the references come from, in words.
        shown: Format of values without a half-width.
        plain: Whether the reference stands in the heading, without differences.
    """

    name: str
    value: str = ""
    error: str = ""
    to: str | float = ""
    allowed: str | float = inf
    source: str = ""
    shown: str = ".7g"
    plain: bool = False


@dataclass(frozen=True)
class Table:
    """A table of a page.

    Attributes:
        frame: Values, half-widths and references by the names that the columns have for them; its index has the columns
            that name the rows, if it has names.
        columns: Its columns.
    """

    frame: pd.DataFrame
    columns: Sequence[Column]

    def _of(self, name: str | float) -> pd.Series:
        """A column of the frame, or one value in all rows; NaN for an empty name."""
        if isinstance(name, str) and name:
            return self.frame[name].astype(float)
        return pd.Series(name or (0.0 if name == 0.0 else np.nan), self.frame.index, dtype=float)

    def shown(self) -> pd.DataFrame:
        """The table as on its page: values beside their references, and the differences in % of these.

        A reference that is the same in all rows is in the heading; that of the column before is not repeated.
        """
        keys = [name for name in self.frame.index.names if name]
        rows = self.frame.index.to_frame(index=False)[keys]
        parts: list[pd.DataFrame | pd.Series] = [
            rows.map(lambda key: f"{key:g}" if isinstance(key, float) else str(key))
        ]
        before = pd.Series(dtype=float)
        for column in self.columns:
            value, error, reference = (
                self._of(name).reset_index(drop=True) for name in (column.value or column.name, column.error, column.to)
            )
            cells = pd.Series([cell(*each, column.shown) for each in zip(value, error, strict=True)])
            known = reference.dropna().unique()
            if column.plain or not known.any():
                parts.append(cells.rename(f"{column.name} ({known[0]:g})" if len(known) else column.name))
                continue
            parts.append(cells.rename(column.name))
            alone = len(known) == 1 and len(rows) > 1
            if not alone and not reference.equals(before):
                parts.append(reference.map(lambda each: cell(each, 0, ".9g")).rename("reference"))
            percent = 100 * (value - reference) / reference.abs().where(reference != 0)
            percent = percent.round(8) + 0.0  # further digits are rounding, which depends on the machine
            head = f"difference from {known[0]:.9g}, %" if alone else "difference, %"
            parts.append(percent.map(lambda each: cell(each, 0, "+.2g")).rename(head))
            before = reference
        return pd.concat(parts, axis=1)

    def statements(self) -> dict[str, Judged]:
        """For each column with references and values the statement that all differences are as small as allowed."""
        found = {}
        for column in self.columns:
            reference, allowed = self._of(column.to), self._of(column.allowed)
            size = reference.abs().where(reference != 0, 1.0)
            part = ((self._of(column.value or column.name) - reference).abs() / size).dropna()
            if part.empty:
                continue
            text = f"{column.name} differs by at most {_bound(column, reference)} from {column.source}"
            margins = tuple((margin, 0.0) for margin in (allowed[part.index] - part).tolist())
            largest = f"{part.max():.2g}" if (reference == 0).all() else f"{100 * part.max():.2g} %"
            found[text] = Judged(margins, f"largest {largest}, {len(part)} value{'s' if len(part) > 1 else ''}")
        return found


def _bound(column: Column, reference: pd.Series) -> str:
    """The allowed difference as text."""
    if isinstance(column.allowed, str):
        return column.allowed
    return f"{column.allowed:g}" if (reference == 0).all() else f"{100 * column.allowed:g} %"


def cell(value: float, error: float, form: str) -> str:
    """A number, with its error if it has one; empty for NaN."""
    if error > 0:
        return with_error(value, error).replace(" +- ", PLUS_MINUS)
    text = "" if pd.isna(value) else format(value, form)
    return f"{float(text):.0f}" if "e+0" in text else text  # 2.04e+04 is 20400


def statements(tables: Mapping[str, Table]) -> dict[str, Judged]:
    """The statements of all tables, each with the name of its table before it."""
    return {f"{name}: {text}": judged for name, table in tables.items() for text, judged in table.statements().items()}


def blocks(tables: Mapping[str, Table]) -> dict[str, str]:
    """The text between the marks of the tables of a page, by their names."""
    return {name: pages.markdown(table.shown()) for name, table in tables.items()}


def stated(found: Mapping[str, Judged]) -> str:
    """Statements with their verdicts, as a table in Markdown."""
    rows = [{"statement": text, "": each.verdict, "numbers": each.numbers} for text, each in found.items()]
    return pages.markdown(pd.DataFrame(rows))
