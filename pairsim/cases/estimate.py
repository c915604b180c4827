"""Estimates of the size and duration of a case from its parameters, without making a mesh.

The estimated unknowns were within 25 % in 20 cases with N_p up to 40, and a third too few at N_p = 80.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from pairsim.cases.case import SceneCase
from pairsim.cases.mistakes import Mistake
from pairsim.fem.meshes.cell_columns import LONGEST

TRIANGLE = 0.433  # area of a triangle with sides of length one
MOST_UNKNOWNS = 2e7  # a larger mesh takes gmsh days or exhausts the memory
LARGE = 3e5  # unknowns whose first mesh and factorisation take so long that the user is told beforehand; chosen
# Processor time per unknown of a Newton iteration or a time step [s], twice that in liquids with modes, and the factor
# within which estimates hold: twelve cases of all kinds took 0.5 to 2.2 times as long as estimated on an Intel Xeon.
PER_UNKNOWN = 3.3e-6
WITHIN = 2.5
FIRST_POINT, NEXT_POINT = 20, 14  # Newton iterations of the continuation to the first point, and to each further one
UNITS = (86400.0, "days"), (3600.0, "h"), (60.0, "min"), (1.0, "s")
KINKED = 8  # factor of the work in liquids with a yield stress: the example in configs took 22 s, a Newtonian curve 3 s


@dataclass(frozen=True)
class Estimate:
    """Estimated size and duration of a case."""

    unknowns: int  # of one Newton solve
    seconds: float  # on one core; longer where particles hardly have a steady shape
    adaptation: str = ""  # remark on how adapting the mesh may change the estimate
    within: float = WITHIN  # factor within which `seconds` holds

    @classmethod
    def of(cls, case: SceneCase, solves: float, adaptation: str = "") -> Estimate:
        """The estimate of a case with so many Newton iterations or time steps."""
        size = unknowns(case)
        liquid = case.liquid_model
        work = size * solves * (2 if liquid.modes else 1) * (KINKED if liquid.regularisation else 1)
        return cls(round(size), PER_UNKNOWN * work, adaptation)

    @property
    def duration(self) -> str:
        """How long it takes in words, such as 10 s to 1 min."""
        least, most = self.seconds / self.within, self.seconds * self.within
        return f"{_one_digit(least, math.floor)} to {_one_digit(most, math.ceil)}" if most > 1 else "1 s at most"

    def __str__(self) -> str:
        return f"about {self.unknowns:,} unknowns, {self.duration} on one core{self.adaptation}"

    @property
    def notes(self) -> list[str]:
        """Notes for the user before the computation begins: the estimate, if the case is large."""
        return [str(self)] if self.unknowns >= LARGE else []


def _one_digit(seconds: float, rounded: Callable[[float], int]) -> str:
    """A duration with one digit, such as 20 s, 3 min or 2 h, rounded up or down; at least 1 s."""
    seconds = max(seconds, 1.0)
    size, unit = next(each for each in UNITS if seconds >= each[0])
    power = 10.0 ** math.floor(math.log10(seconds / size))
    return f"{power * rounded(seconds / size / power):g} {unit}"


def liquid_cells(case: SceneCase) -> float:
    """Number of triangles in the liquid: the integral of the inverse of the local area of a cell."""
    length, mesh, coarse = case.tube_length, case.mesh, case.mesh.max_size
    if not case.n:
        return length * 0.5 / (TRIANGLE * coarse**2)
    beta = sum(case.betas) / case.n
    fine = math.pi * beta / 2 / mesh.Np
    fine = min(fine, (1 - beta) / 2 / (mesh.wall_cells or max(mesh.Np / 4, 1)) * 2)
    # The part of the tube around the particles, without their area; cells grow with the distance from the surfaces.
    around, to_wall = min(case.cluster, length), 0.5 * (1 - beta)
    free = around * 0.5 - sum(math.pi * b**2 / 8 for b in case.betas)
    cells = free / TRIANGLE * _per_square(fine, mesh.growth, coarse, to_wall) / to_wall
    # The tube on both sides of the particles; beyond `mesh.rows` pairs of triangles are rectangles in rows along it.
    side = max(length - around, 0.0) / 2
    near = min(mesh.rows, side) if mesh.rows else side
    cells += _per_square(fine, mesh.growth, coarse, near) / TRIANGLE
    if side > near:
        across = min(coarse, fine + mesh.growth * mesh.rows)
        cells += 2 / across * _per_length(across, mesh.growth, LONGEST * min(case.betas), side - near)
    across = mesh.gap_cells or mesh.Np / 4
    for gap in case.gaps:
        if (size := gap / across) < fine:  # equal cell sizes in both directions, in a gap that widens as d + 2 r^2/beta
            cells += 1.6 * (1 - size / fine) * across**2 * math.pi / 2 * math.sqrt(beta / (2 * gap))
    return cells


def _per_length(first: float, growth: float, last: float, reach: float) -> float:
    """The integral of 1/size over a distance `reach`, along which the size grows from `first` to at most `last`."""
    grows = min(max((last - first) / growth, 0.0), reach)
    return math.log1p(growth * grows / first) / growth + (reach - grows) / max(first, last)


def _per_square(first: float, growth: float, last: float, reach: float) -> float:
    """The integral of 1/size^2 over a distance `reach`; the size begins at `first`, or at `last` if that is smaller."""
    first = min(first, last)
    grows = min((last - first) / growth, reach)
    return grows / (first * (first + growth * grows)) + (reach - grows) / last**2


def unknowns(case: SceneCase) -> float:
    """Unknowns of one Newton solve."""
    # Two quadratic nodes and half a vertex per triangle: u, p, eta and, in a viscoelastic liquid, s.
    per_cell = 4.5 + (1.0 if any(case.Ca_es) or case.n > 1 else 0.0) + 8.0 * len(case.liquid_model.modes)
    return liquid_cells(case) * per_cell + sum(2.2 * case.mesh.Np**1.4 * 4.5 for Ca_e in case.Ca_es if Ca_e > 0)


def check_size(case: SceneCase) -> Iterator[Mistake]:
    """Yield a mistake if the estimate exceeds 2e7 unknowns, more than can be meshed."""
    if (size := unknowns(case)) > MOST_UNKNOWNS:
        allowed = f"must give at most {MOST_UNKNOWNS:.0e} unknowns; mesh, length and beta give about {size:.0e}"
        yield Mistake("mesh", None, allowed)


def steady_estimate(case: SceneCase, points: int, factor: float = 1.0) -> Estimate:
    """Estimate of a first quasi-steady solution and `points` further ones; each takes `factor` times the usual time."""
    return Estimate.of(case, factor * (FIRST_POINT + NEXT_POINT * points))
