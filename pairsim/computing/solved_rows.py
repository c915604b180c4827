"""Short rows and infinite trains, from which the model of long rows is made, solved by all processes of a case."""

from __future__ import annotations

from collections.abc import Generator, Iterator, Sequence
from dataclasses import replace
from functools import partial

from pairsim.computing.kept_rows import KeptRows
from pairsim.computing.workers import Desk, PartOf, Workers, found_in_parts
from pairsim.runtime.monitor import Monitor
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.problems import SteadyProblem
from pairsim.solvers.rows.model import Row, Waves
from pairsim.solvers.rows.short_rows import Chain, train_at


def known_rows(
    kept: KeptRows,
    problem: SteadyProblem,
    alone: Parameters,
    chains: Sequence[Chain],
    trains: Sequence[float],
    workers: Workers,
) -> Generator[Row | Waves, None, tuple[list[Row], list[Waves]]]:
    """Read short rows and trains from the cache, or else solve and store them.

    Args:
        kept: Their file in the cache.
        problem, alone, chains, trains, workers: As for `solved_rows`.

    Yields:
        As `solved_rows`; nothing if they are in the cache.

    Returns:
        As `solved_rows`.
    """
    with kept.sole_solver(problem.monitor):
        if (known := kept.read()) is not None:
            return known
        found = yield from solved_rows(problem, alone, chains, trains, workers)
        kept.write(*found)
        return found


def solved_rows(
    problem: SteadyProblem, alone: Parameters, chains: Sequence[Chain], trains: Sequence[float], workers: Workers
) -> Generator[Row | Waves, None, tuple[list[Row], list[Waves]]]:
    """Solve short rows and trains.

    Args:
        problem: The problem of a single particle.
        alone: Materials of a single particle.
        chains: The rows; they are cut into shorter ones if there are several processes.
        trains: Distances of the trains [D_c].
        workers: The processes that share the work.

    Yields:
        Each row and the waves of each train, in the order in which they are solved.

    Returns:
        Rows and waves in the order of `chains` and `trains`.

    Raises:
        NoSteadyState: There is no quasi-steady state of a row, or it was not found.
        MeshFailure: A mesh could not be generated.
    """
    monitor, given = problem.monitor, replace(problem, monitor=Monitor())  # `monitor` stays in this process
    cut = [each for chain in chains for each in chain.cut()] if workers.count > 1 else chains
    parts: list[PartOf[Row | Waves]] = [partial(_rows, given, alone, chain) for chain in cut]
    parts += [partial(_train, given, alone, d) for d in trains]
    found: list[list[Row | Waves]] = [[] for _ in parts]
    for i, each in found_in_parts(workers, monitor, parts):
        found[i].append(each)
        yield each
    every = [each for one in found for each in one]
    return [each for each in every if isinstance(each, Row)], [each for each in every if not isinstance(each, Row)]


def _rows(problem: SteadyProblem, alone: Parameters, chain: Chain, desk: Desk) -> Iterator[Row]:
    return chain.solved(replace(problem, monitor=desk.monitor), alone)


def _train(problem: SteadyProblem, alone: Parameters, d: float, desk: Desk) -> Iterator[Waves]:
    waves = train_at(replace(problem, monitor=desk.monitor), alone, d)
    if waves is not None:
        yield waves
