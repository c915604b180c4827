"""The end of a run that does not give one: when a start from rest should be forgotten."""

from __future__ import annotations

from collections.abc import Iterable

from pairsim.cases.values import MOST_TIME

# Least end [D_c/U_av], factors of De and of the largest Ca_e, and how a viscosity of the particles over eta_0 increases
# the latter. The flow in the tube starts up like exp(-t/De), and soft pairs near each other (beta .5, d .04) forget
# their shape like exp(-t/(6 Ca_e)); the factors were chosen.
SHORTEST_RUN, RUN_PER_DE, RUN_PER_CAPILLARY, RUN_PER_VISCOSITY = 2.0, 6.0, 20.0, 0.45
DEFAULT_END = (
    f"the largest of {SHORTEST_RUN:g}, {RUN_PER_DE:g} De and {RUN_PER_CAPILLARY:g} Ca_e; later with "
    "slower modes and viscous particles"
)


def default_end(slowest: float, soft: Iterable[tuple[float, float]]) -> float:
    """End time [D_c/U_av].

    Args:
        slowest: The longest relaxation time of the liquid [D_c/U_av].
        soft: Ca_e of each particle, and its viscosity over eta_0.
    """
    of_particles = [RUN_PER_CAPILLARY * Ca_e * (1 + RUN_PER_VISCOSITY * eta) for Ca_e, eta in soft]
    end = max(SHORTEST_RUN, *of_particles, RUN_PER_DE * slowest)
    return float(f"{min(end, MOST_TIME):.3g}")
