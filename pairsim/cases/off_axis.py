"""The key `focus` of questions about particles on the axis: whether they stay there."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from pairsim.cases.case import SceneCase
from pairsim.cases.keys import Key, Part

MOST = 5  # largest number of particles that are displaced; chosen
YIELDS = "must be one without a yield stress: how its regularisation changes the rates has not been assessed"
POINTS = 9  # steady states that take as long as the rates at three distances; measured, soft pair in a Newtonian liquid


def _check_focus(case: OffAxisCase) -> str:
    """Why the particles of a case cannot be displaced; "" if they can, or are not to be."""
    if not case.focus:
        return ""
    out, liquid = "must be left out", case.liquid_model
    if not case.n:
        return f"{out}: there are no particles"
    if case.n > MOST:
        return f"{out} with more than {MOST} particles"
    if not case.drive.is_flow_alone or (case.has_history and not case.in_time):
        return f"{out} with after, and with velocity or flow: 0, as the flow alone must drive the particles"
    if case.ends != "developed" and not case.of_train:
        return f"{out}, or ends must be developed"
    return f"{out}, or the liquid {YIELDS}" if liquid.regularisation or liquid.yielding is not None else ""


class OffAxisCase(SceneCase):
    """A case whose particles may be displaced from the axis when its question is answered."""

    focus: Annotated[bool, Key(part=Part.REPORT, since="0.4", check=_check_focus)] = Field(
        False,
        strict=True,
        description="also compute whether the particles stay on the axis: focus.csv has the rates, as from pairsim "
        "focus, and the answer a line about them",
    )

    @property
    def of_train(self) -> bool:
        """Whether it is an infinite train, whose rates are those of short rows in a tube with developed ends."""
        return False


def points_off_axis(case: OffAxisCase) -> int:
    """The number of steady states that take as long as the rates off the axis; 0 if these are not computed."""
    return POINTS if case.focus else 0
