"""Compute the quasi-steady master curve dU(d) and its zeros.

The case file has d (distances in tube diameters D_c: a list, or {start, stop,
num, spacing}) in place of d0. Writes curve.csv (dU in U_av), equilibria.csv,
curve.png of two points or more, case.yaml and run.json.

Exit codes: 0 finished, 2 wrong input, 3 computation failed, 4 installation or
system at fault (pairsim doctor), 5 no steady state there, 130 interrupted.
"""

from __future__ import annotations

import math
from collections.abc import Generator, Iterator, Mapping, Sequence
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

import typer
from pydantic import Field

from pairsim.api.compute import Computation
from pairsim.api.results import Result
from pairsim.cases.accuracy import DEFAULT, percent
from pairsim.cases.case import SceneCase
from pairsim.cases.case_checks import check_scene
from pairsim.cases.cost import Estimate, steady_estimate
from pairsim.cases.mistakes import Mistake, broken, missing
from pairsim.cases.value_lists import ALLOWED, MOST_VALUES, Gaps
from pairsim.cases.values import CurveTolerance, Distance, Velocity, Whole
from pairsim.cli.compute import compute
from pairsim.cli.options import Budget, CaseFile, DryRun, Output, Overwrite, Progress, Quiet, Settings
from pairsim.computing import events
from pairsim.computing.answer import shapes_in
from pairsim.computing.question import InSweeps, Question, Tables, Value, rows_in
from pairsim.results.columns import (
    EQUILIBRIA_COLUMNS,
    FORCES,
    GAP,
    curve_columns,
    names_of,
    suffixes,
    suffixes_in,
)
from pairsim.runtime.errors import RunFailure
from pairsim.solvers.curves.distances import between

if TYPE_CHECKING:
    import pandas as pd

    from pairsim.api.curve import Curve
    from pairsim.computing.steady import Solutions
    from pairsim.computing.warm_start import WarmStart
    from pairsim.plots.style import Page
    from pairsim.results import curve_table as in_tables
    from pairsim.results.travel import Travel
    from pairsim.results.xdmf import FieldFrame
    from pairsim.runtime.arrays import Array
    from pairsim.runtime.monitor import Monitor
    from pairsim.solvers.curves.branch import Branch, Point
    from pairsim.solvers.curves.curve import Equilibrium
    from pairsim.solvers.curves.interpolant import CurveInterpolant, Region
    from pairsim.solvers.steady.scene import SteadySolver

FAR = 1.2  # ratio of distances from which on it is told where a start is forgotten; chosen
FORCE = names_of(1, *FORCES)  # columns of the only point of a single particle that is moved


class CurveCase(SceneCase):
    """A master curve dU(d): quasi-steady solutions at many distances d."""

    kind: ClassVar[str] = "curve"
    usual_distances: ClassVar[dict[str, Any]] = {"d": {"start": 0.02, "stop": 0.8, "num": 9}}

    d: Gaps | None = Field(
        None,
        description="distances between the facing surfaces [D_c]: a list of numbers (or of lists, one number for each "
        "gap), or a range; a curve has points at other distances, too, no more than a factor of 1.8 apart",
    )
    tol: CurveTolerance = Field(
        percent(DEFAULT) / 100,
        description="points are added until the half-width of the interval of dU between them is below this fraction "
        "of the largest |dU|, or below twice that at the points (default: accuracy)",
    )
    max_points: Whole = Field(200, ge=1, le=MOST_VALUES, description="no points are added once the curve has this many")
    fields: tuple[Distance, ...] = Field(
        (), max_length=MOST_VALUES, description="distances at which fields are written to fields.xdmf [D_c]"
    )
    velocity: Velocity | None = Field(
        None,
        description="velocity at which the rigid particles are moved, 0 to hold them [U_av]; the forces that this "
        "takes are columns of curve.csv (default: no force acts on the particles)",
    )
    flow: Literal[0, 1] = Field(
        1,
        description="mean velocity of the liquid in the tube [U_av]; 0 is a liquid at rest, between closed ends if "
        "these are developed, in which velocity must be given: with velocity: 1 the unit is that of the particles",
    )

    def _defaults(self) -> dict[str, Any]:
        return super()._defaults() | {"tol": self.error_wanted}

    @property
    def places(self) -> list[tuple[float, ...]]:
        """The requested distances [D_c] in the order of the file, a tuple with one value for each gap."""
        if self.n < 2:
            return [()]
        return [v if isinstance(v, tuple) else (v,) * (self.n - 1) for v in self.d or ()]

    @property
    def gaps(self) -> tuple[float, ...]:
        """The largest distance of each gap [D_c], which sets the length of the tube."""
        return tuple(max(values) for values in zip(*self.places, strict=True))

    @property
    def range_of_d(self) -> tuple[float, float]:
        values = [d for place in self.places for d in place]
        return min(values), max(values)

    @property
    def driven(self) -> tuple[float, float | None]:
        return float(self.flow), self.velocity

    @property
    def common(self) -> bool:
        """Whether all gaps have the same distance at every point, so that the result is a curve over d."""
        return self.n > 1 and all(len(set(place)) == 1 for place in self.places)

    @property
    def in_order(self) -> list[tuple[float, ...]]:
        """The distances in the order of solution: from the largest down, where the first is easiest to find."""
        if self.common:
            wanted = {place[0] for place in self.places} | set(self.fields)
            return [(d,) * (self.n - 1) for d in sorted(wanted, reverse=True)]
        return self.places

    def _slug_parts(self) -> list[str]:
        parts = ["curve", *super()._slug_parts()]
        parts += [] if self.velocity is None else [f"velocity{self.velocity:g}"]
        return parts if self.flow else [*parts, "at-rest"]


def check(case: CurveCase) -> Iterator[Mistake]:
    """Check the keys of a curve against each other; yields mistakes as `check_scene` does."""
    if case.n < 1:
        yield Mistake("particles", case.n, "must be at least 1 for a curve")
        return
    if case.n > 1 and case.d is None:
        yield missing("d", f"must be {ALLOWED}")
    if case.n == 1 and case.d is not None:
        yield Mistake("d", list(case.d), "must be left out: there is only one particle")
    wrong = [place for place in case.d or () if isinstance(place, tuple) and len(place) != case.n - 1]
    if wrong and case.n > 1:
        yield Mistake("d", list(wrong[0]), f"must be numbers, or lists of {case.n - 1} numbers, one for each gap")
        return
    if case.fields and not case.common:
        yield Mistake("fields", list(case.fields), "must be left out if the gaps have different distances")
    elif case.fields and case.places:
        least, most = case.range_of_d
        allowed = f"must be between the smallest and the largest d, {least:g} and {most:g}"
        yield from (Mistake("fields", d, allowed) for d in case.fields if not least <= d <= most)
    moved, at_rest = case.velocity is not None, case.flow == 0
    yield from broken(
        case,
        ("velocity", moved and any(case.Ca_es), "must be left out: only rigid particles (Ca_e: 0) can be moved"),
        ("flow", at_rest and not case.velocity, "must be 1: nothing moves, unless velocity is given and not 0"),
        ("flow", at_rest and case.physical is not None, "must be 1 with a physical block, whose velocity is its unit"),
    )
    yield from check_scene(case)


def estimate(case: CurveCase) -> Estimate:
    """Size and duration of a master curve: the points between those requested, and a third more where dU is curved."""
    points = len(case.places)
    if case.common and points > 1:
        points = len(between(sorted(case.places), case.max_points))
        points = max(min(points + -(-points // 3), case.max_points), points)
    return steady_estimate(case, points - 1)


def solve(
    case: CurveCase, *, monitor: Monitor, sensitivities: bool = False, warm_start: WarmStart | None = None
) -> events.Events:
    """Compute a master curve and, for a pair, its zeros.

    Args:
        case: The validated case.
        monitor: Ends the computation.
        sensitivities: Compute the derivatives of dU with respect to Ca_e, De and beta, too.
        warm_start: Solutions of the previous curve to start from; keeps those of this curve. The caller closes it.
    """
    from pairsim.computing.problems import steady_problem
    from pairsim.computing.steady import Solutions, point_row
    from pairsim.solvers.curves.curve import trace
    from pairsim.solvers.parameters import Parameters

    places = case.in_order
    expected = len(between(places, case.max_points)) if case.common else len(places)
    yield events.Begin(f"{expected} point{'s' * (expected > 1)}, more as needed", expected)
    found = Solutions(case, warm_start)
    points, warnings = found.points, list[str]()
    try:
        with found:
            start = Parameters(places[0], case.solid_models, case.liquid_model)
            narrowest = min((d for place in places for d in place), default=math.inf)
            problem = steady_problem(case, narrowest, monitor)
            branch = found.begin(problem, start, places=places, sensitivities=sensitivities)
            yield events.Table("curve", _columns(case, sensitivities), ascending=case.common)
            for point, wanted in trace(branch, places, case.tol, case.max_points):
                points.append(point)
                if case.common:
                    points.sort(key=lambda p: p.d)
                count = len(points)
                yield events.Row("curve", point_row(point) | {"wanted": float(wanted)})
                if any(abs(point.d - d) < 1e-9 * d for d in case.fields):
                    yield events.Frame(_frame(point.d, branch.solver))
                yield events.Progress(min(count, expected), _shown(point, count), count)
            message = f"{len(points)} points"
            if case.n == 2 and case.velocity is None:
                zeros = yield from _zeros(branch, points, warnings)
                message += f"; dU = 0: {', '.join(map(_said, zeros)) or 'at no d'}"
            return events.Outcome("finished", "end", message)
        return found.outcome  # the branch ends before all distances were reached
    finally:
        yield from _end(case, found, warnings)


def _columns(case: CurveCase, sensitivities: bool) -> list[str]:
    """The columns of curve.csv."""
    from pairsim.computing.steady import health_columns

    parameters = [name for name, value in (("Ca_e", max(case.Ca_es)), ("De", case.De), ("beta", 1.0)) if value]
    parameters = parameters if sensitivities else []
    columns = curve_columns(case.n, case.common, parameters, case.velocity is not None)
    return [*columns, *health_columns(case)]


def _shown(point: Point, count: int) -> str:
    """A line of progress for a point."""
    o = point.observation
    gaps = f"d = {', '.join(f'{d:.5f}' for d in point.gaps)}  " if point.gaps else ""
    if len(o.F):
        name, values = "F", ", ".join(f"{F:.6g}" for F in o.F)
    elif o.U.size > 1:
        name, values = "dU", ", ".join(f"{dU:+.4e}" for dU in o.dU)
    else:
        name, values = "U", f"{o.U[0]:.6f}"
    return f"{gaps}{name} = {values}  Newton {point.newton}  point {count}"


def _frame(d: float, solver: SteadySolver) -> FieldFrame:
    """The fields of the present solution."""
    from pairsim.results.fields import SteadyMoment, frame

    (h, x), flow = solver.state(), solver.developed_flow
    moment = SteadyMoment(d, solver.scene, x, h, solver.constraints.V @ solver.y)
    return frame(moment, solver.h_star(solver.parameters), flow)


def _last_shapes(solver: SteadySolver) -> FieldFrame:
    """The fields of the last solution on the way to parameters that were not reached."""
    solver.reopen()
    try:
        return _frame(min(solver.parameters.gaps), solver)
    finally:
        solver.close()


def _zeros(
    branch: Branch, points: list[Point], warnings: list[str]
) -> Generator[events.Event, None, Sequence[Equilibrium]]:
    """Find the zeros of the curve of a pair; those found before a failure are written, too."""
    from pairsim.solvers.curves.curve import Zero, equilibria, find_zeros

    zeros: list[Zero] = []
    failure: RunFailure | None = None
    try:
        for found in find_zeros(branch, points):
            if isinstance(found, Zero):
                zeros.append(found)
            else:
                warnings.append(found.message)
    except RunFailure as error:
        failure = error
    result = equilibria(zeros, points)
    yield events.Table("equilibria", EQUILIBRIA_COLUMNS, [vars(zero) | {"stable": zero.stable} for zero in result])
    if failure is not None:
        raise failure
    return result


def _said(zero: Equilibrium) -> str:
    """A zero in words."""
    kind = "stable" if zero.stable else "unstable"
    return f"{kind} at d = {zero.d:.5g}{'' if zero.certain else ' (uncertain)'}"


def _end(case: CurveCase, found: Solutions, warnings: list[str]) -> Iterator[events.Event]:
    """What run.json says, and the fields of the last state on a way that has not arrived."""
    from pairsim.computing.steady import adaptation_report, moving_errors
    from pairsim.solvers.curves.adaptation import ENOUGH
    from pairsim.solvers.curves.curve import ROUNDING, interpolants

    points, entries = found.points, dict[str, Any](points=len(found.points))
    if case.velocity is not None:
        warnings = [*warnings, *_large_force_errors(case, points)]
    elif found.branch is not None and case.n > 1 and points:
        curves = interpolants(points) if case.common and len(points) > 1 else []
        size = max(abs(curve.peak.dU) for curve in curves) if len(points) >= ENOUGH and curves else found.branch.dU
        reported = adaptation_report(case, found.branch, points, [size] * len(points), f"the largest |dU| ({size:.3g})")
        entries["adaptation"], missed = reported
        entries["adaptation"]["reference_dU"] = size
        moved = moving_errors(case, points, size) if size > ROUNDING else []
        warnings = [*warnings, *missed, *moved, *(_far_apart(case, curves, size) if size > ROUNDING else [])]
    yield from found.last_events(entries, warnings)
    if found.ended is not None and found.ended.last is not None and case.n > 1:
        yield events.Frame(_last_shapes(found.ended.last))


def _far_apart(case: CurveCase, curves: Sequence[CurveInterpolant], size: float) -> list[str]:
    """Warn of points so far apart that the interpolation error of dU exceeds `accuracy` and the errors at the points.

    Args:
        case: The case.
        curves: dU of every gap.
        size: The largest |dU| [U_av].
    """
    import numpy as np

    from pairsim.computing.warnings import finer

    if not curves:
        return []
    d, known = curves[0].d, [np.maximum(curve.dU_error[:-1], curve.dU_error[1:]) for curve in curves]
    errors = np.max([np.where(c.errors > e, c.errors, 0.0) for c, e in zip(curves, known, strict=True)], axis=0) / size
    worst = int(errors.argmax())
    if errors[worst] <= case.error_wanted:
        return []
    part = f"{100 * errors[worst]:.2g} %" if np.isfinite(errors[worst]) else "any part"
    where = f"between d = {d[worst]:.4g} and {d[worst + 1]:.4g}"
    advice = finer(case)
    if len(d) >= case.max_points:
        advice = f"more points (--set max_points={2 * case.max_points})"
    elif case.tol > case.error_wanted:
        advice = f"points nearer to each other (--set tol={case.error_wanted:g})"
    return [
        f"{where} the interpolated dU may be off by {part} of its largest value, more than accuracy: {case.accuracy}; "
        f"use {advice}"
    ]


def _large_force_errors(case: CurveCase, points: list[Point]) -> list[str]:
    """Warnings of large errors of the forces that move the particles, relative to themselves."""
    from pairsim.computing.warnings import ErrorAt, large_errors
    from pairsim.solvers.steady.continuation import where

    errors = [
        ErrorAt(float(error / abs(F)), where(point.parameters), 0.0)
        for point in points
        for F, error in zip(point.observation.F, point.estimate.F_error, strict=True)
        if F
    ]
    return large_errors(case, "F_error", "F", errors)


def answer_of_curve(
    table: Mapping[str, Array], zeros: Sequence[in_tables.Zero], record: Mapping[str, Any]
) -> list[str]:
    """The answer of a master curve.

    Args:
        table: Columns of curve.csv.
        zeros: Zeros of dU, in ascending distance.
        record: run.json.
    """
    from pairsim.results.curve_table import peak_of, regions_of
    from pairsim.results.units import LENGTH, VELOCITY, in_unit, scales_in, with_error

    gaps = suffixes_in(table, "dU")
    if not gaps:
        velocities = [f"U{each} = {table[f'U{each}'][0]:.6g}" for each in suffixes_in(table, "U")]
        forces = suffixes_in(table, "F")
        moved = [f"F{each} = {with_error(table[f'F{each}'][0], table[f'F_error{each}'][0])}" for each in forces]
        return [f"{', '.join([*velocities, *moved])}.", *shapes_in(table, 0, "")]
    lines = []
    scales = scales_in(record)
    if "dU" in table:
        regions = regions_of(table, [zero.d for zero in zeros])
        met = {a.stop for a, b in pairwise(regions) if a.sign * b.sign < 0}
        zeros = [zero for zero in zeros if zero.d in met]
        lines.append(_motion_over_d(regions, zeros))
        if scales is not None and zeros:
            places = ", ".join(in_unit(scales, LENGTH, zero.d, zero.error) for zero in zeros)
            lines.append(f"In physical units: it keeps its distance at d = {places}.")
        lines += _starts(table)
    for gap in gaps:
        name, peak = f"dU{gap}", peak_of(table, gap)
        value, place = with_error(peak.dU, peak.error, "+"), with_error(peak.d, peak.d_error)
        if not math.isfinite(peak.error):
            lines.append(f"Largest |{name}| of two points: {value} at d = {place}; what lies between is not known.")
            continue
        lines.append(f"Largest |{name}|: {value} at d = {place}.")
        if scales is not None:
            value, place = (
                in_unit(scales, VELOCITY, peak.dU, peak.error, "+"),
                in_unit(scales, LENGTH, peak.d, peak.d_error),
            )
            lines.append(f"In physical units: {value} at d = {place}.")
    shapes = {f"D{each}": table[f"D{each}"] for each in suffixes_in(table, "D")}
    ranges = ", ".join(f"{name} from {values.min():.3g} to {values.max():.3g}" for name, values in shapes.items())
    return [*lines, f"Taylor parameters: {ranges}."] if ranges else lines


def _motion_over_d(regions: Sequence[Region], zeros: Sequence[in_tables.Zero]) -> str:
    """Where a pair separates, where it comes closer, where neither is certain, and where it keeps its distance."""

    def where(region: Region) -> str:
        far = region.stop > region.start
        return f"between d = {region.start:.4g} and {region.stop:.4g}" if far else f"at d = {region.start:.4g}"

    if not regions:
        return "The pair keeps its distance: dU vanishes at every d."
    moves = [f"{'separates' if each.sign > 0 else 'comes closer'} {where(each)}" for each in regions if each.sign]
    sentences = [f"The pair {', '.join(moves)}."] if moves else []
    if open_ones := [where(each) for each in regions if not each.sign]:
        sentences.append(f"Not decided {', '.join(open_ones)}: the interval of dU holds both signs.")
    if zeros:
        sentences.append(f"It keeps its distance at d = {', '.join(map(str, zeros))}.")
    return " ".join(sentences)


def _starts(table: Mapping[str, Array]) -> list[str]:
    """From where on pairs that start at an end of the curve and move along it are on the curve, if that is far."""
    from pairsim.results.curve_table import forgotten_at

    lines = []
    for end, sign in ((0, 1), (-1, -1)):
        d, dU, held = (float(table[name][end]) for name in ("d", "dU", "dU_held"))
        there = forgotten_at(table, d) if dU * sign > 0 else None
        if there is None or 1 / FAR < there / d < FAR:
            continue
        known = f"follows this curve from d = {there:.3g} on" if math.isfinite(there) else "does not follow this curve"
        change = f"{100 * abs(held / dU - 1):.2g} % {'more' if held / dU > 1 else 'less'}"
        lines.append(
            f"A pair that starts at d = {d:.4g} {known}, when it has forgotten its start; at first, dU depends on that "
            f"(with the shapes of a held distance: {change})."
        )
    return lines


def draw(directory: Path, out: Path, page: Page) -> list[Path]:
    """dU with its error and its zeros, and D."""
    from pairsim.plots.runs_and_curves import draw_curve

    return draw_curve(directory, out, page)


def result_columns(case: CurveCase) -> tuple[str, ...]:
    """Points, zeros, and by gap the largest |dU| with its distance and errors; the force on a single moved particle."""
    names = ["d_peak{}", "d_peak_error{}", "dU_peak{}", "dU_error{}"]
    others = (
        ["zeros", "zeros_error", "stable"]
        if case.n == 2
        else FORCE
        if case.n == 1 and case.velocity is not None
        else []
    )
    return ("points", *others, *(name.format(gap) for gap in suffixes(GAP, case.n) for name in names))


def read(tables: Tables) -> dict[str, Value]:
    """The result columns; `zeros` and what belongs to them are lists in ascending d."""
    from pairsim.results.curve_table import peak_of

    table, zeros = tables["curve"], tables["equilibria"]
    values: dict[str, Value] = {"points": rows_in(table)}
    if not values["points"]:
        return values
    values |= {name: float(table[name][0]) for name in FORCE if name in table}
    for gap in suffixes_in(table, "dU"):
        peak = peak_of(table, gap)
        found = {"d_peak": peak.d, "d_peak_error": peak.d_error, "dU_peak": peak.dU, "dU_error": peak.error}
        values |= {column + gap: value for column, value in found.items()}
    shown = {"zeros": "d", "zeros_error": "d_error", "stable": "stable"}
    return values | {name: zeros[column].tolist() for name, column in shown.items() if column in zeros}


class CurveResult(Result):
    """A master curve. `table` is curve.csv, with a row for each point."""

    @cached_property
    def equilibria(self) -> pd.DataFrame:
        """The zeros of dU (equilibria.csv): d, stable, slope, peak, d_error and certain."""
        from pairsim.results.tables import frame_of

        found = frame_of(self.tables["equilibria"])
        return found if len(found.columns) else found.reindex(columns=list(EQUILIBRIA_COLUMNS))

    @property
    def zeros(self) -> pd.DataFrame:
        """Another name of `equilibria`."""
        return self.equilibria

    @cached_property
    def curve(self) -> Curve:
        """dU as a function of the distance: `dU, half_width = result.curve(d)`."""
        from pairsim.api.curve import Curve

        return Curve(self.columns)

    def dU(self, d: Any, gap: int = 1) -> Any:
        """dU at any distance of the curve [U_av]; see `curve`, which returns the half-width of its interval, too."""
        return self.curve(d, gap)[0]

    def travel(self, start: float | str, stop: float | str) -> Travel:
        """Time and length of tube in which the pair moves from one distance to another, as `pairsim travel`.

        Args:
            start: First distance: a number [D_c], or a text with a unit such as "5um".
            stop: Last distance.

        Returns:
            Time, length and their half-widths; as text what the command prints.

        Raises:
            InputError: A distance is outside the curve, or the pair does not move from the one to the other.
        """
        from pairsim.results.travel import travel

        source = "curve" if self.folder is None else str(self.folder)
        return travel(self.columns, start, stop, source, self.record)

    @property
    def distances(self) -> Array:
        """Distances at which there are fields [D_c], shape (n,); see `fields` of the case."""
        return self.places

    def _headline(self) -> str:
        zeros = ", ".join(
            f"{'stable' if row.stable else 'unstable'} zero at d = {row.d:.5g}" for row in self.zeros.itertuples()
        )
        return super()._headline() + (f"; {zeros}" if zeros else "")

    def findings(self) -> list[str]:
        """Where particles separate and come closer, and how fast."""
        from pairsim.results.curve_table import zeros_in

        if not rows_in(self.tables["curve"]):
            return ["No point was solved."]
        return answer_of_curve(self.tables["curve"], zeros_in(self.tables["equilibria"]), self.record)

    def afterwards(self) -> str:
        if rows_in(self.columns) > 1 and "dU" in self.columns:
            return f"pairsim travel {self._place} --from D --to D gives the time and tube that a pair needs"
        return f"pairsim plot {self._place} draws it"


QUESTION = Question(
    model=CurveCase,
    check=check,
    estimate=estimate,
    solve=solve,
    tables={"curve": (), "equilibria": (), "way": ()},
    result=CurveResult,
    in_sweeps=InSweeps(result_columns, read, neighbours=("De", "Ca_e")),
    draw=draw,
    captions={"curve": "Relative velocity and shapes over distance"},
    frames="d",
    draws_from=2,  # one point is no line, and matplotlib takes as long as a point
    flags=("sensitivities",),
)

curve: Computation[CurveResult] = Computation(QUESTION, __doc__)
"""Compute the quasi-steady master curve dU(d) of a case, which has `d` in place of `d0`, and its zeros."""
app = typer.Typer()


@app.command(
    "curve",
    help=__doc__,
    epilog="Examples: pairsim curve configs/curve.yaml | pairsim curve case.yaml -o out --sensitivities "
    "--set 'd={start: 0.02, stop: 1, num: 12}'",
)
def _command(
    case: CaseFile,
    output: Output = None,
    overwrite: Overwrite = False,
    sensitivities: Annotated[
        bool,
        typer.Option("--sensitivities", help="Add the derivatives of dU with respect to Ca_e, De and beta at fixed d."),
    ] = False,
    budget: Budget = None,
    dry_run: DryRun = False,
    progress: Progress = "auto",
    quiet: Quiet = False,
    set_: Settings = None,
) -> None:
    compute(curve, case, output, overwrite, budget, dry_run, progress, quiet, set_, sensitivities=sensitivities)
