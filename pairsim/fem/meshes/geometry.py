"""Geometry of spheres in a tube: diameters, distances, outlines, reference domain, and settings of the mesh."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol

import numpy as np

from pairsim.runtime.arrays import Array

SAME_ANGLE = 1e-12  # difference up to which polar angles are equal; rounding leaves up to 2e-13


class CellSizes(Protocol):
    """Cell sizes that were adapted to solutions (`pairsim.fem.meshes.size_field`)."""

    def on(self, geometry: Geometry) -> Callable[[float, float], float]:
        """Size [D_c] as a function of (z, r)."""

    def along_outline(self, i: int, angles: Array) -> Array:
        """Lengths of arcs at polar angles of the outline of particle i [D_c]."""

    def scaled(self, factor: float) -> CellSizes:
        """All sizes times a factor."""


@dataclass(frozen=True)
class MeshSettings:
    """Cell sizes. The origin of the default values is given in docs/explanation/decisions.md.

    Attributes:
        Np: Least number of cells along each half-circle.
        grading: Length of the arcs at the poles over that at the equator, of Np arcs in all.
        growth: Growth of the cell size per unit distance from a particle.
        gap_cells: Number of cells across the gap between two particles; 0 means N_p/4.
        gap_exponent: For d < 0.1 the number of cells across a gap is multiplied by (0.1/d)**gap_exponent.
        wall_cells: Number of cells between a particle and the wall; 0 means N_p/4.
        wall_arcs: Arcs of an outline are at most its local distance from the wall divided by wall_arcs N_p.
        max_size: Largest cell size [D_c].
        core_growth: Growth of the cell size per unit depth inside a particle.
        rows: Distance from the outermost particles beyond which cells are arranged in rows along the tube [D_c]; 0 for
            unstructured cells everywhere.
        row_grading: Length of the cells across the tube at the axis over that at the wall, in rows.
        sizes: Adapted sizes, in place of those by N_p, the wall and `max_size`; None without adaptation.
    """

    Np: int = 40
    growth: float = 0.15
    gap_cells: int = 0
    gap_exponent: float = 0.0
    wall_cells: int = 0
    wall_arcs: float = 0.35
    max_size: float = 0.2
    core_growth: float = 0.3
    rows: float = 0.0
    grading: float = 1.0
    row_grading: float = 1.0
    sizes: CellSizes | None = None

    def scaled(self, factor: float, fewest: int) -> MeshSettings:
        """Cells larger by a factor, with at least `fewest` cells on each half-circle."""
        return replace(
            self,
            Np=max(fewest, round(self.Np / factor)),
            gap_cells=round(self.gap_cells / factor),
            wall_cells=round(self.wall_cells / factor),
            growth=self.growth * factor,
            max_size=self.max_size * factor,
            sizes=self.sizes.scaled(factor) if self.sizes is not None else None,
        )


@dataclass(frozen=True)
class Geometry:
    """Undeformed spheres on the axis of a tube of radius 1/2; the middle of the train of particles is at z = 0.

    Attributes:
        betas: Diameters of the particles from upstream [D_c], N values.
        gaps: Distances between facing surfaces from upstream [D_c], N-1 values.
        length: Length of the tube [D_c].
        closed: Whether the tube is a period of an infinite row of equal particles: the last one is followed by the
            first one of the next period.
    """

    betas: tuple[float, ...]
    gaps: tuple[float, ...]
    length: float
    closed: bool = False

    @cached_property
    def centres(self) -> Array:
        """Axial positions of the centres [D_c], shape (N,)."""
        if not self.betas:
            return np.zeros(0)
        z = [self.betas[0] / 2]
        for i, gap in enumerate(self.gaps):
            z.append(z[-1] + self.betas[i] / 2 + gap + self.betas[i + 1] / 2)
        return np.array(z) - (z[-1] + self.betas[-1] / 2) / 2

    def repeated(self, count: int) -> Geometry:
        """A closed tube that consists of `count` periods of this one."""
        between = self.length - sum(self.betas) - sum(self.gaps)
        gaps = (*self.gaps, *(between, *self.gaps) * (count - 1))
        return Geometry(self.betas * count, gaps, self.length * count, closed=True)

    @property
    def mirrored(self) -> bool:
        """Whether the geometry is symmetric under z -> -z."""
        return self.betas == self.betas[::-1] and bool(np.allclose(self.gaps, self.gaps[::-1], rtol=1e-12))


@dataclass(frozen=True)
class Reference:
    """Reference domain of the liquid: around undeformed spheres, or around deformed outlines.

    Attributes:
        geometry: Spheres, and the gaps between the outlines.
        outlines: Division of the half-circles into arcs, from upstream.
        positions: Nodes of every outline, ends and mid-points of arcs alternating, downstream pole first; one array of
            shape (2 k + 1, 2) for each particle.
        deformed: Whether the outlines are deformed.
        planes: Axial positions of cross-sections at which the mesh is not displaced, besides its ends [D_c].
    """

    geometry: Geometry
    outlines: tuple[Outline, ...]
    positions: tuple[Array, ...]
    deformed: bool
    planes: tuple[float, ...] = ()

    @staticmethod
    def spheres(geometry: Geometry, outlines: Sequence[Outline]) -> Reference:
        positions = tuple(o.nodes + [z, 0.0] for o, z in zip(outlines, geometry.centres, strict=True))
        return Reference(geometry, tuple(outlines), positions, False)

    def repeated(self, count: int) -> Reference:
        """A closed domain that consists of `count` periods of this one, with planes between them."""
        length, places = self.geometry.length, np.arange(count) - (count - 1) / 2
        positions = tuple(nodes + [length * place, 0.0] for place in places for nodes in self.positions)
        planes = tuple(float(length * (place + 0.5)) for place in places[:-1])
        return Reference(self.geometry.repeated(count), self.outlines * count, positions, self.deformed, planes)

    @cached_property
    def mirrored(self) -> bool:
        """Whether the domain is symmetric under z -> -z, and its outlines with it, so that half of it can be meshed.

        Equal distances do not imply that outlines are mirror images of each other, as outlines may be divided into arcs
        for other distances than those of the geometry, which are rounded for meshes along a curve. The outline of a
        particle in the middle needs the end of an arc at its equator, where the meshed half begins.
        """
        if self.deformed or not self.geometry.mirrored:
            return False
        middle = self.outlines[len(self.outlines) // 2] if len(self.outlines) % 2 else None
        if middle is not None and len(middle.angles) % 2 == 0:
            return False
        n = len(self.outlines)
        return all(each.mirrors(self.outlines[n - 1 - i]) for i, each in enumerate(self.outlines[: (n + 1) // 2]))


@dataclass(frozen=True)
class Outline:
    """The half-circle of one particle, divided into arcs.

    Attributes:
        radius: Radius of the sphere [D_c].
        angles: Polar angles of the ends of the arcs, from the downstream pole (0) to the upstream pole (pi), shape
            (k + 1,).
    """

    radius: float
    angles: Array

    @cached_property
    def node_angles(self) -> Array:
        """Polar angles of all nodes, ends and mid-points of arcs alternating, shape (2 k + 1,)."""
        both = np.empty(2 * len(self.angles) - 1)
        both[::2] = self.angles
        both[1::2] = (self.angles[1:] + self.angles[:-1]) / 2
        return both

    @cached_property
    def nodes(self) -> Array:
        """Nodes relative to the centre, downstream pole first, shape (2 k + 1, 2)."""
        xy = self.radius * np.column_stack([np.cos(self.node_angles), np.sin(self.node_angles)])
        xy[[0, -1], 1] = 0.0
        return xy

    def mirror(self) -> Outline:
        return Outline(self.radius, (np.pi - self.angles)[::-1].copy())

    def mirrors(self, other: Outline) -> bool:
        """Whether it is the mirror image of another one, or of itself, under z -> -z."""
        mine, theirs = self.angles, np.pi - other.angles[::-1]
        return len(mine) == len(theirs) and bool(np.allclose(mine, theirs, rtol=0.0, atol=SAME_ANGLE))

    def size_at(self, angle: float) -> float:
        """Length of the arc that contains a polar angle."""
        angles = self._angles  # a list, since this is called for every point at which gmsh evaluates the cell size
        k = min(max(bisect_left(angles, angle), 1), len(angles) - 1)
        return (angles[k] - angles[k - 1]) * self.radius

    @cached_property
    def _angles(self) -> list[float]:
        angles: list[float] = self.angles.tolist()
        return angles
