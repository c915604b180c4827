"""Reference meshes with gmsh: the liquid around undeformed spheres, and one half-disc per soft particle.

Everything here is numpy on one process; the mesh of the liquid and those of the particles are separate and share
the nodes of the outlines exactly, so that a remeshing of the liquid leaves the particles as they are.
A scene that is its own mirror image is meshed for z > 0 and mirrored: dU is a small difference of large
velocities, and a mirrored mesh cancels most of its error (design: 1.2 % instead of 9 % at N_p 10).
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import gmsh
import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import spsolve
from scipy.spatial import cKDTree

from pairsim.errors import MeshFailure

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

TUBE_RADIUS = 0.5
STRAIGHT_ENOUGH = 0.3  # least Jacobian, against straight sides, of a mesh whose curved sides are left to themselves
# Local node numbers of gmsh's 6-node triangle: swapping the first two vertices' neighbours mirrors a cell.
_MIRRORED_CELL = np.array([0, 2, 1, 5, 4, 3])
_MIDSIDE_PARENTS = {3: (0, 1), 4: (1, 2), 5: (2, 0)}


@dataclass(frozen=True)
class MeshSettings:
    """How finely to mesh.

    Attributes:
        Np: Cells on each half-circle, at least.
        growth: Growth of the cell size per unit distance from a particle.
        gap_cells: Cells across the gap between two particles (0: N_p/4).
        gap_exponent: Below d = 0.1 the cells across a gap grow as (0.1/d)**gap_exponent.
        wall_cells: Cells between a particle and the wall (0: N_p/4).
        max_size: Largest cell size (in D_c).
        core_growth: Growth of the cell size per unit depth inside a particle.
    """

    Np: int = 40
    growth: float = 0.15
    gap_cells: int = 0
    gap_exponent: float = 0.0
    wall_cells: int = 0
    wall_arcs: float = 0.35
    max_size: float = 0.2
    core_growth: float = 0.3


@dataclass(frozen=True)
class Geometry:
    """Undeformed spheres on the axis of a tube of radius 1/2, the cluster centred at z = 0.

    Attributes:
        betas: Diameters of the particles, counted from upstream.
        gaps: The N-1 distances between facing surfaces.
        length: Length of the tube.
    """

    betas: tuple[float, ...]
    gaps: tuple[float, ...]
    length: float

    @cached_property
    def centres(self) -> Array:
        """Axial positions of the centres, shape (N,)."""
        if not self.betas:
            return np.zeros(0)
        z = [self.betas[0] / 2]
        for i, gap in enumerate(self.gaps):
            z.append(z[-1] + self.betas[i] / 2 + gap + self.betas[i + 1] / 2)
        return np.array(z) - (z[-1] + self.betas[-1] / 2) / 2

    @property
    def mirrored(self) -> bool:
        """Whether the scene is its own mirror image in z."""
        return self.betas == self.betas[::-1] and bool(np.allclose(self.gaps, self.gaps[::-1], rtol=1e-12))


@dataclass(frozen=True)
class Reference:
    """A reference domain of the liquid: around undeformed spheres, or around outlines as they are.

    Attributes:
        geometry: Spheres and gaps (those between the outlines).
        outlines: The cut half-circles, counted from upstream.
        positions: Quadratic nodes of every outline, downstream pole first.
        deformed: Whether the positions are not those of the spheres.
    """

    geometry: Geometry
    outlines: tuple[Outline, ...]
    positions: tuple[Array, ...]
    deformed: bool

    @staticmethod
    def spheres(geometry: Geometry, outlines: Sequence[Outline]) -> Reference:
        positions = tuple(o.nodes + [z, 0.0] for o, z in zip(outlines, geometry.centres, strict=True))
        return Reference(geometry, tuple(outlines), positions, False)

    @property
    def mirrored(self) -> bool:
        """Whether the domain is its own mirror image in z."""
        return self.geometry.mirrored and not self.deformed


@dataclass(frozen=True)
class QuadraticMesh:
    """A mesh of 6-node triangles in the half-plane (z, r >= 0).

    Attributes:
        points: Nodes, shape (n, 2).
        cells: Node numbers in gmsh's order (vertices, then mid-sides 01, 12, 20), shape (m, 6).
    """

    points: Array
    cells: Indices

    @cached_property
    def vertices(self) -> Indices:
        """Numbers of the nodes that are vertices, ascending."""
        return np.unique(self.cells[:, :3])

    @cached_property
    def parents(self) -> Indices:
        """For each node its two parent vertices (twice itself for a vertex), shape (n, 2)."""
        pair = np.repeat(np.arange(len(self.points))[:, None], 2, axis=1)
        for k, (i, j) in _MIDSIDE_PARENTS.items():
            pair[self.cells[:, k]] = self.cells[:, [i, j]]
        return pair

    @cached_property
    def jacobians(self) -> Array:
        """`jacobians` of every cell, shape (m, 7)."""
        return jacobians(self.points[self.cells])

    def mirror(self) -> QuadraticMesh:
        """The image under z -> -z."""
        return QuadraticMesh(self.points * [-1.0, 1.0], self.cells[:, _MIRRORED_CELL])

    def with_mirror_image(self) -> QuadraticMesh:
        """This mesh of z >= 0 joined to its mirror image along z = 0."""
        on_plane = np.abs(self.points[:, 0]) < 1e-10
        points = self.points.copy()
        points[on_plane, 0] = 0.0
        image = np.arange(len(points))
        image[~on_plane] = len(points) + np.arange(np.count_nonzero(~on_plane))
        other = (points * [-1.0, 1.0])[~on_plane]
        return QuadraticMesh(np.vstack([points, other]), np.vstack([self.cells, image[self.cells[:, _MIRRORED_CELL]]]))


@dataclass(frozen=True)
class Outline:
    """The half-circle of one particle, cut into arcs.

    Attributes:
        radius: Radius of the sphere.
        angles: Polar angles of the arc ends from the downstream pole (0) to the upstream pole (pi).
    """

    radius: float
    angles: Array

    @cached_property
    def node_angles(self) -> Array:
        """Angles of all quadratic nodes: arc ends and middles alternating."""
        both = np.empty(2 * len(self.angles) - 1)
        both[::2] = self.angles
        both[1::2] = (self.angles[1:] + self.angles[:-1]) / 2
        return both

    @cached_property
    def nodes(self) -> Array:
        """Quadratic nodes about the centre, shape (2 n + 1, 2), downstream pole first."""
        xy = self.radius * np.column_stack([np.cos(self.node_angles), np.sin(self.node_angles)])
        xy[[0, -1], 1] = 0.0
        return xy

    def mirror(self) -> Outline:
        return Outline(self.radius, (np.pi - self.angles)[::-1].copy())

    def size_at(self, angle: float) -> float:
        """Length of the arc that holds the angle."""
        angles = self._angles  # gmsh asks for every cell: plain numbers, not arrays
        k = min(max(bisect_left(angles, angle), 1), len(angles) - 1)
        return (angles[k] - angles[k - 1]) * self.radius

    @cached_property
    def _angles(self) -> list[float]:
        angles: list[float] = self.angles.tolist()
        return angles


def make_outlines(geometry: Geometry, settings: MeshSettings) -> list[Outline]:
    """Cut every half-circle into at least N_p arcs, finer towards narrow gaps and a near wall."""
    outlines: list[Outline] = []
    n = len(geometry.betas)
    for i in range(n):
        if geometry.mirrored and i > n - 1 - i:
            outlines.append(outlines[n - 1 - i].mirror())
            continue
        middle = geometry.mirrored and 2 * i == n - 1
        span = np.pi / 2 if middle else np.pi
        fine = np.linspace(0.0, span, 4001)
        size = np.array([_outline_size(geometry, settings, i, angle) for angle in fine])
        density = geometry.betas[i] / 2 / size
        count = np.concatenate([[0.0], np.cumsum((density[1:] + density[:-1]) / 2 * np.diff(fine))])
        arcs = max(2, math.ceil(count[-1] - 1e-9))
        angles = np.interp(np.linspace(0.0, count[-1], arcs + 1), count, fine)
        angles[[0, -1]] = 0.0, span
        if middle:
            angles = np.concatenate([angles, np.pi - angles[-2::-1]])
        outlines.append(Outline(geometry.betas[i] / 2, angles))
    return outlines


def _gap_cells(settings: MeshSettings, gap: float) -> float:
    cells = settings.gap_cells or settings.Np / 4
    return cells * max(1.0, 0.1 / gap) ** settings.gap_exponent


def _wall_cells(settings: MeshSettings) -> float:
    return settings.wall_cells or settings.Np / 4


def _outline_size(geometry: Geometry, settings: MeshSettings, i: int, angle: float) -> float:
    a = geometry.betas[i] / 2
    z, r = geometry.centres[i] + a * math.cos(angle), a * math.sin(angle)
    size = min(math.pi * a / settings.Np, (TUBE_RADIUS - r) / (settings.wall_arcs * settings.Np))
    for j, gap in ((i - 1, i - 1), (i + 1, i)):
        if 0 <= j < len(geometry.betas):
            distance = math.hypot(z - geometry.centres[j], r) - geometry.betas[j] / 2
            # Arcs may be longer than the cells across a gap: along the gap all changes over sqrt(a d) >> d.
            size = min(size, max(distance, 0.0) * 2 / _gap_cells(settings, geometry.gaps[gap]))
    return size


Distances = Callable[[float, float], list[tuple[float, float]]]


def _from_spheres(reference: Reference) -> Distances:
    """Distance to every sphere, and the length of its nearest arc."""
    centres = [float(z) for z in reference.geometry.centres]
    outlines = reference.outlines

    def distances(z: float, r: float) -> list[tuple[float, float]]:
        return [
            (
                max(math.hypot(z - centre, r) - outline.radius, 0.0),
                outline.size_at(math.atan2(abs(r), z - centre)),
            )
            for centre, outline in zip(centres, outlines, strict=True)
        ]

    return distances


def _from_nodes(reference: Reference) -> Distances:
    """Distance to every deformed outline, and the length of its nearest arc."""
    outlines = []
    for nodes in reference.positions:
        chord = np.hypot(*np.diff(nodes[::2], axis=0).T)
        at_ends = np.minimum(np.append(chord, chord[-1]), np.append(chord[0], chord))
        arcs = np.empty(len(nodes))
        arcs[::2], arcs[1::2] = at_ends, chord
        centre = (nodes[0, 0] + nodes[-1, 0]) / 2
        angles = np.maximum.accumulate(np.arctan2(nodes[:, 1], nodes[:, 0] - centre))
        outlines.append((centre, angles.tolist(), nodes.tolist(), arcs.tolist()))

    def distances(z: float, r: float) -> list[tuple[float, float]]:
        found = []
        for centre, angles, nodes, arcs in outlines:
            # The node in this direction is close to the nearest one: from there downhill, as gmsh asks for every cell.
            last = len(nodes) - 1
            k = min(bisect_left(angles, math.atan2(abs(r), z - centre)), last)
            least = math.hypot(z - nodes[k][0], r - nodes[k][1])
            for step in (-1, 1):
                while 0 <= k + step <= last:
                    distance = math.hypot(z - nodes[k + step][0], r - nodes[k + step][1])
                    if distance >= least:
                        break
                    k, least = k + step, distance
            found.append((least, arcs[k]))
        return found

    return distances


def _liquid_size(reference: Reference, settings: MeshSettings) -> Callable[[float, float], float]:
    """Cell size in the liquid as a function of (z, r)."""
    distances = _from_nodes(reference) if reference.deformed else _from_spheres(reference)
    gap_cells = [_gap_cells(settings, gap) for gap in reference.geometry.gaps]
    wall_cells = _wall_cells(settings)

    def size(z: float, r: float) -> float:
        h = settings.max_size
        surface = distances(z, r)
        for distance, arc in surface:
            h = min(h, arc + settings.growth * distance)
            h = min(h, max((TUBE_RADIUS - r + distance) / wall_cells, 0.5 * arc))
        for i, cells in enumerate(gap_cells):
            (s, arc), (other, other_arc) = surface[i], surface[i + 1]
            h = min(h, max((s + other) / cells, 0.25 * min(arc, other_arc)))
        return h

    return size


def liquid_mesh(reference: Reference, settings: MeshSettings) -> QuadraticMesh:
    """Mesh the liquid of a reference domain.

    Args:
        reference: The outlines, whose nodes become nodes of this mesh.
        settings: Cell sizes.

    Returns:
        The mesh; nodes of the two ends match in r.

    Raises:
        MeshFailure: gmsh failed or left a cell turned over.
    """
    half = reference.geometry.length / 2
    size = _liquid_size(reference, settings)
    end_cells = max(2, math.ceil(TUBE_RADIUS / size(half, TUBE_RADIUS / 2)))
    mirrored = reference.mirrored
    pieces = [nodes[::-1] for nodes in reference.positions]  # from the upstream pole to the downstream one
    if mirrored:
        n = len(pieces)
        middle = [pieces[n // 2][len(pieces[n // 2]) // 2 :]] if n % 2 else []
        pieces = middle + pieces[(n + 1) // 2 :]
    from_middle = mirrored and len(reference.positions) % 2 == 1

    def build() -> None:
        curve: list[int] = []
        point, line = gmsh.model.geo.addPoint, gmsh.model.geo.addLine
        start = None if from_middle else point(0.0 if mirrored else -half, 0.0, 0.0)
        last = start
        for nodes in pieces:
            tags = [point(float(z), float(r), 0.0) for z, r in nodes[::2]]
            if last is None:
                start = tags[0]
            else:
                curve.append(line(last, tags[0]))
            curve += _one_cell_lines(tags)
            last = tags[-1]
        corner = point(half, 0.0, 0.0), point(half, TUBE_RADIUS, 0.0)
        top = point(0.0 if mirrored else -half, TUBE_RADIUS, 0.0)
        curve.append(line(last, corner[0]))
        outlet, wall, inlet = line(*corner), line(corner[1], top), line(top, start)
        for end in (outlet,) if mirrored else (outlet, inlet):
            gmsh.model.geo.mesh.setTransfiniteCurve(end, end_cells + 1)
        gmsh.model.geo.addPlaneSurface([gmsh.model.geo.addCurveLoop([*curve, outlet, wall, inlet])])

    mesh = _run_gmsh(build, size, pieces)
    return mesh.with_mirror_image() if mirrored else mesh


def _one_cell_lines(tags: Sequence[int]) -> list[int]:
    """Straight lines through points, each the side of one cell."""
    lines = [gmsh.model.geo.addLine(a, b) for a, b in pairwise(tags)]
    for tag in lines:
        gmsh.model.geo.mesh.setTransfiniteCurve(tag, 2)
    return lines


def particle_mesh(outline: Outline, settings: MeshSettings) -> QuadraticMesh:
    """Mesh the inside of one undeformed sphere about its own centre.

    Raises:
        MeshFailure: gmsh failed or left a cell turned over.
    """
    symmetric = bool(np.allclose(outline.angles, np.pi - outline.angles[::-1], rtol=0.0, atol=1e-12))
    a = outline.radius

    def size(z: float, r: float) -> float:
        depth = max(a - math.hypot(z, r), 0.0)
        return min(outline.size_at(math.atan2(abs(r), z)) + settings.core_growth * depth, a / 3)

    halved = symmetric and len(outline.angles) % 2 == 1
    nodes = outline.nodes[::-1]
    if halved:
        nodes = nodes[len(nodes) // 2 :]

    def build() -> None:
        point, line = gmsh.model.geo.addPoint, gmsh.model.geo.addLine
        tags = [point(float(z), float(r), 0.0) for z, r in nodes[::2]]
        axis = [line(tags[-1], tags[0])]
        if halved:
            centre = point(0.0, 0.0, 0.0)
            axis = [line(tags[-1], centre), line(centre, tags[0])]
        gmsh.model.geo.addPlaneSurface([gmsh.model.geo.addCurveLoop([*_one_cell_lines(tags), *axis])])

    mesh = _run_gmsh(build, size, [nodes])
    return mesh.with_mirror_image() if halved else mesh


def particle_meshes(
    geometry: Geometry, settings: MeshSettings, outlines: Sequence[Outline], Ca_es: Sequence[float]
) -> list[QuadraticMesh | None]:
    """One mesh a soft particle, None for a rigid one; mirror images of each other where the scene is mirrored."""
    meshes: list[QuadraticMesh | None] = []
    n = len(outlines)
    for i, (outline, Ca_e) in enumerate(zip(outlines, Ca_es, strict=True)):
        twin = meshes[n - 1 - i] if geometry.mirrored and n - 1 - i < i else None
        meshes.append(None if Ca_e == 0 else twin.mirror() if twin else particle_mesh(outline, settings))
    return meshes


def _run_gmsh(
    build: Callable[[], None], size: Callable[[float, float], float], curves: Sequence[Array]
) -> QuadraticMesh:
    """Mesh what `build` describes; mid-sides along the curves' nodes are then put where the curves have them."""
    gmsh.initialize(readConfigFiles=False, interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("General.NumThreads", 1)
        gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", 0)
        gmsh.option.setNumber("Mesh.MeshSizeFromPoints", 0)
        gmsh.option.setNumber("Mesh.Algorithm", 6)
        gmsh.model.add("pairsim")
        build()
        gmsh.model.geo.synchronize()
        gmsh.model.mesh.setSizeCallback(lambda dim, tag, z, r, _, lc: size(z, r))
        gmsh.model.mesh.generate(2)
        gmsh.model.mesh.setOrder(2)
        tags, coordinates, _ = gmsh.model.mesh.getNodes()
        kind = gmsh.model.mesh.getElementType("Triangle", 2)
        _, nodes = gmsh.model.mesh.getElementsByType(kind)
        if len(nodes) == 0:
            raise MeshFailure("gmsh made no cell", advice="another mesh.Np or a wider gap")
    except MeshFailure:
        raise
    except Exception as error:
        raise MeshFailure(f"gmsh: {error}", advice="another mesh.Np or a wider gap") from error
    finally:
        gmsh.finalize()
    used, cells = np.unique(nodes, return_inverse=True)
    row = np.empty(int(tags.max()) + 1, dtype=np.int64)
    row[tags.astype(np.int64)] = np.arange(len(tags))
    points = coordinates.reshape(-1, 3)[row[used.astype(np.int64)], :2].copy()
    points[np.abs(points[:, 1]) < 1e-12, 1] = 0.0
    triangles = cells.reshape(-1, 6).astype(np.int64)
    clockwise = jacobians(points[triangles])[:, -1] < 0
    triangles[clockwise] = triangles[clockwise][:, _MIRRORED_CELL]
    straight = QuadraticMesh(points, triangles)
    mesh = _curved(straight, curves, spread=False)
    if _least_jacobian(mesh) < STRAIGHT_ENOUGH:
        mesh = _curved(straight, curves, spread=True)
    if _least_jacobian(mesh) <= 0:
        raise MeshFailure("a cell of the new mesh is turned over", advice="a larger mesh.Np")
    return mesh


def _least_jacobian(mesh: QuadraticMesh) -> float:
    """Smallest Jacobian of the mesh over that of its cells with straight sides."""
    x = mesh.points[mesh.cells[:, :3]]
    (a, b), (c, d) = (x[:, 1] - x[:, 0]).T, (x[:, 2] - x[:, 0]).T
    return float((mesh.jacobians / (a * d - b * c)[:, None]).min())


def _curved(straight: QuadraticMesh, curves: Sequence[Array], spread: bool) -> QuadraticMesh:
    """Put mid-sides along the curves where the curves have them.

    Args:
        straight: Mesh with straight sides.
        curves: Quadratic nodes of each curve.
        spread: Let the other nodes near a curve follow, harmonically; a side that is bent too much for its cell would
            turn the cell over.
    """
    points = straight.points.copy()
    boundary = [np.arange(0)]
    for nodes in curves:
        both = np.vstack([nodes[::2], (nodes[:-2:2] + nodes[2::2]) / 2])
        distance, index = cKDTree(straight.points).query(both)
        if distance.max() > 1e-9:
            raise MeshFailure("an arc of an outline was cut", advice="another mesh.Np")
        points[index] = np.vstack([nodes[::2], nodes[1::2]])
        boundary.append(index)
    if spread:
        shift = points - straight.points
        on_curve = np.zeros(len(points), dtype=bool)
        on_curve[np.concatenate(boundary)] = True
        stiffness = _harmonic(straight)
        for component in range(2):
            fixed = on_curve | _on_boundary(straight, axis=component == 1)
            free = ~fixed
            load = -stiffness[free][:, fixed] @ shift[fixed, component]
            shift[free, component] = spsolve(stiffness[free][:, free].tocsc(), load)
        points = straight.points + shift
    return QuadraticMesh(points, straight.cells)


def _on_boundary(mesh: QuadraticMesh, axis: bool) -> np.ndarray:
    """Nodes on a straight boundary; those on the axis only if asked for (they may slide along it)."""
    z, r = mesh.points.T
    outer = (r > TUBE_RADIUS - 1e-9) | (z < z.min() + 1e-9) | (z > z.max() - 1e-9)
    return np.asarray(outer | (r < 1e-12) if axis else outer)


def _harmonic(mesh: QuadraticMesh) -> sparse.csr_matrix:
    """Stiffness matrix of the Laplacian on quadratic cells, weighted by the inverse cell area."""
    points, weights = np.array([[1 / 6, 1 / 6], [2 / 3, 1 / 6], [1 / 6, 2 / 3]]), np.full(3, 1 / 6)
    local = shape_gradients(points)
    dx = np.einsum("qak,mai->mqik", local, mesh.points[mesh.cells])
    gradients = np.einsum("qak,mqki->mqai", local, np.linalg.inv(dx))
    # The inverse area cancels the area of the integral.
    values = np.einsum("q,mqai,mqbi->mab", weights, gradients, gradients)
    row, column = np.repeat(mesh.cells, 6, axis=1).ravel(), np.tile(mesh.cells, (1, 6)).ravel()
    return sparse.csr_matrix(sparse.coo_matrix((values.ravel(), (row, column)), shape=(len(mesh.points),) * 2))


def shape_values(points: Array) -> Array:
    """The six quadratic shape functions at points of the reference triangle, shape (q, 6)."""
    s, t = points[:, 0], points[:, 1]
    u = 1 - s - t
    return np.stack([u * (2 * u - 1), s * (2 * s - 1), t * (2 * t - 1), 4 * u * s, 4 * s * t, 4 * t * u], axis=1)


def shape_gradients(points: Array) -> Array:
    """Reference gradients of the six quadratic shape functions, shape (q, 6, 2)."""
    s, t = points[:, 0], points[:, 1]
    u = 1 - s - t
    zero = np.zeros_like(s)
    ds = np.stack([1 - 4 * u, 4 * s - 1, zero, 4 * (u - s), 4 * t, -4 * t], axis=1)
    dt = np.stack([1 - 4 * u, zero, 4 * t - 1, -4 * s, 4 * s, 4 * (u - t)], axis=1)
    return np.stack([ds, dt], axis=2)


# Vertices, mid-sides and centroid: the determinant is a polynomial of degree 2, bounded well by these.
_SAMPLES = shape_gradients(
    np.array([[0, 0], [1, 0], [0, 1], [0.5, 0], [0.5, 0.5], [0, 0.5], [1 / 3, 1 / 3]], dtype=np.float64)
)


def jacobians(cell_points: Array) -> Array:
    """Determinant of the map of each cell at seven points.

    Args:
        cell_points: Node positions by cell, shape (m, 6, 2).

    Returns:
        Determinants, shape (m, 7); all positive in a valid mesh.
    """
    dx = np.einsum("qak,mai->mqik", _SAMPLES, cell_points)
    return np.asarray(dx[..., 0, 0] * dx[..., 1, 1] - dx[..., 0, 1] * dx[..., 1, 0])
