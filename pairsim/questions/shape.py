"""Compute the steady shape of one particle over Ca_e.

The case file has particles: 1, and along: values of Ca_e (a list, or {start,
stop, num, spacing}). Writes shape.csv (Taylor's D with its error, U in U_av),
shape.png, case.yaml and run.json.

Exit codes: 0 finished, 2 wrong input, 3 computation failed, 4 installation or
system at fault (pairsim doctor), 5 no steady state there, 130 interrupted.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

import typer
from pydantic import Field

from pairsim.api.compute import Computation
from pairsim.api.results import Result
from pairsim.cases.case import SceneCase
from pairsim.cases.case_checks import check_scene
from pairsim.cases.cost import Estimate, steady_estimate
from pairsim.cases.mistakes import Mistake, missing
from pairsim.cases.values import Values
from pairsim.cli.compute import compute
from pairsim.cli.options import Budget, CaseFile, DryRun, Output, Overwrite, Progress, Quiet, Settings
from pairsim.computing.question import InSweeps, Question, rows_in
from pairsim.results.columns import Column
from pairsim.results.units import AREA

if TYPE_CHECKING:
    from pairsim.computing.events import Events
    from pairsim.plots.style import Page
    from pairsim.runtime.monitor import Monitor
    from pairsim.solvers.curves.adaptation import AdaptiveBranch

COARSER = 2**0.5
D_ERROR = Column("D_error", r"\epsilon_D", "|D - D on a mesh with cells 2^0.5 times larger|")
CONTOUR = (
    Column("area", "A", "area of the meridional section", AREA),
    Column("deformation", r"\mathrm{Def}", "1 - 2 sqrt(pi area)/perimeter of the meridional section"),
    Column("area_hull", r"A_c", "area of the convex hull of the section", AREA),
    Column("deformation_hull", r"\mathrm{Def}_c", "deformation of the convex hull, as cytometry measures it"),
)
COLUMNS = (
    *("Ca_e", "D_1", D_ERROR, *CONTOUR, "U_1", "U_correction_1"),
    *("dp_plus", "dp_plus_correction", "corrected", "newton"),
)
"""The columns that shape.csv begins with."""
COARSE_TOO = 1.5  # factor of the time for also solving on a coarser mesh


class ShapeCase(SceneCase):
    """The steady shapes of one particle at several Ca_e."""

    kind: ClassVar[str] = "shape"

    along: Values | None = Field(None, description="elastic capillary numbers of the shapes: a list or a range")

    @property
    def series(self) -> tuple[float, ...]:
        """The elastic capillary numbers, ascending."""
        return tuple(sorted(set(self.along or ())))

    @property
    def gaps(self) -> tuple[float, ...]:
        """None."""
        return ()

    def _slug_parts(self) -> list[str]:
        return ["shape", *super()._slug_parts()]


def check(case: ShapeCase) -> Iterator[Mistake]:
    """Check the keys against each other; yields mistakes."""
    if case.n != 1:
        yield Mistake("particles", case.n, "must be 1: the shape is that of a particle on its own")
    elif case.along is None:
        yield missing("along", "must be values of Ca_e: a list, or {start, stop, num, spacing}")
    elif case.Ca_e == 0:
        yield Mistake("Ca_e", case.Ca_e, "must be above 0, as along replaces it")
    else:
        yield from check_scene(case)


def estimate(case: ShapeCase) -> Estimate:
    """Size and duration of the shapes."""
    return steady_estimate(case, len(case.series), COARSE_TOO)


def solve(case: ShapeCase, *, monitor: Monitor) -> Events:
    """Solve the shapes in ascending Ca_e."""
    from pairsim.computing.events import Begin, Outcome, Progress, Row, Table
    from pairsim.computing.problems import steady_problem
    from pairsim.computing.steady import Solutions, health_columns, point_row
    from pairsim.fem.diagnostics import contour
    from pairsim.solvers.parameters import Parameters
    from pairsim.solvers.steady.first_solution import coarser

    yield Begin(f"{len(case.series)} shapes", len(case.series))
    own = [each.name if isinstance(each, Column) else each for each in COLUMNS]
    yield Table("shape", [*own, *health_columns(case)])
    found = Solutions(case)
    try:
        with found:
            beside: AdaptiveBranch | None = None
            problem, start = steady_problem(case, 1.0, monitor), Parameters((), case.solid_models, case.liquid_model)
            for count, Ca_e in enumerate(case.series, 1):
                place = start.with_Ca_e(Ca_e)
                branch = found.branch or found.begin(problem, place)
                beside = beside or found.begin(coarser(problem, COARSER), place, beside=True)
                found.points.append(branch.at(place))
                row = point_row(found.points[-1]) | {"Ca_e": Ca_e}
                row["D_error"] = abs(point_row(beside.at(place))["D_1"] - row["D_1"])
                scene = branch.solver
                names = (each.name for each in CONTOUR)
                row |= dict(zip(names, contour(scene.bodies[0].outline_points(scene.state()[0])), strict=True))
                yield Row("shape", row)
                yield Progress(count, f"Ca_e = {Ca_e:.4g}  D = {row['D_1']:.5f}  shape {count}", count)
            return Outcome("finished", "end", f"{len(case.series)} shapes")
        return found.outcome  # the branch ends before the last Ca_e
    finally:
        yield from found.last_events({"points": len(found.points)})


def draw(directory: Path, out: Path, page: Page) -> list[Path]:
    """D and U over Ca_e."""
    from pairsim.plots.chart import POINT, Panel, Series, draw_chart
    from pairsim.plots.labels import case_parts, read_case
    from pairsim.plots.style import printing
    from pairsim.plots.units import Units
    from pairsim.results.table_files import read_table

    units = Units.of(directory, page.physical)
    table = units.table(read_table(directory / "shape.csv"))
    errors, joined = {"D_1": table["D_error"], "U_1": None}, {"linestyle": "-"}
    series = [Series(n, table["Ca_e"], table[n], error, mark=POINT, look=joined) for n, error in errors.items()]
    panels = {name: Panel(units.axis_label(["Ca_e"]), units.axis_label([name])) for name in errors}
    with printing():
        figure, _ = draw_chart(page, panels, series, case_parts(read_case(directory / "case.yaml"), {"Ca_e"}))
        return page.save(figure, out, "shape")


class ShapeResult(Result):
    """Steady shapes. `table` is shape.csv, with a row for each Ca_e."""

    def findings(self) -> list[str]:
        """How far the particle deforms, and how fast it moves."""
        from pairsim.results.units import with_error

        if not rows_in(self.tables["shape"]):
            return ["No shape was found."]
        D, error, Ca_e, U = (self.tables["shape"][name] for name in ("D_1", "D_error", "Ca_e", "U_1"))
        ends = (0, -1) if len(D) > 1 else (0,)
        shapes = (f"{with_error(D[i], error[i])} at Ca_e = {Ca_e[i]:.4g}" for i in ends)
        return [f"D = {' to '.join(shapes)}.", f"It moves at U = {' to '.join(f'{U[i]:.6g}' for i in ends)}."]


QUESTION = Question(
    model=ShapeCase,
    check=check,
    estimate=estimate,
    solve=solve,
    tables={"shape": COLUMNS, "way": ()},
    result=ShapeResult,
    in_sweeps=InSweeps(lambda _: ("points", "D_1", "D_error"), parameters=("beta", "De")),
    draw=draw,
    captions={"shape": "Shape and velocity over the elastic capillary number"},
)

shape: Computation[ShapeResult] = Computation(QUESTION, __doc__)
"""Compute the steady shape of one particle over the values of Ca_e that the case has under `along`."""
app = typer.Typer()


@app.command(
    "shape",
    help=__doc__,
    epilog="Examples: pairsim shape case.yaml | "
    "pairsim shape case.yaml -o out --set 'along={start: 0.01, stop: 0.2, num: 8}'",
)
def _command(
    case: CaseFile,
    output: Output = None,
    overwrite: Overwrite = False,
    budget: Budget = None,
    dry_run: DryRun = False,
    progress: Progress = "auto",
    quiet: Quiet = False,
    set_: Settings = None,
) -> None:
    compute(shape, case, output, overwrite, budget, dry_run, progress, quiet, set_)
