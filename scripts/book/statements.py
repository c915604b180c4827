"""Statements about results, judged with the errors of the numbers that they are about.

    curve = pairsim.curve("case.yaml", d=[0.05, 0.1, 0.2, 0.4])
    repels = statements.of_sign(curve, +1, low=0.1)
    repels.verdict, repels.numbers        # ("holds", "least dU from d = 0.1 to 0.4: 1.2e-04 ± 2e-06 at 0.4")

A value is a number with the half-width of its interval. A statement is a list of margins, the amounts by which its
conditions hold; they are negative where these do not.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import hypot, inf, isnan
from typing import Literal

from pairsim import CurveResult

type Value = tuple[float, float]
"""A number and the half-width of its interval."""
type Verdict = Literal["holds", "within error", "does not hold"]


@dataclass(frozen=True)
class Judged:
    """A statement and what results say of it.

    Attributes:
        margins: The amounts by which its conditions hold, each with its error; it holds if all exceed their errors.
        numbers: The numbers that were looked at, as text.
    """

    margins: tuple[Value, ...]
    numbers: str = ""

    @property
    def verdict(self) -> Verdict:
        """It holds if every margin exceeds its error, and does not if one is negative by more than its error.

        Otherwise it is within error.
        """
        if any(margin < -error for margin, error in self.margins):
            return "does not hold"
        return "within error" if any(margin <= error for margin, error in self.margins) else "holds"

    @property
    def decisive(self) -> Value:
        """The margin that decides the verdict: with it alone the verdict would be the same."""
        short = [each for each in self.margins if each[0] < -each[1]]
        return min(short, key=sum) if short else min(self.margins, key=lambda each: each[0] - each[1])

    def __and__(self, other: Judged) -> Judged:
        """The statement that both hold."""
        return Judged(self.margins + other.margins, "; ".join(filter(None, (self.numbers, other.numbers))))


def listed(values: Iterable[float], form: str = ".3g") -> str:
    """Numbers with commas between; NaN is none."""
    return ", ".join("none" if isnan(value) else f"{value:{form}}" for value in values)


def _named(name: str, values: Sequence[Value]) -> str:
    return f"{name} {listed(value for value, _ in values)}" if name else ""


def positive(values: Sequence[Value], name: str = "") -> Judged:
    """All values are positive; `name` says what they are in `numbers`."""
    return Judged(tuple(values), _named(name, values))


def negative(values: Sequence[Value], name: str = "") -> Judged:
    """All values are negative."""
    return Judged(tuple((-value, error) for value, error in values), _named(name, values))


def rising(values: Sequence[Value], name: str = "") -> Judged:
    """Each value is above the one before, such as along a parameter."""
    return Judged(tuple((b - a, e + f) for (a, e), (b, f) in pairwise(values)), _named(name, values))


def falling(values: Sequence[Value], name: str = "") -> Judged:
    """Each value is below the one before."""
    return Judged(tuple((a - b, e + f) for (a, e), (b, f) in pairwise(values)), _named(name, values))


def below(values: Sequence[Value], limit: float, name: str = "", form: str = ".3g") -> Judged:
    """The magnitudes of all values are below a limit."""
    text = f"{name} {listed((value for value, _ in values), form)}" if name else ""
    return Judged(tuple((limit - abs(value), error) for value, error in values), text)


def above(values: Sequence[Value], limit: float, name: str = "", form: str = ".3g") -> Judged:
    """All values are above a limit."""
    text = f"{name} {listed((value for value, _ in values), form)}" if name else ""
    return Judged(tuple((value - limit, error) for value, error in values), text)


def alike(values: Sequence[Value], within: float, name: str = "") -> Judged:
    """All values lie in a range of this width."""
    low, high = min(values), max(values)
    return Judged(((within - (high[0] - low[0]), high[1] + low[1]),), _named(name, values))


def ratio(value: Value, other: Value) -> Value:
    """A ratio with its error to first order, both errors independent."""
    found = value[0] / other[0]
    return found, abs(found) * hypot(value[1] / value[0], other[1] / other[0]) if value[0] else inf


def of_sign(curve: CurveResult, sign: int, low: float = 0.0, high: float = inf, least: float = 0.0) -> Judged:
    """dU of a curve is positive (sign 1) or negative (-1) at all of its points in a range of distances.

    Args:
        curve: The curve of a pair.
        sign: 1 or -1.
        low: Smallest distance [D_c].
        high: Largest distance [D_c].
        least: Least error of dU that is assumed [U_av], such as what a drawing does not show.

    Raises:
        ValueError: The curve has no points there.
    """
    table = curve.table[curve.table["d"].between(low, high)]
    columns = (table[name].tolist() for name in ("dU", "dU_error", "d"))
    points = [(sign * dU, max(error, least), d) for dU, error, d in zip(*columns, strict=True)]
    margin, error, d = min(points)
    extent = f"{table['d'].min():.3g} to {table['d'].max():.3g}"
    text = f"{'least' if sign > 0 else 'largest'} dU from d = {extent}: {sign * margin:.1e} ± {error:.0e} at {d:.3g}"
    return Judged(tuple((value, error) for value, error, _ in points), text)


def each[T](items: Iterable[T], judge: Callable[[T], Judged], label: Callable[[T], str] | None = None) -> Judged:
    """A statement about each of several items.

    Args:
        items: The items.
        judge: The statement about one of them.
        label: Returns the text before the numbers of an item. If the numbers of all items begin with the same name and
            a colon, this name is then written once, before the first label.
    """
    known = list(items)
    found = [judge(item) for item in known]
    texts, start = [one.numbers for one in found], ""
    if label is not None and any(labels := [label(item) for item in known]):
        names = {text.rpartition(": ")[0] for text in texts}
        if len(names) == 1:
            texts, start = [text.rpartition(": ")[2] for text in texts], "".join(f"{name}, " for name in names if name)
        texts = [f"{name}: {text}" if name else text for name, text in zip(labels, texts, strict=True)]
    return Judged(tuple(margin for one in found for margin in one.margins), start + "; ".join(filter(None, texts)))
