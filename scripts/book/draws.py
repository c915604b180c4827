"""Random scenes with one particle: laws of a liquid and of a solid, with their numbers, and both kinds of ends."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

LIQUIDS: dict[str, Callable[[Draw], dict[str, Any]]] = {
    "newtonian": lambda draw: {},
    "power-law": lambda draw: {"n": draw.between(0.4, 1.2)},
    "giesekus": lambda draw: {"alpha": draw.between(0.02, 0.5)},
    "ptt-exp": lambda draw: {"epsilon": draw.evenly_in_log(0.02, 0.5)},
    "oldroyd-b": lambda draw: {},
    "fene-p": lambda draw: {"L2": draw.evenly_in_log(20.0, 500.0)},
}
"""Liquids by name, each with the function that draws its parameters. Those without a memory come first."""
WITHOUT_MEMORY = ("newtonian", "power-law")


class Draw:
    """Draws the numbers of one scene, to three digits.

    Args:
        seed: Seed of the random numbers.
        De, Ca_e: Ranges from which these are drawn, uniformly in their logarithms.
        rigid: Probability that the particle is rigid.
        beta: Range from which beta is drawn, uniformly.
    """

    def __init__(
        self, seed: int, De: tuple[float, float], Ca_e: tuple[float, float], rigid: float, beta: tuple[float, float]
    ) -> None:
        self.generator = np.random.default_rng(seed)
        self.De, self.Ca_e, self.rigid, self.beta = De, Ca_e, rigid, beta

    def happens(self, probability: float) -> bool:
        return bool(self.generator.random() < probability)

    def between(self, low: float, high: float) -> float:
        return float(f"{self.generator.uniform(low, high):.3g}")

    def evenly_in_log(self, low: float, high: float) -> float:
        return float(f"{low * (high / low) ** self.generator.random():.3g}")

    def solid(self) -> dict[str, Any]:
        kinds: list[dict[str, Any]] = [
            {"law": "neo-hookean"},
            {"law": "mooney-rivlin", "c": self.between(0.0, 0.5)},
            {"law": "kelvin-voigt", "eta": self.evenly_in_log(0.1, 10.0)},
        ]
        return kinds[int(self.generator.choice(len(kinds), p=(0.5, 0.25, 0.25)))]

    def scene(self, liquid: str) -> dict[str, Any]:
        """A scene in one of `LIQUIDS`, as keys of a case."""
        scene: dict[str, Any] = {"particles": 1, "liquid": {"law": liquid} | LIQUIDS[liquid](self)}
        scene["De"] = 0 if liquid in WITHOUT_MEMORY else self.evenly_in_log(*self.De)
        rigid = self.happens(self.rigid)
        scene["Ca_e"] = 0 if rigid else self.evenly_in_log(*self.Ca_e)
        if not rigid:
            scene["solid"] = self.solid()
        scene["beta"] = self.between(*self.beta)
        return scene | ({"ends": "developed", "length": "auto"} if self.happens(0.8) else {"ends": "periodic"})


def scenes(seed: int, count: int, liquids: Sequence[str], **ranges: Any) -> dict[str, dict[str, Any]]:
    """Random scenes by name, with the liquids in turn. Each has its own seed, so that it does not depend on the others.

    Args:
        seed: Number from which the seeds of all follow.
        count: Number of scenes.
        liquids: Names of liquids.
        **ranges: As for `Draw`.
    """
    found = {}
    for i in range(count):
        liquid = liquids[i % len(liquids)]
        found[f"{i:02d}-{liquid}"] = Draw(1000 * seed + i, **ranges).scene(liquid)
    return found
