"""`pairsim curve`: the quasi-steady master curve dU(d)."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from pairsim.config.cost import Estimate, steady_estimate
from pairsim.config.curve_case import CurveCase, check_curve
from pairsim.questions.question import InSweeps, Question, Tables, Value, rows_in
from pairsim.results.columns import FORCES, GAP, names_of, suffixes, suffixes_in
from pairsim.solvers.curves.distances import between

if TYPE_CHECKING:
    from pairsim.plots.style import Page
    from pairsim.questions.events import Events


def solve(case: CurveCase, **more: Any) -> Events:
    """See `pairsim.questions.curve_solving.solve`."""
    from pairsim.questions import curve_solving

    return curve_solving.solve(case, **more)


def estimate(case: CurveCase) -> Estimate:
    """Size and duration of a master curve: the points between those requested, and a third more where dU is curved."""
    points = len(case.places)
    if case.common and points > 1:
        points = len(between(sorted(case.places), case.max_points))
        points = max(min(points + -(-points // 3), case.max_points), points)
    return steady_estimate(case, points - 1)


def answer(tables: Tables, record: dict[str, Any]) -> list[str]:
    """Where particles separate and come closer, and how fast."""
    from pairsim.results.answer import answer_of_curve, zeros_in

    return answer_of_curve(tables["curve"], zeros_in(tables["equilibria"]), record)


def draw(directory: Path, out: Path, page: Page) -> list[Path]:
    """dU with its error and its zeros, and D."""
    from pairsim.plots.curves import draw_curve

    return draw_curve(directory, out, page)


FORCE = names_of(1, *FORCES)  # columns of the only point of a single particle that is moved


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


QUESTION = Question(
    model=CurveCase,
    check=check_curve,
    estimate=estimate,
    solve=solve,
    tables=("curve", "equilibria", "way"),
    answer=answer,
    in_sweeps=InSweeps(result_columns, read, neighbours=("De", "Ca_e")),
    draw=draw,
    captions={"curve": "Relative velocity and shapes over distance"},
    afterwards=lambda folder, pair: (
        f"pairsim travel {folder} --from D --to D gives the time and tube that a pair needs"
        if pair
        else f"pairsim plot {folder} draws it"
    ),
    distances={"d": {"start": 0.02, "stop": 0.8, "num": 9}},
    frames="d",
    draws_from=2,  # one point is no line, and matplotlib takes as long as a point
    flags=("sensitivities",),
)
