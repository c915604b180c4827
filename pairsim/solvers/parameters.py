"""Where a quasi-steady scene is in the space of its parameters."""

from __future__ import annotations

from dataclasses import dataclass, replace


@dataclass(frozen=True)
class Parameters:
    """Where a scene is in the space of its parameters.

    Attributes:
        gaps: Distances between facing surfaces on the axis, (N-1,).
        Ca_es: Elastic capillary numbers, 0 for rigid particles, (N,).
        De: Deborah number; 0 without polymer.
        size: Factor of all particle diameters; differs from 1 only for derivatives with respect to beta.
    """

    gaps: tuple[float, ...]
    Ca_es: tuple[float, ...]
    De: float = 0.0
    size: float = 1.0

    def with_gap(self, d: float) -> Parameters:
        """All gaps equal to d."""
        return replace(self, gaps=(d,) * len(self.gaps))
