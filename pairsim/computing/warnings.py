"""Warnings about results that may be less accurate than requested, for run.json and the terminal.

`of` is the symbol of the goal of a case, such as dU.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from pairsim.cases.accuracy import SETTINGS, settings_of
from pairsim.cases.case import FREE_ENDS, SceneCase
from pairsim.quantities.kinds import LENGTH
from pairsim.runtime.message import Message, Text

# Least length of tube on each side, relative to that with `length: auto`; with less, errors above about 1 % of the peak
# were measured. Periodic ends need more, since the polymer stress caused by the particles returns to them.
NEAR_ENDS = {"developed": 0.5, "periodic": 0.65}
# Relative length as above, and the largest error measured below it with either kind of ends [% of the largest |dU|].
ENDS_ERRORS = ((0.33, 44), (0.5, 7), (0.65, 2))
COARSEST = "5%"
FINER = 1.5  # factor by which advice divides the sizes of cells; chosen
SHARPER = 10.0  # factor by which advice multiplies the parameter of a regularisation; chosen
MOST_DE = 2.0  # largest De at which dU was compared with finer meshes, docs/explanation/limits.md


def beyond_checked(case: SceneCase) -> list[str]:
    """Warn of a De that is larger than any at which dU was compared with finer meshes."""
    slowest = case.slowest_time
    if (De := slowest * max(case.values_of_De)) <= MOST_DE or case.n == 0:
        return []
    mode = "" if slowest == 1 else " of the slowest mode"
    return [
        f"De = {De:g}{mode} is above {MOST_DE:g}, the largest at which dU was compared with finer meshes: the stress "
        "around the particles may not be resolved (docs/explanation/limits.md); compare with a finer mesh (mesh.Np, "
        "mesh.max_size)"
    ]


def above(value: float, limit: float) -> str:
    """A number that exceeds a limit, with two significant digits, or as many as it takes to read above the limit."""
    texts = (f"{value:.{digits}g}" for digits in range(2, 17))
    return next((text for text in texts if float(text) > limit), f"{value}")


def coarse_mesh(case: SceneCase, of: str) -> list[str]:
    """Warn of a mesh that is coarser than any whose error was measured."""
    measured = SETTINGS[COARSEST].mesh(case.liquid_model.cells, case.betas, case.in_time)
    coarse = {"Np": case.mesh.Np < measured["Np"], "max_size": case.mesh.max_size > measured["max_size"]}
    return [
        f"mesh.{name} = {getattr(case.mesh, name):g} is coarser than accuracy: {COARSEST} ({measured[name]:g}): the "
        f"error of {of} may exceed {COARSEST} of its largest value"
        for name, is_coarse in coarse.items()
        if case.n and is_coarse
    ]


def finer(case: SceneCase) -> str:
    """A finer mesh as options of the command line."""
    sizes = {"Np": round(FINER * case.mesh.Np), "max_size": f"{case.mesh.max_size / FINER:.2g}"}
    return f"a finer mesh ({' '.join(f'--set mesh.{name}={size}' for name, size in sizes.items())})"


def unresolved_stress(case: SceneCase, s_jump: float, of: str) -> list[str]:
    """Warn of a polymer stress that the mesh does not resolve; `s_jump` is the largest change of s within a cell."""
    allowed = settings_of(case.accuracy).s_jump
    if s_jump <= allowed:
        return []
    return [
        f"the logarithm of the conformation tensor changes by {above(s_jump, allowed)} within one cell: the polymer "
        f"stress is not resolved there. Above {allowed:g}, the error of {of} may exceed {case.accuracy} of its largest "
        f"value (docs/explanation/limits.md); compare with {finer(case)}"
    ]


@dataclass(frozen=True)
class ErrorAt:
    """The estimated error of a result."""

    relative: float  # the error, relative to the size of the result
    where: Sequence[Text]  # the place, such as "De = 1" and "d = 0.1"; empty for a single particle
    ends: float  # the part of the error that is due to the ends of the tube, relative as well
    regularisation: float  # the part that is due to the regularisation of the liquid, likewise

    def no_mesh_helps(self, case: SceneCase) -> str:
        """What would reduce most of the error, as an option of the command line; "" if that is a finer mesh."""
        if self.ends > self.relative / 2:
            return _longer(case)
        if self.regularisation > self.relative / 2:
            place, name = case.liquid_model.regularisation.split(".")
            larger = f"liquid.{name}" if case.is_viscous else f"liquid.{place}.{name}"
            return f"a larger {name} (--set {larger}={SHARPER * case.liquid_model.numbers[f'{place}.{name}']:.3g})"
        return ""


def _longer(case: SceneCase) -> str:
    """A longer tube as an option of the command line."""
    return f"a longer tube (--set length={1.5 * case.tube_length:.3g})"


def large_errors(case: SceneCase, error: str, size: str, errors: Sequence[ErrorAt]) -> list[Text]:
    """Warn of estimated errors that exceed `accuracy`; `error` is their name, `size` what they are relative to."""
    allowed = case.error_wanted
    worst = max(errors, key=lambda each: each.relative, default=None)
    if worst is None or worst.relative <= allowed:
        return []
    at = " at " + Message.joined(", ", worst.where) if worst.where else ""
    advice, percent = worst.no_mesh_helps(case) or finer(case), above(100 * worst.relative, 100 * allowed)
    said = "{} is {} % of {}{}, more than accuracy: {}; use {}"
    return [Message(said, error, percent, size, at, case.accuracy, advice)]


def moves_on(case: SceneCase, places: Sequence[Text], part: float) -> list[Text]:
    """Warn of particles that move on before the effect of their start has decayed.

    Args:
        case: The case.
        places: Places such as "d = 0.1", at which this alone leaves an error of dU above `accuracy`.
        part: The largest of these errors, relative to the largest |dU|.
    """
    if not places:
        return []
    several = len(places) > 1
    at = Message("{} places from {} to {}", len(places), places[0], places[-1]) if several else places[0]
    said = (
        "at {} the particles move on before they have forgotten their start (t_relax): this alone makes dU_error up to "
        "{} % of the largest |dU|, more than accuracy: {}, and no mesh reduces it; pairsim run shows how particles "
        "that start there move"
    )
    return [Message(said, at, above(100 * part, 100 * case.error_wanted), case.accuracy)]


def near_ends(case: SceneCase, span: float, of: str) -> list[Text]:
    """Warn of a row of particles, whose largest length is `span` [D_c], that comes too near the ends of the tube.

    The measured errors are in docs/explanation/decisions.md, "Tube and ends".
    """
    part = NEAR_ENDS["periodic" if case.ends != "developed" and case.liquid_model.modes else "developed"]
    left, least = (case.tube_length - span) / 2, part * case.margin
    if not case.n or case.closed or left >= least:
        return []
    message = Message(
        "there are {} of tube on each side of the particles, less than {}: the ends affect {}",
        LENGTH(left, ".3g", named=True),
        LENGTH(least, ".3g"),
        of,
    )
    if case.liquid_model.modes and of == "dU":
        off = next(error for below, error in ENDS_ERRORS if left < below * case.margin)
        message += f", by up to {off} % of the largest |dU| in the tubes that were tested"
    if left < FREE_ENDS:  # a run has ended there, and says which length is enough
        return [message]
    return [message + f"; use {_longer(case)}, or limits.max_gap in a run"]


def common_warnings(case: SceneCase, of: str, s_jump: float, span: float) -> list[Text]:
    """The warnings that all questions share.

    Args:
        case: The case.
        of: Symbol of its goal.
        s_jump: Largest change of s = log c within a cell.
        span: Largest length of the row of particles [D_c].
    """
    resolved = *coarse_mesh(case, of), *unresolved_stress(case, s_jump, of)
    return [*beyond_checked(case), *resolved, *near_ends(case, span, of)]
