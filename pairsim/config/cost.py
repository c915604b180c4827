"""What a case will cost, guessed from its numbers alone, without a mesh.

The guess orders a sweep (dearest cases first) and gives `--dry-run` its figures. Unknowns were within 25 % in 20 cases
with N_p up to 40, and a third too few at N_p 80; seconds within a factor of 2, but nobody knows beforehand how a very
soft pair, or one that touches, will fare. Memory was within 15 % for the examples in configs.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from pairsim.config.case import Case, SceneCase
from pairsim.config.curve_case import CriticalCase, CurveCase
from pairsim.config.mistakes import Mistake

STRIPS = 200  # of the tube's length, over which the density of cells is summed
MOST_UNKNOWNS = 2e7  # beyond it gmsh alone would take days, or all memory
START = 1.2  # seconds until a process has imported everything and made its first mesh
LIBRARIES = 230e6  # bytes of a process that has imported everything
# Bytes an unknown of a run at 15,000 unknowns, Newtonian and viscoelastic; factors
# grow a little faster than their number.
RUN_BYTES, STEADY_BYTES = (11e3, 15e3), (19e3, 28e3)
USUAL, GROWTH = 15e3, 0.1
COARSE_TOO = 1.3  # a second, coarser scene beside the first


@dataclass(frozen=True)
class Estimate:
    """A guess.

    Attributes:
        unknowns: Unknowns of one Newton solve.
        seconds: Wall time on one core.
        memory: Largest memory of one process, all libraries included [bytes].
    """

    unknowns: int
    seconds: float
    memory: float


def liquid_cells(case: SceneCase) -> float:
    """Triangles of the liquid: the integral of the area over that of a cell of the wanted size."""
    length, coarse = case.tube_length, case.mesh.max_size
    if not case.n:
        return length * 0.5 / (0.433 * coarse**2)
    beta = sum(case.betas) / case.n
    fine = math.pi * beta / 2 / case.mesh.Np
    fine = min(fine, (1 - beta) / 2 / (case.mesh.wall_cells or max(case.mesh.Np / 4, 1)) * 2)
    # Cells grow with the distance from the surfaces; the particles' rows are cut out of the first part of the tube.
    beside = min(case.cluster, length)
    free = beside * 0.5 - sum(math.pi * b**2 / 8 for b in case.betas)
    cells = free / (0.433 * _mean_square(fine, case.mesh.growth, coarse, 0.5 * (1 - beta)))
    step = max(length - beside, 0.0) / STRIPS
    for i in range(STRIPS):
        away = (i + 0.5) * step / 2
        if 0 < case.mesh.rows < away:  # two triangles share a square
            across = min(coarse, fine + case.mesh.growth * case.mesh.rows)
            along = max(across, min(0.5, across + case.mesh.growth * (away - case.mesh.rows)))
            cells += step * 0.5 / (across * along) * 2
        else:
            size = min(coarse, fine + case.mesh.growth * away)
            cells += step * 0.5 / (0.433 * size**2)
    across = case.mesh.gap_cells or case.mesh.Np / 4
    for gap in case.gaps:
        if (size := gap / across) < fine:  # square cells of a gap that widens as d + 2 r^2/beta
            cells += 1.6 * (1 - size / fine) * across**2 * math.pi / 2 * math.sqrt(beta / (2 * gap))
    return cells


def _mean_square(fine: float, growth: float, coarse: float, reach: float) -> float:
    """Square of the cell size whose inverse is the mean inverse square between a surface and `reach` from it."""
    sizes = [min(coarse, fine + growth * reach * (i + 0.5) / 20) for i in range(20)]
    return 20 / sum(1 / size**2 for size in sizes)


def unknowns(case: SceneCase) -> float:
    """Unknowns of one Newton solve."""
    # A triangle brings two quadratic nodes and half a vertex: u, p, eta and, in a viscoelastic liquid, s.
    per_cell = 4.5 + (1.0 if any(case.Ca_es) or case.n > 1 else 0.0) + (8.0 if case.polymer else 0.0)
    return liquid_cells(case) * per_cell + sum(2.2 * case.mesh.Np**1.4 * 4.5 for Ca_e in case.Ca_es if Ca_e > 0)


def check_size(case: SceneCase) -> Iterator[Mistake]:
    """What no machine can mesh: the guess is beyond 2e7 unknowns."""
    if (size := unknowns(case)) > MOST_UNKNOWNS:
        allowed = f"must give {MOST_UNKNOWNS:.0e} unknowns at most; mesh, length and beta give some {size:.0e}"
        yield Mistake("mesh", None, allowed)


def _memory(size: float, per_unknown: tuple[float, float], polymer: bool) -> float:
    return LIBRARIES + size * per_unknown[polymer] * (size / USUAL) ** GROWTH


def run_estimate(case: Case) -> Estimate:
    """The guess for a run in time."""
    size, polymer = unknowns(case), case.polymer is not None
    end, first = case.time.end, case.time.first_step
    if case.time.fixed_step is not None:
        steps = end / case.time.fixed_step
    else:
        pace = (3e-4 / case.time.tol) ** 0.45 if any(case.Ca_es) or polymer else 0.25
        steps = 10 * pace * math.log(1 + end / first) * (3 if polymer else 1) + end / case.time.max_step
    return Estimate(round(size), START + steps * 1.6e-6 * size**1.15, _memory(size, RUN_BYTES, polymer))


def _steady_estimate(case: CurveCase | CriticalCase, points: int) -> Estimate:
    """The way to a first quasi-steady solution, then so many points."""
    size, polymer = unknowns(case), case.polymer is not None
    each = 0.8e-6 * size**1.15 * (3 if polymer else 1) * (1.5 if case.mesh_error else 1)
    memory = _memory(size * (COARSE_TOO if case.mesh_error else 1.0), STEADY_BYTES, polymer)
    return Estimate(round(size), START + (40 + 8 * points) * each, memory)


def curve_estimate(case: CurveCase) -> Estimate:
    """The guess for a master curve, on which as many points are added as were asked for."""
    return _steady_estimate(case, min(2 * len(case.places), case.max_points))


def critical_estimate(case: CriticalCase) -> Estimate:
    """The guess for critical distances: a search for zeros on each line, then two branches over all values."""
    values = len(next(iter(case.along.values()))) if case.along else 1
    lines = len(next(iter(case.lines.values()))) if case.lines else 1
    return _steady_estimate(case, lines * (15 + 4 * values))
