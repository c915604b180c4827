"""The computation of a train: its growth rates, and the answer that follows from them."""

from __future__ import annotations

from collections.abc import Generator, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import islice
from math import inf, isfinite, nan, pi

import numpy as np

from pairsim.computing import events
from pairsim.computing.off_axis.beside import rates_beside
from pairsim.computing.problems import steady_problem
from pairsim.computing.warnings import beyond_checked, coarse_mesh
from pairsim.computing.workers import Workers
from pairsim.quantities.kinds import LENGTH, POSITION, RATE, VELOCITY
from pairsim.quantities.text import in_unit, with_name
from pairsim.questions.train import (
    DIFFUSION,
    DIFFUSION_ERROR,
    GROWTH,
    GROWTH_ERROR,
    OF_A_ROW,
    SENTENCES,
    SPACING,
    SPECTRUM,
    TRAIN,
    TUBE,
    TUBE_LEAST,
    TUBE_MOST,
    VERDICT,
    D,
    K,
    TrainCase,
    work,
)
from pairsim.questions.train.row import first_gaps, follow
from pairsim.record.column import Column, table_row
from pairsim.record.columns import D_ERROR, T_RELAX, U_ERROR, U
from pairsim.record.run_entries import SIZE
from pairsim.runtime.errors import BranchEnd, MeshFailure, NoSteadyState
from pairsim.runtime.message import Message, Text
from pairsim.runtime.monitor import Monitor
from pairsim.solvers.curves.branch import Branch
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.problems import SteadyProblem
from pairsim.solvers.rows.short_rows import LEAST
from pairsim.solvers.steady.ends import arrived
from pairsim.solvers.steady.first_solution import first_scene
from pairsim.solvers.trains.spectrum import Wave
from pairsim.solvers.trains.train import Train, on_meshes, transition

FAST = 0.3  # rate times t_relax above which it is a warning that disturbances change while stresses relax; chosen
CHANGES = {"orders": (1 / 10, "of 20 % becomes one of 2 %"), "clusters": (10.0, "of 2 % becomes one of 20 %")}


def computation(case: TrainCase, monitor: Monitor, workers: Workers) -> events.Events:
    """Compute the train and its growth rates on two meshes, and on finer ones while errors are larger than wanted."""
    row_of = f", then a row of {case.beads}" if case.beads else ""
    yield events.Begin(f"the growth rates of a train of {case.train.cell} beads{row_of}", work.of_case(case))
    done = 0.0
    problem, start = steady_problem(case, inf, monitor), Parameters((), case.solid_models, case.liquid_model)
    place, d, slope = case.train.transition, case.mean_d, nan
    try:
        if place is not None:
            d, slope = transition(problem, start, case.train.cell, place)
            done += work.TRANSITION
            yield events.Progress(done, Message("trains change at d = {}", LENGTH(d)), 1)
        meshes = islice(on_meshes(problem, start, case.train.cell, d), len(work.MESHES))
        for refined, found in enumerate(meshes, 1):
            errors = f"errors {100 * found.error:.2g} % of the largest rate"
            done += work.MESHES[refined - 1]
            yield events.Progress(done, errors, refined)
            verdict = found.spectrum.verdict
            certain = verdict != "undecided" or place is not None
            if verdict == "neither" or case.fixed_cells or (found.error <= case.error_wanted and certain):
                break
    except BranchEnd as end:
        yield events.Summary({})
        return events.Outcome("finished", end.reason, end.message)
    answer, names = Answer(found, slope), TRAIN.named(1)
    yield events.Table("train", names)
    yield events.Row("train", dict.fromkeys(names) | answer.row())  # the main result, before rows and spectrum
    waves = [wave._asdict() for wave in found.spectrum.of_cell]
    yield events.Table("spectrum", SPECTRUM.named(1), waves)
    sentences = list(_train_in_words(case, answer))  # to which those of a row are added
    warnings = list[Text](_warnings(case, found))
    yield events.Summary({SIZE: found.unknowns, SENTENCES: sentences}, warnings)
    if (gaps := first_gaps(case, found.d)).size:
        sentences += yield from follow(case, problem, start, gaps, found, done, sum(work.MESHES[refined:]), workers)
    if case.focus:
        warnings += yield from _off_axis(case, problem, start, sorted({found.d, *gaps.tolist()}))
    return events.Outcome("finished", "end", f"verdict: {verdict}")


def _off_axis(
    case: TrainCase, problem: SteadyProblem, alone: Parameters, distances: Sequence[float]
) -> Generator[events.Event, None, list[Text]]:
    """Compute rates off the axis of short rows, at the least and at the largest distance; returns warnings.

    Rates of an infinite train are not computed: the effect of second neighbours is small.

    Args:
        case: The case.
        problem: The problem of a single bead in the train.
        alone: The materials of a single bead.
        distances: The distances [D_c], ascending.
    """
    chosen = dict.fromkeys((distances[0], distances[-1]))
    length = OF_A_ROW * problem.betas[0] + (OF_A_ROW - 1) * distances[-1] + 2 * case.margin
    row = replace(
        problem.repeated(OF_A_ROW), length=length, closed=False, periodic=False, narrowest=max(distances[0], LEAST)
    )
    places = [Parameters((d,) * (OF_A_ROW - 1), alone.solids * OF_A_ROW, alone.liquid) for d in chosen]
    try:
        branch = Branch(arrived(first_scene(row, places[-1])))
    except (NoSteadyState, MeshFailure) as failure:
        return [Message("no rate off the axis was found: {}", failure.message)]
    with closing(branch):
        return (yield from rates_beside(case, branch, places, work.of_case(case), len(places)))


@dataclass(frozen=True)
class Answer:
    """The results of a train: its numbers, and those that follow from its growth rates.

    Attributes:
        found: The train.
        slope: The slope that `transition` returns, from which the error of its distance follows; nan if the distance of
            the train is not that of a transition.
    """

    found: Train
    slope: float = nan

    @property
    def verdict(self) -> str:
        """Whether the train "orders", "clusters", does "neither", or is "undecided"."""
        return self.found.spectrum.verdict

    @property
    def wave(self) -> Wave:
        """The disturbance that grows most, or decays fastest."""
        return self.found.spectrum.fastest

    @property
    def diffusion(self) -> tuple[float, float]:
        """C and its half-width: long waves grow at -C k^2 [U_av/D_c]."""
        longest = self.found.spectrum.everywhere[0]
        return -longest.scaled, longest.scaled_error

    @cached_property
    def tubes(self) -> tuple[float, ...]:
        """Length of tube in which a spread of the distances changes tenfold, and its least and largest value [D_c].

        Empty if the train neither surely orders nor surely clusters.
        """
        if self.verdict not in CHANGES:
            return ()
        lengths = self.found.U * np.array(self.found.spectrum.time_to(CHANGES[self.verdict][0]))
        return tuple(map(float, lengths)) if isfinite(lengths[0]) else ()

    @property
    def d_error(self) -> float | None:
        """Half-width of the distance of a transition [D_c]; None if the distance is not that of a transition."""
        if not isfinite(self.slope):
            return None
        wave = self.found.spectrum.least_stable
        return (abs(wave.scaled) + abs(wave.scaled_error)) / abs(self.slope)

    def row(self) -> dict[str, float | str]:
        """The row of train.csv."""
        C, C_error = self.diffusion
        values: dict[Column, float | tuple[float]] = {
            SPACING: self.found.spacing,
            D: self.found.d,
            U: (self.found.U,),
            U_ERROR: (self.found.U_error,),
            K: self.wave.k,
            GROWTH: self.wave.growth,
            GROWTH_ERROR: self.wave.growth_error,
            DIFFUSION: C,
            DIFFUSION_ERROR: C_error,
            T_RELAX: self.found.t_relax,
        }
        if self.d_error is not None:
            values[D_ERROR] = self.d_error
        if self.tubes:
            values |= zip((TUBE, TUBE_LEAST, TUBE_MOST), self.tubes, strict=True)
        return {VERDICT.name: self.verdict, **table_row(1, values)}


def _train_in_words(case: TrainCase, answer: Answer) -> Iterator[str]:
    """Yield the answer of a train in words."""
    scales, verdict, train, fastest = case.scales, answer.verdict, answer.found, answer.wave
    U = in_unit(scales, VELOCITY, train.U, train.U_error)
    growth, C = (in_unit(scales, RATE, *each) for each in ((fastest.growth, fastest.growth_error), answer.diffusion))
    spacing, d = (with_name(scales, LENGTH, each) for each in (train.spacing, train.d))
    yield f"Beads {spacing} apart from centre to centre, {d} from surface to surface, move at U = {U}."
    wave = f"a wave of {2 * pi / fastest.k:.3g} beads"
    length = train.U / abs(fastest.growth or nan)
    error = length * (fastest.growth_error / abs(fastest.growth or nan) + train.U_error / train.U)
    at = f"at {growth}, by a factor e within {with_name(scales, POSITION, length, error)}"
    yield {
        "orders": f"The train orders: disturbances of all wavelengths decay, {wave} fastest: {at}.",
        "clusters": f"The train clusters: {wave} grows fastest: {at}.",
        "neither": "The train neither orders nor clusters: waves travel along it and keep their size.",
        "undecided": f"Whether the train orders is not certain: {wave} has the largest growth rate, {growth}.",
    }[verdict]
    value, half_width = answer.diffusion
    sign = np.sign(value) if abs(value) > half_width else 0
    long = {1: "decay", -1: "grow", 0: "may decay or grow"}[sign]
    yield f"Waves of many beads {long}: their growth rate is -C k^2 with C = {C} and k = 2 pi over the number of beads."
    if answer.tubes:
        tube, least, most = (with_name(scales, POSITION, each) for each in answer.tubes)
        small = "if the differences of the distances are small and independent at first"
        yield f"A spread of the distances {CHANGES[verdict][1]} within {tube} of tube ({least} to {most}), {small}."
    if answer.d_error is not None:
        nearer, farther = ("cluster", "order") if answer.slope < 0 else ("order", "cluster")
        at = in_unit(scales, LENGTH, train.d, answer.d_error)
        yield f"Trains with distances of less than {at} {nearer}, and those with more {farther}."


def _warnings(case: TrainCase, found: Train) -> list[str]:
    """Warnings of errors larger than wanted, and of disturbances that change while shapes and stresses relax."""
    warnings, part = (
        [*beyond_checked(case), *coarse_mesh(case, U.name)],
        abs(found.spectrum.rates).max() * found.t_relax,
    )
    if found.error > case.error_wanted and found.spectrum.verdict != "neither":
        off = f"growth rates are within {100 * found.error:.2g} % of the largest"
        warnings.append(f"accuracy: {case.accuracy} was not kept: {off}")
    if part > FAST:
        warnings.append(
            f"disturbances change by a fraction of {part:.2g} while shapes and stresses relax: the last term of the "
            "series for this is included in the errors of the rates; modes that do not follow the distances are not "
            "sought"
        )
    return warnings
