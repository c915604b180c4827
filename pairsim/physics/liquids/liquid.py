"""A liquid: a solvent with a viscosity law, and polymer modes, each with a law of the conformation."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, ClassVar, Literal

from pairsim.physics.fields import PRESSURE, VELOCITY, Field
from pairsim.physics.liquids.conformation import LOG_CONFORMATION, ConformationLaw, Invariants
from pairsim.physics.liquids.newtonian import Newtonian
from pairsim.physics.liquids.viscous import ViscousLaw
from pairsim.physics.liquids.yielding import YieldLaw
from pairsim.physics.material import Material, Parameter, between
from pairsim.physics.operations import sqrt
from pairsim.quantities.measurable import a_time, a_viscosity

if TYPE_CHECKING:
    from ufl.core.expr import Expr

SEVERAL_TIMES = "; several relaxation times are modes, liquid: {law: modes, modes: [...]}"
LEAST_STRAIN2 = 1e-12  # added to |c_d|^2, so that |tau_d| has a derivative at rest; chosen
# Deborah number of the first solution from undeformed spheres: log c overflows from 0.02 on in gaps of 0.02, and from
# 0.05 on at N_p 28.
COLD_DEBORAH = 0.01


@dataclass(frozen=True)
class Liquid:
    """A liquid with all its parameters: the one owner of De, xi and the parameters of its laws.

    The extra stress is 2 xi eta(gamma) e(u) + sum_i tau_i, in units of eta_0 U_av/D_c.

    Attributes:
        solvent: Its viscosity law.
        xi: Viscosity of the solvent over eta_0; 1 without modes.
        De: Deborah number, 0 without modes.
        modes: The modes of the polymer; none in a liquid without a memory.
        yielding: The law by which a yield stress stops the relaxation of its only mode; None without one.
    """

    solvent: ViscousLaw = Newtonian()
    xi: Any = 1.0
    De: Any = 0.0
    modes: tuple[ConformationLaw, ...] = ()
    yielding: YieldLaw | None = None

    OF_POLYMER: ClassVar[dict[str, Parameter]] = {
        "De": Parameter(
            r"\mathrm{De}",
            "Deborah number lambda U_av/D_c; 0 is a liquid without elasticity",
            1e-6,
            1e4,
            dimension=a_time(
                "relaxation",
                "relaxation time lambda; gives De = lambda U_av/D_c",
                r"\lambda",
                uncertain=True,
                if_several=SEVERAL_TIMES,
            ),
        ),
        "xi": Parameter(
            r"\xi",
            "solvent viscosity over eta_0",
            1e-4,
            1.0,
            default=0.09,
            dimension=a_viscosity(
                "solvent", "viscosity of the solvent eta_s; gives xi = eta_s/eta_0", symbol=r"\eta_s", uncertain=True
            ),
        ),
    }

    @property
    def newtonian(self) -> bool:
        """Whether the stress is that of a Newtonian liquid: linear in the velocity, without a memory."""
        return self.solvent.linear and not self.has_memory

    @property
    def transported(self) -> tuple[Field, ...]:
        """The transported fields that its laws declare; the conformations of all modes are one field."""
        of_modes = (LOG_CONFORMATION.times(len(self.modes)),) if self.modes else ()
        return *self.solvent.transported, *of_modes

    @property
    def has_memory(self) -> bool:
        """Whether its stress depends on the history of the motion, and not on the present motion alone."""
        return bool(self.transported)

    @property
    def fields(self) -> tuple[Field, ...]:
        """Its unknowns, apart from those of its mesh."""
        return VELOCITY, PRESSURE, *self.transported

    @property
    def structure(self) -> str:
        """The names of its laws, on which its forms depend, such as "giesekus" or "oldroyd-b+fene-p/carreau"."""
        polymer = "+".join(mode.name for mode in self.modes)
        if not polymer:
            return self.solvent.name
        polymer += f"@{self.yielding.name}" if self.yielding else ""
        return polymer if isinstance(self.solvent, Newtonian) else f"{polymer}/{self.solvent.name}"

    @property
    def label(self) -> str:
        """Its name in pictures and sentences."""
        polymer = " + ".join(dict.fromkeys(mode.label for mode in self.modes))
        if not polymer:
            return self.solvent.label
        polymer = f"{self.yielding.label} {polymer}" if self.yielding else polymer
        count = f"{len(self.modes)} modes: " if len(self.modes) > 1 else ""
        return f"{count}{polymer}" + ("" if self.solvent.linear else f" in {self.solvent.label}")

    @property
    def numbers(self) -> dict[str, float]:
        """All parameters by name; those of laws are preceded by their place: "solvent.n", "modes.0.alpha"."""
        found = {f"solvent.{name}": value for name, value in self.solvent.numbers.items()}
        if self.modes:
            found |= {"De": self.De, "xi": self.xi}
        for i, mode in enumerate(self.modes):
            own = {"time": mode.time, "weight": mode.weight, **mode.numbers}
            found |= {f"modes.{i}.{name}": value for name, value in own.items()}
        return found | {f"yielding.{name}": x for name, x in (self.yielding.numbers if self.yielding else {}).items()}

    def with_numbers(self, numbers: Mapping[str, float | Expr]) -> Liquid:
        """The same liquid with other parameters, or with constants of a form in place of them."""

        def of(place: str) -> dict[str, float | Expr]:
            return {key.removeprefix(place): value for key, value in numbers.items() if key.startswith(place)}

        modes = tuple(replace(mode, **of(f"modes.{i}.")) for i, mode in enumerate(self.modes))
        own = {key: value for key, value in numbers.items() if "." not in key}
        yielding = self.yielding and replace(self.yielding, **of("yielding."))
        return replace(self, solvent=replace(self.solvent, **of("solvent.")), modes=modes, yielding=yielding, **own)

    def with_De(self, De: float) -> Liquid:
        """The same liquid at another Deborah number; one without modes has none."""
        return replace(self, De=De) if self.modes else self

    @property
    def regularisation(self) -> str:
        """Key in `numbers` of the parameter that rounds off a kink of the solvent's stress; "" without one."""
        return self.solvent.regularisation and f"solvent.{self.solvent.regularisation}"

    def sharper(self, factor: float) -> Liquid:
        """The same liquid with the kink of its stress, if it has one, sharper by a factor."""
        if self.yielding is not None:
            return replace(self, yielding=replace(self.yielding, width=self.yielding.width / factor))
        numbers, m = self.numbers, self.regularisation
        return self.with_numbers(numbers | {m: factor * numbers[m]}) if m else self

    def towards(self, other: Liquid, tau: float) -> Liquid:
        """A liquid between this one (tau = 0) and another one of the same laws (tau = 1).

        The interpolation is geometric in De and in the regularisation, and linear in all other parameters.
        """
        return self.with_numbers(between(self.numbers, other.numbers, tau, {"De", self.regularisation}))

    def easier(self) -> Liquid:
        """The same liquid with parameters at which a solution is found from undeformed spheres."""
        return replace(self.with_De(min(self.De, COLD_DEBORAH)), solvent=self.solvent.easier())

    def modulus(self, mode: ConformationLaw) -> Any:
        """Modulus G of a mode, (1 - xi) weight/De, in units of eta_0 U_av/D_c."""
        return (1 - self.xi) * mode.weight / (self.De * mode.time)

    def relaxation(self, mode: ConformationLaw, at: Invariants) -> tuple[Any, ...]:
        """The scalars g_0, g_1 and g_2 of a mode, multiplied by the factor kappa of a yield stress."""
        g = mode.relaxation(at)
        if self.yielding is None:
            return g
        kappa = self.yielding.factor(self.magnitude(mode, at))
        return tuple(kappa * each for each in g)

    def magnitude(self, mode: ConformationLaw, at: Invariants) -> Any:
        """Magnitude |tau_d| of the deviatoric stress of a mode, |tau_d|^2 = tau_d : tau_d/2 [eta_0 U_av/D_c]."""
        strain2 = (at.square - at.trace**2 / 3) / 2 + LEAST_STRAIN2
        return self.modulus(mode) * sqrt(mode.stress(at)[1] ** 2 * strain2)

    @property
    def plastic(self) -> ViscousLaw | YieldLaw:
        """The law with the attribute `yield_stress`, which is 0 in a liquid without one."""
        return self.yielding or self.solvent

    def relaxation_time(self, mode: ConformationLaw) -> Any:
        """Relaxation time of a mode [D_c/U_av]."""
        return self.De * mode.time

    @property
    def longest(self) -> float:
        """The longest of the relaxation times of modes and solvent [D_c/U_av]; 0 without a memory."""
        return max([float(self.solvent.memory), *(float(self.relaxation_time(mode)) for mode in self.modes)])

    @property
    def cells(self) -> Literal["newtonian", "viscous", "thinning", "hardening"]:
        """The kind of velocity profile and of stress layers at the particles, from which cell sizes are chosen."""
        if not self.modes:
            return "newtonian" if self.newtonian else "viscous"
        return "hardening" if any(mode.hardens for mode in self.modes) else "thinning"


NEWTONIAN = Liquid()


def single(law: Material, De: float = 0.0, xi: float = 0.09) -> Liquid:
    """The liquid of one law: a viscosity law alone, or one mode at a Deborah number in a Newtonian solvent.

    At De = 0 a viscoelastic liquid is Newtonian.
    """
    if isinstance(law, ViscousLaw):
        return Liquid(law)
    assert isinstance(law, ConformationLaw)
    return Liquid(Newtonian(), xi, De, (law,)) if De > 0 else NEWTONIAN
