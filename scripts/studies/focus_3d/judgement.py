"""The three-dimensional results, extrapolated to the axis, beside those of `pairsim focus`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import pandas as pd
from book import pages
from book.case_parts import complete
from book.comparison import cell
from book.statements import Judged, below
from book.study import Part

from studies.focus_3d.cases import SMALL

WITHIN = {"U": 0.1, "rotation": 0.1, "drag": 0.2, "torque": 0.2, "V": 2.0, "limit": 2.0}
"""Allowed differences, % of the value: errors by the tetrahedra."""
ZERO = 1e-9
"""Largest velocity that is 0 by reversibility [U_av/D_c]."""
NAMES = {
    "U": "U",
    "rotation": "rotation/x",
    "drag": r"lateral drag over $6\pi\eta_0 a$",
    "torque": r"torque over $8\pi\eta_0 a^3$",
    "V": "V/x",
    "limit": "V/(De x) by the reciprocal theorem",
}
FORMS = {"U": ".5f", "rotation": ".4f", "drag": ".4f", "torque": ".4f", "V": ".5f", "limit": ".4f"}


class Line(NamedTuple):
    """A quantity in three dimensions and by `pairsim focus`."""

    De: float
    quantity: str
    at: dict[float, float]  # by displacement
    limit: float  # towards the axis; NaN from one displacement
    axis: float
    half_width: float

    @property
    def percent(self) -> float:
        """The difference in % of the value."""
        return 100 * (self.limit / self.axis - 1)


def lines(results: pd.DataFrame) -> Iterator[Line]:
    """All quantities at all De; errors by cells are odd in x, so that what is extrapolated is linear in x^2."""
    space, axis = (results[results["kind"] == kind] for kind in ("3D", "axis"))
    axis = axis.set_index("De")
    De: Any
    for De, rows in space.groupby("De"):
        wanted = ("V", "U", "rotation", "drag", "torque") if De == 0 else ("limit",) if De == SMALL else ("V", "U")
        if De not in axis.index:
            continue
        for name in (each for each in wanted if rows.get(each) is not None and rows[each].notna().any()):
            at = dict(sorted(zip(rows["x"].tolist(), rows[name].tolist(), strict=True), reverse=True))
            limit = float("nan")
            if len(at) == 2:
                (x, far), (y, near) = at.items()
                limit = (near * x**2 - far * y**2) / (x**2 - y**2)
            here: Any = axis.loc[De]
            known = here["V"] / De if name == "limit" else here[name]
            error = here["error"] / (De if name == "limit" else 1.0) if name in ("V", "limit") else 0.0
            yield Line(float(De), name, at, limit, float(known), float(error))


def statements(results: pd.DataFrame, parts: Sequence[Part]) -> dict[str, Judged]:
    """That velocities agree within the half-widths of `pairsim focus` and the errors by the tetrahedra."""
    found = list(lines(results))
    zeros = [(x, 0.0) for line in found if line.De == 0 and line.quantity == "V" for x in line.at.values()]
    stated = {"a bead in a Newtonian liquid keeps its distance from the axis": below(zeros, ZERO, "V/x", ".0e")}
    for name, within in WITHIN.items():
        own = [line for line in found if line.quantity == name and line.limit == line.limit and line.De + (name != "V")]
        percent = [(line.percent, 100 * line.half_width / abs(line.axis)) for line in own]
        margins = tuple((within + error - abs(value), 0.0) for value, error in percent)
        if margins:
            text = f"{NAMES[name]} differs by at most {within:g} % and the half-width of `pairsim focus`"
            stated[text] = Judged(margins, ", ".join(f"{value:+.2g} %" for value, _ in percent))
    return stated | complete(results, parts)


def blocks(results: pd.DataFrame, parts: Sequence[Part]) -> dict[str, str]:
    """The table of the page."""
    rows = []
    for line in lines(results):
        form = ".0e" if line.De == 0 and line.quantity == "V" else FORMS[line.quantity]
        zero = form == ".0e"
        cells = {"": f"{f'De {line.De:g}' if line.De else 'Newtonian'}: {NAMES[line.quantity]}"}
        cells |= {f"x = {x:g}": cell(value, 0, form) for x, value in line.at.items()}
        cells["x to 0"] = "" if zero else cell(line.limit, 0, form)
        cells["`pairsim focus`"] = cell(line.axis, 0 if zero else line.half_width, form)
        rows.append(cells | {"difference, %": "" if zero else cell(line.percent, 0, "+.2g")})
    return {"three-dimensions": pages.markdown(pd.DataFrame(rows).fillna(""))}
