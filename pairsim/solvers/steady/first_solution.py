"""First quasi-steady solution of a branch: from undeformed spheres, a solution on larger cells, or by continuation.

See "First solution" and "Continuation" in docs/explanation/numerics.md.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace

from pairsim.physics.pipe import FIRST_GRADIENT, Pipe
from pairsim.runtime.errors import MeshFailure, NoSteadyState
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.problems import SteadyProblem
from pairsim.solvers.steady.continuation import (
    SPREAD_OF_SEVERAL,
    begin,
    cold_start,
    ended,
    follow,
    prepared,
    solve_on_mesh,
)
from pairsim.solvers.steady.ends import Ended
from pairsim.solvers.steady.predictors import adopt, place_undeformed
from pairsim.solvers.steady.scene import SteadySolver

FEWEST_CELLS = 4  # on a half-circle; chosen
# The continuation to the first parameters takes many solutions that are not reported. It is done on larger cells.
SCOUT = 2.0  # factor by which these are larger; chosen
SCOUT_CELLS = 8  # least number of them on a half-circle; chosen
# Particles are nearly too soft where beta Ca_e, times the stress relative to that of a Newtonian liquid, exceeds this;
# steady shapes end near 0.064 in a Newtonian liquid (docs/explanation/decisions.md).
SOFT = 0.05
ROUND = 100.0  # largest regularisation m at which Ca_e of particles that are nearly too soft is raised; chosen
FINER_SCOUT = 2**0.5  # the same factor of a second scout, tried where the first one fails or finds an end; chosen
FINER = 2**0.5  # factor of the number of cells on a particle, tried where a branch has ended; chosen


def coarser(problem: SteadyProblem, factor: float, fewest: int = FEWEST_CELLS) -> SteadyProblem:
    """The same problem on cells larger by a factor, with at least `fewest` cells on each half-circle."""
    return replace(problem, mesh=problem.mesh.scaled(factor, fewest))


def by_continuation(problem: SteadyProblem, parameters: Parameters) -> SteadySolver | Ended:
    """Create a scene at given parameters by continuation from an easier liquid and nearly rigid particles.

    De (or a regularisation) and Ca_e are raised together. For particles that are nearly too soft for a steady shape,
    and where this fails, De is raised first and then Ca_e, so that an end of the branch is found at the De wanted.

    Returns:
        The scene, or the reason why the continuation did not reach the parameters.

    Raises:
        NoSteadyState: No solution was found at the start.
        MeshFailure: A mesh could not be generated.
    """
    start = cold_start(parameters)
    if not (parameters.De or parameters.liquid.regularisation) or not any(parameters.Ca_es):
        return _continued_through(problem, start, parameters)
    if _softness(problem, parameters) < SOFT:
        with suppress(NoSteadyState, MeshFailure):
            found = _continued_through(problem, start, parameters)
            if isinstance(found, SteadySolver):
                return found
    # With a sharp kink of the stress, a solution on a new mesh is only found by way of rounder kinks, which takes long
    # for each step of a continuation. Ca_e is therefore raised with a rounder kink, which is sharpened at last.
    sharpness = parameters.liquid.numbers[parameters.liquid.regularisation] if parameters.liquid.regularisation else 1.0
    rounder = parameters.less_regularised(min(1.0, ROUND / sharpness))
    return _continued_through(problem, start, replace(rounder, solids=start.solids), rounder, parameters)


def _softness(problem: SteadyProblem, parameters: Parameters) -> float:
    """Largest product of beta and Ca_e, times the factor by which a yield stress makes the stress larger."""
    stress = 1.0
    if parameters.liquid.regularisation:
        stress = max(stress, Pipe(parameters.liquid, problem.drive.flow).steady().gradient / FIRST_GRADIENT)
    return stress * max(beta * Ca_e for beta, Ca_e in zip(problem.betas, parameters.Ca_es, strict=True))


def _continued_through(problem: SteadyProblem, start: Parameters, *places: Parameters) -> SteadySolver | Ended:
    """Create a scene at the last one of `places`, continued from a start by way of the others.

    Raises:
        NoSteadyState: No solution was found at the start.
        MeshFailure: A mesh could not be generated.
    """
    scene = SteadySolver(problem, start)
    try:
        begin(scene)
        for place in places:
            if (end := follow(scene, place)) is not None:
                scene.close()
                return end
    except (NoSteadyState, MeshFailure):
        scene.close()
        raise
    return scene


def try_from_rest(scene: SteadySolver) -> bool:
    """Solve at the parameters of a new scene from spheres at rest, if the liquid has no memory and thins little.

    Measured for beta 0.2, 0.4 and 0.6 and distances of 0.02 to 0.5: it converges up to Ca_e 0.2, 0.1 and 0.05.

    Returns:
        Whether a solution was found, on a mesh that need not be replaced.
    """
    if scene.parameters.liquid.easier() != scene.parameters.liquid or scene.parameters.liquid.has_memory:
        return False
    place_undeformed(scene, at_rest=True)
    if scene.solve(scene.parameters).converged and not scene.distorted():
        return True
    scene.forget()
    return False


def try_from_other_mesh(scene: SteadySolver, parameters: Parameters, scout: SteadySolver) -> bool:
    """Solve at given parameters from a solution of the same scene on another mesh.

    Args:
        scene: The scene, on its mesh.
        parameters: Parameters at which to solve.
        scout: The scene on the other mesh, at a solution.

    Returns:
        Whether a solution was found.
    """
    with suppress(MeshFailure, NoSteadyState):
        adopt(scene, scout)
        return solve_on_mesh(scene, parameters, prepared(scene, parameters, scene.y)).converged
    return False


def first_scene(problem: SteadyProblem, parameters: Parameters) -> SteadySolver | Ended:
    """Create a scene at given parameters: directly, from a solution on larger cells, or by continuation.

    Returns:
        The scene, or the end of its branch.

    Raises:
        NoSteadyState: No solution was found from which to continue.
        MeshFailure: A mesh could not be generated.
    """
    scene, scout, ends = SteadySolver(problem, parameters), None, list[Ended]()
    try:
        if try_from_rest(scene):
            return scene
        scout = _scout(problem, parameters, ends)
        if scout is None and len(ends) == 2 and (end := agreed(ends, parameters)).proven:
            scene.close()
            return end
        found = scout is not None and try_from_other_mesh(scene, parameters, scout)
        if scout is not None:
            scene.take_over_costs(scout)
    except NoSteadyState:
        scene.close()
        raise
    finally:
        if scout is not None:
            scout.close()
    if found:
        return scene
    scene.close()
    other = by_continuation(problem, parameters)
    if isinstance(other, Ended):
        return agreed([*ends, other], parameters) if other.kind else other
    other.take_over_costs(scene)
    return other


def scene_past_end(problem: SteadyProblem, parameters: Parameters, end: Ended) -> SteadySolver | Ended:
    """Try finer cells where a branch has ended.

    Near the softest shapes the surface of a particle becomes neutral to waves as long as its cells, at parameters that
    differ from mesh to mesh. A branch that ends there on one mesh may continue on another, and the solution on that
    mesh may lead to one on the first mesh as well, beyond the apparent end.

    Args:
        problem: The problem.
        parameters: Parameters that its branch has not reached.
        end: The end of the branch.

    Returns:
        A scene at the parameters, on the cells of the problem or with more cells on the particles; or the end of the
        branch, if finer cells do not reach them either.
    """
    mesh = replace(problem.mesh, Np=round(FINER * problem.mesh.Np))
    try:
        finer = first_scene(replace(problem, mesh=mesh), parameters)
    except (MeshFailure, NoSteadyState):
        return end
    if isinstance(finer, Ended):
        return agreed([finer, end], parameters) if finer.kind else end
    scene = _from_other_mesh(problem, parameters, finer)
    if scene is None:
        return finer
    finer.close()
    return scene


def _from_other_mesh(problem: SteadyProblem, parameters: Parameters, known: SteadySolver) -> SteadySolver | None:
    """The scene, solved from a solution on another mesh without continuation; None where that fails."""
    scene = SteadySolver(problem, parameters)
    if try_from_other_mesh(scene, parameters, known):
        return scene
    scene.close()
    return None


def _scout(problem: SteadyProblem, parameters: Parameters, ends: list[Ended]) -> SteadySolver | None:
    """The scene on larger cells, at a solution; None where it is not needed or was not found.

    Args:
        problem: The problem.
        parameters: Parameters at which to solve.
        ends: List to which the ends of the branch on these cells are appended.
    """
    if cold_start(parameters) == parameters:
        return None
    for factor in (SCOUT, FINER_SCOUT):
        with suppress(MeshFailure, NoSteadyState):
            found = by_continuation(coarser(problem, factor, SCOUT_CELLS), parameters)
            if isinstance(found, SteadySolver):
                return found
            ends += [found] if found.kind else []
    return None


def agreed(ends: Sequence[Ended], target: Parameters) -> Ended:
    """The end of a branch from those on several meshes: midway between the extreme ones, with an error that covers all.

    Args:
        ends: The end of the branch on each mesh.
        target: The parameters wanted.
    """
    *_, last = ends
    if len(ends) == 1:
        return last
    at = {}
    for name in last.on_mesh:
        found = sorted(each.on_mesh[name] for each in ends if name in each.on_mesh)
        low, high = found[0][0], found[-1][0]
        at[name] = (low + high) / 2, (high - low) / 2 + max(error for _, error in found)
    kinds = {each.kind for each in ends}
    end = ended(last.kind if len(kinds) == 1 else "wrinkles", at, target, SPREAD_OF_SEVERAL)
    return replace(end, way=last.way, last=last.last)
