"""What run.json and warnings say of the meshes that `accuracy` has led to."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from pairsim.config.case import SceneCase
from pairsim.questions.warnings import above
from pairsim.solvers.curves.adaptation import AdaptiveBranch
from pairsim.solvers.curves.branch import Point
from pairsim.solvers.curves.curve import ROUNDING
from pairsim.solvers.steady.continuation import where

MOST_NAMED = 5  # distances that a warning names


def adaptation_report(
    case: SceneCase, branch: AdaptiveBranch, points: Sequence[Point], sizes: Sequence[float], what: str
) -> tuple[dict[str, Any], list[str]]:
    """The entry of run.json, and a warning of the points whose error is larger than wanted.

    Args:
        case: The case.
        branch: Its branch.
        points: Points whose error should be small.
        sizes: What the error of dU at each of them is a part of [U_av].
        what: What these are, in words.
    """
    wanted, errors = case.error_wanted, dict[str, float]()
    by_ends = False
    for point, size in zip(points, sizes, strict=True):
        if size > ROUNDING:
            error, ends = float(point.estimate.dU_error.max()) / size, float(point.estimate.ends_error.max()) / size
            by_ends = by_ends or (error > max(wanted, *errors.values(), 0.0) and ends > error / 2)
            errors[where(point.parameters)] = error
    missed = [place for place, error in errors.items() if error > wanted]
    worst = max(errors.values(), default=0.0)
    entry = {
        "wanted": wanted,
        "reached": worst,
        "kept": not missed,
        "meshes": [
            {"d": gaps[0] if len(set(gaps)) == 1 else list(gaps), "unknowns": n, "rounds": branch.rounds[gaps]}
            for gaps, n in sorted(branch.unknowns.items())
        ],
    }
    if not missed:
        return entry, []
    more = f" and {len(missed) - MOST_NAMED} more" if len(missed) > MOST_NAMED else ""
    held = " and ".join(f"mesh.{name}" for name in sorted(case.held))
    advice = "; use a larger length" if by_ends else f"; leave out {held}" if held else ""
    warning = (
        f"accuracy: {case.accuracy} was not kept at {', '.join(missed[:MOST_NAMED])}{more}: dU_error is up to "
        f"{above(100 * worst, 100 * wanted)} % of {what}{advice}"
    )
    return entry, [warning]
