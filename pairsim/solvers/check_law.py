"""Requirements on a law, and how far it is from meeting them: for `pairsim check-law` and tests of the shipped laws."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import closing
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from pairsim.fem.algebra.constraints import PositionUpdate
from pairsim.fem.meshes.geometry import MeshSettings
from pairsim.physics.conformation import IDENTITY, relaxation
from pairsim.physics.homogeneous import conformation_after, extension, rate_of_change, shear, steady_shear, stress_after
from pairsim.physics.liquids import DEFAULT, ConformationLaw, Liquid, ViscousLaw, YieldLaw, single
from pairsim.physics.liquids.conformation import Invariants
from pairsim.physics.liquids.structured import StructuredLaw
from pairsim.physics.material import Material
from pairsim.physics.pipe import Pipe
from pairsim.physics.solids import Solid
from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import PairsimError
from pairsim.solvers.problems import Problem
from pairsim.solvers.stepping.step_size import StepControl
from pairsim.solvers.transient.transient import Transient

DE, XI, CA_E = 0.5, 0.09, 0.1  # numbers of the liquids and solids that are checked
RATES = 0.2, 2.0, 10.0  # shear rates [U_av/D_c]
COS, SIN = np.cos(0.7), np.sin(0.7)
TURN = np.array([[COS, -SIN, 0.0], [SIN, COS, 0.0], [0.0, 0.0, 1.0]])  # rotation of the frame in the (z, r) plane
STEPS = 1e-5, 1e-6, 1e-7, 1e-8, 1e-9  # of differences, relative to the unknowns; the last for nearly unsheared liquid
EXACT, SMALL, DISCRETE = 1e-10, 1e-5, 3e-3  # allowed errors of rounding, of differences, of cells and steps; chosen
# Exceptions that an unfinished law may raise.
WRONG = PairsimError, ArithmeticError, AttributeError, LookupError, NotImplementedError, TypeError, ValueError
JACOBIAN = "the Jacobian is that of differences"
TUBE = "the start-up in a tube is that of one dimension"
SCENES = JACOBIAN, TUBE  # statements that need a mesh; they are only checked if all others hold
NOT_TRIED = "not tried, as another statement is wrong"
Statement = tuple[str, float, Callable[[], float]]
SOLID = 0.01  # relaxation rate at rest up to which a law counts as solid there, for a rounded kink [1/De]; chosen
CELLS = 0.1, 0.05, 0.025, 0.0125  # cell sizes in the tube, tried until one resolves a kink of the stress [D_c]


@dataclass(frozen=True)
class Check:
    """A statement about a law.

    Attributes:
        says: The statement.
        off: Deviation from the statement; not finite where it could not be evaluated.
        allowed: Largest value of `off` at which the statement holds.
        why: Why it could not be checked; empty if it was.
    """

    says: str
    off: float
    allowed: float
    why: str = ""

    @property
    def holds(self) -> bool:
        """Whether the statement holds."""
        return bool(self.off <= self.allowed)


def sample(law: type[Material], given: Mapping[str, float]) -> Material:
    """A law whose parameters have given values, else their defaults, else values in the lower part of their ranges."""
    values = {}
    for name, p in law.parameters().items():
        inside = p.least * 10 if p.least > 0 else min(p.most / 10, 1.0)
        values[name] = given.get(name, p.default if p.default is not None else min(inside, p.most))
    return law(CA_E, **values) if issubclass(law, Solid) else law(**values)


def checks(law: Material) -> Iterator[Check]:
    """Check the statements about a law, the fast ones first; those of `SCENES` compile its forms."""
    statements: dict[type[Material], Callable[[Any], Iterator[Statement]]]
    statements = {ConformationLaw: _of_conformation, ViscousLaw: _of_viscosity, Solid: _of_solid}
    statements[YieldLaw] = lambda law: _in_the_tube(replace(single(sample(DEFAULT, {}), DE, XI), yielding=law))
    (of_kind,) = (each for kind, each in statements.items() if isinstance(law, kind))
    right = True
    alike: Statement = "numbers, arrays, complex numbers and forms give the same", EXACT, lambda: _alike(law)
    for says, allowed, off in (alike, *of_kind(law)):
        check = _checked(says, allowed, off) if right or says not in SCENES else Check(says, np.inf, allowed, NOT_TRIED)
        right = right and check.holds
        yield check


def _checked(says: str, allowed: float, off: Callable[[], float]) -> Check:
    try:
        with np.errstate(all="ignore"):
            return Check(says, float(off()), allowed)
    except WRONG as no:
        return Check(says, np.inf, allowed, f"{type(no).__name__}: {no}")


def _scalars(law: Material, number: Callable[[float], Any]) -> tuple[Any, ...]:
    """All scalar functions of a law at one set of arguments, which `number` converts from floats."""
    if isinstance(law, StructuredLaw):
        state = [number(0.4) for _ in law.transported]
        return (law.viscosity(number(2.3)), law.viscosity_at(number(2.3), *state), *law.rates(number(2.3), *state))
    if isinstance(law, ViscousLaw):
        return (law.viscosity(number(2.3)),)
    if isinstance(law, YieldLaw):
        return (law.factor(number(2.3)),)
    if isinstance(law, ConformationLaw):
        at = Invariants(number(3.7), number(5.9), number(2.3))
        return (*law.relaxation(at), *law.stress(at))
    assert isinstance(law, Solid)
    return law.response(number(3.04), number(3.03))


def _alike(law: Material) -> float:
    """Largest relative difference between the values that a law has for floats, arrays, complex numbers and in UFL."""
    import ufl

    plain = np.array([complex(each) for each in _scalars(law, lambda x: x)])
    others = [
        [complex(np.ravel(each)[0]) for each in _scalars(law, lambda x: np.array([x]))],
        [complex(np.ravel(each)[0]).real for each in _scalars(law, lambda x: np.array([x + 1e-30j * x]))],
        [complex(ufl.as_ufl(each)(())) for each in _scalars(law, lambda x: ufl.as_ufl(x))],
    ]
    return float(np.max(np.abs(np.array(others) - plain) / np.maximum(np.abs(plain), 1e-300)))


def _turned(tensor: Array) -> Array:
    """A tensor, (zz, zr, rr, tt), in the rotated frame."""
    zz, zr, rr, tt = tensor
    turned = TURN @ np.array([[zz, zr, 0.0], [zr, rr, 0.0], [0.0, 0.0, tt]]) @ TURN.T
    return np.array([turned[0, 0], turned[0, 1], turned[1, 1], tt])


def _of_conformation(law: ConformationLaw) -> Iterator[Statement]:
    rest, liquid = Invariants(3.0, 3.0, 1e-12), single(law, DE, XI)

    def unsteady(L: Array) -> float:
        """Rate of change of c [1/De], relative to c, when a flow should be steady; infinite if c is not positive."""
        c = conformation_after(liquid, L, 100 * DE)
        zz, zr, rr, tt = c
        tensor = np.array([[zz, zr, 0], [zr, rr, 0], [0, 0, tt]])
        if not np.isfinite(c).all() or np.linalg.eigvalsh(tensor).min() <= 0:
            return float(np.inf)
        return float(DE * np.abs(rate_of_change(liquid, law, c[:, None], L)).max() / np.abs(c).max())

    def beside_newton() -> float:
        """Relative difference of viscosity and N1 in steady shear between Newton's method and integration in time."""
        rate = RATES[1]
        tau = stress_after(liquid, shear(rate), 100 * DE)
        viscosity, N1 = steady_shear(liquid, np.array([rate, RATES[2]]))
        found, wanted = np.array([viscosity[0], N1[0]]), np.array([XI + tau[1] / rate, tau[0] - tau[2]])
        return float(np.abs(found - wanted).max() / np.abs(wanted).max())

    def lost(L: Array) -> float:
        """Magnitude of the power of the polymer's stress in steady flow if it is negative, relative to the stress."""
        tau = stress_after(liquid, L, 100 * DE)
        D = (L + L.T) / 2
        work = tau[0] * D[0, 0] + 2 * tau[1] * D[0, 1] + tau[2] * D[1, 1] + tau[3] * D[2, 2]
        return float(max(-work, 0.0) / np.abs(tau).max())

    def turned() -> float:
        L = shear(RATES[1])
        found, wanted = stress_after(liquid, TURN @ L @ TURN.T, DE), _turned(stress_after(liquid, L, DE))
        return float(np.abs(found - wanted).max() / np.abs(wanted).max())

    def grows() -> float:
        c = IDENTITY[:, None] * (1 + 1e-4)
        return max(float(relaxation(liquid, law, c, np.array([1.0]))[0, 0]), 0.0)

    def not_in_De() -> float:
        g = law.relaxation(rest)
        rate = float(g[1] + 2 * g[2])
        return abs(rate - 1) if abs(rate) > SOLID else 0.0

    flows = [shear(rate) for rate in RATES] + [extension(0.3 / DE)]
    yield "at rest, c = I, nothing relaxes: g_0 + g_1 + g_2 = 0", EXACT, lambda: abs(sum(law.relaxation(rest)))
    yield "De is the relaxation time: g_1 + 2 g_2 = 1 at rest, or 0 below a yield stress", EXACT, not_in_De
    yield "there is no stress at rest: h_0 + h_1 = 0", EXACT, lambda: abs(sum(law.stress(rest)))
    yield "G is the modulus: h_1 = 1 at rest", EXACT, lambda: abs(law.stress(rest)[1] - 1)
    yield "a swollen state relaxes", 0.0, grows
    yield "shear and extension become steady, with a positive c", SMALL, lambda: max(map(unsteady, flows))
    yield "steady shear by Newton's method is where shear leads", SMALL, beside_newton
    yield "steady flows cost work", 0.0, lambda: max(map(lost, flows))
    yield "the stress turns with the frame", SMALL, turned
    yield from _in_the_tube(liquid)


def _of_viscosity(law: ViscousLaw) -> Iterator[Statement]:
    rates = np.logspace(-3, 3, 61)

    def falls() -> float:
        stress = rates * law.viscosity(rates**2)
        return float(max(-np.diff(np.log(stress)).min(), 0.0)) if (stress > 0).all() else float(np.inf)

    yield "the stress is positive, and grows with the shear rate", 0.0, falls
    if isinstance(law, StructuredLaw):
        yield from _of_structure(law)
    yield from _in_the_tube(single(law))


def _of_structure(law: StructuredLaw) -> Iterator[Statement]:
    rest = [field.rest for field in law.transported]
    yield "at rest nothing changes", EXACT, lambda: float(np.abs(law.rates(1e-24, *rest)).max() * law.memory)

    def unsteady() -> float:
        rates = [law.rates(rate**2, *law.in_steady_shear(rate**2)) for rate in RATES]
        return float(np.abs(rates).max() * law.memory)

    yield "in steady shear, too", EXACT, unsteady


def _of_solid(law: Solid) -> Iterator[Statement]:
    def at_rest() -> float:
        b1, b2 = law.response(3.0, 3.0)
        return float(abs(b1 - b2 - 1))

    def curl() -> float:
        """|d b_1/d I_2 + d b_2/d I_1|, which is zero if b_1 and -b_2 are derivatives of an energy."""
        h, (I1, I2) = 1e-5, (3.04, 3.03)
        by_2 = (law.response(I1, I2 + h)[0] - law.response(I1, I2 - h)[0]) / (2 * h)
        by_1 = (law.response(I1 + h, I2)[1] - law.response(I1 - h, I2)[1]) / (2 * h)
        return float(abs(by_2 + by_1))

    def turned() -> float:
        B = np.array([1.2, 0.1, 0.9, 1 / (1.2 * 0.9 - 0.01)])
        zz, zr, rr, tt = _turned(B)
        bb = B[0], B[1], B[2], B[3]
        found, wanted = np.array(law.stress((zz, zr, rr, tt))), _turned(np.array(law.stress(bb)))
        return float(np.abs(found - wanted).max() / np.abs(wanted).max())

    yield "G_p is the shear modulus: b_1 - b_2 = 1 at rest", EXACT, at_rest
    yield "the stress has an energy: db_1/dI_2 + db_2/dI_1 = 0", SMALL, curl
    yield "the stress turns with the frame", EXACT, turned
    sphere = Problem(
        betas=(0.4,),
        solids=(law,),
        gaps=(),
        length=4.0,
        periodic=False,
        mesh=MeshSettings(Np=8),
        control=StepControl(3e-4, 1e-9, 5.0),
        first_step=0.01 * law.Ca_e,
    )
    yield JACOBIAN, SMALL, lambda: jacobian_off(sphere)


def _in_the_tube(liquid: Liquid) -> Iterator[Statement]:
    """Statements about a liquid in the start-up from rest of the flow in a tube without particles."""
    tube = Problem(
        betas=(),
        solids=(),
        gaps=(),
        length=0.5,
        periodic=False,
        mesh=MeshSettings(max_size=CELLS[0]),
        control=StepControl(2e-3, 1e-8, 2.0),
        first_step=1e-3,
        liquid=liquid,
        t_end=DE,
    )

    def beside_one_dimension() -> float:
        exact = Pipe(liquid).until(DE)(DE).gradient
        offs = list[float]()
        for size in CELLS:
            with closing(Transient(replace(tube, mesh=MeshSettings(max_size=size), U_m=0.0))) as transient:
                *_, last = transient.steps(iter([DE]))
            offs.append(float(abs(last.observation.dp / tube.length / exact - 1)))
            if offs[-1] <= DISCRETE:
                return offs[-1]
        # The error without the part of first order in the cell size, by extrapolation, if that is smaller.
        return min(offs[-1], abs(2 * offs[-1] - offs[-2]))

    yield JACOBIAN, SMALL, lambda: jacobian_off(tube)
    yield TUBE, DISCRETE, beside_one_dimension


def jacobian_off(problem: Problem) -> float:
    """Largest relative difference, of all fields, between the Jacobian in a random direction and difference quotients.

    The best of several step sizes counts: where a law bends sharply, the quotients of large steps are inaccurate.
    """
    with closing(Transient(problem)) as transient:
        newton, constraints = transient.newton, transient.constraints
        random = np.random.default_rng(1)
        h = transient.history.h[0]
        update = PositionUpdate(h, 0.03, problem.U_m)
        star = transient.scene.with_displacements(transient.history.x[0], h) if transient.scene.has_rates else None
        y = newton.solve(transient._first_guess(), update, star)[0]
        y = y * (1 + 0.02 * random.standard_normal(constraints.size))
        direction = random.standard_normal(constraints.size) * np.maximum(np.abs(y), 1e-3)
        product = newton.jacobian_times(y, update, direction)

        def off(step: float) -> float:
            ends = [newton.residual_at(y + sign * step * direction, update) for sign in (1, -1)]
            change = ends[0] - ends[1]
            parts = [(product[i], change[i] / (2 * step)) for i in constraints.fields.values()]
            return max(float(np.linalg.norm(a - b) / max(np.linalg.norm(a), 1e-3)) for a, b in parts)

        return min(map(off, STEPS))
