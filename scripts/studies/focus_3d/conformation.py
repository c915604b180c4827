"""The conformation of a Giesekus liquid in a given flow: developed in the tube, and in three dimensions.

The law is that of the program: stress 2 xi D + (1 - xi)/De (c - I), and De times the upper-convected derivative of c is
-(c - I) - alpha (c - I)^2.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import ufl
from dolfinx import fem
from dolfinx.fem import petsc
from scipy.integrate import cumulative_simpson
from scipy.optimize import brentq

from studies.focus_3d.mesh import RADIUS, ROUNDING, Array
from studies.focus_3d.stokes import PETSc, Stokes

COMPONENTS = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))
OPTIONS = {"ksp_type": "gmres", "ksp_gmres_restart": 60, "ksp_rtol": 1e-3, "ksp_max_it": 300, "pc_type": "ilu"}

MOST_STEPS = 12  # of Newton's method in one flow; chosen
REDUCTION, ACCURATELY = 0.02, 1e-8  # of the residual there; chosen
HELPS = 0.2  # of the residual, left by a step after which the Jacobian is kept; chosen
LEAST_RESIDUAL = 1e-11


@dataclass(frozen=True)
class Giesekus:
    """A Giesekus liquid; De is the relaxation time over D_c/U_av."""

    De: float
    alpha: float = 0.2
    xi: float = 0.09


class Developed:
    """Its developed flow with the mean velocity 1.

    Attributes:
        r: Radii, ascending.
        u: Velocity along the tube at them.
        c: Conformation at them, rr, rz, zz.
    """

    def __init__(self, law: Giesekus) -> None:
        shear = np.concatenate([[0], np.geomspace(1e-3, 40, 800)])
        c = np.array([1.0, 0.0, 1.0])
        in_shear = []
        for g in shear:
            c = in_steady_shear(law, g, c)
            in_shear.append(c)
        table = np.array(in_shear)
        stress = law.xi * shear + (1 - law.xi) / law.De * table[:, 1]
        self.r = np.linspace(0, RADIUS, 2001)

        def profile(gradient: float) -> Array:
            return np.interp(gradient * self.r / 2, stress, shear)

        def mean(gradient: float) -> float:
            return float(np.trapezoid(self.r**2 * profile(gradient), self.r) / RADIUS**2)

        rates = profile(brentq(lambda gradient: mean(gradient) - 1, 1, 64))
        integral = cumulative_simpson(rates, x=self.r, initial=0)
        self.u = integral[-1] - integral
        c_rr, c_rz, c_zz = (np.interp(rates, shear, table[:, i]) for i in range(3))
        self.c = np.array([c_rr, -c_rz, c_zz])

    def velocity(self, r: Array) -> Array:
        """Velocity at radii."""
        return np.interp(r, self.r, self.u)

    def conformation(self, points: Array) -> Array:
        """Components of the conformation at points, shape (n, 6)."""
        x, y = points[:, :2].T
        r = np.hypot(x, y)
        c_rr, c_rz, c_zz = (np.interp(r, self.r, each) for each in self.c)
        cos, sin = (np.divide(each, r, out=np.zeros_like(r), where=r > 0) for each in (x, y))
        found = [1 + (c_rr - 1) * cos**2, (c_rr - 1) * cos * sin, c_rz * cos]
        return np.column_stack([*found, 1 + (c_rr - 1) * sin**2, c_rz * sin, c_zz])


def in_steady_shear(law: Giesekus, g: float, start: Array) -> Array:
    """Conformation rr, rz, zz in shear of u_z at the rate g along r, by Newton's method from a start."""
    c = start.copy()
    for _ in range(60):
        rr, rz, zz = c - [1, 0, 1]
        residual = [
            rr + law.alpha * (rr**2 + rz**2),
            rz + law.alpha * rz * (rr + zz) - law.De * g * (1 + rr),
            zz + law.alpha * (zz**2 + rz**2) - 2 * law.De * g * rz,
        ]
        a = law.alpha
        jacobian = [
            [1 + 2 * a * rr, 2 * a * rz, 0],
            [a * rz - law.De * g, 1 + a * (rr + zz), a * rz],
            [0, 2 * a * rz - 2 * law.De * g, 1 + 2 * a * zz],
        ]
        step = np.linalg.solve(jacobian, residual)
        c = c - step
        if np.abs(step).max() < 1e-13:
            return c
    raise RuntimeError(f"no conformation at the shear rate {g}")


def tensor(f: Any) -> Any:
    """The symmetric matrix of six components."""
    return ufl.as_matrix([[f[0], f[1], f[2]], [f[1], f[3], f[4]], [f[2], f[4], f[5]]])


class Conformation:
    """The conformation c in quadratic elements with SUPG test functions.

    Args:
        stokes: The flow.
        law: The liquid.
    """

    def __init__(self, stokes: Stokes, law: Giesekus) -> None:
        self.stokes, self.law = stokes, law
        mesh, dx = stokes.mesh, ufl.Measure("dx", domain=stokes.mesh, metadata={"quadrature_degree": 5})
        space = fem.functionspace(mesh, ("Lagrange", 2, (6,)))
        self.u = fem.Function(stokes.velocity_space)
        self.U = fem.Constant(mesh, 0.0)
        self.De = fem.Constant(mesh, law.De)
        self.c = fem.Function(space)
        test, unit = tensor(ufl.TestFunction(space)), ufl.Identity(3)
        c, L = tensor(self.c), ufl.grad(self.u)
        v = self.u - ufl.as_vector([0, 0, self.U])  # in the frame of the bead
        i, j, k = ufl.indices(3)

        def carried(T: Any) -> Any:
            return ufl.as_tensor(v[k] * ufl.grad(T)[i, j, k], (i, j))

        g = c - unit + law.alpha * ufl.dot(c - unit, c - unit)
        strong = carried(c) - L * c - c * L.T + g / self.De
        h = abs(ufl.JacobianDeterminant(mesh)) ** (1 / 3)
        time = 1 / ufl.sqrt(4 * ufl.inner(v, v) / h**2 + 1 / self.De**2)
        residual = ufl.inner(test + time * carried(test), strong) * dx
        self.residual = fem.form(residual)
        self.jacobian = fem.form(ufl.derivative(residual, self.c))
        w, _ = ufl.TestFunctions(stokes.space)
        extra = (1 - law.xi) * (2 * ufl.sym(ufl.grad(self.u)) - (c - unit) / self.De)
        self.load_form = fem.form(ufl.inner(extra, ufl.sym(ufl.grad(w))) * stokes.dx)
        self.J = petsc.create_matrix(self.jacobian)
        self.ksp = PETSc.KSP().create(self.J.comm)
        self.ksp.setOptionsPrefix("conformation_")
        for name, value in OPTIONS.items():
            PETSc.Options()[f"conformation_{name}"] = value
        self.ksp.setFromOptions()
        points = space.tabulate_dof_coordinates()
        self._end_nodes = np.flatnonzero(np.abs(points[:, 2]) > np.abs(points[:, 2]).max() - ROUNDING)
        self._end_points = points[self._end_nodes]
        self.ends = (6 * self._end_nodes[:, None] + np.arange(6)).ravel()

    def at_ends(self, developed: Developed) -> None:
        """Set the conformation at the ends of the tube to that of developed flow."""
        self.c.x.array.reshape(-1, 6)[self._end_nodes] = developed.conformation(self._end_points)

    def flow(self, x: Array, U: float) -> None:
        """Set the flow, and the velocity of the bead along the tube, in whose frame the flow is steady."""
        self.u.x.array[:], self.U.value = x[self.stokes.of_velocity], U

    def _residual(self) -> Array:
        """The residual, zero where the conformation is given."""
        found = fem.assemble_vector(self.residual).array.copy()
        found[self.ends] = 0
        return found

    def renew(self) -> None:
        """Assemble the Jacobian at the present conformation."""
        self.J.zeroEntries()
        petsc.assemble_matrix(self.J, self.jacobian)
        self.J.assemble()
        self.J.zeroRows(self.ends.astype(PETSc.IntType))
        self.ksp.setOperators(self.J)

    def solve(self, reduction: float = REDUCTION) -> int:
        """Find the conformation in the flow to a part of its first residual; returns the iterations of GMRES.

        The Jacobian is that of an earlier flow as long as each step with it helps.
        """
        residual, iterations = self._residual(), 0
        first = size = float(np.linalg.norm(residual))
        for _ in range(MOST_STEPS):
            if size <= max(reduction * first, LEAST_RESIDUAL):
                return iterations
            before, start = size, self.c.x.array.copy()
            correction = self.J.createVecRight()
            self.ksp.solve(PETSc.Vec().createWithArray(residual, comm=self.J.comm), correction)
            iterations += int(self.ksp.its)
            self.c.x.array[:] -= correction.array
            residual = self._residual()
            size = float(np.linalg.norm(residual))
            if not size < HELPS * before:
                if not size < before:
                    self.c.x.array[:], residual, size = start, residual, before
                    residual = self._residual()
                self.renew()
        return iterations

    def load(self) -> Array:
        """What a flow of viscosity 1 lacks of the stress of the liquid, tested with all functions."""
        return fem.assemble_vector(self.load_form).array.copy()
