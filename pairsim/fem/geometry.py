"""Spheres in a tube: diameters, distances, outlines, the configuration a mesh is made for, and how fine it is."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pairsim.runtime.arrays import Array


@dataclass(frozen=True)
class MeshSettings:
    """How finely to mesh.

    Attributes:
        Np: Cells on each half-circle, at least.
        growth: Growth of the cell size per unit distance from a particle.
        gap_cells: Cells across the gap between two particles (0: N_p/4).
        gap_exponent: Below d = 0.1 the cells across a gap grow as (0.1/d)**gap_exponent.
        wall_cells: Cells between a particle and the wall (0: N_p/4).
        wall_arcs: Arcs of an outline across its distance from the wall, in parts of N_p.
        max_size: Largest cell size (in D_c).
        core_growth: Growth of the cell size per unit depth inside a particle.
        rows: Distance from the outermost particles beyond which cells lie in rows along the tube; 0: nowhere.
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
