"""Kinds of quantities: the dimensionless unit of each, and the physical one that is shown in its place."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from pairsim.quantities.quantity import Quantity
from pairsim.quantities.scales import Scales


@dataclass(frozen=True)
class Unit:
    """A unit of columns: its name, that of the physical unit in its place ("" of pure numbers), and its size there."""

    name: str = ""
    physical: str = ""
    size: Callable[[Scales], float] = lambda _: 1.0

    @property
    def tex(self) -> str:
        return self.name.replace("eta_0", r"\eta_0").replace("U_av", "U_{av}")

    def factor(self, scales: Scales | None) -> float:
        """The factor to the physical unit; 1 without scales."""
        return 1.0 if scales is None else self.size(scales)

    def __call__(
        self, value: float | Iterable[float], form: str = ".4g", *, error: float = 0.0, named: bool = False
    ) -> Quantity:
        """A quantity of this kind, to stand in a message.

        Args:
            value: The number, or several in a list.
            form: How it is written without units, as in an f-string.
            error: Half-width of its interval, left out where it is 0.
            named: Whether the text without units has the name of the dimensionless unit, such as D_c.
        """
        texts = tuple(f"{each:{form}}" for each in (value if isinstance(value, Iterable) else (value,)))
        if error:
            return Quantity(self, (*texts, f"{error:.2g}"), " +- ", named)
        return Quantity(self, texts, named=named)


PURE = Unit()
TIME = Unit("D_c/U_av", "s", lambda scales: scales.time)
LENGTH = Unit("D_c", "um", lambda scales: 1e6 * scales.length)
POSITION = Unit("D_c", "mm", lambda scales: 1e3 * scales.length)
VELOCITY = Unit("U_av", "um/s", lambda scales: 1e6 * scales.velocity)
STRESS = Unit("eta_0 U_av/D_c", "Pa", lambda scales: scales.stress)
RATE = Unit("U_av/D_c", "1/s", lambda scales: 1 / scales.time)
AREA = Unit("D_c^2", "um^2", lambda scales: 1e12 * scales.length**2)
VOLUME = Unit("D_c^3", "um^3", lambda scales: 1e18 * scales.length**3)
FORCE = Unit("eta_0 U_av D_c", "nN", lambda scales: 1e9 * scales.stress * scales.length**2)
SECONDS = Unit("s", "s")
