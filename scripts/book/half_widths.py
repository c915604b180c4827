"""Statements that errors are inside the half-widths of 95 % intervals."""

from __future__ import annotations

import pandas as pd

from book.statements import Judged

INSIDE, BEYOND = 0.95, 2.0
"""Least fraction of errors that must be inside their half-widths, and the largest ratio of an error to its half-width.
"""


def mostly_inside(inside: pd.Series, what: str, whose: str = "their half-widths") -> dict[str, Judged]:
    """The statement that nearly all errors are inside half-widths.

    Args:
        inside: Whether each error is inside.
        what: What has the errors, such as "dU".
        whose: The half-widths, in words.
    """
    share = float(inside.mean()) if len(inside) else 0.0
    text = f"at least {100 * INSIDE:.0f} % of {what} are inside {whose}"
    return {text: Judged(((share - INSIDE, 0.0),), f"{inside.sum()} of {len(inside)}: {100 * share:.1f} %")}


def half_widths_hold(ratio: pd.Series, known: pd.Series | float, what: str) -> dict[str, Judged]:
    """The statements that errors are inside half-widths, nearly all of them, and that none is far beyond.

    Args:
        ratio: Errors over half-widths.
        known: Half-widths of the references over those that are judged; 0 where they count as exact.
        what: What has the half-widths, such as "dU".
    """
    margins = pd.DataFrame({"margin": BEYOND - ratio, "known": known})
    largest = f"largest error over half-width {ratio.max():.2f}" if len(ratio) else "none is judged"
    return {
        **mostly_inside(ratio <= 1, what),
        f"none is beyond {BEYOND:g} half-widths": Judged(tuple(margins.itertuples(index=False, name=None)), largest),
    }
