"""Compute the steady shape of one particle over Ca_e.

The case file has Ca_e or along: several values of it (a list, or {start, stop,
num, spacing}). Writes shape.csv (Taylor's D with its error, U in U_av),
shape.png, case.yaml and run.json.

Exit codes: 0 finished, 2 wrong input, 3 computation failed, 4 installation or
system at fault (pairsim doctor), 5 no steady state there, 130 interrupted.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from pairsim.computing.along import AlongCase, check_along, estimate_along, solve_along
from pairsim.computing.found import Found
from pairsim.computing.question import InSweeps, Question
from pairsim.computing.result import Result
from pairsim.quantities.kinds import AREA, PURE, VELOCITY, VOLUME, Kind
from pairsim.quantities.text import in_unit, softness, with_error
from pairsim.record.column import Column, Columns
from pairsim.record.columns import (
    CA_E,
    CORRECTED,
    DP_PLUS,
    DP_PLUS_CORRECTION,
    DP_PLUS_ERROR,
    NEWTON,
    STEADY,
    TAYLOR,
    U_CORRECTION,
    U_ERROR,
    WAY_COLUMNS,
    U,
)
from pairsim.record.run_entries import OF_STEADY
from pairsim.solvers import goals
from pairsim.solvers.goals import Goal

if TYPE_CHECKING:
    from pairsim.fem.diagnostics import Contour
    from pairsim.plots.style import Page
    from pairsim.solvers.steady.scene import SteadySolver


def _contour(solver: SteadySolver) -> Contour:
    from pairsim.fem.diagnostics import contour

    return contour(solver.bodies[0].outline_points(solver.state()[0]))


def _of_contour(name: str, found: Found) -> float:
    return float(getattr(_contour(found.solver), name))


def _half_width(goal: Goal, found: Found) -> float:
    return float(found.point.estimate[goal].half_width[0])


def _measured(name: str, symbol: str, meaning: str, unit: Kind = PURE, half_width: str = "") -> Column:
    return Column(name, symbol, meaning, unit, value=partial(_of_contour, name), half_width=half_width)


def _error(goal: Goal, symbol: str) -> Column:
    meaning = f"half-width of the interval of {goal.name}: error by mesh, ends and Newton's method"
    return Column(goal.error_column, symbol, meaning, value=partial(_half_width, goal))


CONTOUR = (
    _measured("area", "A", "area of the meridional section", AREA),
    _measured("deformation", r"\mathrm{Def}", "1 - 2 sqrt(pi area)/perimeter of the meridional section"),
    _measured("area_hull", r"A_c", "area of the convex hull of the section", AREA),
    _measured(
        "deformation_hull",
        r"\mathrm{Def}_c",
        "deformation of the convex hull, as cytometry measures it",
        half_width=goals.DEFORMATION.error_column,
    ),
    _error(goals.DEFORMATION, r"\epsilon_\mathrm{Def}"),
    _measured("inertia_ratio_hull", "I_c", "root of the hull's second moment of area along the axis over that across"),
    _measured("volume", "V", "volume of the particle", VOLUME),
)
D_ERROR = _error(goals.D, r"\epsilon_D")
COLUMNS = Columns(
    *(CA_E, TAYLOR, D_ERROR, CONTOUR, U, U_CORRECTION, U_ERROR),
    *(DP_PLUS, DP_PLUS_ERROR, DP_PLUS_CORRECTION, CORRECTED, NEWTON),
)
"""The columns that shape.csv begins with."""
TABLE = Columns(COLUMNS, STEADY)
GOALS = (goals.D, goals.DEFORMATION, goals.U, goals.DP_PLUS)
"""The goals to whose errors meshes are adapted, and of which half-widths are written."""


class ShapeCase(AlongCase):
    """The steady shapes of one particle at several Ca_e."""

    kind: ClassVar[str] = "shape"


class ShapeResult(Result):
    """Steady shapes. `table` is shape.csv, with a row for each Ca_e."""

    def findings(self) -> list[str]:
        """How far the particle deforms, and how fast it moves."""
        if not (table := self.columns).rows:
            return ["No shape was found."]
        D, error, Ca_e = table.of(TAYLOR, "_1"), table[D_ERROR], table[CA_E]
        scales, ends = self.record.scales, (0, -1) if len(D) > 1 else (0,)
        velocities = (in_unit(scales, VELOCITY, table.of(U, "_1")[i], table.of(U_ERROR, "_1")[i]) for i in ends)
        shapes = (f"{with_error(D[i], error[i])} at {softness(Ca_e[i], scales)}" for i in ends)
        return [f"D = {' to '.join(shapes)}.", f"It moves at U = {' to '.join(velocities)}."]


def draw(folder: Path, out: Path, page: Page) -> list[Path]:
    """Draw the table of a folder."""
    from pairsim.computing.along_picture import draw_along

    return draw_along(folder, out, page, "shape", TABLE, ("D_1", "U_1"))


QUESTION = Question(
    __name__,
    model=ShapeCase,
    check=check_along,
    estimate=estimate_along,
    solve=lambda case, monitor, workers: solve_along(case, monitor, workers, COLUMNS, "D_1", GOALS),
    tables={"shape": TABLE, "way": WAY_COLUMNS},
    shared=True,
    entries=OF_STEADY,
    result=ShapeResult,
    in_sweeps=InSweeps(lambda _: ("points", "D_1", "D_error"), parameters=("beta", "De")),
    draw=draw,
    captions={"shape": "Shape and velocity over the elastic capillary number"},
    examples="Examples: pairsim shape case.yaml | "
    "pairsim shape case.yaml -o out --set 'along={start: 0.01, stop: 0.2, num: 8}'",
)
