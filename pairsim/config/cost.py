"""Estimates of unknowns, wall time and memory of a case from its parameters, without making a mesh.

A sweep starts the most expensive cases first by these estimates, and `--dry-run` prints them. The unknowns were within
25 % in 20 cases with N_p up to 40, and a third too few at N_p 80. The wall time was within a factor of 2; it cannot be
predicted for very soft pairs and for pairs that come into contact. Memory was within 15 % for the examples in configs.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterator
from dataclasses import dataclass

from pairsim.config.case import SceneCase
from pairsim.config.difficulty import first_point_factor
from pairsim.config.mistakes import Mistake
from pairsim.fem.meshes.columns import LONGEST
from pairsim.runtime.duration import duration

STRIPS = 200  # slices of the tube over which the number of cells is summed
MOST_UNKNOWNS = 2e7  # a larger mesh takes gmsh days or exhausts the memory
LARGE = 3e5  # unknowns whose first mesh and factorisation take so long that the user is told beforehand; chosen
START = 1.0  # seconds for imports and the first mesh
LIBRARIES = 210e6  # memory after all imports [bytes]
# Bytes per unknown at 15,000 unknowns, in a Newtonian and in a viscoelastic liquid. The memory of the LU factors grows
# slightly faster than the number of unknowns.
RUN_BYTES, STEADY_BYTES = (4e3, 6e3), (6e3, 8e3)
USUAL, GROWTH = 15e3, 0.1
# Newton iterations of the continuation to the first point and to each further one, and what the estimate of the error
# of a point costs, in Newton iterations: .3 to .6, and .5 to 1.5 on a new mesh.
FIRST_POINT, NEXT_POINT, ERROR_ESTIMATE = 20, 14, 0.8
ERROR_TOO = 1.45  # factor of the time of a run for carrying its error along


@dataclass(frozen=True)
class Estimate:
    """Estimated cost of a case.

    Attributes:
        unknowns: Unknowns of one Newton solve.
        seconds: Wall time on one core.
        memory: Peak memory of one process, libraries included [bytes].
        adaptation: What adapting the mesh may make of it, empty without adaptation.
    """

    unknowns: int
    seconds: float
    memory: float
    adaptation: str = ""

    def __str__(self) -> str:
        """One line, which says so if this machine has less memory."""
        here = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
        less = f"; this machine has {here / 1e6:.0f} MB of memory" if here < self.memory else ""
        took = f"{duration(self.seconds)} on one core, {self.memory / 1e6:.0f} MB"
        return f"about {self.unknowns:,} unknowns, {took}{less}{self.adaptation}"

    @property
    def notes(self) -> list[str]:
        """Notes for the user before the computation begins: the estimate, if the case is large."""
        return [str(self)] if self.unknowns >= LARGE else []


def liquid_cells(case: SceneCase) -> float:
    """Number of triangles in the liquid: the integral of one over the local area of a cell."""
    length, coarse = case.tube_length, case.mesh.max_size
    if not case.n:
        return length * 0.5 / (0.433 * coarse**2)
    beta = sum(case.betas) / case.n
    fine = math.pi * beta / 2 / case.mesh.Np
    fine = min(fine, (1 - beta) / 2 / (case.mesh.wall_cells or max(case.mesh.Np / 4, 1)) * 2)
    # The part of the tube around the particles, without their area; cells grow with the distance from the surfaces.
    around = min(case.cluster, length)
    free = around * 0.5 - sum(math.pi * b**2 / 8 for b in case.betas)
    cells = free / (0.433 * _mean_square(fine, case.mesh.growth, coarse, 0.5 * (1 - beta)))
    step = max(length - around, 0.0) / STRIPS
    for i in range(STRIPS):
        away = (i + 0.5) * step / 2
        if 0 < case.mesh.rows < away:  # rows of rectangles, two triangles each
            across = min(coarse, fine + case.mesh.growth * case.mesh.rows)
            along = max(across, min(LONGEST * min(case.betas), across + case.mesh.growth * (away - case.mesh.rows)))
            cells += step * 0.5 / (across * along) * 2
        else:
            size = min(coarse, fine + case.mesh.growth * away)
            cells += step * 0.5 / (0.433 * size**2)
    across = case.mesh.gap_cells or case.mesh.Np / 4
    for gap in case.gaps:
        if (size := gap / across) < fine:  # equal cell sizes in both directions, in a gap that widens as d + 2 r^2/beta
            cells += 1.6 * (1 - size / fine) * across**2 * math.pi / 2 * math.sqrt(beta / (2 * gap))
    return cells


def _mean_square(fine: float, growth: float, coarse: float, reach: float) -> float:
    """Harmonic mean of the squared cell size over distances from 0 to `reach` from a surface."""
    sizes = [min(coarse, fine + growth * reach * (i + 0.5) / 20) for i in range(20)]
    return 20 / sum(1 / size**2 for size in sizes)


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


def memory_of(size: float, per_unknown: tuple[float, float], polymer: bool) -> float:
    """Peak memory of a process with so many unknowns [bytes], `per_unknown` in a Newtonian and another liquid."""
    return LIBRARIES + size * per_unknown[polymer] * (size / USUAL) ** GROWTH


def steady_estimate(case: SceneCase, points: int, factor: float = 1.0) -> Estimate:
    """Estimated cost of quasi-steady solutions.

    Args:
        case: The case.
        points: Number of points after the first one.
        factor: Factor of the time of each.
    """
    size, polymer = unknowns(case), bool(case.liquid_model.modes)
    each = 0.46e-6 * size**1.15 * (2 if polymer else 1) * factor
    memory = memory_of(size, STEADY_BYTES, polymer)
    first = FIRST_POINT * first_point_factor(case.liquid_model, case.betas, case.Ca_es)
    iterations = first + NEXT_POINT * points + ERROR_ESTIMATE * (points + 1)
    return Estimate(round(size), START + iterations * each, memory)
