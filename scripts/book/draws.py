"""Scenes drawn at random: one to four particles, every law of a liquid and of a solid, both kinds of ends."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

LIQUIDS: dict[str, Callable[[Draw], dict[str, Any]]] = {
    "newtonian": lambda draw: {},
    "power-law": lambda draw: {"n": draw.between(0.4, 1.2)},
    "carreau": lambda draw: draw.carreau() | {"a": draw.between(1.0, 2.5), "eta_inf": draw.between(0.0, 0.3)},
    "giesekus": lambda draw: {"alpha": draw.between(0.02, 0.5)},
    "ptt-linear": lambda draw: {"epsilon": draw.evenly_in_log(0.02, 0.5)},
    "ptt-exp": lambda draw: {"epsilon": draw.evenly_in_log(0.02, 0.5)},
    "oldroyd-b": lambda draw: {},
    "fene-p": lambda draw: {"L2": draw.evenly_in_log(20.0, 500.0)},
    "white-metzner": lambda draw: draw.carreau(),
    "modes": lambda draw: {"modes": [draw.mode(1.0), draw.mode(draw.between(0.05, 0.4))]},
    "thinning-solvent": lambda draw: {"law": "giesekus", "solvent": {"law": "carreau", **draw.carreau()}},
}
"""Liquids by name, each with what draws its parameters. Those without a memory come first."""
WITHOUT_MEMORY = ("newtonian", "power-law", "carreau")
PARTICLES, SHARES = (1, 2, 3, 4), (0.15, 0.5, 0.2, 0.15)


class Draw:
    """What one scene is drawn with, to three digits.

    Args:
        seed: Of the generator.
        De, Ca_e: What they are drawn from, evenly in their logarithms.
        particles: Their number; drawn where it is 0.
        rigid: Probability that all particles are rigid.
        beta: What it is drawn from, evenly.
        d: What it is drawn from, evenly in its logarithm.
    """

    def __init__(
        self,
        seed: int,
        De: tuple[float, float] = (0.1, 3.0),
        Ca_e: tuple[float, float] = (0.002, 0.2),
        particles: int = 0,
        rigid: float = 0.33,
        beta: tuple[float, float] = (0.15, 0.6),
        d: tuple[float, float] = (0.03, 0.8),
    ) -> None:
        self.generator = np.random.default_rng(seed)
        self.De, self.Ca_e, self.particles, self.rigid = De, Ca_e, particles, rigid
        self.beta, self.d = beta, d

    def happens(self, probability: float) -> bool:
        return bool(self.generator.random() < probability)

    def between(self, low: float, high: float) -> float:
        return float(f"{self.generator.uniform(low, high):.3g}")

    def evenly_in_log(self, low: float, high: float) -> float:
        return float(f"{low * (high / low) ** self.generator.random():.3g}")

    def each(self, count: int, same: float, value: Callable[[], Any]) -> Any:
        """A value for all, with the probability `same`, or one for each."""
        return value() if count < 2 or self.happens(same) else [value() for _ in range(count)]

    def carreau(self) -> dict[str, Any]:
        return {"n": self.between(0.4, 0.9), "Cu": self.evenly_in_log(0.3, 30.0)}

    def mode(self, time: float) -> dict[str, Any]:
        law = str(self.generator.choice(["giesekus", "ptt-linear", "ptt-exp", "fene-p"]))
        return {"law": law, "time": time, "weight": self.between(0.2, 1.0), **LIQUIDS[law](self)}

    def solid(self) -> dict[str, Any]:
        kinds: list[dict[str, Any]] = [
            {"law": "neo-hookean"},
            {"law": "mooney-rivlin", "c": self.between(0.0, 0.5)},
            {"law": "kelvin-voigt", "eta": self.evenly_in_log(0.1, 10.0)},
        ]
        return kinds[int(self.generator.choice(len(kinds), p=(0.5, 0.25, 0.25)))]

    def scene(self, liquid: str) -> dict[str, Any]:
        """A scene in one of `LIQUIDS`, as the keys of a curve with one point."""
        count = self.particles or int(self.generator.choice(PARTICLES, p=SHARES))
        scene: dict[str, Any] = {"particles": count, "liquid": {"law": liquid} | LIQUIDS[liquid](self)}
        scene["De"] = 0 if liquid in WITHOUT_MEMORY else self.evenly_in_log(*self.De)
        rigid = self.happens(self.rigid)
        scene["Ca_e"] = 0 if rigid else self.each(count, 0.7, lambda: self.evenly_in_log(*self.Ca_e))
        if not rigid:
            scene["solid"] = self.each(count, 0.8, self.solid)
        # Equal rigid particles keep their distance where the liquid has no memory.
        same = 0.0 if rigid and liquid in WITHOUT_MEMORY else 0.6
        scene["beta"] = self.each(count, same, lambda: self.between(*self.beta))
        if count > 1:
            d = self.each(count - 1, 0.5, lambda: self.evenly_in_log(*self.d))
            scene["d"] = [d]
        return scene | ({"ends": "developed", "length": "auto"} if self.happens(0.8) else {"ends": "periodic"})


def scenes(
    seed: int, count: int, name: str = "", liquids: Sequence[str] = tuple(LIQUIDS), **ranges: Any
) -> dict[str, dict[str, Any]]:
    """So many scenes by name, the liquids in turn. Each has a seed of its own, whatever the others draw.

    Args:
        seed: Of all of them.
        count: Number of scenes.
        name: What their names begin with.
        liquids: Names of liquids.
        **ranges: As for `Draw`.
    """
    found = {}
    for i in range(count):
        liquid = liquids[i % len(liquids)]
        scene = Draw(1000 * seed + i, **ranges).scene(liquid)
        found[f"{name}{i:02d}-{liquid}-N{scene['particles']}"] = scene
    return found
