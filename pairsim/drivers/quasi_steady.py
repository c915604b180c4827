"""Shared by curve and critical: rows of quasi-steady solutions, cost of a branch, and the final run.json."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from pairsim.config.case import SceneCase
from pairsim.config.checked_range import beyond_checked
from pairsim.drivers.outcome import Outcome
from pairsim.drivers.session import Session, write_failure
from pairsim.drivers.warnings import ErrorAt, coarse_mesh, moves_on, near_ends, unresolved_stress
from pairsim.results.columns import (
    CURVE_HEALTH,
    FORCES,
    POLYMER_HEALTH,
    gap_endings,
    named_row,
    observed,
    particle_endings,
)
from pairsim.solvers.curves.branch import Branch, Point
from pairsim.solvers.steady.continuation import where


def kept() -> str:
    """End of the message of an interrupted computation, after the name of the signal."""
    return "; the results written so far are kept"


def health_columns(case: SceneCase) -> tuple[str, ...]:
    """Diagnostic columns in a table of quasi-steady solutions."""
    return CURVE_HEALTH + (POLYMER_HEALTH if case.liquid_model.modes else ())


def point_row(point: Point) -> dict[str, float]:
    """All values of a quasi-steady solution by the names of their columns."""
    o = point.observation
    row = named_row(0.0, point.gaps, o.U, o.dU, o.D, o.dp, o.dp_plus)
    gaps = gap_endings(o.d.size + 1)
    estimate = point.estimate
    values = {
        "slope": point.slopes,
        "dU_held": point.held_dUs,
        "stretch": point.motion.stretch,
        "mesh_error": point.mesh_errors,
    }
    values |= {"dU_correction": estimate.dU, "dU_error": point.dU_errors, "ends_error": estimate.ends_error}
    values |= {f"by_{name}": change for name, change in point.sensitivities.items()}
    for name, each in values.items():
        row |= {name + gap: value for gap, value in zip(gaps, each if each is not None else (), strict=False)}
    row |= {f"U_correction{each}": value for each, value in zip(particle_endings(o.U.size), estimate.U, strict=True)}
    for name, each in zip(FORCES, (o.F, estimate.F, estimate.F_error), strict=True):
        row |= {name + ending: value for ending, value in zip(particle_endings(o.U.size), each, strict=False)}
    row["dp_plus_correction"] = estimate.dp_plus
    row |= {"newton": point.newton, "meshes": point.meshes, "t_relax": point.t_relax}
    row |= {**observed(o), "distortion": point.distortion}
    return {name: float(value) for name, value in row.items()}


def error_at(point: Point, gap: int, size: float) -> ErrorAt:
    """The estimated error of a relative velocity of a point by mesh and ends, relative to a velocity."""
    estimate = point.estimate
    ends = float(estimate.ends_error[gap]) / size
    return ErrorAt(float(estimate.dU_error[gap]) / size, where(point.parameters), ends, bool(estimate.cancelling[gap]))


def moving_errors(case: SceneCase, points: Sequence[Point], size: float) -> list[str]:
    """Warnings of points at which particles move on too fast for a curve, relative to a velocity."""
    parts = {
        f"d = {', '.join(f'{d:.4g}' for d in dict.fromkeys(point.gaps))}": float(point.motion.remainder.max()) / size
        for point in points
    }
    far = [place for place, part in parts.items() if part > case.error_wanted]
    return moves_on(case, far, max(parts.values()))


def costs(branch: Branch | None) -> tuple[dict[str, Any], dict[str, float]]:
    """Cost of a branch: counts, and the wall time of each phase [s]."""
    if branch is None:
        return {}, {}
    counts = {
        "newton_iterations": sum(s.iterations for s in branch.scenes),
        "factorisations": sum(s.factorisations for s in branch.scenes),
        "meshes": sum(s.meshes for s in branch.scenes),
        "unknowns": branch.fine.constraints.size,
    }
    phases: dict[str, float] = {}
    for scene in branch.scenes:
        for name, seconds in scene.clock.seconds.items():
            phases[name] = phases.get(name, 0.0) + seconds
    return counts, phases


def conclude(
    case: SceneCase,
    session: Session,
    outcome: Outcome,
    branch: Branch | None,
    points: Sequence[Point],
    warnings: Sequence[str],
    summary: dict[str, Any],
) -> Outcome:
    """Write the end: the outcome, the costs, and the warnings, those of mesh, stresses and tube added.

    Args:
        case: The case.
        session: The open session of the command.
        outcome: How the computation ended.
        branch: The solvers, None if they were not created.
        points: The points solved.
        warnings: Further warnings.
        summary: Further entries of run.json.

    Returns:
        The outcome; a failure if run.json cannot be written.
    """
    counts, phases = costs(branch)
    seen = [c.s_jump for p in points if (c := p.observation.conformation) is not None]
    stress = unresolved_stress(case, max(seen, default=0.0))
    warnings = [*warnings, *beyond_checked(case), *coarse_mesh(case), *stress, *near_ends(case, case.cluster)]
    try:
        session.record.write(outcome, {**summary, **counts, "warnings": warnings}, phases)
    except OSError as error:
        failure = write_failure(error, session.folder.path, "the same command with --overwrite")
        return Outcome("failed", failure.reason, str(failure))
    return outcome
