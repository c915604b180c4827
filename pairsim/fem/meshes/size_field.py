"""Cell sizes from the contributions of single cells to the error of a solution.

In a viscoelastic liquid the contributions of the constitutive equation have random signs where stress or adjoint are
not resolved, and the root of the sum of their squares is the error to expect (docs/explanation/error-estimate.md).
Contributions of the momentum equation nearly cancel by the symmetry of the flow in the tube; these do not. A cell of
size h is assumed to contribute eta ~ h^ORDER; for a given number of cells the sum of eta^2 is least if all eta are
equal.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy

from pairsim.fem.meshes.geometry import Geometry, Outline
from pairsim.quantities.scales import TUBE_RADIUS
from pairsim.runtime.arrays import Array, Indices

# Power of the cell size with which the contribution of a cell is assumed to fall. It is a setting, not an order of
# convergence: contributions fell with the power 3.2 when all cells were halved at De 2. With the larger power sizes
# change less from round to round, and the scatter still becomes what was asked for (docs/explanation/decisions.md,
# "Adaptation").
ORDER = 5.0
# The same in a liquid without modes. The contribution of a cell in which the shear rate vanishes falls with the power
# 3, but the number of such cells does not grow as cells become smaller: the sum of squares falls as if all cells
# contributed with the power 4.
VISCOUS_ORDER = 4.0
GRADATION = 0.2  # largest growth of the cell size per unit distance; chosen
LEAST_FACTOR = 0.4  # smallest factor by which a size changes in one round; chosen
MOST_FACTOR = 1.5  # largest factor by which a size changes in one round; chosen
EQUILATERAL = 4 / 3**0.5  # square of the side of an equilateral triangle over its area
ASKED = 1.12  # size asked of gmsh over the side of an equilateral triangle with the area of its cells; measured
SMOOTHINGS = 2  # rounds of averaging over the cells around a vertex; contributions of single cells are random
SPACING = 0.05  # of the grid, relative to the smallest radius; chosen
MOST_INTERVALS = 800  # of the grid along the tube; chosen
BEYOND = 0.1  # distance by which the grid extends beyond the reach of the sizes [D_c]; chosen
BISECTIONS = 40  # steps in the search for the contribution that all cells should have

Size = Callable[[float, float], float]


@dataclass(frozen=True, eq=False)
class CellIndicators:
    """Contributions of the liquid's cells to the errors of k results of a solution, such as every dU.

    Attributes:
        geometry: Geometry of the reference domain.
        mirrored: Whether the reference domain is symmetric under z -> -z.
        corners: Vertices of the cells in the reference domain, (m, 3, 2).
        squares: Squares of the contributions of the cells to each result, (m, k).
        order: Power of the cell size with which contributions are assumed to fall.
    """

    geometry: Geometry
    mirrored: bool
    corners: Array
    squares: Array
    order: float = ORDER

    def joined(self, other: CellIndicators) -> CellIndicators:
        """The indicators of these results and of others of the same solution."""
        return replace(self, squares=np.hstack([self.squares, other.squares]))

    def sizes(self, most: Array, largest_factor: float, reach: float) -> SizeField:
        """Cell sizes with which the root-sum-squares of the contributions are expected not to exceed given values.

        Args:
            most: The value for each result, (k,).
            largest_factor: Upper bound on the factor by which cells become larger.
            reach: Distance from the particles up to which sizes are wanted [D_c].
        """
        x = self.corners
        (a, b), (c, d) = (x[:, 1] - x[:, 0]).T, (x[:, 2] - x[:, 0]).T
        area = np.abs(a * d - b * c) / 2
        h, centres = ASKED * np.sqrt(EQUILATERAL * area), x.mean(axis=1)
        places, inverse = np.unique(x.reshape(-1, 2).round(12), axis=0, return_inverse=True)
        cells: Indices = inverse.reshape(-1, 3)
        density = (self.squares / most**2).sum(axis=1) / area
        if self.mirrored:
            density = (density + density[scipy.spatial.cKDTree(centres).query(centres * [-1.0, 1.0])[1]]) / 2
        for _ in range(SMOOTHINGS):
            density = _at_vertices(cells, density, area, len(places))[cells].mean(axis=1)
        eta = np.sqrt(density * area)
        grid = _Grid.around(self.geometry, reach)
        on_grid = grid.interpolation(places)
        least, largest = 1e-6 * float(eta.max(initial=1e-300)), 1e3 * float(eta.max(initial=1e-300))
        for _ in range(BISECTIONS):
            each = float(np.sqrt(least * largest))
            factor = np.clip((each / np.maximum(eta, 1e-300)) ** (1 / self.order), LEAST_FACTOR, largest_factor)
            sizes = grid.graded(np.exp(on_grid(_at_vertices(cells, np.log(h * factor), area, len(places)))))
            there = grid.at(sizes, centres)
            expected = float(np.sum((eta**2) * (there / h) ** (2 * self.order - 2)))
            least, largest = (least, each) if expected > 1.0 else (each, largest)
        return SizeField(self.geometry, float(grid.z[0]), grid.spacing, sizes)


@dataclass(frozen=True, eq=False)
class SizeField:
    """Cell sizes on a grid around the particles, for one geometry.

    Attributes:
        geometry: The geometry.
        begin: Axial position of the first column of the grid [D_c].
        spacing: Spacing of the grid [D_c].
        sizes: Cell sizes, (axial, radial) [D_c].
    """

    geometry: Geometry
    begin: float
    spacing: float
    sizes: Array

    @cached_property
    def _rows(self) -> list[list[float]]:
        rows: list[list[float]] = self.sizes.tolist()  # lists, since gmsh asks for one point at a time
        return rows

    def at(self, z: float, r: float) -> float:
        """Size at a point of the field's own geometry; beyond the grid that of its nearest point."""
        rows = self._rows
        along = min(max((z - self.begin) / self.spacing, 0.0), len(rows) - 1.001)
        across = min(abs(r) / self.spacing, len(rows[0]) - 1.001)
        i, j = int(along), int(across)
        a, b = along - i, across - j
        low, high = rows[i], rows[i + 1]
        return (1 - a) * ((1 - b) * low[j] + b * low[j + 1]) + a * ((1 - b) * high[j] + b * high[j + 1])

    def at_most(self, largest: float) -> SizeField:
        """This field with a bound on all sizes [D_c]."""
        return replace(self, sizes=np.minimum(self.sizes, largest))

    def on(self, geometry: Geometry) -> Size:
        """Sizes for the same particles at other distances: gaps are stretched, particles are not."""
        here, own = _edges(geometry), _edges(self.geometry)
        if here == own:
            return self.at
        last = len(here) - 1

        def size(z: float, r: float) -> float:
            k = bisect_left(here, z)
            if k == 0 or k > last:
                end = 0 if k == 0 else last
                return self.at(own[end] + z - here[end], r)
            part = (z - here[k - 1]) / (here[k] - here[k - 1])
            return self.at(own[k - 1] + part * (own[k] - own[k - 1]), r)

        return size


@dataclass(frozen=True, eq=False)
class AdaptedSizes:
    """Cell sizes for several distances of the same particles.

    Attributes:
        fields: The sizes for each of these distances.
        factor: Factor of all sizes.
    """

    fields: tuple[SizeField, ...]
    factor: float = 1.0

    def scaled(self, factor: float) -> AdaptedSizes:
        """All sizes times a factor."""
        return replace(self, factor=self.factor * factor)

    def on(self, geometry: Geometry) -> Size:
        """Sizes for a geometry, from the field whose distances are the nearest to its own."""

        def apart(field: SizeField) -> float:
            pairs = zip(geometry.gaps, field.geometry.gaps, strict=True)
            return max((abs(float(np.log(a / b))) for a, b in pairs), default=0.0)

        size, factor = min(self.fields, key=apart).on(geometry), self.factor
        return lambda z, r: factor * size(z, r)

    def along_outline(self, i: int, angles: Array) -> Array:
        """Lengths of arcs by the smallest size of all fields, as a particle has the same outline at all distances.

        Args:
            i: Number of the particle.
            angles: Polar angles, from the downstream pole, shape (k,).

        Returns:
            Lengths [D_c], shape (k,).
        """
        least = np.full(len(angles), np.inf)
        for field in self.fields:
            outline = Outline(field.geometry.betas[i] / 2, angles)
            centre = float(field.geometry.centres[i])
            z, r = centre + outline.radius * np.cos(angles), outline.radius * np.sin(angles)
            # Outlines of a symmetric geometry are mirror images even if meshes around deformed shapes are not.
            for side in (1.0, -1.0) if field.geometry.mirrored else (1.0,):
                sizes = [field.at(side * place, height) for place, height in zip(z.tolist(), r.tolist(), strict=True)]
                least = np.minimum(least, sizes)
        return self.factor / ASKED * least


@dataclass(frozen=True, eq=False)
class _Grid:
    """A grid of square cells over the tube around the particles."""

    z: Array
    r: Array
    spacing: float

    @classmethod
    def around(cls, geometry: Geometry, reach: float) -> _Grid:
        half = min((sum(geometry.betas) + sum(geometry.gaps)) / 2 + reach + BEYOND, geometry.length / 2)
        spacing = max(SPACING * min(geometry.betas) / 2, 2 * half / MOST_INTERVALS)
        count = int(np.ceil(half / spacing))
        across = int(np.ceil(TUBE_RADIUS / spacing))
        return cls(spacing * np.arange(-count, count + 1.0), spacing * np.arange(across + 1.0), spacing)

    def interpolation(self, places: Array) -> Callable[[Array], Array]:
        """Function that interpolates values at points linearly to the grid; beyond their convex hull, the nearest."""
        grid = np.stack(np.meshgrid(self.z, self.r, indexing="ij"), axis=-1)
        triangles = scipy.spatial.Delaunay(places)
        simplex = triangles.find_simplex(grid)
        inside = simplex >= 0
        transform = triangles.transform[simplex[inside]]
        two = np.einsum("nij,nj->ni", transform[:, :2], grid[inside] - transform[:, 2])
        weights = np.column_stack([two, 1 - two.sum(axis=1)])
        corners = triangles.simplices[simplex[inside]]
        nearest = scipy.spatial.cKDTree(places).query(grid[~inside])[1]

        def interpolate(values: Array) -> Array:
            result = np.empty(grid.shape[:2])
            result[inside] = (weights * values[corners]).sum(axis=1)
            result[~inside] = values[nearest]
            return result

        return interpolate

    def graded(self, sizes: Array) -> Array:
        """The largest sizes not above given ones that grow by no more than GRADATION along both axes."""
        for axis in (0, 1, 0, 1):
            slope = GRADATION * self.spacing * np.arange(sizes.shape[axis])
            slope = slope[:, None] if axis == 0 else slope
            sizes = np.minimum.accumulate(sizes - slope, axis=axis) + slope
            sizes = np.flip(np.minimum.accumulate(np.flip(sizes + slope, axis), axis=axis), axis) - slope
        return sizes

    def at(self, sizes: Array, places: Array) -> Array:
        """Values at points by bilinear interpolation."""
        at = ((places - [self.z[0], 0.0]) / self.spacing).T
        return np.asarray(scipy.ndimage.map_coordinates(sizes, at, order=1, mode="nearest"))


def _at_vertices(cells: Indices, values: Array, weights: Array, count: int) -> Array:
    """Weighted averages of the values of the cells around each vertex, (count,)."""
    total, weight = np.zeros(count), np.zeros(count)
    for corner in cells.T:
        np.add.at(total, corner, values * weights)
        np.add.at(weight, corner, weights)
    return np.asarray(total / weight)


def _edges(geometry: Geometry) -> list[float]:
    """Axial positions of all poles, ascending."""
    radii: Sequence[float] = [beta / 2 for beta in geometry.betas]
    return [float(z + side * a) for z, a in zip(geometry.centres, radii, strict=True) for side in (-1, 1)]
