"""Weak forms of disturbed liquids and solids, linearised about the axisymmetric solution.

The forms are those of `pairsim.physics.forms` in three dimensions, on the configuration of the axisymmetric solution,
with the disturbances of `pairsim.fem.azimuthal.fields` as unknowns. UFL differentiates them with respect to these, at
zero disturbance.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import ufl
from ufl.algorithms import expand_derivatives, replace

from pairsim.fem.azimuthal import calculus
from pairsim.fem.azimuthal.calculus import ANGLES, Angle, Expr, Kinematics, Section
from pairsim.fem.azimuthal.fields import COMPONENTS
from pairsim.fem.phases.compiled_phase import UPWIND_SCALE, VOLUME_MODULUS, mode_part
from pairsim.physics.forms.constitutive import upwind_time
from pairsim.physics.liquids import ConformationLaw, Liquid
from pairsim.physics.liquids.conformation import LOG_CONFORMATION, Invariants
from pairsim.physics.liquids.structured import StructuredLaw
from pairsim.physics.liquids.viscous import LEAST_RATE
from pairsim.physics.log_conformation import LogConformation
from pairsim.physics.solids import Solid


@dataclass(frozen=True)
class Terms:
    """Ingredients of a form.

    Attributes:
        mesh: Mesh of the undisturbed configuration.
        base: Fields of the axisymmetric solution.
        x: Disturbances.
        test: Test functions of the same kind.
        constants: Constants of the forms.
        dx: Measure on the undisturbed configuration.
    """

    mesh: ufl.Mesh
    base: dict[str, Expr]
    x: dict[str, Expr]
    test: dict[str, Expr]
    constants: dict[str, ufl.Constant]
    dx: ufl.Measure

    @property
    def r(self) -> Expr:
        """Radius."""
        return ufl.SpatialCoordinate(self.mesh)[1]


def linearised(build: Callable[[Terms, Angle], ufl.Form], terms: Terms, x: ufl.Coefficient) -> ufl.Form:
    """The bilinear form of a disturbance.

    Args:
        build: Builds the nonlinear form in a half-plane; only its derivative at zero disturbance matters.
        terms: Its ingredients.
        x: The disturbances as one mixed function.
    """
    form = sum(build(terms, at) for at in ANGLES)
    derivative = expand_derivatives(ufl.derivative(form, x, ufl.TrialFunction(x.ufl_function_space())))
    return replace(derivative, {x: ufl.as_vector([0.0] * x.ufl_shape[0])})


def work(kin: Kinematics, stress: Expr, p: Expr, v: Section) -> Expr:
    """Virtual work of the stress sigma - p I with a test function v, per area of the half-plane."""
    return ufl.inner(stress - p * ufl.Identity(3), kin.grad(v)) * kin.volume


def extension(eta: Section, xi: Section, mesh: ufl.Mesh, r: Expr) -> Expr:
    """Elastic extension of the displacement into the liquid, as in `pairsim.physics.forms.mesh_motion`."""
    strain, other = ufl.sym(calculus.grad(eta, r)), ufl.sym(calculus.grad(xi, r))
    return (2 * ufl.inner(strain, other) + ufl.tr(strain) * ufl.tr(other)) / abs(ufl.JacobianDeterminant(mesh))


def disturbed_liquid(liquid: Liquid) -> Callable[[Terms, Angle], ufl.Form]:
    """The form of a liquid with the disturbances u, p, chi of its modes and displacement eta of the mesh.

    The conformation is c = c_0^(1/2) (I + chi) c_0^(1/2), and what is tested is c_0^(-1/2) r c_0^(-1/2) with the
    residual r of its equation. Like the logarithm s of the axisymmetric solution, chi and this product are of order one
    even where c changes by orders of magnitude from one cell to the next. The disturbances of c, of u and of the mesh
    grow as exp(rate t). With the Reynolds number Re = rho U_av D_c/eta_0 the momentum balance is
    Re Du/Dt = div(sigma - p I).

    Args:
        liquid: The liquid; its parameters are constants of the form.
    """

    def build(terms: Terms, at: Angle) -> ufl.Form:
        x, test, r = terms.x, terms.test, terms.r
        here = liquid.with_numbers({name: terms.constants[name] for name in liquid.numbers})
        eta = calculus.vector(x["eta"], at)
        kin = Kinematics.of(eta, r)
        u = calculus.axisymmetric_vector(terms.base["u"]) + calculus.vector(x["u"], at)
        p = terms.base["p"] + calculus.scalar(x["p"], at).value
        L = kin.grad(u)
        gamma2 = 2 * ufl.inner(ufl.sym(L), ufl.sym(L)) + LEAST_RATE**2
        carried = {
            f.name: calculus.axisymmetric_scalar(terms.base[f.name]) + calculus.scalar(x[f.name], at)
            for f in here.solvent.transported
        }
        state = [each.value for each in carried.values()]
        stress = 2 * here.xi * here.solvent.viscosity_at(gamma2, *state) * ufl.sym(L)
        rate = terms.constants["rate"]
        v = u.value - calculus.axisymmetric_vector(terms.base["w"]).value - rate * eta.value
        acceleration = rate * calculus.vector(x["u"], at).value + ufl.dot(L, v)
        w = calculus.vector(test["u"], at)
        more = terms.constants["Re"] * ufl.inner(acceleration, w.value) * kin.volume
        if isinstance(here.solvent, StructuredLaw):
            time = upwind_time(terms.mesh, v, here.solvent.memory, UPWIND_SCALE)
            for name, own in zip(carried, here.solvent.rates(gamma2, *state), strict=True):
                strong = rate * calculus.scalar(x[name], at).value + kin.slope_along(v, carried[name]) - own
                t = calculus.scalar(test[name], at)
                more += (t.value + time * kin.slope_along(v, t)) * strong * kin.volume
        for i, law in enumerate(here.modes):
            half = LogConformation.of(mode_part(terms.base[LOG_CONFORMATION.name], i) / 2)
            root, inverse = (calculus.axisymmetric_tensor(*half.exp(sign)).value for sign in (1, -1))
            chi, S = (calculus.tensor([f["chi"][COMPONENTS * i + k] for k in range(COMPONENTS)], at) for f in (x, test))
            c1 = between(root, chi)
            c = between(root, calculus.identity()) + c1
            invariants = Invariants(ufl.tr(c.value), ufl.inner(c.value, c.value), gamma2)
            stress += polymer(here, law, c.value, invariants)
            De = here.relaxation_time(law)
            strong = rate * c1.value + kin.along(v, c) - upper_convection(L, c.value)
            strong += relaxation(here, law, c.value, invariants) / De
            upwinded = S.value + upwind_time(terms.mesh, v, De, UPWIND_SCALE) * kin.along(v, S)
            more += ufl.inner(upwinded, ufl.dot(inverse, ufl.dot(strong, inverse))) * kin.volume
        more += work(kin, stress, p, w)
        more -= calculus.scalar(test["p"], at).value * ufl.tr(L) * kin.volume
        more += extension(eta, calculus.vector(test["eta"], at), terms.mesh, r)
        return more * terms.dx

    return build


def between(root: Expr, chi: Section) -> Section:
    """The product R chi R of a disturbance chi and an axisymmetric tensor R, `root`, such as c^(1/2)."""
    return Section(ufl.dot(root, ufl.dot(chi.value, root)), ufl.dot(root, ufl.dot(chi.by_theta, root)))


def polymer(liquid: Liquid, law: ConformationLaw, c: Expr, at: Invariants) -> Expr:
    """Stress of a mode, G (h_0 I + h_1 c)."""
    h0, h1 = law.stress(at)
    return liquid.modulus(law) * (h0 * ufl.Identity(3) + h1 * c)


def upper_convection(L: Expr, c: Expr) -> Expr:
    """L c + c L^T."""
    return ufl.dot(L, c) + ufl.dot(c, ufl.transpose(L))


def relaxation(liquid: Liquid, law: ConformationLaw, c: Expr, at: Invariants) -> Expr:
    """g(c) = g_0 I + g_1 c + g_2 c^2."""
    g0, g1, g2 = liquid.relaxation(law, at)
    return g0 * ufl.Identity(3) + g1 * c + g2 * ufl.dot(c, c)


def disturbed_solid(solid: Solid, volume_modulus: bool) -> Callable[[Terms, Angle], ufl.Form]:
    """The form of a solid with the disturbances eta and p, and the velocity v of the material if it is viscous.

    The base field X is the undeformed position as a function of the deformed one. In the axisymmetric solution the
    material is at rest.

    Args:
        solid: Its law.
        volume_modulus: As in `pairsim.fem.phases.compiled_phase.solid_phase`.
    """

    def build(terms: Terms, at: Angle) -> ufl.Form:
        x, test, r, X = terms.x, terms.test, terms.r, terms.base["X"]
        here = solid.with_numbers({name: terms.constants[name] for name in solid.numbers})
        kin = Kinematics.of(calculus.vector(x["eta"], at), r)
        B, inverse = deformation(ufl.grad(X), r / X[1])
        F = ufl.Identity(3) + kin.H
        B, inverse = ufl.dot(F, ufl.dot(B, F.T)), ufl.dot(kin.inverse.T, ufl.dot(inverse, kin.inverse))
        p = terms.base["p"] + calculus.scalar(x["p"], at).value
        expansion = kin.J / (ufl.det(ufl.grad(X)) * X[1] / r)  # J R/r of the axisymmetric forms
        if volume_modulus:
            p -= VOLUME_MODULUS / terms.constants["Ca_e"] * (expansion - 1)
        stress = elastic(here, B, inverse)
        if here.viscosity is not None:
            stress += 2 * here.viscosity * ufl.sym(kin.grad(calculus.vector(x["v"], at)))
        form = work(kin, stress, p, calculus.vector(test["eta"], at))
        # (expansion - 1) is tested per undeformed volume V_0, which is constant: V_0 expansion = V J, with the volume V
        # of the axisymmetric solution.
        return (form - calculus.scalar(test["p"], at).value * kin.volume) * terms.dx

    return build


def deformation(G: Expr, hoop: Expr) -> tuple[Expr, Expr]:
    """Left Cauchy-Green tensor and its inverse of an axisymmetric deformation.

    Args:
        G: Inverse of the deformation gradient in the (z, r) plane.
        hoop: Hoop stretch.
    """
    inverse = ufl.dot(G.T, G)
    B = ufl.inv(inverse)
    return calculus.axisymmetric_tensor(B, hoop**2).value, calculus.axisymmetric_tensor(inverse, hoop**-2).value


def elastic(solid: Solid, B: Expr, inverse: Expr) -> Any:
    """Elastic stress [b_1 (B - I) + b_2 (B^-1 - I)]/Ca_e."""
    terms = zip(solid.response(ufl.tr(B), ufl.tr(inverse)), (B, inverse), strict=True)
    used = [(b, tensor) for b, tensor in terms if not (isinstance(b, int) and b == 0)]
    return sum((b * (tensor - ufl.Identity(3)) for b, tensor in used), start=ufl.zero(3, 3)) / solid.Ca_e
