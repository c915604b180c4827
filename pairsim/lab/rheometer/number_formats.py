"""Numbers in the cells of a table: decimal and thousands marks, and what stands in place of an overload."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

NUMBER = r"(?i)[-+]?(\d+[.,]?\d*|[.,]\d+)([ed][-+]?\d+)?"
THOUSANDS = r"[-+]?[1-9]\d{0,2}[.,]\d{3}"
"""A number whose mark may be one of thousands."""
HUGE = 1e30  # above all measured values; voltmeters write 9.9e37 for an overload
FAR_ABOVE = 10.0  # ratio to the rows around it above which 9999 is an overload, not a value; chosen


@dataclass(frozen=True)
class Marks:
    """The marks in the numbers of a table."""

    decimal: str
    certain: bool  # whether a number shows that the decimal mark is no thousands mark

    @property
    def thousands(self) -> str:
        """Pattern of numbers with thousands marks; they must have decimals, too, unless the decimal mark is certain."""
        other = "," if self.decimal == "." else "."
        return rf"\d{{1,3}}([ '{other}]\d{{3}})+(\{self.decimal}\d+){'?' if self.certain else ''}"


def marks_of(cells: Sequence[str], separator: str) -> tuple[Marks, str]:
    """The marks of a table, and what is wrong if its commas may be decimal or thousands marks ("" if nothing is)."""
    numbers = [cell for cell in cells if re.fullmatch(NUMBER, cell)]
    with_mark = {mark: [cell for cell in numbers if mark in cell] for mark in ",."}
    of_thousands = {mark: all(re.fullmatch(THOUSANDS, cell) for cell in each) for mark, each in with_mark.items()}
    decimal = "," if len(with_mark[","]) > len(with_mark["."]) else "."
    if all(with_mark.values()) and of_thousands[","] != of_thousands["."]:  # as in 0,5 beside 1.500
        decimal = "." if of_thousands[","] else ","
    certain = not of_thousands[decimal]
    doubt = ""
    if decimal == "," and not certain and separator != ";" and (commas := with_mark[","]):
        doubt = f"has {commas[0]}, whose comma may mark decimals or thousands; export it with decimal points"
    return Marks(decimal, certain), doubt


def numbers_in(cells: pd.Series[str], marks: Marks) -> pd.Series[float]:
    """Cells as numbers; NaN where there is none, or where the instrument was overloaded.

    Raises:
        ValueError: The marks may separate thousands: the column has numbers such as 1.500 and 950, and goes up and
            down.
    """
    other = "," if marks.decimal == "." else "."
    plain = cells.where(~cells.str.fullmatch(marks.thousands), cells.str.replace(rf"[ '{other}]", "", regex=True))
    plain = plain.where(plain.str.fullmatch(NUMBER)).str.translate(str.maketrans(marks.decimal + other + "dD", ".?ee"))
    numbers: pd.Series[float] = pd.to_numeric(plain, errors="coerce").astype(float)
    marked = cells[numbers.notna() & cells.str.contains(marks.decimal, regex=False)]
    steps = np.diff(numbers.dropna())
    mixed = marked.str.fullmatch(THOUSANDS).all() and cells.str.fullmatch(r"\d{3}").any()
    if len(marked) and mixed and (steps > 0).any() and (steps < 0).any():
        raise ValueError(
            f"has {marked.iloc[0]}, whose mark may be that of decimals or thousands; export it without thousands marks"
        )
    return numbers.where(~_overloads(cells, numbers))


def _overloads(cells: pd.Series[str], numbers: pd.Series[float]) -> pd.Series[bool]:
    """Whether numbers stand for an overload: they are huge, or consist of nines and are far above the rows around."""
    digits = cells.str.replace(r"(?i)e.*|[.,]0*$", "", regex=True).str.replace(r"\D", "", regex=True)
    nines = digits.str.fullmatch("9{4,}")
    around = numbers.where(~nines)
    most = np.fmax(around.ffill(), around.bfill())
    return (numbers.abs() > HUGE) | (nines & (numbers > FAR_ABOVE * most))
