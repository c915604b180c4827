"""What a user should be told of results that may be worse than they look: the warnings of run.json and the terminal."""

from __future__ import annotations

from pairsim.config.accuracy import SETTINGS, Accuracy, liquid_of
from pairsim.config.case import Case, SceneCase

LONG_ARC = 1.5  # over the gap that it faces: 2.5 % of dU at 3 times, for N_p 40 and a gap of .005
# Parts of the tube that `length: auto` leaves on each side; with less, errors of more than some 1 % of the peak were
# measured. What the liquid remembers of the particles comes back to them through periodic ends.
NEAR_ENDS = {"developed": 0.5, "periodic": 0.65}
# Below such a part of that tube: the largest error measured, with either kind of ends [% of the largest |dU|].
ENDS_ERRORS = ((0.33, 44), (0.5, 7), (0.65, 2))
COARSEST: Accuracy = "5%"


def coarse_mesh(case: SceneCase) -> list[str]:
    """Of a mesh with fewer or larger cells than any that was measured to keep an error."""
    measured = SETTINGS[COARSEST].mesh(liquid_of(dict(case)), case.betas)
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


def unresolved_stress(case: SceneCase, s_jump: float) -> list[str]:
    """Of the largest change of s within a cell."""
    allowed = SETTINGS[case.accuracy].s_jump
    if s_jump <= allowed:
        return []
    return [
        f"s = log c changes by {s_jump:.2g} within one cell: the polymer's stress is not resolved there. Above "
        f"{allowed:g}, dU may be more than {case.accuracy} of its largest value off (docs/how-to/accuracy.md); compare "
        "with a finer mesh (mesh.Np near the particles, mesh.max_size elsewhere)"
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
    """Of a row of particles, so long at its longest, that is near the ends of the tube.

    Figures: "Length of the tube" and "Periodic ends" in docs/notebook/viscoelastic.md.
    """
    part = NEAR_ENDS[case.ends if case.polymer else "developed"]
    left, least = (case.tube_length - span) / 2, part * case.margin
    if not case.n or left >= least:
        return []
    message = f"the particles leave {left:.3g} of tube on each side, less than {least:.3g}: the ends act on them"
    if case.polymer is not None:
        off = next(error for below, error in ENDS_ERRORS if left < below * case.margin)
        message += f", by up to {off} % of the largest |dU| in such tubes that were measured"
    return [f"{message}; a longer length, or limits.max_gap of a run, avoids it"]
