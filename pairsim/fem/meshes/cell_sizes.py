"""Sizes of cells: the arcs of the outlines, and the cells of the liquid around them."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from pairsim.fem.meshes.geometry import Geometry, MeshSettings, Outline, Reference
from pairsim.quantities.scales import TUBE_RADIUS
from pairsim.runtime.arrays import Array

Distances = Callable[[float, float], list[tuple[float, float]]]


def make_outlines(geometry: Geometry, settings: MeshSettings) -> list[Outline]:
    """Divide every half-circle into arcs, at least N_p unless sizes are adapted, finer at narrow gaps and a near wall.

    Args:
        geometry: The spheres.
        settings: Cell sizes.

    Returns:
        One outline for each particle; mirror images of each other in a symmetric geometry.
    """
    outlines: list[Outline] = []
    n = len(geometry.betas)
    row, first = (geometry.repeated(3), n) if geometry.closed else (geometry, 0)  # a period between its neighbours
    for i in range(n):
        if geometry.mirrored and i > n - 1 - i:
            outlines.append(outlines[n - 1 - i].mirror())
            continue
        middle = geometry.mirrored and 2 * i == n - 1
        span = np.pi / 2 if middle else np.pi
        fine = np.linspace(0.0, span, 4001)
        angles = divided(fine, geometry.betas[i] / 2 / _outline_size(row, settings, first + i, fine))
        if middle:
            angles = np.concatenate([angles, np.pi - angles[-2::-1]])
        outlines.append(Outline(geometry.betas[i] / 2, angles))
    return outlines


def divided(places: Array, density: Array) -> Array:
    """Divide an interval into at least two parts of given density.

    Args:
        places: Points of the interval from its beginning to its end, ascending, shape (m,).
        density: Number of parts per unit length at these points, shape (m,).

    Returns:
        The ends of the k parts, ascending, shape (k + 1,).
    """
    count = np.concatenate([[0.0], np.cumsum((density[1:] + density[:-1]) / 2 * np.diff(places))])
    parts = max(2, math.ceil(count[-1] - 1e-9))
    ends = np.interp(np.linspace(0.0, count[-1], parts + 1), count, places)
    ends[[0, -1]] = places[[0, -1]]
    return np.asarray(ends)


def _gap_cells(settings: MeshSettings, gap: float) -> float:
    cells = settings.gap_cells or settings.Np / 4
    return cells * max(1.0, 0.1 / gap) ** settings.gap_exponent


def _wall_cells(settings: MeshSettings) -> float:
    return settings.wall_cells or settings.Np / 4


def _outline_size(geometry: Geometry, settings: MeshSettings, i: int, angles: Array) -> Array:
    a = geometry.betas[i] / 2
    z, r = geometry.centres[i] + a * np.cos(angles), a * np.sin(angles)
    if settings.sizes is not None:
        size = settings.sizes.along_outline(i, angles)
    else:
        arcs = math.pi * a / settings.Np * _graded(angles, settings.grading)
        size = np.minimum(arcs, (TUBE_RADIUS - r) / (settings.wall_arcs * settings.Np))
    for j, gap in ((i - 1, i - 1), (i + 1, i)):
        if 0 <= j < len(geometry.betas):
            distance = np.hypot(z - geometry.centres[j], r) - geometry.betas[j] / 2
            # Arcs may be longer than the cells across a gap: along the gap the flow varies over a length of order
            # sqrt(a d), much larger than d.
            size = np.minimum(size, np.maximum(distance, 0.0) * 2 / _gap_cells(settings, geometry.gaps[gap]))
    return size


def _graded(angles: Array, grading: float) -> Array:
    """Length of an arc relative to the mean: grading^cos^2(angle), scaled such that the number of arcs is kept."""
    half = math.log(grading) / 2
    mean = math.exp(-half) * np.i0(half)  # of grading^(-cos^2) over the half-circle
    return np.asarray(mean * grading ** (np.cos(angles) ** 2))


def _from_spheres(reference: Reference) -> Distances:
    """Function of (z, r) that returns, for every sphere, its distance and the length of the nearest arc."""
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
    """Function of (z, r) that returns, for every deformed outline, its distance and the length of the nearest arc."""
    outlines = []
    for nodes in reference.positions:
        chord = np.hypot(*np.diff(nodes[::2], axis=0).T)
        at_ends = np.minimum(np.append(chord, chord[-1]), np.append(chord[0], chord))
        arcs = np.empty(len(nodes))
        arcs[::2], arcs[1::2] = at_ends, chord
        outlines.append((nodes @ [1, 1j], nodes.tolist(), arcs.tolist()))

    def distances(z: float, r: float) -> list[tuple[float, float]]:
        found = []
        for places, nodes, arcs in outlines:
            nearest = int(np.abs(places - complex(z, r)).argmin())
            found.append((math.dist((z, r), nodes[nearest]), arcs[nearest]))
        return found

    return distances


def liquid_size(reference: Reference, settings: MeshSettings) -> Callable[[float, float], float]:
    """Cell size in the liquid as a function of (z, r)."""
    if reference.geometry.closed:
        reference = reference.repeated(3)
    distances = _from_nodes(reference) if reference.deformed else _from_spheres(reference)
    gap_cells = [_gap_cells(settings, gap) for gap in reference.geometry.gaps]
    wall_cells = _wall_cells(settings)
    adapted = settings.sizes.on(reference.geometry) if settings.sizes is not None else None

    def size(z: float, r: float) -> float:
        h = settings.max_size if adapted is None else adapted(z, r)
        surface = distances(z, r)
        for distance, arc in surface:
            h = min(h, arc + settings.growth * distance)
            if adapted is None:
                h = min(h, max((TUBE_RADIUS - r + distance) / wall_cells, 0.5 * arc))
        for i, cells in enumerate(gap_cells):
            (s, arc), (other, other_arc) = surface[i], surface[i + 1]
            h = min(h, max((s + other) / cells, 0.25 * min(arc, other_arc)))
        return h

    return size
