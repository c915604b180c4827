"""Whether inertia, which the model leaves out, is negligible in an experiment."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from pairsim.cases.case import SceneCase

SMALL_RE = 1.0
SMALL_PART = 0.1  # inertia is negligible if Re beta^2 is below this fraction of the larger of Ca_e and De
RIGID = "rigid particles in a liquid without a memory keep their distance: only inertia, neglected here, changes it"
LARGE = "inertia may change the distance as much as the softness of the particles and the elasticity of the liquid"


@dataclass(frozen=True)
class Inertia:
    """The effect of inertia on the distance of particles, in comparison with softness and elasticity.

    Attributes:
        Re: The Reynolds number rho U_av D_c/eta_0.
        of_particle: Reynolds number of the largest particle, Re beta^2, by which inertia changes distances.
        drive: The larger of Ca_e and De, by which softness and elasticity change them.
        keeps_distance: Whether nothing but inertia changes distances.
    """

    Re: float
    of_particle: float
    drive: float
    keeps_distance: bool

    @classmethod
    def of(cls, case: SceneCase, Re: float) -> Inertia:
        """Inertia in a case whose Reynolds number rho U_av D_c/eta_0 is `Re`."""
        keeps_distance = not case.liquid_model.has_memory and not any(case.Ca_es)
        return cls(Re, Re * max(case.betas) ** 2, max(*case.Ca_es, case.De), keeps_distance)

    @property
    def is_negligible(self) -> bool:
        return self.Re <= SMALL_RE and self.of_particle <= SMALL_PART * self.drive

    @property
    def sentence(self) -> str:
        """The comparison in words, without a full stop."""
        verdict = "is" if self.is_negligible else "may not be"
        comparison = f"Re beta^2 = {self.of_particle:.2g} against {self.drive:.2g}, the larger of Ca_e and De"
        return f"inertia {verdict} negligible: Re = {self.Re:.2g}, {comparison}"

    @property
    def warnings(self) -> Iterator[str]:
        """Warnings of what a result without inertia leaves out."""
        if self.keeps_distance:
            yield RIGID
        elif not self.is_negligible:
            yield LARGE
