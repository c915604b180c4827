"""Whether the particles of a case differ from each other, and by how much, in words."""

from __future__ import annotations

from pairsim.cases.case import SceneCase


def differ(case: SceneCase) -> bool:
    """Whether the particles of a case differ in size or stiffness."""
    return len({*case.betas}) > 1 or len({*case.Ca_es}) > 1


def difference_in_words(case: SceneCase) -> str:
    """By how much the two particles of a pair differ; "" if they do not."""
    if case.n != 2 or not differ(case):
        return ""
    (first, second), (soft, softer) = case.betas, case.Ca_es
    parts = [f"{second / first:.4g} times the diameter"] if first != second else []
    if soft != softer and min(soft, softer):
        parts.append(f"{soft / softer:.4g} times the modulus")
    ratios = [f"the leading one has {' and '.join(parts)} of the trailing one"] if parts else []
    if max(soft, softer) and not min(soft, softer):
        ratios.append(f"the {'leading' if soft else 'trailing'} one is rigid")
    return f"The beads differ: {', and '.join(ratios)}"
