"""`pairsim critical`: the distances at which dU = 0."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from pairsim.config.cost import Estimate, steady_estimate
from pairsim.config.curve_case import CriticalCase, check_critical
from pairsim.questions.question import InSweeps, Question, Tables, Value, rows_in

if TYPE_CHECKING:
    from pairsim.plots.style import Page
    from pairsim.questions.events import Events

SHOWN = {"zeros": "d_cr", "stable": "stable"}


def solve(case: CriticalCase, **more: Any) -> Events:
    """See `pairsim.questions.critical_solving.solve`."""
    from pairsim.questions import critical_solving

    return critical_solving.solve(case, **more)


def estimate(case: CriticalCase) -> Estimate:
    """Size and duration of critical distances: on each line a search for zeros, then two branches over all values."""
    values = len(next(iter(case.along.values()))) if case.along else 1
    lines = len(next(iter(case.lines.values()))) if case.lines else 1
    return steady_estimate(case, lines * (15 + 4 * values))


def answer(tables: Tables, record: dict[str, Any]) -> list[str]:
    """Which critical distances there are, and where branches of them end."""
    from pairsim.results.answer import answer_of_critical, zeros_in

    return answer_of_critical(zeros_in(tables["critical"], "d_cr"), record)


def draw(directory: Path, out: Path, page: Page) -> list[Path]:
    """Critical distances over the parameter that was followed."""
    from pairsim.plots.critical import draw_critical

    return draw_critical(directory, out, page)


def read(tables: Tables) -> dict[str, Value]:
    """The result columns; lists in the order of critical.csv."""
    table = tables["critical"]
    wanted = table["kind"] == "wanted"
    return {"points": rows_in(table), **{name: table[of][wanted].tolist() for name, of in SHOWN.items()}}


QUESTION = Question(
    model=CriticalCase,
    check=check_critical,
    estimate=estimate,
    solve=solve,
    tables=("critical", "way"),
    answer=answer,
    nothing="No critical distance was found in the given range: dU keeps its sign.",
    in_sweeps=InSweeps(lambda _: ("points", "zeros", "stable"), read),
    draw=draw,
    captions={"critical": "Critical distances"},
    distances={"d": [0.02, 0.8]},
)
