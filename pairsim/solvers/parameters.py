"""Parameters of a quasi-steady scene that vary along a branch."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from pairsim.physics.liquids import NEWTONIAN, Liquid
from pairsim.physics.material import between
from pairsim.physics.solids import Solid

# Step of the central differences that approximate derivatives with respect to parameters. Chosen; sensitivities agree
# to 1e-3 with differences of neighbouring solutions.
DIFFERENCE = 1e-5


@dataclass(frozen=True)
class Parameters:
    """Parameters of a quasi-steady scene: distances and materials; De, Ca_e and those of laws belong to the materials.

    Attributes:
        gaps: Distances between facing surfaces on the axis from upstream [D_c], N-1 values.
        solids: The particles' materials, None for rigid particles, N entries.
        liquid: The liquid.
        sizes: Factors that multiply the particles' diameters, N values; empty where all are 1. They differ from 1 only
            for derivatives with respect to diameters.
        varied: Index, from upstream, of the only distance that varies along a curve; None where all distances vary and
            are equal.
        followed: Value of the quantity over which critical distances are followed, and on which liquid and solids
            depend (`pairsim.solvers.curves.equilibrium_lines.Followed`); 0 where there is none.
    """

    gaps: tuple[float, ...]
    solids: tuple[Solid | None, ...]
    liquid: Liquid = NEWTONIAN
    sizes: tuple[float, ...] = ()
    varied: int | None = None
    followed: float = 0.0

    @property
    def De(self) -> float:
        """Deborah number, 0 for a liquid without modes."""
        return float(self.liquid.De)

    @property
    def Ca_es(self) -> tuple[float, ...]:
        """Elastic capillary numbers, 0 for rigid particles, N values."""
        return tuple(0.0 if solid is None else float(solid.Ca_e) for solid in self.solids)

    def with_gap(self, d: float) -> Parameters:
        """The same parameters with all distances, or the only one that varies, equal to d [D_c]."""
        return replace(self, gaps=tuple(d if self.varied in (None, i) else gap for i, gap in enumerate(self.gaps)))

    def with_longer_gap(self, i: int, change: float) -> Parameters:
        """These parameters with the i-th distance from upstream longer by `change` [D_c]."""
        return replace(self, gaps=(*self.gaps[:i], self.gaps[i] + change, *self.gaps[i + 1 :]))

    def diameters(self, betas: Sequence[float]) -> tuple[float, ...]:
        """The particles' diameters [D_c], N values, from those whose factors `sizes` are 1."""
        if not self.sizes:
            return tuple(betas)
        return tuple(beta * size for beta, size in zip(betas, self.sizes, strict=True))

    def resized(self, factors: Sequence[float]) -> Parameters:
        """These parameters with the particles' diameters multiplied by factors, N values."""
        return replace(self, sizes=self.diameters(factors))

    def with_De(self, De: float) -> Parameters:
        """These parameters at another Deborah number."""
        return replace(self, liquid=self.liquid.with_De(De))

    def less_regularised(self, factor: float) -> Parameters:
        """These parameters with the kink of the liquid's stress, if any, sharper by a factor: m is multiplied by it."""
        return replace(self, liquid=self.liquid.sharper(factor))

    def softer(self, factor: float) -> Parameters:
        """These parameters with every Ca_e multiplied by a factor."""
        return replace(self, solids=tuple(s and replace(s, Ca_e=s.Ca_e * factor) for s in self.solids))

    def softened(self, factors: Sequence[float]) -> Parameters:
        """These parameters with the Ca_e of each particle multiplied by a factor, N values."""
        each = zip(self.solids, factors, strict=True)
        return replace(self, solids=tuple(s and replace(s, Ca_e=s.Ca_e * factor) for s, factor in each))

    def with_Ca_e(self, Ca_e: float) -> Parameters:
        """These parameters with another Ca_e of all soft particles; rigid particles remain rigid."""
        return replace(self, solids=tuple(s and replace(s, Ca_e=Ca_e) for s in self.solids))

    def towards(self, end: Parameters, tau: float) -> Parameters:
        """Parameters on the way to others of the same laws: those of the liquid as in `Liquid.towards`, others linear.

        The displacement of the liquid's mesh is linear in the distances, so that a tangent predictor along a line that
        is linear in them is exact for the mesh.

        Args:
            end: Parameters at tau = 1.
            tau: Fraction of the way, from 0 to 1.
        """
        solids = zip(self.solids, end.solids, strict=True)
        return Parameters(
            tuple(a + (b - a) * tau for a, b in zip(self.gaps, end.gaps, strict=True)),
            tuple(a and b and a.with_numbers(between(a.numbers, b.numbers, tau, ())) for a, b in solids),
            self.liquid.towards(end.liquid, tau),
            self.sizes,
            self.varied,
            end.followed,
        )
