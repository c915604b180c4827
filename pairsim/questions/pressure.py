"""Compute the extra pressure drop of one particle over Ca_e.

The case file has Ca_e or along: several values of it (a list, or {start, stop,
num, spacing}). Writes pressure.csv (the pressure drop in excess of that of the
tube without the particle, with its error), pressure.png, case.yaml and
run.json.

Exit codes: 0 finished, 2 wrong input, 3 computation failed, 4 installation or
system at fault (pairsim doctor), 5 no steady state there, 130 interrupted.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from pairsim.computing.along import AlongCase, check_along, estimate_along, solve_along
from pairsim.computing.question import InSweeps, Question
from pairsim.computing.result import Result
from pairsim.quantities.kinds import STRESS
from pairsim.quantities.text import in_unit, softness
from pairsim.record.column import Columns
from pairsim.record.columns import (
    CA_E,
    CORRECTED,
    DP_PLUS,
    DP_PLUS_CORRECTION,
    DP_PLUS_ERROR,
    NEWTON,
    STEADY,
    TAYLOR,
    U_ERROR,
    WAY_COLUMNS,
    U,
)
from pairsim.record.run_entries import OF_STEADY
from pairsim.solvers import goals

if TYPE_CHECKING:
    from pairsim.plots.style import Page

COLUMNS = Columns(CA_E, DP_PLUS, DP_PLUS_ERROR, DP_PLUS_CORRECTION, CORRECTED, U, U_ERROR, TAYLOR, NEWTON)
"""The columns that pressure.csv begins with."""
TABLE = Columns(COLUMNS, STEADY)

GOALS = (goals.DP_PLUS, goals.U)
"""The goals to whose errors meshes are adapted, and of which half-widths are written."""


class PressureCase(AlongCase):
    """The extra pressure drop of one particle at several Ca_e."""

    kind: ClassVar[str] = "pressure"


class PressureResult(Result):
    """Extra pressure drops. `table` is pressure.csv, with a row for each Ca_e."""

    def findings(self) -> list[str]:
        """How much the particle adds to the pressure drop, at the first and at the last Ca_e."""
        if not self.columns.rows:
            return ["No pressure drop was found."]
        Ca_e, dp, error = (self.columns[column] for column in (CA_E, DP_PLUS, DP_PLUS_ERROR))
        scales, ends = self.record.scales, (0, -1) if len(dp) > 1 else (0,)
        drops = (f"{in_unit(scales, STRESS, dp[i], error[i])} at {softness(Ca_e[i], scales)}" for i in ends)
        return [f"The particle adds {' to '.join(drops)} to the pressure drop."]


def draw(folder: Path, out: Path, page: Page) -> list[Path]:
    """Draw the table of a folder."""
    from pairsim.computing.along_picture import draw_along

    return draw_along(folder, out, page, "pressure", TABLE, ("dp_plus",))


QUESTION = Question(
    __name__,
    model=PressureCase,
    check=check_along,
    estimate=estimate_along,
    solve=lambda case, monitor, workers: solve_along(case, monitor, workers, COLUMNS, "dp_plus", GOALS),
    tables={"pressure": TABLE, "way": WAY_COLUMNS},
    shared=True,
    entries=OF_STEADY,
    result=PressureResult,
    draw=draw,
    captions={"pressure": "Extra pressure drop over the elastic capillary number"},
    in_sweeps=InSweeps(lambda _: ("points", "dp_plus", "dp_plus_error"), parameters=("beta", "De")),
    examples="Example: pairsim pressure case.yaml -o out --set 'along=[0.02, 0.1]'",
)
