"""The end of a run that does not give one: when a start from rest should be forgotten."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pairsim.config.values import MOST_TIME, is_finite

# Least end [D_c/U_av], and factors of De and of the largest Ca_e. The flow in the tube starts up like exp(-t/De), and
# soft pairs near each other (beta .5, d .04) forget their shape like exp(-t/(6 Ca_e)); the factors were chosen.
SHORTEST_RUN, RUN_PER_DE, RUN_PER_CAPILLARY = 2.0, 6.0, 20.0
DEFAULT_END = f"the largest of {SHORTEST_RUN:g}, {RUN_PER_DE:g} De and {RUN_PER_CAPILLARY:g} Ca_e"


def default_end(case: Mapping[str, Any]) -> float:
    """End time [D_c/U_av] of a case that need not be validated yet: a valid one for all values."""
    Ca_e, De = case.get("Ca_e"), case.get("De")
    softness = [value for value in (Ca_e if isinstance(Ca_e, list | tuple) else [Ca_e]) if is_finite(value)]
    end = max(SHORTEST_RUN, RUN_PER_CAPILLARY * max(softness, default=0.0), RUN_PER_DE * De if is_finite(De) else 0.0)
    return float(f"{min(end, MOST_TIME):.3g}")
