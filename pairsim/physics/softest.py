"""The softest particles that have a steady shape, in a Newtonian liquid and under the tension of a polymer."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pairsim.physics.liquids import Liquid

# Largest Ca_e with steady shapes and its relative variation, by beta: equal pairs at six distances from 0.02 to 0.8,
# each followed in Ca_e to the end of its branch on two meshes (docs/explanation/decisions.md, "Soft particles"). The
# distance matters little, since it is the flow at the wall that strains the rim of each particle.
LARGEST = {
    0.15: (0.423, 0.02),
    0.2: (0.319, 0.06),
    0.3: (0.214, 0.07),
    0.4: (0.157, 0.08),
    0.5: (0.127, 0.07),
    0.6: (0.110, 0.25),
    0.7: (0.093, 0.30),
}
WALL_RATE = 8.0  # shear rate at the wall of Poiseuille flow [U_av/D_c]
# Tension of the polymer at the wall, times beta, over the modulus, above which there is rarely a steady state: of
# nineteen points above it one had a steady state, of nineteen soft ones below it eighteen (fifty points at random, all
# laws, De .2 to 5, Ca_e to .3, beta .15 to .75, and ten of another seed).
TENSION = 1.5


def largest_Ca_e(beta: float) -> tuple[float, float]:
    """Largest Ca_e with a steady shape in a Newtonian liquid at a diameter beta, and its relative error.

    Between the computed values log(beta Ca_e) is linear in beta; beyond them it is constant.
    """
    from numpy import interp, log  # slow to import

    found = list(LARGEST)
    inside = min(max(beta, found[0]), found[-1])
    products = [log(b * Ca_e) for b, (Ca_e, _) in LARGEST.items()]
    error = interp(inside, found, [part for _, part in LARGEST.values()])
    return math.exp(interp(inside, found, products)) / beta, float(error)


def beyond_steady_shapes(betas: Sequence[float], Ca_es: Sequence[float]) -> Iterator[str]:
    """Yield a warning for each kind of particle softer than the softest with a steady shape in a Newtonian liquid."""
    for beta, Ca_e in sorted(set(zip(betas, Ca_es, strict=True))):
        largest, error = largest_Ca_e(beta)
        if Ca_e > largest * (1 + error):
            yield (
                f"Ca_e = {Ca_e:.3g} exceeds {largest:.2g} (within {100 * error:.0f} %), the largest at which particles "
                f"of beta {beta:.3g} have a steady shape in a Newtonian liquid: beyond it they stretch without limit"
            )


def tension(liquid: Liquid, betas: Sequence[float], Ca_es: Sequence[float]) -> float:
    """First normal stress difference at the wall times beta over the modulus G_p, of the softest particle."""
    softest = max((beta * Ca_e for beta, Ca_e in zip(betas, Ca_es, strict=True)), default=0.0)
    if not liquid.modes or not softest:
        return 0.0
    from numpy import array

    from pairsim.physics.homogeneous import steady_shear

    return float(steady_shear(liquid, array([WALL_RATE]))[1][0] * softest)


def beyond_tension(liquid: Liquid, betas: Sequence[float], Ca_es: Sequence[float]) -> Iterator[str]:
    """Yield a warning if the tension of the polymer is likely to stretch particles without limit."""
    if (ratio := tension(liquid, betas, Ca_es)) > TENSION:
        yield (
            f"the polymer may stretch the particles without limit: its tension at the wall (the first normal stress "
            f"difference), times beta, is {ratio:.2g} times their modulus; above {TENSION:g} one of nineteen cases had "
            "a steady state (docs/explanation/limits.md)"
        )
