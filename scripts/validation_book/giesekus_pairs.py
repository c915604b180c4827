"""Critical distances of rigid pairs in a Giesekus liquid, beside what publications say of them in words."""

from __future__ import annotations

from itertools import pairwise

import pairsim
from pairsim.results.units import with_error
from validation_book.comparisons import CONFIGS, Found, Keys, Setting, rows_of, text_table

CASE = CONFIGS / "giesekus-pair.yaml"
# What is varied, and its values; published is that d_cr falls with each (Esposito et al. 2024 on their reference 20).
LINES: dict[str, tuple[float, ...]] = {"De": (0.25, 0.5, 1.0), "alpha": (0.1, 0.2, 0.4), "beta": (0.3, 0.4, 0.5)}
COARSE: Keys = {"mesh": {"Np": 12, "max_size": 0.2}}


def compute(setting: Setting) -> Found:
    """d_cr along three lines through De 0.5, alpha 0.2, beta 0.4."""
    lines, said = [], []
    for key, values in LINES.items():
        if setting.quick and key != "De":
            continue
        found = {value: critical(setting, {key: value}) for value in (values[1:] if setting.quick else values)}
        for value, (d, error) in found.items():
            lines.append([f"{key} {value:g}", with_error(d, error).replace("+-", "±")])
        said.append([f"the range of attraction shrinks as {key} grows", verdict(list(found.values()))])
    tables = {"critical": text_table(["De 0.5, alpha 0.2, beta 0.4 but", "critical distance d_cr"], lines)}
    return Found([], tables | {"statements": text_table(["statement", "pairsim"], said)})


def critical(setting: Setting, keys: Keys) -> tuple[float, float]:
    """The unstable distance with the half-width of its interval."""
    coarse = COARSE if setting.quick else {}
    row = next(row for row in rows_of(pairsim.critical(CASE, **(keys | coarse))) if not row["stable"])
    return row["d_cr"], row["d_error"]


def verdict(found: list[tuple[float, float]]) -> str:
    """Whether distances fall from one to the next, by more than their intervals."""
    falls = [(a - b) / (e + f) for (a, e), (b, f) in pairwise(found)]
    if min(falls) > 1:
        return "holds"
    if min(falls) < -1:
        return "does not hold"
    return "holds, in part within the intervals" if min(falls) > 0 else "undecided: changes are within the intervals"
