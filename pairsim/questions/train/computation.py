"""The growth rates of a train, and what they say."""

from __future__ import annotations

from collections.abc import Generator, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import replace
from itertools import islice
from math import inf, isfinite, nan, pi
from typing import Any

import numpy as np

from pairsim.computing import events
from pairsim.computing.off_axis.beside import rates_beside
from pairsim.computing.problems import steady_problem
from pairsim.computing.warnings import beyond_checked, coarse_mesh
from pairsim.quantities.kinds import LENGTH, POSITION, RATE, VELOCITY
from pairsim.quantities.text import in_unit, with_name
from pairsim.questions.train import OF_A_ROW, SENTENCES, SPECTRUM, TRAIN, TrainCase, work
from pairsim.questions.train.row import LEAST, first_gaps, follow
from pairsim.record.run_entries import SIZE
from pairsim.runtime.errors import BranchEnd, MeshFailure, NoSteadyState
from pairsim.runtime.message import Message, Text
from pairsim.runtime.monitor import Monitor
from pairsim.solvers.curves.branch import Branch
from pairsim.solvers.goals import U
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.problems import SteadyProblem
from pairsim.solvers.steady.ends import arrived
from pairsim.solvers.steady.first_solution import first_scene
from pairsim.solvers.trains.train import Train, on_meshes, transition

FAST = 0.3  # rate times t_relax from which on an answer says that beads move while they remember; chosen
TUBES = "tube", "tube_least", "tube_most"
CHANGES = {"orders": (1 / 10, "of 20 % becomes one of 2 %"), "clusters": (10.0, "of 2 % becomes one of 20 %")}


def computation(case: TrainCase, monitor: Monitor) -> events.Events:
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
    row = _row(found, slope)
    names = TRAIN.named(1)
    yield events.Table("train", names)
    yield events.Row("train", dict.fromkeys(names) | row)  # the result that is waited for
    waves = [wave._asdict() for wave in found.spectrum.of_cell]
    yield events.Table("spectrum", SPECTRUM.named(1), waves)
    sentences = list(_said(case, row, slope))  # to which those of a row are added
    warnings = list[Text](_warnings(case, found))
    yield events.Summary({SIZE: found.unknowns, SENTENCES: sentences}, warnings)
    if (gaps := first_gaps(case, found.d)).size:
        sentences += yield from follow(case, problem, start, gaps, found, done, sum(work.MESHES[refined:]))
    if case.focus:
        warnings += yield from _off_axis(case, problem, start, sorted({found.d, *gaps.tolist()}))
    return events.Outcome("finished", "end", f"verdict: {verdict}")


def _off_axis(
    case: TrainCase, problem: SteadyProblem, alone: Parameters, distances: Sequence[float]
) -> Generator[events.Event, None, list[Text]]:
    """Rates off the axis of short rows with the least and the largest of some distances, ascending; returns warnings.

    Those of an infinite train are not computed: what neighbours of neighbours do is small.
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


def _row(found: Train, slope: float) -> dict[str, Any]:
    """The row of train.csv; with the slope of `transition` there has an error of its distance."""
    spectrum = found.spectrum
    row = vars(found) | spectrum.fastest._asdict() | {"verdict": spectrum.verdict}
    row |= {"U_1": found.U, "U_error_1": found.U_error}
    longest = spectrum.everywhere[0]
    row["diffusion"], row["diffusion_error"] = -longest.scaled, longest.scaled_error
    if spectrum.verdict in CHANGES:
        tubes = found.U * np.array(spectrum.time_to(CHANGES[spectrum.verdict][0]))
        row |= dict(zip(TUBES, tubes, strict=True)) if isfinite(tubes[0]) else {}
    if isfinite(slope):
        wave = spectrum.least_stable
        row["d_error"] = (abs(wave.scaled) + abs(wave.scaled_error)) / abs(slope)
    return row


def _said(case: TrainCase, row: Mapping[str, Any], slope: float) -> Iterator[str]:
    """What a row of train.csv says."""
    scales, verdict = case.scales, row["verdict"]
    U = in_unit(scales, VELOCITY, row["U_1"], row["U_error_1"])
    growth, C = (in_unit(scales, RATE, row[name], row[f"{name}_error"]) for name in ("growth", "diffusion"))
    spacing, d = (with_name(scales, LENGTH, row[name]) for name in ("spacing", "d"))
    yield f"Beads {spacing} apart from centre to centre, {d} from surface to surface, move at U = {U}."
    wave = f"a wave of {2 * pi / row['k']:.3g} beads"
    length = row["U_1"] / abs(row["growth"] or nan)
    error = length * (row["growth_error"] / abs(row["growth"] or nan) + row["U_error_1"] / row["U_1"])
    at = f"at {growth}, by a factor e within {with_name(scales, POSITION, length, error)}"
    yield {
        "orders": f"The train orders: disturbances of all wave lengths decay, {wave} fastest: {at}.",
        "clusters": f"The train clusters: {wave} grows fastest: {at}.",
        "neither": "The train neither orders nor clusters: waves travel along it and keep their size.",
        "undecided": f"Whether the train orders is not certain: {wave} has the largest growth rate, {growth}.",
    }[verdict]
    sign = np.sign(row["diffusion"]) if abs(row["diffusion"]) > row["diffusion_error"] else 0
    long = {1: "decay", -1: "grow", 0: "may decay or grow"}[sign]
    yield f"Waves of many beads {long}: at -C k^2 with C = {C}, where k is 2 pi over their number of beads."
    if "tube" in row:
        tube, least, most = (with_name(scales, POSITION, row[name]) for name in TUBES)
        small = "where distances differ little at first, independently of each other"
        yield f"A spread of the distances {CHANGES[verdict][1]} within {tube} of tube ({least} to {most}), {small}."
    if "d_error" in row:
        nearer, farther = ("cluster", "order") if slope < 0 else ("order", "cluster")
        at = in_unit(scales, LENGTH, row["d"], row["d_error"])
        yield f"Trains with distances of less than {at} {nearer}, and those with more {farther}."


def _warnings(case: TrainCase, found: Train) -> list[str]:
    """Warnings of errors larger than wanted, and of beads that move while they remember."""
    warnings, part = (
        [*beyond_checked(case), *coarse_mesh(case, U.name)],
        abs(found.spectrum.rates).max() * found.t_relax,
    )
    if found.error > case.error_wanted and found.spectrum.verdict != "neither":
        off = f"growth rates are within {100 * found.error:.2g} % of the largest"
        warnings.append(f"accuracy: {case.accuracy} was not kept: {off}")
    if part > FAST:
        warnings.append(
            f"disturbances change by a part of {part:.2g} while shapes and stresses relax: the last term of the series "
            "for that is in the errors of the rates; modes that do not follow the distances are not looked for"
        )
    return warnings
