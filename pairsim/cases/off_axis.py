"""The key `focus` of questions about particles on the axis: whether they stay there."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated

from pydantic import Field

from pairsim.cases.case import SceneCase
from pairsim.cases.keys import Key, Part
from pairsim.cases.mistakes import Mistake, broken

MOST = 5  # particles that are displaced; chosen
YIELDS = "must be one without a yield stress: how much a rounded one changes the rates has not been judged"
POINTS = 9  # steady states that take as long as the rates at three distances; measured of a soft pair, Newtonian


class OffAxisCase(SceneCase):
    """A case whose particles may be displaced from the axis when its question is answered."""

    focus: Annotated[bool, Key(part=Part.REPORT, since="0.4")] = Field(
        False,
        strict=True,
        description="compute whether the particles stay on the axis, too: rates as of pairsim focus in focus.csv, and "
        "a line in the answer",
    )


def points_off_axis(case: OffAxisCase) -> int:
    """How many steady states take as long as the rates off the axis."""
    return POINTS if case.focus else 0


def check_off_axis(case: OffAxisCase) -> Iterator[Mistake]:
    """Check whether the particles of a case can be displaced; yields mistakes."""
    if not case.focus:
        return
    out = "must be left out"
    yield from broken(
        case,
        ("focus", not case.n, f"{out}: there are no particles"),
        ("focus", case.n > MOST, f"{out} of more than {MOST} particles"),
        ("focus", case.ends == "periodic" and not case.closed, f"{out}, or ends be developed"),
    )
    liquid = case.liquid_model
    if liquid.regularisation or liquid.yielding is not None:
        yield Mistake("focus", True, f"{out}, or the liquid {YIELDS}")
