"""A manufactured solution of the viscoelastic liquid on a moving mesh: orders of convergence in space and in time.

Forms, constraints, Newton's method and time scheme are those of a run; only the sources and the values on the boundary
are given. Velocity, pressure and conformation c are smooth functions of place and time in a frame that moves along the
axis, and so is the displacement of the mesh. The sources follow from the axisymmetric equations for c in the current
configuration, by symbolic differentiation; that of s = log c is theirs times the derivative of the logarithm, by
eigenvectors. So nothing in the sources shares a formula with the forms. The order in time is that of the equations in
space, whose sources are the forms at exact nodal values and rates: no error but that of the time scheme is left.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache, cached_property
from itertools import pairwise
from typing import Literal

import numpy as np
import pytest
import sympy
from support.scenes import tube

from pairsim.fem.meshes.geometry import Geometry, MeshSettings, Reference
from pairsim.fem.meshes.quadrature import CellQuadrature
from pairsim.fem.meshes.six_node_mesh import SixNodeMesh
from pairsim.fem.scene import Scene
from pairsim.physics.conformation import logarithm
from pairsim.physics.liquids import single
from pairsim.physics.liquids.giesekus import Giesekus
from pairsim.runtime.arrays import Array
from pairsim.solvers.errors.run_errors import RunErrors
from pairsim.solvers.nonlinear.convergence import Report
from pairsim.solvers.stepping.history import History
from pairsim.solvers.stepping.step_size import StepControl
from pairsim.solvers.transient.state import Counts, State
from pairsim.solvers.transient.transient import Transient

LIQUID = single(Giesekus(alpha=0.2), De=0.7, xi=0.3)
LENGTH = 1.0
FRAME = 0.8  # velocity of the frame
Flow = Literal["general", "parabolic"]
"""Which solution: in the parabolic flow u is of degree two and p of degree one in place."""
Field = Callable[[Array, float], Array]
"""Places (..., 2) and a time to values (..., components)."""


@cache
def exact(flow: Flow) -> dict[str, Field]:
    """u, p, c, the derivatives of c by t, z and r, the force, and the source of c.

    The velocity is that of the stream function r^2 A, so that it is free of divergence; at the wall it has no radial
    component. On the axis all fields are smooth in three dimensions.
    """
    z, r, t = sympy.symbols("z r t")
    xi, De, alpha = (sympy.Float(value) for value in (LIQUID.xi, LIQUID.De, LIQUID.modes[0].numbers["alpha"]))
    A = 1 + r**2 * (sympy.cos(t) - 1)
    p = 3 * z * sympy.cos(t)
    if flow == "general":
        A += (1 - 4 * r**2) * sympy.sin(3 * z + 2 * t) / 3
        p = 3 * sympy.cos(2 * z - t) * (1 + r**2)
    u = sympy.Matrix([2 * A + r * A.diff(r), -r * A.diff(z)])
    hoop_rate = -A.diff(z)
    common = sympy.Rational(4, 5) + sympy.sin(2 * z + t) / 4  # c_rr and c_tt agree on the axis
    zz = 1 + sympy.cos(2 * z + 3 * t) / 2 + 8 * r**2 * (1 + sympy.sin(t) / 2)  # c is isotropic at places of the axis
    zr = r * (1 + sympy.cos(z + 2 * t)) / 2
    c = sympy.Matrix([[zz, zr], [zr, common + r**2 * sympy.cos(z + t)]])
    c_tt = common + r**2 * sympy.sin(z - 2 * t)

    L = u.jacobian([z, r])
    convected = sympy.Matrix([u[0] - sympy.Float(FRAME), u[1]])

    def material(f: sympy.Expr) -> sympy.Expr:
        return f.diff(t) + convected[0] * f.diff(z) + convected[1] * f.diff(r)

    one = sympy.eye(2)
    source = c.applyfunc(material) - L * c - c * L.T + (c - one + alpha * (c - one) ** 2) / De
    source_tt = material(c_tt) - 2 * hoop_rate * c_tt + (c_tt - 1 + alpha * (c_tt - 1) ** 2) / De

    sigma = xi * (L + L.T) + (1 - xi) / De * (c - one) - p * one
    sigma_tt = 2 * xi * hoop_rate + (1 - xi) / De * (c_tt - 1) - p
    force = [
        -(sigma[0, 0].diff(z) + sigma[0, 1].diff(r) + sigma[0, 1] / r),
        -(sigma[1, 0].diff(z) + sigma[1, 1].diff(r) + (sigma[1, 1] - sigma_tt) / r),
    ]
    components = [c[0, 0], c[0, 1], c[1, 1], c_tt]
    formulas = {
        "u": list(u),
        "p": [p],
        "c": components,
        "c_t": [f.diff(t) for f in components],
        "c_z": [f.diff(z) for f in components],
        "c_r": [f.diff(r) for f in components],
        "source": [source[0, 0], source[0, 1], source[1, 1], source_tt],
        "force": force,
    }

    def evaluated(formula: list[sympy.Expr]) -> Field:
        compiled = sympy.lambdify((z, r, t), formula, "numpy", cse=True)
        return lambda x, time: np.stack(
            [np.broadcast_to(f, x.shape[:-1]) for f in compiled(x[..., 0], x[..., 1], time)], axis=-1
        )

    return {name: evaluated(formula) for name, formula in formulas.items()}


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

    def set_step(self, star: Array, g: float, U_m: float) -> None:
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
        problem = tube(LENGTH, MeshSettings(), control, step, liquid=LIQUID, t_end=1.0)
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
        index, weight = self.scene.gauge
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
        assert self.scene.positions(x) == pytest.approx(places, abs=1e-12)
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


@pytest.fixture(autouse=True)
def _sourced_scenes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Scenes take sources, and their mesh moves although there are no particles."""
    monkeypatch.setattr("pairsim.solvers.meshed_scene.Scene", SourcedScene)
    monkeypatch.setattr("pairsim.fem.scene.mesh_moves", lambda *_, **__: True)


def errors(flow: Flow, n: int, times: Sequence[float], *, discrete: bool = False) -> dict[str, float]:
    """Errors at the last of the times; at the first three the exact values are given."""
    run = Manufactured(flow, n, times[2::-1], max(b - a for a, b in pairwise(times)), discrete=discrete)
    try:
        steps = list(run.steps(iter(times[3:])))
        assert [step.t for step in steps] == pytest.approx(times[3:])
        return run.errors()
    finally:
        run.close()


def check(coarse: dict[str, float], fine: dict[str, float], expected: dict[str, float], bounds: list[float]) -> None:
    """Half the size: each order is at most .2 below the expected one, and the errors are below their bounds."""
    observed = {name: round(float(np.log2(coarse[name] / fine[name])), 3) for name in expected}
    assert all(observed[name] > order - 0.2 for name, order in expected.items()), observed
    assert all(fine[name] < bound for name, bound in zip(expected, bounds, strict=True)), fine


@pytest.mark.parametrize(
    ("flow", "n", "bounds"),
    [
        ("general", 4, [1.8e-4, 3.8e-3, 6e-4]),
        pytest.param("parabolic", 4, [7e-7, 1e-5, 7.5e-5], marks=pytest.mark.slow),
        pytest.param("general", 8, [2.3e-5, 9e-4, 1.1e-4], marks=pytest.mark.slow),
        pytest.param("parabolic", 8, [5e-8, 1.3e-6, 1.3e-5], marks=pytest.mark.slow),
        pytest.param("general", 16, [2.9e-6, 2.3e-4, 2e-5], marks=pytest.mark.long),
    ],
)
def test_orders_in_space(flow: Flow, n: int, bounds: list[float]) -> None:
    """u, p and s on n and 2 n cells across the radius.

    s is driven by grad u, whose error is of order two: in the general flow its order falls towards that (2.7, 2.5,
    2.3). In the parabolic flow the discrete spaces hold u and p: the error is that of s itself, of order 2.5 with SUPG.
    """
    times = list(np.linspace(0.0, 0.2, 17))
    expected = {"u": 3.0, "p": 2.0, "s": 2.0 if flow == "general" else 2.5}
    check(errors(flow, n, times), errors(flow, 2 * n, times), expected, bounds)


@pytest.mark.slow
def test_order_in_time() -> None:
    """Three in all fields, with steps that grow and shrink by 1.4 in turn."""

    def in_steps(count: int) -> dict[str, float]:
        steps = np.tile([1.0, 1.4], count // 2)
        times = 0.5 * np.concatenate([[0.0], np.cumsum(steps)]) / steps.sum()
        return errors("general", 4, list(times), discrete=True)

    check(in_steps(24), in_steps(48), {"u": 3.0, "p": 3.0, "s": 3.0}, [4.5e-8, 1.5e-6, 1.8e-6])
