"""How hard it is to reach the first solution of a case, from two numbers of its liquid in simple flows.

Both were read off fifty points at random (`scripts/hard`): all laws, De .2 to 5, Ca_e to .3, beta .15 to .75.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from pairsim.config.softest import largest_Ca_e

if TYPE_CHECKING:
    from pairsim.physics.liquids import Liquid

WALL_RATE = 8.0  # shear rate at the wall of Poiseuille flow [U_av/D_c]
PASSAGE = 3.0  # time in the extension beside a particle, whose rate is about 1/(1 - beta) [D_c/U_av]
# The time of a point is that of a liquid at rest times exp(STRETCHED log(tr c/3)) after this extension; median of the
# fifty, beside other work, when 74 % were within a factor of 2 (30 % without it); alone most take half as long (52 %).
STRETCHED, MOST = 0.35, 40.0
# Tension of the polymer at the wall, times beta, over the modulus from which steady states end before: one of nineteen
# points above it had a steady state, of the nineteen soft ones below it eighteen (the fifty, and ten of another seed).
# Factors of the time until the end is known, in a viscoelastic and in another liquid.
TENSION, ELASTIC_END, VISCOUS_END = 1.5, 22.0, 25.0


def stretch(liquid: Liquid, beta: float) -> float:
    """tr c/3 of the polymer, the largest of its modes, after the extension of the liquid beside a particle."""
    if not liquid.modes:
        return 1.0
    from pairsim.physics.homogeneous import conformation_after, extension

    c = conformation_after(liquid, extension(1 / (1 - beta)), PASSAGE).reshape(-1, 4)
    return float((c[:, 0] + c[:, 2] + c[:, 3]).max() / 3)


def tension(liquid: Liquid, betas: Sequence[float], Ca_es: Sequence[float]) -> float:
    """First normal stress difference at the wall times beta over the modulus G_p, of the softest particle."""
    softest = max((beta * Ca_e for beta, Ca_e in zip(betas, Ca_es, strict=True)), default=0.0)
    if not liquid.modes or not softest:
        return 0.0
    from numpy import array

    from pairsim.physics.homogeneous import steady_shear

    return float(steady_shear(liquid, array([WALL_RATE]))[1][0] * softest)


def first_point_factor(liquid: Liquid, betas: Sequence[float], Ca_es: Sequence[float]) -> float:
    """How much longer the first solution takes than in a liquid at rest around stiff particles."""
    if not liquid.modes:
        beyond = any(Ca_e > largest_Ca_e(beta)[0] for beta, Ca_e in zip(betas, Ca_es, strict=True) if Ca_e)
        return VISCOUS_END if beyond else 1.0
    longer = math.exp(min(STRETCHED * math.log(stretch(liquid, max(betas))), math.log(MOST))) if betas else 1.0
    return max(longer, ELASTIC_END if tension(liquid, betas, Ca_es) > TENSION else 1.0)


def beyond_tension(liquid: Liquid, betas: Sequence[float], Ca_es: Sequence[float]) -> Iterator[str]:
    """What is said of particles that the tension of the polymer should stretch without limit."""
    if (ratio := tension(liquid, betas, Ca_es)) > TENSION:
        yield (
            f"the tension of the polymer at the wall times beta is {ratio:.2g} times the modulus of the particles: one "
            f"of nineteen points with more than {TENSION:g} had a steady state (docs/explanation/limits.md)"
        )
