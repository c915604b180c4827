"""When and with which code stored results were computed, as a sentence."""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd

from book.study import Part


def made(results: pd.DataFrame, parts: Sequence[Part]) -> str:
    """A sentence: how many parts are computed, when, and with how many states of the code, or at which commits.

    Args:
        results: Stored rows, at least one, as `Results.of` returns them.
        parts: All parts of the study.
    """
    done = results.drop_duplicates("part")
    days = sorted({done["computed"].min(), done["computed"].max()})
    text = f"{len(done)} of {len(parts)} parts are computed, {' to '.join(days)}"
    commits = sorted({code for code in done["code"].unique() if " " in code and "," not in code})
    states = done["code"].nunique() - len(commits)
    code = [f"at {each}" for each in commits] + [f"with {states} state{'s' * (states > 1)} of the code"] * (states > 0)
    return f"{text}, {' and '.join(code)}."
