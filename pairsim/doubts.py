"""What a user should be told of results that may be worse than they look: the warnings of run.json and the terminal."""

from __future__ import annotations

from pairsim.accuracy import SETTINGS, Accuracy
from pairsim.case import Case, SceneCase

COARSE_JUMP = 2.0  # of s within a cell: c changes by a factor e^2 there
LONG_ARC = 1.5  # over the gap that it faces: 2.5 % of dU at 3 times, for N_p 40 and a gap of .005
NEAR_ENDS = 0.5  # of the tube that `length: auto` leaves on each side
COARSEST: Accuracy = "5%"


def coarse_mesh(case: SceneCase) -> list[str]:
    """Of a mesh with fewer or larger cells than any that was measured to keep an error."""
    measured = SETTINGS[COARSEST].mesh(case.polymer is not None, case.betas)
    coarse = {"Np": case.mesh.Np < measured["Np"], "max_size": case.mesh.max_size > measured["max_size"]}
    return [
        f"mesh.{name} = {getattr(case.mesh, name):g} is coarser than accuracy: {COARSEST} ({measured[name]:g}): dU may "
        "be off by more than that part of its largest value"
        for name, is_coarse in coarse.items()
        if case.n and is_coarse
    ]


def long_steps(case: Case, part: float) -> list[str]:
    """Of time steps that leave this part of the largest |dU|, as `time_error` estimates it."""
    if 100 * part <= float(case.accuracy.removesuffix("%")):
        return []
    cure = "time.tol or time.first_step" if case.time.fixed_step is None else "time.fixed_step"
    return [
        f"time steps may leave about {100 * part:.2g} % of the largest |dU|, more than accuracy: {case.accuracy}; "
        f"a smaller {cure}"
    ]


def unresolved_stress(s_jump: float) -> list[str]:
    """Of the largest change of s within a cell."""
    if s_jump <= COARSE_JUMP:
        return []
    return [
        f"s = log c changes by {s_jump:.2g} within one cell, more than {COARSE_JUMP:g}: the polymer's stress is not "
        "resolved there; compare with a finer mesh (mesh.Np near the particles, mesh.max_size elsewhere)"
    ]


def narrow_gap(gap: float, arc: float) -> list[str]:
    """Of a gap narrower than what the outlines beside it were cut for."""
    if arc <= LONG_ARC * gap:
        return []
    return [
        f"a gap of {gap:.3g} has arcs {arc / gap:.2g} times as long beside it, cut for d0: dU there is known to a few "
        "percent of itself; a larger mesh.Np, or pairsim curve at that d, tells more"
    ]


def near_ends(case: SceneCase, span: float) -> list[str]:
    """Of a row of particles, so long at its longest, that came near the ends of the tube."""
    left = (case.tube_length - span) / 2
    if not case.n or left >= NEAR_ENDS * case.margin:
        return []
    return [
        f"the particles left {left:.3g} of tube on each side, less than {NEAR_ENDS:g} of what length: auto gives "
        f"({case.margin:g}): the ends act on them; a longer length, or limits.max_gap, avoids it"
    ]
