"""A run whose velocity, pressure, conformation and moving mesh are given functions of place and time.

Forms, constraints, Newton's method and time scheme are those of a run; only the sources and the values on the boundary
are given. That of s = log c is the source of c times the derivative of the logarithm, by eigenvectors. The order in
time is that of the equations in space, whose sources are the forms at exact nodal values and rates: no error but that
of the time scheme is left.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cached_property
from itertools import pairwise
from unittest.mock import patch

import numpy as np

from pairsim.fem.meshes.geometry import Geometry, MeshSettings, Reference
from pairsim.fem.meshes.quadrature import CellQuadrature
from pairsim.fem.meshes.six_node_mesh import SixNodeMesh
from pairsim.fem.scene import Scene
from pairsim.physics.conformation import logarithm
from pairsim.runtime.arrays import Array
from pairsim.solvers.errors.run_errors import RunErrors
from pairsim.solvers.nonlinear.convergence import Report
from pairsim.solvers.problems import Problem
from pairsim.solvers.stepping.history import History
from pairsim.solvers.stepping.step_size import StepControl
from pairsim.solvers.transient.state import Counts, State
from pairsim.solvers.transient.transient import Transient
from studies.manufactured.fields import FRAME, LIQUID, Field, Flow, exact

LENGTH = 1.0


def of_logarithm(c: Array, change: Array) -> Array:
    """Change of log c that belongs to a change of c, components (zz, zr, rr, tt), both (n, 4)."""
    block = [[0, 1], [1, 2]]
    values, vectors = np.linalg.eigh(c[:, block])
    rotated = np.swapaxes(vectors, 1, 2) @ change[:, block] @ vectors
    # Divided differences of the logarithm: its derivative where two eigenvalues are one.
    slope, distance = 2 / (values[:, :, None] + values[:, None, :]), values[:, 1] - values[:, 0]
    apart = distance > 1e-8
    slope[apart, 0, 1] = slope[apart, 1, 0] = np.diff(np.log(values[apart]))[:, 0] / distance[apart]
    back = vectors @ (slope * rotated) @ np.swapaxes(vectors, 1, 2)
    return np.column_stack([back[:, 0, 0], back[:, 0, 1], back[:, 1, 1], change[:, 3] / c[:, 3]])


def displacement(X: Array, t: float) -> Array:
    """Displacement of the mesh, none on wall and ends."""
    z, r = X.T
    inside = np.cos(np.pi * z / LENGTH) * (1 - 4 * r**2)
    return np.column_stack([0.12 * inside * np.sin(3 * t + 1), 0.3 * r * inside * np.cos(4 * t)])


def displacement_rate(X: Array, t: float) -> Array:
    z, r = X.T
    inside = np.cos(np.pi * z / LENGTH) * (1 - 4 * r**2)
    return np.column_stack([0.36 * inside * np.cos(3 * t + 1), -1.2 * r * inside * np.sin(4 * t)])


def triangles(n: int) -> SixNodeMesh:
    """The half-plane of the tube in 4 n^2 six-node triangles, n across the radius."""
    columns, rows = 4 * n + 1, 2 * n + 1
    z, r = np.meshgrid(np.linspace(-LENGTH / 2, LENGTH / 2, columns), np.linspace(0, 0.5, rows), indexing="ij")
    number = np.arange(columns * rows).reshape(columns, rows)
    cells = []
    for i in range(0, columns - 1, 2):
        for j in range(0, rows - 1, 2):
            a, b, c, d = (i, j), (i + 2, j), (i + 2, j + 2), (i, j + 2)
            first, second = ((a, b, c), (a, c, d)) if (i + j) // 2 % 2 else ((a, b, d), (b, c, d))
            for corners in (first, second):
                sides = [(corners[k], corners[(k + 1) % 3]) for k in range(3)]
                middles = [((p[0] + q[0]) // 2, (p[1] + q[1]) // 2) for p, q in sides]
                cells.append([number[place] for place in (*corners, *middles)])
    return SixNodeMesh(np.column_stack([z.ravel(), r.ravel()]), np.array(cells))


class SourcedScene(Scene):
    """A scene of the liquid alone with sources.

    Attributes:
        source: What is added to the residual, a full vector.
        rate: Source of s at the nodes, a full vector. It goes in with what the time scheme has fixed, so that SUPG
            weights it as it does the rest of the equation.
    """

    source: Array | float = 0.0
    rate: Array | float = 0.0

    def load(self) -> Array:
        return super().load() + self.source

    def set_step(self, star: Array, g: float, U_m: float) -> None:  # type: ignore[override]
        super().set_step(star + g * self.rate, g, U_m)


class Manufactured(Transient):
    """A run that begins with exact values at three times.

    Args:
        flow: Which solution.
        n: Cells across the radius.
        old: The three times, newest first.
        step: Largest step.
        discrete: The sources are those for which the exact nodal values solve the equations in space: all error is
            that of the time scheme. Otherwise they are those of the differential equations.
    """

    scene: SourcedScene

    def __init__(self, flow: Flow, n: int, old: Sequence[float], step: float, *, discrete: bool) -> None:
        self.fields, self.discrete = exact(flow), discrete
        control = StepControl(1.0, 1e-9, step, fixed=step)
        problem = Problem(
            betas=(),
            solids=(),
            gaps=(),
            length=LENGTH,
            periodic=False,
            mesh=MeshSettings(),
            control=control,
            first_step=step,
            liquid=LIQUID,
            t_end=1.0,
        )
        reference = Reference.spheres(Geometry((), (), LENGTH), [])
        state = State(
            History(),
            reference,
            triangles(n),
            (),
            step,
            FRAME,
            False,
            Counts(steps=3),
            {},
            np.zeros(0),
            (),
            RunErrors.of(LIQUID),
        )
        super().__init__(problem, state)
        self.history = History(list(old), [np.zeros(0)] * 3, [self.exact(t) for t in old], frame=[0.0] * 3)

    # Values at the nodes

    @property
    def mesh(self) -> SixNodeMesh:
        return self.scene.liquid.six_node_mesh

    def _vector(self, **fields: Array) -> Array:
        """A full vector of values at all nodes (n, components); p is taken at the vertices."""
        x, liquid = np.zeros(self.scene.size), self.scene.liquid
        for name, values in fields.items():
            nodes = liquid.carriers(name)
            for component, value in enumerate(values[nodes].T):
                x[liquid.index(name, nodes, component)] = value
        return x

    def _linear(self, field: Field, t: float) -> Array:
        """A displacement or velocity of the mesh, linear in every cell, at all nodes."""
        return np.asarray(field(self.mesh.points, t)[self.mesh.parents].mean(axis=1))

    def places(self, t: float) -> Array:
        """Current places of the nodes."""
        return self.mesh.points + self._linear(displacement, t)

    def exact(self, t: float) -> Array:
        """The full vector of exact nodal values, with p as its gauge has it."""
        u, p, c = (self.fields[name](self.places(t), t) for name in ("u", "p", "c"))
        x = self._vector(u=u, p=p, s=logarithm(c), eta=self._linear(displacement, t))
        index, weight = self.scene.scalar_terms.gauge
        x[index] -= weight @ x[index] / weight.sum()
        return x

    # What a run takes from elsewhere

    def _attempt(self, dt: float, gradually: bool = False) -> tuple[Array, Array, Array, Report, float]:
        self._U_m = FRAME
        return super()._attempt(dt, gradually)

    def _drive_at(self, x: Array, t: float) -> None:
        """Exact values wherever the constraints hold a field, and the sources of this time."""
        now, held = self.exact(t), np.diff(self.constraints.N.indptr) == 0
        x[held] = now[held]
        scene, liquid = self.scene, self.scene.liquid
        scene.source, scene.rate = np.zeros(scene.size), 0.0
        scene.set(now)
        scene.set_step(now - self._rates(t), 1.0, FRAME)
        # The equation of the mesh has no physical meaning: its source is the one that moves it as is wanted.
        begin = 0 if self.discrete else liquid.offsets["eta"]
        scene.source[begin : liquid.size] = -liquid.residual()[begin:]
        if not self.discrete:
            places = self.places(t)
            scene.source -= self._vector(u=self._load(places, t))
            change = self.fields["source"](places, t)
            scene.rate = self._vector(s=of_logarithm(self.fields["c"](places, t), change))

    def _rates(self, t: float) -> Array:
        """d/dt at the nodes of what the time scheme differentiates, s and the displacement of the mesh."""
        places, velocity = self.places(t), self._linear(displacement_rate, t)
        c, c_t, c_z, c_r = (self.fields[name](places, t) for name in ("c", "c_t", "c_z", "c_r"))
        return self._vector(s=of_logarithm(c, c_t + velocity[:, :1] * c_z + velocity[:, 1:] * c_r), eta=velocity)

    def _load(self, places: Array, t: float) -> Array:
        """int f . v 2 pi R dx over the current domain, by node and component."""
        cells, shapes = self.mesh.cells, self.quadrature.shapes
        force = self.fields["force"](shapes @ places[cells], t)
        load = np.zeros((len(places), 2))
        np.add.at(load, cells, np.einsum("mq,qa,mqc->mac", self.quadrature.weights(places), shapes, force))
        return load

    # Errors

    @cached_property
    def quadrature(self) -> CellQuadrature:
        return CellQuadrature(self.mesh)

    def _at_quadrature(self, x: Array) -> dict[str, Array]:
        """u, p and s of a full vector, (cells, points, components)."""
        liquid, vertices = self.scene.liquid, self.mesh.vertices
        p = np.zeros((len(self.mesh.points), 1))
        p[vertices, 0] = x[liquid.index("p", vertices)]
        nodal = {"u": liquid.nodal("u", x), "p": p[self.mesh.parents].mean(axis=1), "s": liquid.nodal("s", x)}
        return {name: self.quadrature.shapes @ values[self.mesh.cells] for name, values in nodal.items()}

    def errors(self) -> dict[str, float]:
        """Errors of u, p and s at the last time: root mean squares over the current volume."""
        t, x = self.history.t[0], self.history.x[0]
        places, now = self.places(t), self.exact(t)
        assert np.allclose(self.scene.positions(x), places, rtol=0, atol=1e-12)
        weights = self.quadrature.weights(places)
        if self.discrete:
            wanted = self._at_quadrature(now)
        else:
            points = self.quadrature.shapes @ places[self.mesh.cells]
            wanted = {name: self.fields[name](points, t) for name in ("u", "p", "c")}
            wanted["s"] = logarithm(wanted["c"].reshape(-1, 4)).reshape(wanted["c"].shape)
        errors = {}
        for name, found in self._at_quadrature(x).items():
            difference = found - wanted[name]
            if name == "p":
                difference -= np.sum(weights * difference[..., 0]) / weights.sum()
            errors[name] = float(np.sqrt(np.sum(weights * np.sum(difference**2, axis=2)) / weights.sum()))
        return errors


@contextmanager
def sourced() -> Iterator[None]:
    """Scenes take sources, and their mesh moves although there are no particles."""
    with (
        patch("pairsim.solvers.meshed_scene.Scene", SourcedScene),
        patch("pairsim.fem.scene.mesh_moves", lambda *_, **__: True),
    ):
        yield


def errors(flow: Flow, n: int, times: Sequence[float], *, discrete: bool = False) -> dict[str, float]:
    """Errors at the last of the times; at the first three the exact values are given."""
    with sourced():
        step = max(b - a for a, b in pairwise(times))
        run = Manufactured(flow, n, times[2::-1], step, discrete=discrete)
        try:
            steps = list(run.steps(iter(times[3:])))
            assert np.allclose([step.t for step in steps], times[3:], rtol=1e-6)
            return run.errors()
        finally:
            run.close()
