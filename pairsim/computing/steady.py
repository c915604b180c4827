"""Quasi-steady solutions of a command: their branch, rows of tables, and their summary in run.json."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from functools import reduce
from typing import Any, Self

from pairsim.analysis.rows_of_points import way_row
from pairsim.cases.case import SceneCase
from pairsim.computing.accuracy import adaptation_report
from pairsim.computing.branch_report import COUNTS, BranchReport
from pairsim.computing.events import Event, Note, Outcome, Summary, Table
from pairsim.computing.warnings import common_warnings, moves_on
from pairsim.computing.workers import FoundAt, Shared
from pairsim.quantities.kinds import LENGTH
from pairsim.record.column import names_of
from pairsim.record.columns import POLYMER_HEALTH, STEADY_HEALTH, WAY_COLUMNS, YIELD_HEALTH
from pairsim.record.run_entries import ADAPTATION, END_OF_BRANCH, SIZE, Entries, Entry
from pairsim.runtime.message import Message, Text
from pairsim.solvers.curves.adaptation import AdaptiveBranch
from pairsim.solvers.curves.point import Point
from pairsim.solvers.goals import Goal
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.problems import SteadyProblem
from pairsim.solvers.steady.ends import Ended, Passed, SpentOnTheWay
from pairsim.solvers.steady.first_solution import first_scene, scene_past_end


class Solutions:
    """The quasi-steady solutions of a case, on a branch that is closed at the end of the context.

    The errors of its goals are kept below `accuracy`, or a warning says which ones are not.

    Args:
        case: The case.
        goals: The goals of the case.

    Attributes:
        points: The solutions that are results.
        judged: The solutions that must meet `accuracy`: all, unless a question sets a list of its own.
        largest: Largest values of goals that a question knows better than from its points.
        branch: The branch; None until `begin`.
        ended: The end of the continuation that ended the computation; None if all was solved.
        way: The solutions on the way to parameters that were not reached.
        others: Reports of other processes on the branches on which they have found points, by name of the process.
    """

    def __init__(self, case: SceneCase, goals: Sequence[Goal]) -> None:
        self.case, self.goals, self.points = case, goals, list[Point]()
        self.judged, self.largest = self.points, dict[Goal, float]()
        self.ended: Ended | None = None
        self.way: Sequence[Passed] = ()
        self.branch: AdaptiveBranch | None = None
        self.others = dict[str, BranchReport]()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, failure: BaseException | None, *_: object) -> None:
        if isinstance(failure, SpentOnTheWay):
            self.way = failure.way
        if self.branch is not None:
            self.branch.close()

    def outcome_of(self, ended: Ended) -> Outcome:
        """The outcome if a continuation ended before all was solved: that there is no steady state, if this is proven.

        Raises:
            NoSteadyState: It is not proven.
        """
        self.ended, self.way = ended, ended.way
        if not ended.proven:
            raise ended.failure
        return Outcome("finished", ended.failure.reason, ended.failure.message)

    def begin(
        self,
        problem: SteadyProblem,
        first: Parameters,
        *,
        places: Sequence[tuple[float, ...]] = (),
        sensitivities: Collection[str] = (),
    ) -> AdaptiveBranch | Ended:
        """Solve at the first parameters, from which others follow on the branch.

        Its meshes are adapted until the errors of the goals are below `accuracy`.

        Args:
            problem: The problem of the case.
            first: The first parameters.
            places: Distances of the case, see `AdaptiveBranch`.
            sensitivities: Parameters by which dU is differentiated.

        Returns:
            The branch, or why the first parameters were not reached.

        Raises:
            NoSteadyState: No solution was found.
            MeshFailure: A mesh could not be generated.
        """
        scene = first_scene(problem, first)
        if isinstance(scene, Ended) and scene.kind and not first.gaps:
            scene = scene_past_end(problem, first, scene)
        if isinstance(scene, Ended):
            return scene
        wanted, fixed = self.case.error_wanted, self.case.fixed_cells
        self.branch = AdaptiveBranch(scene, sensitivities, goals=self.goals, wanted=wanted, places=places, fixed=fixed)
        return self.branch

    def in_part[P, T](
        self,
        begin: Callable[[], AdaptiveBranch | Ended],
        places: Sequence[P],
        read: Callable[[AdaptiveBranch, P], T | Ended],
        name: str,
    ) -> Iterator[FoundAt[P, T] | tuple[str, BranchReport]]:
        """Solve at some places of a question, in the process of a worker.

        The end of a continuation is not reported: the main process finds it, too.

        Args:
            begin: Begins the branch, unless an earlier part has done so in this process.
            places: The places, in order along the branch.
            read: Returns the result at a place, or why it was not reached.
            name: The name of this process.

        Yields:
            The result at each place, and after each the name of the process with the report on its branch.
        """
        branch = self.branch or begin()
        if isinstance(branch, Ended):
            return
        for place in places:
            result = read(branch, place)
            if isinstance(result, Ended):
                return
            yield FoundAt(place, result)
            yield name, BranchReport.of(branch)

    def hear(self, said: tuple[str, BranchReport]) -> None:
        """Store the report of another process on its branch, which comes with the name of the process."""
        self.others.update([said])

    def last_events(self, entries: Entries, warnings: Sequence[Text] = ()) -> Iterator[Event]:
        """The last events: the summary, and the solutions on the way to parameters that were not reached."""
        yield self.summary(entries, warnings)
        if self.way:
            yield Table("way", WAY_COLUMNS.named(self.case.n), [*map(way_row, self.way)])

    def summary(self, entries: Entries, warnings: Sequence[Text] = ()) -> Summary:
        """The summary for run.json.

        Args:
            entries: Entries of the question, to which the costs, the end of the branch, and whether the accuracy was
                kept are added.
            warnings: Warnings of the question, to which those of accuracy and those that all questions share are added.
        """
        case, report = self.case, self.report
        seen = [c.s_jump for p in self.points if (c := p.observation.conformation) is not None]
        common = common_warnings(case, self.goals[0].name, max(seen, default=0.0), case.cluster)
        end = self.ended if self.ended is not None and self.ended.proven else None
        place: Entries = {} if end is None else {END_OF_BRANCH: {"kind": end.kind, **end.at}}
        kept, missed = dict[Entry[Any], Any](), list[Text]()
        if report is not None:
            kept[ADAPTATION], missed = adaptation_report(case, self.goals, report, self.judged, self.largest)
        costs = {} if report is None else report.entries
        return Summary(
            {**entries, **kept, **costs, **place}, [*missed, *warnings, *common], report.phases if report else {}
        )

    @property
    def report(self) -> BranchReport | None:
        """The report on the branch and on those of other processes; None before `begin`."""
        own = [] if self.branch is None else [BranchReport.of(self.branch)]
        each = [*own, *self.others.values()]
        return reduce(BranchReport.joined, each) if each else None


def told(shared: Shared[Any, Any]) -> Iterator[Note]:
    """Yield the pending notes about workers."""
    while shared.notes:
        yield Note(shared.notes.pop(0))


def together(summaries: Sequence[Summary], entries: Entries, warnings: Sequence[Text] = ()) -> Summary:
    """The summary of computations on several branches: counts are added up, and of sizes the largest is taken.

    Args:
        summaries: The summary of each.
        entries: Further entries, of all of them together.
        warnings: Further warnings, likewise.
    """
    found, phases = dict[Entry[Any], Any](), dict[str, float]()
    for each in summaries:
        for entry, value in each.entries.items():
            if entry in COUNTS:
                value = found.get(entry, 0) + value
            found[entry] = max(found.get(entry, 0), value) if entry is SIZE else value
        for phase, seconds in each.phases.items():
            phases[phase] = phases.get(phase, 0.0) + seconds
    said = dict.fromkeys(text for each in summaries for text in each.warnings)
    return Summary({**found, **entries}, [*warnings, *said], phases)


def health_columns(case: SceneCase) -> list[str]:
    """Diagnostic columns in a table of quasi-steady solutions."""
    liquid = case.liquid_model
    of_liquid = [*(POLYMER_HEALTH if liquid.modes else ()), *(YIELD_HEALTH if liquid.regularisation else ())]
    return names_of(case.n, *STEADY_HEALTH, *of_liquid)


def moving_errors(case: SceneCase, points: Sequence[Point], size: float) -> list[Text]:
    """Warnings of points at which particles move on before the effect of their start has decayed.

    The error of dU that this leaves is compared with `accuracy` times a velocity `size` [U_av].
    """
    parts = {
        Message("d = {}", LENGTH(dict.fromkeys(point.gaps))): float(point.motion.remainder.max()) / size
        for point in points
    }
    far = [place for place, part in parts.items() if part > case.error_wanted]
    return moves_on(case, far, max(parts.values()))
