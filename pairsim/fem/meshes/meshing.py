"""Generation of reference meshes with gmsh: the liquid around the particles, and a half-disc for each soft particle.

The meshes of liquid and particles are separate but share the nodes of the outlines, so that the liquid can be remeshed
while the particles keep their meshes.

A symmetric geometry is meshed for z > 0 and mirrored: dU is a small difference of large velocities, and on a symmetric
mesh most of the discretisation error cancels (measured at N_p 10: error of dU 1.2 % instead of 9 %).
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import gmsh
import numpy as np
from scipy.sparse.linalg import spsolve

from pairsim.fem.meshes.cell_columns import LONGEST, stations
from pairsim.fem.meshes.cell_sizes import divided, liquid_size
from pairsim.fem.meshes.extruded_cells import extruded, graded_ends
from pairsim.fem.meshes.geometry import Geometry, MeshSettings, Outline, Reference
from pairsim.fem.meshes.quadrature import CellQuadrature, assembled
from pairsim.fem.meshes.six_node_mesh import MIRRORED_CELL, SixNodeMesh, jacobians, nodes_at
from pairsim.quantities.scales import TUBE_RADIUS
from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import MeshFailure

RADII = 1001  # number of radii at which the cell size is evaluated to divide the ends of a closed row; chosen
SHORT_ROWS = 0.2  # length of a stretch of rows below which unstructured cells are used instead [D_c]; chosen
# Ratio of the Jacobians of curved and straight cells below which nodes near a curved boundary are moved too; chosen.
STRAIGHT_ENOUGH = 0.3
TERMINAL, THROW = "General.Terminal", 2  # an option, and the General.AbortOnError by which gmsh raises exceptions


def liquid_mesh(reference: Reference, settings: MeshSettings) -> SixNodeMesh:
    """Mesh the liquid of a reference domain.

    Args:
        reference: The outlines, whose nodes become nodes of this mesh.
        settings: Cell sizes.

    Returns:
        The mesh; the nodes of the two ends have the same radii.

    Raises:
        MeshFailure: gmsh failed, or a cell of the mesh is inverted.
    """
    half = reference.geometry.length / 2
    size = liquid_size(reference, settings)
    low, high = _near_zone(reference, settings)
    end_cells = max(2, math.ceil(TUBE_RADIUS / min(size(z, TUBE_RADIUS / 2) for z in (low, high))))
    at_ends = None
    if reference.geometry.closed:
        radii = np.linspace(0.0, TUBE_RADIUS, RADII)
        at_ends = divided(radii, 1 / np.array([size(high, r) for r in radii.tolist()]))[1:-1].tolist()
    section = _Section(reference, low, high, end_cells, settings.row_grading, at_ends)

    def rows(mesh: SixNodeMesh, begin: float) -> SixNodeMesh:
        longest = LONGEST * min(reference.geometry.betas)
        return extruded(mesh, np.array(stations(begin, half, TUBE_RADIUS / end_cells, settings.growth, longest)))

    mesh = _run_gmsh(section.build, size, section.pieces)
    if settings.row_grading != 1.0 and at_ends is None:
        mesh = graded_ends(mesh, (high,) if section.mirrored else (low, high), end_cells, settings.row_grading)
    if high < half:
        mesh = rows(mesh, high)
    if low > -half and not section.mirrored:
        mesh = rows(mesh.mirror(), -low).mirror()
    return mesh.with_mirror_image() if section.mirrored else mesh


@dataclass(frozen=True)
class _Section:
    """The meridional section of the liquid around the particles, which is meshed without rows of cells.

    Attributes:
        reference: The outlines.
        low: Its upstream end [D_c].
        high: Its downstream end [D_c].
        end_cells: Number of cells on a free end.
        grading: Length of the cells of a free end on the axis over that at the wall.
        at_ends: Radii of the nodes between axis and wall on the ends of a closed row, which are the same on both; None
            for free ends.
    """

    reference: Reference
    low: float
    high: float
    end_cells: int
    grading: float
    at_ends: list[float] | None

    @property
    def mirrored(self) -> bool:
        """Whether only the part at z > 0 is meshed."""
        return self.reference.mirrored

    @property
    def left(self) -> float:
        """Where the part that is meshed begins [D_c]."""
        return 0.0 if self.mirrored else self.low

    @cached_property
    def pieces(self) -> list[Array]:
        """The outlines in this part, each from its upstream to its downstream pole; of one about z = 0, half."""
        pieces = [nodes[::-1] for nodes in self.reference.positions]
        if not self.mirrored:
            return pieces
        n = len(pieces)
        middle = [pieces[n // 2][len(pieces[n // 2]) // 2 :]] if n % 2 else []
        return middle + pieces[(n + 1) // 2 :]

    def build(self) -> None:
        """Add the section to gmsh's model."""
        point, line = gmsh.model.geo.addPoint, gmsh.model.geo.addLine
        start, last, curve = self._add_outlines()
        corner = point(self.high, 0.0, 0.0), point(self.high, TUBE_RADIUS, 0.0)
        top = point(self.left, TUBE_RADIUS, 0.0)
        curve.append(line(last, corner[0]))
        wall = line(corner[1], top)
        add_ends = self._add_free_ends if self.at_ends is None else self._add_closed_ends
        outlet, inlet = add_ends(corner, top, start)
        gmsh.model.geo.addPlaneSurface([gmsh.model.geo.addCurveLoop([*curve, *outlet, wall, *inlet])])

    def _add_outlines(self) -> tuple[int, int, list[int]]:
        """Add the axis and the outlines; returns the first and the last point, and the lines between them."""
        point, line = gmsh.model.geo.addPoint, gmsh.model.geo.addLine
        from_middle = self.mirrored and len(self.reference.positions) % 2 == 1
        start = None if from_middle else point(self.left, 0.0, 0.0)
        last, curve = start, list[int]()
        for nodes in self.pieces:
            tags = [point(float(z), float(r), 0.0) for z, r in nodes[::2]]
            if last is None:
                start = tags[0]
            else:
                curve.append(line(last, tags[0]))
            curve += _one_cell_lines(tags)
            last = tags[-1]
        assert start is not None, "there is an outline, or an inlet"
        assert last is not None, "a section without outlines has an inlet"
        return start, last, curve

    def _add_closed_ends(self, corner: tuple[int, int], top: int, start: int) -> tuple[list[int], list[int]]:
        """Add the ends of a closed row, whose nodes lie at the same radii: the lines of outlet and inlet."""
        point, radii = gmsh.model.geo.addPoint, self.at_ends or []
        outlet = _one_cell_lines([corner[0], *(point(self.high, r, 0.0) for r in radii), corner[1]])
        others = () if self.mirrored else [point(self.low, r, 0.0) for r in radii[::-1]]
        inlet = [gmsh.model.geo.addLine(top, start)] if self.mirrored else _one_cell_lines([top, *others, start])
        return outlet, inlet

    def _add_free_ends(self, corner: tuple[int, int], top: int, start: int) -> tuple[list[int], list[int]]:
        """Add ends with graded cells: the lines of outlet and inlet."""
        line = gmsh.model.geo.addLine
        outlet, inlet = [line(*corner)], [line(top, start)]
        # Ratio of the lengths of neighbouring cells; the outlet begins on the axis.
        ratio = self.grading ** (1 / (self.end_cells - 1))
        for end, growth in ((outlet, 1 / ratio),) if self.mirrored else ((outlet, 1 / ratio), (inlet, ratio)):
            gmsh.model.geo.mesh.setTransfiniteCurve(end[0], self.end_cells + 1, coef=growth)
        return outlet, inlet


def _near_zone(reference: Reference, settings: MeshSettings) -> tuple[float, float]:
    """Axial limits of the unstructured part of the mesh: the whole tube if there is no room for rows of cells."""
    half = reference.geometry.length / 2
    if not settings.rows or not reference.positions or reference.geometry.closed:
        return -half, half
    z = np.concatenate([nodes[:, 0] for nodes in reference.positions])
    low, high = float(z.min()) - settings.rows, float(z.max()) + settings.rows
    return (low if low > -half + SHORT_ROWS else -half), (high if high < half - SHORT_ROWS else half)


def _one_cell_lines(tags: Sequence[int]) -> list[int]:
    """Straight gmsh lines between consecutive points, each of which becomes the side of one cell."""
    lines = [gmsh.model.geo.addLine(a, b) for a, b in pairwise(tags)]
    for tag in lines:
        gmsh.model.geo.mesh.setTransfiniteCurve(tag, 2)
    return lines


def particle_mesh(outline: Outline, settings: MeshSettings) -> SixNodeMesh:
    """Mesh the half-disc inside one undeformed sphere, centred at the origin.

    Args:
        outline: The outline, whose nodes become nodes of this mesh.
        settings: Cell sizes.

    Raises:
        MeshFailure: gmsh failed, or a cell of the mesh is inverted.
    """
    a = outline.radius

    def size(z: float, r: float) -> float:
        depth = max(a - math.hypot(z, r), 0.0)
        return min(outline.size_at(math.atan2(abs(r), z)) + settings.core_growth * depth, a / 3)

    halved = outline.mirrors(outline) and len(outline.angles) % 2 == 1
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
    geometry: Geometry, settings: MeshSettings, outlines: Sequence[Outline], soft: Sequence[bool]
) -> list[SixNodeMesh | None]:
    """Meshes of the particles, None for a rigid one; mirror images of each other in a symmetric geometry.

    Raises:
        MeshFailure: gmsh failed, or a cell of a mesh is inverted.
    """
    meshes: list[SixNodeMesh | None] = []
    n = len(outlines)
    for i, (outline, inside) in enumerate(zip(outlines, soft, strict=True)):
        twin = meshes[n - 1 - i] if geometry.mirrored and n - 1 - i < i else None
        meshes.append(None if not inside else twin.mirror() if twin else particle_mesh(outline, settings))
    return meshes


@contextmanager
def _session() -> Iterator[None]:
    """Run gmsh with an empty model and default options; a session of the caller gets its model and options back."""
    if own := not gmsh.isInitialized():
        gmsh.initialize(readConfigFiles=False, interruptible=False)
    theirs, terminal = gmsh.model.getCurrent(), gmsh.option.getNumber(TERMINAL)
    gmsh.option.setNumber(TERMINAL, 0)
    with tempfile.NamedTemporaryFile(suffix=".opt") as options:
        gmsh.write(options.name)
        gmsh.option.restoreDefaults()
        gmsh.option.setNumber(TERMINAL, 0)
        gmsh.option.setNumber("General.AbortOnError", THROW)
        gmsh.model.add("pairsim")
        try:
            yield
        finally:
            gmsh.merge(options.name)
            gmsh.model.remove()
            gmsh.option.setNumber(TERMINAL, terminal)
            if theirs:  # a model without a name cannot be made the current one, but is when it is alone
                gmsh.model.setCurrent(theirs)
            if own:
                gmsh.finalize()


def _run_gmsh(build: Callable[[], None], size: Callable[[float, float], float], curves: Sequence[Array]) -> SixNodeMesh:
    """Run gmsh and move the mid-side nodes on curved boundaries onto the curves.

    Args:
        build: Function that defines the geometry with gmsh's built-in kernel.
        size: Cell size as a function of (z, r).
        curves: Nodes of each curve, ends and mid-points of arcs alternating; one cell side for each arc.

    Raises:
        MeshFailure: gmsh failed, or a cell of the mesh is inverted.
    """
    interrupts: list[KeyboardInterrupt] = []

    def uninterrupted(dim: int, tag: int, z: float, r: float, _: float, lc: float) -> float:
        try:
            return size(z, r)
        except KeyboardInterrupt as interrupt:  # would be lost in a callback; raised afterwards
            interrupts.append(interrupt)
            return size(z, r)

    try:
        with _session():
            gmsh.option.setNumber("General.NumThreads", 1)
            gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", 0)
            gmsh.option.setNumber("Mesh.MeshSizeFromPoints", 0)
            gmsh.option.setNumber("Mesh.Algorithm", 6)
            # Precision to which gmsh integrates the cell size along lines. Its default of 1e-9 evaluates the size ten
            # times as often, for nodes that agree to 1e-6.
            gmsh.option.setNumber("Mesh.LcIntegrationPrecision", 1e-6)
            build()
            gmsh.model.geo.synchronize()
            gmsh.model.mesh.setSizeCallback(uninterrupted)
            gmsh.model.mesh.generate(2)
            if interrupts:
                raise interrupts[0]
            gmsh.model.mesh.setOrder(2)
            tags, coordinates, _ = gmsh.model.mesh.getNodes()
            kind = gmsh.model.mesh.getElementType("Triangle", 2)
            _, nodes = gmsh.model.mesh.getElementsByType(kind)
            if len(nodes) == 0:
                raise MeshFailure("gmsh generated no cells", advice="another mesh.Np or a wider gap")
    except MeshFailure:
        raise
    except Exception as error:
        raise MeshFailure(f"gmsh: {error}", advice="another mesh.Np or a wider gap") from error
    used, cells = np.unique(nodes, return_inverse=True)
    row = np.empty(int(tags.max()) + 1, dtype=np.int64)
    row[tags.astype(np.int64)] = np.arange(len(tags))
    points = coordinates.reshape(-1, 3)[row[used.astype(np.int64)], :2].copy()
    points[np.abs(points[:, 1]) < 1e-12, 1] = 0.0
    triangles = cells.reshape(-1, 6).astype(np.int64)
    clockwise = jacobians(points[triangles])[:, -1] < 0
    triangles[clockwise] = triangles[clockwise][:, MIRRORED_CELL]
    straight = SixNodeMesh(points, triangles)
    mesh = _curved(straight, curves, spread=False)
    if _least_jacobian(mesh) < STRAIGHT_ENOUGH:
        mesh = _curved(straight, curves, spread=True)
    if _least_jacobian(mesh) <= 0:
        raise MeshFailure("a cell of the new mesh is inverted", advice="a larger mesh.Np")
    return mesh


def _least_jacobian(mesh: SixNodeMesh) -> float:
    """Smallest ratio of the Jacobian of a cell to that of the same cell with straight sides."""
    x = mesh.points[mesh.cells[:, :3]]
    (a, b), (c, d) = (x[:, 1] - x[:, 0]).T, (x[:, 2] - x[:, 0]).T
    return float((mesh.jacobians / (a * d - b * c)[:, None]).min())


def _curved(straight: SixNodeMesh, curves: Sequence[Array], spread: bool) -> SixNodeMesh:
    """Move the mid-side nodes on curved boundaries onto the curves.

    Args:
        straight: Mesh with straight sides.
        curves: Nodes of each curve, ends and mid-points of arcs alternating.
        spread: Whether the other nodes follow by a harmonic extension. Moving the boundary nodes alone can invert a
            cell whose side is strongly curved.

    Raises:
        MeshFailure: gmsh has divided an arc.
    """
    points = straight.points.copy()
    boundary = [np.arange(0)]
    for nodes in curves:
        both = np.vstack([nodes[::2], (nodes[:-2:2] + nodes[2::2]) / 2])
        index = nodes_at(straight.points, both)
        if index.min() < 0:
            raise MeshFailure("gmsh divided an arc of an outline into several sides", advice="another mesh.Np")
        points[index] = np.vstack([nodes[::2], nodes[1::2]])
        boundary.append(index)
    if spread:
        shift = points - straight.points
        on_curve = np.zeros(len(points), dtype=bool)
        on_curve[np.concatenate(boundary)] = True
        products = CellQuadrature(straight, 2).gradient_products
        stiffness = assembled(np.einsum("maibi->mab", products), straight.cells, len(points))
        for component in range(2):
            fixed = on_curve | _on_boundary(straight, axis=component == 1)
            free = ~fixed
            load = -stiffness[free][:, fixed] @ shift[fixed, component]
            shift[free, component] = spsolve(stiffness[free][:, free].tocsc(), load)
        points = straight.points + shift
    return SixNodeMesh(points, straight.cells)


def _on_boundary(mesh: SixNodeMesh, axis: bool) -> np.ndarray:
    """Mask of the nodes on wall and ends and, if `axis`, on the axis, along which nodes may otherwise slide."""
    z, r = mesh.points.T
    outer = (r > TUBE_RADIUS - 1e-9) | (z < z.min() + 1e-9) | (z > z.max() - 1e-9)
    return np.asarray(outer | (r < 1e-12) if axis else outer)
