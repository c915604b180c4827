"""Two soft spheres in a Newtonian liquid with pyoomph alone: a second opinion on pairsim's numbers and its speed.

The scene is pairsim's: a tube of diameter 1 with mean velocity 1, viscosity 1, two equal incompressible neo-Hookean
spheres of modulus 1/Ca_e on its axis, no inertia, Poiseuille flow at both ends. Solved are the quasi-steady point
(distance held, shapes and both velocities unknown) and the transient from rest, on one or more meshes.

    python pyoomph_pair.py                         # 20, 40 and 80 cells on a half-circle, point and transient
    python pyoomph_pair.py --cells 40 --no-transient --Ca_e 1e-4
"""

from __future__ import annotations

import argparse
import csv
import os
import tempfile
import time
from collections import Counter
from pathlib import Path

# One thread, set before MKL is loaded: seconds are compared with those of a serial program.
os.environ["OMP_NUM_THREADS"] = os.environ["MKL_NUM_THREADS"] = "1"

import numpy as np
import pyoomph.expressions as ex
from pyoomph import GlobalLagrangeMultiplier, MeshTemplate, Problem, WeakContribution
from pyoomph.equations.ALE import LaplaceSmoothedMesh, PinMeshCoordinates
from pyoomph.equations.generic import DirichletBC, IntegralObservables
from pyoomph.equations.navier_stokes import StokesEquations
from pyoomph.equations.solid import DeformableSolidEquations, FSIConnection, IncompressibleSolidConstitutiveLaw
from pyoomph.solvers.generic import GenericLinearSystemSolver
from pyoomph.solvers.pardiso import PardisoSolver

# Tube on each side of the pair: what pairsim takes with `length: auto` in a Newtonian liquid.
MARGIN = 2.0
# Names of the particles by the sign of their z: the leading one is downstream.
PARTICLES = {-1: "trailing", 1: "leading"}
# Largest residual that Newton accepts. Steps start close by, and 1e-6 changes dU by 2e-5 of itself or less.
TOLERANCE, TOLERANCE_STEP = 1e-9, 1e-6


class NeoHookean(IncompressibleSolidConstitutiveLaw):
    """Cauchy stress -p I + G (B - I). pyoomph's own incompressible law, -p I + G (I - B^-1), is another material."""

    def __init__(self, modulus):
        super().__init__()
        self.modulus = modulus

    def get_sigma(self, dim, isotropic_growth_factor=1, pressure_var=None):
        # J is 1 only in the mean. With it here, a constant pressure works at the surface alone. Without it, the tension
        # of some 80 that the liquid has around the pair (p is 0 near the inlet) makes spheres of Ca_e .02 wrinkle.
        J = ex.square_root(ex.determinant(self.get_Gij(dim)))
        inverse = self.get_G_up_ij(dim)
        return self.modulus * (self.get_gij(dim) - inverse) - pressure_var * J * inverse


class PairMesh(MeshTemplate):
    """Nine-node quadrilaterals in blocks, the half z < 0 a mirror image of the half z > 0.

    dU is a small difference of two large velocities; a mirrored mesh cancels most of its error. Coordinates of nodes
    are (r, z), pyoomph's order.

    Args:
        cells: Cells on each half-circle.
        beta: Diameter of the spheres.
        d: Distance between them.
    """

    def __init__(self, cells: int, beta: float, d: float):
        super().__init__()
        self.cells, self.radius, self.centre = cells, beta / 2, (d + beta) / 2
        self.end = self.centre + self.radius + MARGIN

    def define_geometry(self):
        self.fluid = self.new_domain("fluid")
        self.solids = {side: self.new_domain(name) for side, name in PARTICLES.items()}
        near, outline, shell = self.around_the_sphere()
        tube = self.tube(shell)
        inside, core = self.inside_the_sphere(outline)
        for side, name in PARTICLES.items():
            mirror = np.array([1, side])
            for block in (near, tube):
                self.add_cells(self.fluid, block * mirror)
            for block in (inside, core):
                self.add_cells(self.solids[side], block * mirror)
            self.mark("gap", near[0] * mirror)
            self.mark(f"{name}_surface", outline * mirror)
            for line in (near[-1], tube[0], core[0], inside[0], inside[-1]):
                self.mark("axis", line * mirror)
            for line in (shell[self.wall], tube[-1]):
                self.mark("wall", line * mirror)
            self.mark("outlet" if side > 0 else "inlet", tube[:, -1] * mirror)

    def around_the_sphere(self):
        """Liquid between the sphere and a box of its own: nodes along the outline, then outwards."""
        a, c = self.radius, self.centre
        box = c + max(2 * a, 0.5)
        # Radial projection of the box's corners; the sector to the left faces the gap.
        corners = np.array([0, np.arctan2(0.5, c), np.pi - np.arctan2(0.5, box - c), np.pi])
        counts = np.maximum(np.round(np.diff(corners) / np.pi * self.cells), 2).astype(int)
        counts[1] = self.cells - counts[0] - counts[2]
        pieces = [np.linspace(p, q, 2 * n + 1) for p, q, n in zip(corners, corners[1:], counts, strict=False)]
        angle = np.concatenate([pieces[0], pieces[1][1:], pieces[2][1:]])
        outline = np.stack([a * np.sin(angle), c - a * np.cos(angle)], 1)
        outline[[0, -1], 0] = 0
        direction = np.stack([np.sin(angle), -np.cos(angle)], 1)
        direction[[0, -1], 0] = 0
        with np.errstate(divide="ignore"):
            reach = np.min([0.5 / direction[:, 0], np.abs((np.where(angle < 1.5, 0, box) - c) / direction[:, 1])], 0)
        shell = np.array([0, c]) + reach[:, None] * direction
        # Exact, because blocks find each other by the places of their nodes.
        first, second = 2 * int(counts[0]), 2 * int(counts[0] + counts[1])
        self.wall = slice(first, second + 1)
        shell[: first + 1, 1], shell[self.wall, 0], shell[second:, 1] = 0, 0.5, box
        shell[[0, -1], 0] = 0
        shell[1::2] = (shell[:-1:2] + shell[2::2]) / 2
        layers = max(3, self.cells // 4)
        length = np.linalg.norm(shell - outline, axis=1)
        steps = np.stack([graded(s, layers, np.pi * a / self.cells) for s in length])
        steps[1::2] = (steps[:-1:2] + steps[2::2]) / 2
        return outline[:, None] + steps[..., None] * (shell - outline)[:, None], outline, shell

    def tube(self, shell):
        """Liquid from the box to the end, rows from the axis to the wall."""
        rows = shell[self.wall.stop - 1 :][::-1]
        box = rows[0, 1]
        layers = max(4, round(0.4 * self.cells))
        z = box + (self.end - box) * graded(self.end - box, layers, 2 / self.cells)
        z[-1] = self.end
        return np.stack(np.broadcast_arrays(rows[:, :1], z[None]), -1)

    def inside_the_sphere(self, outline):
        """Layers under the surface, and the core, whose sides have a quarter, a half and a quarter of the cells."""
        n, half = self.cells // 4, 0.5 * self.radius
        s = np.linspace(0, 1, 2 * n + 1)
        t = np.linspace(-1, 1, 2 * (self.cells - 2 * n) + 1)
        # Bulging sides: corners of a square would leave thin layers on the diagonals.
        r, z = np.meshgrid(s, t, indexing="ij")
        core = half * np.stack([r * (1 - 0.15 * z**2), z * (1 - 0.15 * r**2)], -1) + np.array([0, self.centre])
        rim = np.concatenate([core[:, 0], core[-1, 1:], core[-2::-1, -1]])
        layers = max(2, self.cells // 7)
        steps = np.linspace(0, 1, 2 * layers + 1)[:, None]
        inside = rim[:, None] + steps * (outline - rim)[:, None]
        return inside, core

    def add_cells(self, domain, block):
        """Cells of a block of nodes (odd, odd, 2), each with the orientation that pyoomph wants."""
        nodes = np.array([[self.add_node_unique(*map(float, x)) for x in row] for row in block])
        for i in range(0, len(block) - 2, 2):
            for j in range(0, len(block[0]) - 2, 2):
                along, across = block[i + 2, j] - block[i, j], block[i, j + 2] - block[i, j]
                cell = nodes[i : i + 3, j : j + 3]
                positive = along[0] * across[1] > along[1] * across[0]
                domain.add_quad_2d_C2(*(int(k) for k in (cell.T if positive else cell).ravel()))

    def mark(self, name, line):
        nodes = [self.add_node_unique(*map(float, x)) for x in line]
        for i in range(0, len(nodes) - 2, 2):
            self.add_facet_to_boundary(name, nodes[i : i + 3], [nodes[i], nodes[i + 2]])


def graded(length: float, layers: int, first: float) -> np.ndarray:
    """Nodes (2 layers + 1) on [0, 1] whose cells grow by one factor; the first is `first` of `length` or less."""
    growth = 1.0
    while growth < 3 and sum(growth**k for k in range(layers)) * first < length:
        growth += 1e-3
    ends = np.concatenate([[0], np.cumsum(growth ** np.arange(layers))])
    nodes = np.interp(np.arange(2 * layers + 1) / 2, np.arange(layers + 1), ends)
    return nodes / nodes[-1]


@GenericLinearSystemSolver.register_solver()
class TimedPardiso(PardisoSolver):
    """Pardiso with a stopwatch; the ordering is kept while the pattern stays."""

    idname = "timed_pardiso"

    def __init__(self, problem, verbose=False):
        super().__init__(problem, verbose)
        self.clock = Counter()

    def solve_serial(self, op_flag, *args):
        begin = time.process_time()
        try:
            return super().solve_serial(op_flag, *args)
        finally:
            self.clock["factorise" if op_flag == 1 else "solve"] += time.process_time() - begin
            self.clock["newton"] += op_flag == 1


class Pair(Problem):
    """The scene. `frame` None: the quasi-steady point. A number: the transient, in a frame of that velocity.

    Velocities are those of the laboratory in both cases; code is generated in `folder` and compiled.
    """

    def __init__(self, cells: int, beta: float, d: float, frame: float | None, folder: str):
        super().__init__()
        self.quiet()
        self.set_output_directory(folder)
        self.set_c_compiler("system").optimize_for_max_speed()
        self.set_linear_solver("timed_pardiso")
        self.cells, self.beta, self.d, self.frame = cells, beta, d, frame
        self.Ca_e = self.define_global_parameter(Ca_e=0.1)
        self.ignore_command_line, self.initial_adaption_steps = True, 0
        # Zeros are kept in the matrix, so that Pardiso's ordering serves all iterations.
        self.keep_structural_zeros = True

    def define_problem(self):
        self.set_coordinate_system(ex.axisymmetric)
        self.set_scaling(spatial=1, temporal=1, velocity=1, pressure=1)
        self += PairMesh(self.cells, self.beta, self.d)
        r = ex.var("coordinate_x")
        fluid = StokesEquations(dynamic_viscosity=1, mode="TH").with_pressure_fixation() + LaplaceSmoothedMesh()
        for line in ("axis", "gap"):
            fluid += DirichletBC(mesh_x=0, velocity_x=0) @ line
        fluid += (DirichletBC(velocity_x=0, velocity_y=0) + PinMeshCoordinates()) @ "wall"
        for end in ("inlet", "outlet"):
            fluid += (DirichletBC(velocity_x=0, velocity_y=2 - 8 * r**2) + PinMeshCoordinates()) @ end
        for side, name in PARTICLES.items():
            U = ex.var(f"U_{name}", domain="globals") if self.frame is None else self.frame
            # Liquid velocity = rate of the solid's positions (nothing in a steady solve) + U e_z.
            fluid += FSIConnection(velocity_offset=-U * ex.vector(0, 1)) @ f"{name}_surface"
            law = NeoHookean(1 / self.Ca_e)
            solid = DeformableSolidEquations(law, coordinate_space="C2", pressure_space="C1", scale_for_FSI=True)
            solid += DirichletBC(mesh_x=0) @ "axis"
            solid += IntegralObservables(volume=1, momentum=ex.mesh_velocity()[1])
            if self.frame is None:
                # The facing pole is held; the row that pays for it is the unknown velocity's: no force acts.
                off, row = ex.var("mesh_y") - side * self.d / 2, ex.testfunction(f"U_{name}", domain="globals")
                fluid += WeakContribution(off, row, coordsys=ex.cartesian) @ f"gap/{name}_surface"
                self += GlobalLagrangeMultiplier(f"U_{name}") @ "globals"
            self += solid @ name
        self += fluid @ "fluid"

    def outline(self, name: str) -> np.ndarray:
        """Nodes (r, z) of a particle's surface, by facets of three."""
        facets = self.get_mesh(f"{name}/{name}_surface").elements()
        return np.array([[[e.node_pt(i).x(k) for k in (0, 1)] for i in range(3)] for e in facets])

    def taylor(self, name: str) -> float:
        """(L_z - L_r) / (L_z + L_r) of a particle, taken on its quadratic outline."""
        s = np.linspace(0, 1, 101)
        shapes = np.stack([(1 - s) * (1 - 2 * s), 4 * s * (1 - s), s * (2 * s - 1)])
        r, z = np.einsum("eik,ij->kej", self.outline(name), shapes)
        return float((np.ptp(z) - 2 * r.max()) / (np.ptp(z) + 2 * r.max()))

    def velocity(self, name: str) -> float:
        """Velocity of the particle's centre of volume."""
        if self.frame is None:
            return float(self.get_ode("globals").get_value(f"U_{name}"))
        momentum, volume = (self.get_mesh(name).evaluate_observable(what) for what in ("momentum", "volume"))
        return self.frame + float(momentum) / float(volume)

    def steps(self, end: float, tol: float, first: float = 5e-4):
        """BDF2 steps to `end`, the first one BDF1; yields the time after each.

        The next step's size comes from the surfaces' distance to the parabola through their last three places,
        divided by the step, which makes it an error of velocity. As in pairsim that between the particles counts
        twenty times. pyoomph's own estimate, tried on the solids' positions, is of the size of the second difference
        and jumps with the step: at equal error it takes two to three times as many steps. Nothing is rejected: the
        solution is smooth and steps grow slowly.
        """

        def surfaces() -> np.ndarray:
            return np.stack([self.outline(name).reshape(-1, 2) for name in PARTICLES.values()])

        t, dt, times, places = 0.0, first, [0.0], [surfaces()]
        while t < end * (1 - 1e-9):
            left = end - t  # which the last two steps share
            dt = left if left < 1.01 * dt else min(dt, left / 2)
            self.solve(timestep=dt, newton_solver_tolerance=TOLERANCE_STEP)
            t += dt
            times, places = [*times[-3:], t], [*places[-3:], surfaces()]
            yield t
            if len(times) == 4:
                parabola = sum(
                    x * np.prod([(t - b) / (a - b) for b in times[:3] if b != a])
                    for a, x in zip(times[:3], places[:3], strict=True)
                )
                off = places[3] - parabola
                off -= off.mean((0, 1)) * [0, 1]
                error = max(np.abs(off).max(), 20 * abs(np.diff(off[..., 1].mean(1))[0])) / dt
                dt *= float(np.clip(0.9 * np.sqrt(tol / error), 0.5, 1.4))


def solve(
    cells: int, options: argparse.Namespace, folder: Path, frame: float | None, tol: float = 0.0
) -> tuple[dict[str, float], float]:
    """One row of the table, and the pair's mean velocity.

    Seconds are the processor's, but for `wall`; those of the compiler are in no other.
    """
    begin, start = time.perf_counter(), time.process_time()
    code = str(folder / ("point" if frame is None else "transient"))
    with Pair(cells, options.beta, options.d, frame, code) as pair:
        pair.initialise()
        set_up = time.process_time() - start
        pair.Ca_e.value = options.Ca_e
        start, steps = time.process_time(), 0
        if frame is None:
            pair.solve(newton_solver_tolerance=TOLERANCE, max_newton_iterations=15)
        else:
            steps = sum(1 for _ in pair.steps(options.end, tol))
        total = time.process_time() - start
        clock, (U_T, U_L) = pair.get_la_solver().clock, (pair.velocity(name) for name in PARTICLES.values())
        row = {"cells": cells, "t": 0.0 if frame is None else options.end, "tol": tol, "unknowns": pair.ndof()}
        row |= {"dU": U_L - U_T, "dU_by_Ca_e": (U_L - U_T) / options.Ca_e}
        row |= {"D_T": pair.taylor("trailing"), "D_L": pair.taylor("leading")}
        row |= {"steps": steps, "newton": clock["newton"], "set_up": set_up}
        row |= {"assembly": total - clock["factorise"] - clock["solve"]}
        row |= {"factorise": clock["factorise"], "solve": clock["solve"], "total": total}
        row["wall"] = time.perf_counter() - begin
        return row, (U_L + U_T) / 2


def main() -> None:
    """Solve on every mesh, print the table and write it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    option = parser.add_argument
    option("--cells", type=int, nargs="+", default=[20, 40, 80], help="cells on a half-circle, one mesh or more")
    option("--beta", type=float, default=0.4, help="diameter of the spheres over that of the tube")
    option("--d", type=float, default=0.1, help="distance between the spheres, in tube diameters")
    option("--Ca_e", type=float, default=0.1, help="viscous over elastic stress")
    option("--no-transient", action="store_true", help="the quasi-steady point only")
    option("--end", type=float, default=1.0, help="end time of the transient")
    option("--tol", type=float, nargs="+", default=[1e-3], help="error of velocity allowed to a time step, one or more")
    option("--output", type=Path, default=Path("pyoomph_pair.csv"), help="the table as CSV")
    options = parser.parse_args()

    rows: list[dict[str, float]] = []
    formats = {"dU": ".5e", "dU_by_Ca_e": ".5e", "D_T": ".5f", "D_L": ".5f", "t": "g", "tol": "g"}

    def add(row: dict[str, float]) -> None:
        if not rows:
            print(*(f"{key:>11}" for key in row))
        texts = (format(v, formats.get(k, "d" if isinstance(v, int) else ".2f")) for k, v in row.items())
        print(*(f"{text:>11}" for text in texts), flush=True)
        rows.append(row)

    with tempfile.TemporaryDirectory() as folder:
        for cells in options.cells:
            row, U = solve(cells, options, Path(folder), None)
            add(row)
            if not options.no_transient:
                for tol in options.tol:
                    add(solve(cells, options, Path(folder), U, tol)[0])
    with options.output.open("w", newline="") as file:
        writer = csv.DictWriter(file, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)


if __name__ == "__main__":
    main()
