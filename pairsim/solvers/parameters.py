"""Parameters of a quasi-steady scene that vary along a branch."""

from __future__ import annotations

from dataclasses import dataclass, replace


@dataclass(frozen=True)
class Parameters:
    """Parameters of a quasi-steady scene.

    Attributes:
        gaps: Distances between facing surfaces on the axis from upstream [D_c], N-1 values.
        Ca_es: Elastic capillary numbers, 0 for rigid particles, N values.
        De: Deborah number, 0 for a Newtonian liquid.
        size: Factor of all particle diameters; differs from 1 only for derivatives with respect to beta.
    """

    gaps: tuple[float, ...]
    Ca_es: tuple[float, ...]
    De: float = 0.0
    size: float = 1.0

    def with_gap(self, d: float) -> Parameters:
        """The same parameters with all distances equal to d."""
        return replace(self, gaps=(d,) * len(self.gaps))

    def with_longer_gap(self, i: int, change: float) -> Parameters:
        """The same with gap i, from upstream, longer by a change [D_c]."""
        return replace(self, gaps=(*self.gaps[:i], self.gaps[i] + change, *self.gaps[i + 1 :]))
