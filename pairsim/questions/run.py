"""`pairsim run`: one case in time."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pairsim.config.case import Case
from pairsim.config.case_checks import check_together
from pairsim.config.cost import Estimate
from pairsim.questions.question import InSweeps, Question, Tables
from pairsim.results.columns import names_of

if TYPE_CHECKING:
    from pairsim.plots.style import Page
    from pairsim.questions.events import Events


def solve(case: Case, **more: Any) -> Events:
    """See `pairsim.questions.run_solving.solve`."""
    from pairsim.questions import run_solving

    return run_solving.solve(case, **more)


def estimate(case: Case) -> Estimate:
    """Size and duration of a run in time."""
    polymer = bool(case.liquid_model.modes)
    end, first = case.time.end, case.time.first_step
    if case.time.fixed_step is not None:
        steps = end / case.time.fixed_step
    else:
        pace = (3e-4 / case.time.tol) ** 0.45 if any(case.Ca_es) or polymer else 0.25
        steps = 10 * pace * math.log(1 + end / first) * (3 if polymer else 1) + end / case.time.max_step
    adapted = "; the mesh is adapted: what the run needs is known after a coarse one" if case.adapts else ""
    return Estimate.of(case, steps, adapted)


def answer(tables: Tables, record: dict[str, Any]) -> list[str]:
    """What the particles do at the end."""
    from pairsim.results.run_answer import answer_of_run

    return answer_of_run(tables["series"], record)


def draw(directory: Path, out: Path, page: Page) -> list[Path]:
    """Velocities and shapes over time, and dU over d."""
    from pairsim.plots.series import draw_series

    return draw_series(directory, out, page)


def result_columns(case: Case) -> tuple[str, ...]:
    """Result columns of a run: those of the last row of series.csv."""
    return ("t", *names_of(case.n, "d", "dU", "U", "D"), "dp")


QUESTION = Question(
    model=Case,
    check=check_together,
    estimate=estimate,
    solve=solve,
    tables=("series",),
    answer=answer,
    nothing="No step was completed.",
    in_sweeps=InSweeps(
        result_columns, parameters=("beta", "De", "Ca_e", "d0"), last=("steps", "unknowns", "wall_time")
    ),
    draw=draw,
    captions={"series": "Velocities and shapes over time, relative velocity over distance"},
    afterwards=lambda folder, _: (
        f"pairsim plot {folder} draws it; pairsim run --resume {folder} --set time.end=... continues"
    ),
    distances={"d0": 0.1},
    frames="t",
    resumable=True,
    draws_from=None,
)
