"""Two spheres, rigid or soft, in a Giesekus liquid with pyoomph alone: the quasi-steady pair, or a run from rest.

The scene is that of pyoomph_pair.py beside it, with pyoomph's log-conformation equations in the liquid: a tube with the
developed flow of the Giesekus liquid at both ends, stress included, and particles on which no force acts. No observer
sees a steady stress between particles that separate, so that the state depends on the velocity of the mesh, which here
is pairsim's (docs/explanation/numerics.md, "What is steady, and for whom").

    python pyoomph_viscoelastic.py                                       # four rigid pairs, with and without SUPG
    python pyoomph_viscoelastic.py --De 0.25 --d 0.1 --Ca_e 0.1 --cells 16 24     # a soft pair
    python pyoomph_viscoelastic.py --De 0.25 --d 0.1 --end 1 --steps 50 100       # a rigid pair from rest, in time

With PARDISO's pivots the backward error of a step may be large, and is warned of; Newton's residual decides.
"""

from __future__ import annotations

import argparse
import csv
import math
import tempfile
import time
from itertools import product
from pathlib import Path

import numpy as np
import pyoomph.expressions as ex
from pyoomph import GlobalLagrangeMultiplier, InterfaceEquations, ODEEquations, Problem, WeakContribution
from pyoomph.equations.ALE import LaplaceSmoothedMesh, PinMeshCoordinates
from pyoomph.equations.generic import DirichletBC, EnforcedBC
from pyoomph.equations.navier_stokes import StokesEquations
from pyoomph.equations.solid import DeformableSolidEquations, FSIConnection
from pyoomph.equations.viscoelastic import Giesekus, ViscoelasticEquations
from pyoomph_pair import PARTICLES, NeoHookean, Pair, PairMesh, TimedPardiso  # noqa: F401, sets one thread
from scipy.integrate import solve_ivp
from scipy.interpolate import BarycentricInterpolator
from scipy.optimize import brentq

TOLERANCE = 1e-9
TERMS = 12  # of the even polynomial that the velocity profile is; leaves 1e-7 of U_av at De 1
STEP = 0.1  # largest step in De


class DevelopedFlow:
    """The flow of the liquid without particles in a tube of radius 1/2 at the mean velocity 1, as even polynomials."""

    def __init__(self, xi: float, alpha: float):
        self.xi, self.law = xi, Giesekus(alpha)
        self.De, self.powers = 0.0, np.zeros(TERMS + 1)

    def become(self, De: float) -> None:
        """Find the flow at another De."""
        self.De = De
        r = 0.25 * (1 - np.cos(np.linspace(0, np.pi, 101)))

        def shear_stress(rate: float) -> float:
            return rate * (self.xi + (1 - self.xi) * self.law.steady_shear_coefficients((De * rate) ** 2)[1])

        def velocity(gradient: float) -> np.ndarray:
            rates = [brentq(lambda g, s=s: shear_stress(g) - s, 0, 1e4, xtol=1e-13) for s in gradient * r / 2]
            fit = np.linalg.lstsq(r[:, None] ** (2 * np.arange(TERMS) + 1), np.array(rates), rcond=None)[0]
            powers = fit / (2 * np.arange(TERMS) + 2)
            return np.concatenate([[(powers * 0.25 ** np.arange(1, TERMS + 1)).sum()], -powers])

        def mean(gradient: float) -> float:
            k = np.arange(TERMS + 1)
            return float((8 * velocity(gradient) * 0.5 ** (2 * k + 2) / (2 * k + 2)).sum())

        self.powers = velocity(brentq(lambda gradient: mean(gradient) - 1, 1, 32.1, xtol=1e-12))

    def velocity(self, r: float, _: float = 0.0) -> float:
        return float(np.polynomial.polynomial.polyval(r * r, self.powers))

    def log_conformation(self, r: float, _: float = 0.0) -> dict[str, float]:
        """The components in r and z, x and y for pyoomph."""
        rate = 2 * r * np.polynomial.polynomial.polyval(r * r, np.polynomial.polynomial.polyder(self.powers))
        L = np.array([[0.0, 0.0], [rate, 0.0]])
        one, shear, flow, gradient = self.law.steady_shear_coefficients((self.De * rate) ** 2)
        c = one * np.eye(2) + shear * self.De * (L + L.T) + self.De**2 * (flow * L @ L.T + gradient * L.T @ L)
        values, vectors = np.linalg.eigh(c)
        s = vectors @ np.diag(np.log(values)) @ vectors.T
        return {"xx": s[0, 0], "xy": s[0, 1], "yy": s[1, 1], "aa": math.log(one)}


class StartUp:
    """The flow of the liquid without particles from rest, at the mean velocity 1 from t = 0 on.

    The shear stress (1 - xi)/De c_rz + xi u' = -G r/2 gives u' at every radius, the mean velocity gives G.
    """

    def __init__(self, De: float, xi: float, alpha: float, end: float):
        points, weights = np.polynomial.legendre.leggauss(30)
        inner = (points + 1) / 4
        self.r = np.concatenate([[0.0], inner, [0.5]])
        moments = np.concatenate([[0.0], weights / 4 * inner**2, [0.0]])  # int r^2 u' dr = -1/4 at the mean velocity 1

        def rate(c: np.ndarray) -> np.ndarray:
            without = -(1 - xi) / De * c[1] / xi
            gradient = (moments @ without + 1 / 4) / (moments @ self.r / 2 / xi)
            return without - gradient * self.r / 2 / xi

        def change(_: float, flat: np.ndarray) -> np.ndarray:
            c = flat.reshape(4, -1)  # zz, rz, rr, tt
            zz, rz, rr, tt, shear = *c, rate(c)
            squares = np.array([(zz - 1) ** 2 + rz**2, rz * (zz + rr - 2), (rr - 1) ** 2 + rz**2, (tt - 1) ** 2])
            stretch = np.array([2 * shear * rz, shear * rr, 0 * rr, 0 * rr])
            return (stretch - (np.array([zz - 1, rz, rr - 1, tt - 1]) + alpha * squares) / De).ravel()

        rest = np.repeat([1.0, 0.0, 1.0, 1.0], len(self.r))
        self.solution = solve_ivp(change, (0, end), rest, "LSODA", dense_output=True, rtol=1e-9, atol=1e-11).sol
        self.rate, self.t = rate, math.nan

    def _at(self, t: float) -> None:
        if t == self.t:
            return
        self.t, c = t, self.solution(t).reshape(4, -1)
        shear = BarycentricInterpolator(self.r, self.rate(c))
        x, w = np.polynomial.legendre.leggauss(20)
        u = [-(0.5 - r) / 2 * w @ shear(r + (0.5 - r) * (x + 1) / 2) for r in self.r]
        logs = np.empty_like(c)
        for i, (zz, rz, rr, tt) in enumerate(c.T):
            values, vectors = np.linalg.eigh([[rr, rz], [rz, zz]])
            s = vectors @ np.diag(np.log(values)) @ vectors.T
            logs[:, i] = s[0, 0], s[0, 1], s[1, 1], math.log(tt)
        self.values = BarycentricInterpolator(self.r, np.vstack([u, logs]).T)

    def velocity(self, r: float, t: float) -> float:
        self._at(t)
        return float(self.values(r)[0])

    def log_conformation(self, r: float, t: float) -> dict[str, float]:
        """The components in r and z, x and y for pyoomph."""
        self._at(t)
        return dict(zip(("xx", "xy", "yy", "aa"), self.values(r)[1:], strict=True))


class AtEnds(ex.CustomMathExpression):
    """A function of r and t for boundary conditions."""

    def __init__(self, function):
        super().__init__()
        self.function = function

    def eval(self, arg_array):
        return float(self.function(*map(float, arg_array)))


class Liquid(ViscoelasticEquations):
    """Stress carried by the velocity relative to the mesh, `wind`, and stretched by the velocity itself."""

    def _log_conformation_residual(self, psi, gradu, transported, identity):
        return super()._log_conformation_residual(psi, ex.grad(ex.var("velocity")), transported, identity)


class FreeRigidSurface(InterfaceEquations):
    """A surface with the velocity U e_z, and no force: multipliers are the traction in z."""

    def __init__(self, name: str):
        super().__init__()
        self.name = name

    def define_fields(self):
        self.define_scalar_field("traction", "C2")

    def define_residuals(self):
        traction, test = ex.var_and_test("traction")
        u, u_test = ex.var_and_test("velocity_y")
        U, U_test = ex.var(f"U_{self.name}", domain="globals"), ex.testfunction(f"U_{self.name}", domain="globals")
        self.add_residual(ex.weak(u - U, test) + ex.weak(traction, u_test) - ex.weak(traction, U_test))


class Moved(ODEEquations):
    """How far each of two rigid particles has moved from their middle, `moved`."""

    def define_fields(self):
        self.define_ode_variable("moved")

    def define_residuals(self):
        moved, test = ex.var_and_test("moved")
        dU = ex.var("U_leading") - ex.var("U_trailing")
        self.add_residual(ex.weak(ex.partial_t(moved) - dU / 2, test))


class ViscoelasticPair(Pair):
    """The quasi-steady scene; rigid if Ca_e is 0. With an end, the rigid pair from rest, in the frame of its middle."""

    def __init__(self, options: argparse.Namespace, cells: int, folder: str):
        super().__init__(cells, options.beta, options.d, None, folder)
        self.options, self.De = options, self.define_global_parameter(De=0.01)
        self.flow: DevelopedFlow | StartUp = DevelopedFlow(options.xi, options.alpha)
        if options.end:
            self.De.value = options.De
            self.flow = StartUp(options.De, options.xi, options.alpha, options.end)
        else:
            self.flow.become(0.01)

    def become(self, De: float) -> None:
        """Set De and the flow at the ends."""
        self.De.value = De
        self.flow.become(De)
        self.reapply_boundary_conditions()

    def define_problem(self):
        self.set_coordinate_system(ex.axisymmetric)
        self.set_scaling(spatial=1, temporal=1, velocity=1, pressure=1)
        self += PairMesh(self.cells, self.beta, self.d)
        r, z, t = ex.var(["coordinate_x", "coordinate_y", "time"])
        rigid, moves, xi = self.options.Ca_e == 0, bool(self.options.end), self.options.xi
        U = {side: ex.var(f"U_{name}", domain="globals") for side, name in PARTICLES.items()}
        x = ex.minimum(ex.maximum((z + self.d / 4) / (self.d / 2), 0), 1)
        mesh = (U[-1] + U[1]) / 2 if moves else U[-1] + (U[1] - U[-1]) * (3 * x**2 - 2 * x**3)
        ends = {"velocity_y": AtEnds(self.flow.velocity)}
        for name in ("xx", "xy", "yy", "aa"):
            ends[f"log_conformation_{name}"] = AtEnds(lambda r, t, name=name: self.flow.log_conformation(r, t)[name])
        fluid = StokesEquations(dynamic_viscosity=xi, mode="TH").with_pressure_fixation()
        fluid += Liquid(
            model=Giesekus(self.options.alpha),
            relaxation_time=self.De,
            polymer_viscosity=1 - xi,
            wind=ex.var("velocity") - mesh * ex.vector(0, 1),
            stabilization="SUPG" if self.options.supg else None,
            output_conformation=False,
        )
        for line in ("axis", "gap"):
            fluid += DirichletBC(velocity_x=0, log_conformation_xy=0) @ line
        fluid += DirichletBC(velocity_x=0, velocity_y=0) @ "wall"
        for end in ("inlet", "outlet"):
            fluid += DirichletBC(velocity_x=0, **{name: function(r, t) for name, function in ends.items()}) @ end
        if moves or not rigid:
            fluid += LaplaceSmoothedMesh()
            for line in ("axis", "gap"):
                fluid += DirichletBC(mesh_x=0) @ line
            for line in ("wall", "inlet", "outlet"):
                fluid += PinMeshCoordinates() @ line
        for side, name in PARTICLES.items():
            self += GlobalLagrangeMultiplier(f"U_{name}") @ "globals"
            surface = f"{name}_surface"
            if rigid:
                fluid += (DirichletBC(velocity_x=0) + FreeRigidSurface(name)) @ surface
                if moves:
                    off = ex.var("mesh_y") - ex.var("lagrangian_y") - side * ex.var("moved", domain="globals")
                    fluid += (DirichletBC(mesh_x=True) + EnforcedBC(mesh_y=off)) @ surface
                continue
            fluid += FSIConnection(velocity_offset=-U[side] * ex.vector(0, 1)) @ surface
            law = NeoHookean(1 / self.Ca_e)
            solid = DeformableSolidEquations(law, coordinate_space="C2", pressure_space="C1", scale_for_FSI=True)
            solid += DirichletBC(mesh_x=0) @ "axis"
            off, row = ex.var("mesh_y") - side * self.d / 2, ex.testfunction(f"U_{name}", domain="globals")
            fluid += WeakContribution(off, row, coordsys=ex.cartesian) @ f"gap/{surface}"
            self += solid @ name
        if moves:
            self += Moved() @ "globals"
        self += fluid @ "fluid"


def solve(options: argparse.Namespace, cells: int, folder: str) -> dict[str, float]:
    """A row of the table; seconds are the processor's, without those for mesh and compilation."""
    with ViscoelasticPair(options, cells, folder) as pair:
        pair.initialise()
        pair.Ca_e.value = options.Ca_e or 1.0
        begin, De = time.process_time(), 0.0
        while De < options.De:
            De = min(De + STEP, options.De)
            pair.become(De)
            pair.solve(newton_solver_tolerance=TOLERANCE, max_newton_iterations=30)
        U = {name: velocity(pair, name) for name in PARTICLES.values()}
        row = {"cells": cells, "unknowns": pair.ndof(), "U_T": U["trailing"], "U_L": U["leading"]}
        row |= {"dU": U["leading"] - U["trailing"], "newton": pair.get_la_solver().clock["newton"]}
        row |= {"seconds": time.process_time() - begin}
        if options.Ca_e:
            row |= {f"D_{name[0].upper()}": pair.taylor(name) for name in PARTICLES.values()}
        return row


def run(options: argparse.Namespace, cells: int, steps: int, folder: str) -> list[dict[str, float]]:
    """Rows at a quarter, half and all of the time of a rigid pair from rest, by BDF2."""
    rows = []
    with ViscoelasticPair(options, cells, folder) as pair:
        pair.initialise()
        begin = time.process_time()
        for step in range(1, steps + 1):
            pair.solve(timestep=options.end / steps, newton_solver_tolerance=TOLERANCE, max_newton_iterations=30)
            if step in (steps // 4, steps // 2, steps):
                U = {name: velocity(pair, name) for name in PARTICLES.values()}
                row = {"cells": cells, "unknowns": pair.ndof(), "U_T": U["trailing"], "U_L": U["leading"]}
                row |= {"dU": U["leading"] - U["trailing"], "newton": pair.get_la_solver().clock["newton"]}
                row |= {"seconds": time.process_time() - begin, "steps": steps}
                row |= {"moved": float(pair.get_ode("globals").get_value("moved"))}
                rows.append(row | {"t": step * options.end / steps})
    return rows


def velocity(pair: Problem, name: str) -> float:
    return float(pair.get_ode("globals").get_value(f"U_{name}"))


def main() -> None:
    """Solve on every mesh, print the table and write it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    option = parser.add_argument
    option("--cells", type=int, nargs="+", default=[16, 24, 36], help="cells on a half-circle, one mesh or more")
    option("--De", type=float, nargs="+", default=[0.25, 1.0], help="relaxation time over that of the flow")
    option("--d", type=float, nargs="+", default=[0.1, 0.4], help="distances between the spheres, in tube diameters")
    option("--supg", type=int, nargs="+", default=[0, 1], help="without and with pyoomph's SUPG")
    option("--beta", type=float, default=0.4, help="diameter of the spheres over that of the tube")
    option("--Ca_e", type=float, default=0.0, help="viscous over elastic stress; 0: rigid")
    option("--xi", type=float, default=0.09, help="viscosity of the solvent")
    option("--alpha", type=float, default=0.2, help="mobility")
    option("--end", type=float, default=0.0, help="a run of a rigid pair from rest to this time; 0: the steady state")
    option("--steps", type=int, nargs="+", default=[100], help="time steps of a run, a number or more")
    option("--output", type=Path, default=Path("pyoomph_viscoelastic.csv"), help="the table as CSV")
    options, rows = parser.parse_args(), []
    for De, d, supg, cells in product(options.De, options.d, options.supg, options.cells):
        scene = argparse.Namespace(**vars(options) | {"De": De, "d": d, "supg": supg})
        with tempfile.TemporaryDirectory() as folder:
            found = [solve(scene, cells, folder)] if not options.end else []
        for steps in options.steps if options.end else []:
            with tempfile.TemporaryDirectory() as folder:
                found += run(scene, cells, steps, folder)
        rows += [{"De": De, "d": d, "Ca_e": options.Ca_e, "supg": supg, **row} for row in found]
        print(*rows[-len(found) :], sep="\n", flush=True)
        with options.output.open("w", newline="") as file:
            writer = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
            writer.writeheader()
            writer.writerows(rows)


if __name__ == "__main__":
    main()
