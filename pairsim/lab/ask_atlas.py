"""Answers for a pair of an experiment, read from an atlas: `ask`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from pairsim.analysis.master_curve import Curve
from pairsim.atlas.atlas import SHIPPED, Atlas
from pairsim.cases.case import SceneCase
from pairsim.cases.coverage import beyond, is_of_its_law, liquid_of_atlas
from pairsim.cases.inputs import units_of
from pairsim.cases.keys import keys_of
from pairsim.cases.physical import BLOCK
from pairsim.cases.physical_keys import Physical
from pairsim.cases.spread import SpreadCase
from pairsim.computing.loading import AnyCase
from pairsim.computing.result_content import Content
from pairsim.computing.spread_entry import spread_entry
from pairsim.computing.warnings import MOST_DE, beyond_checked
from pairsim.lab.atlas_curve import curve_of_atlas
from pairsim.lab.case_of_experiment import case_of_experiment
from pairsim.lab.focusing_at_once import first_order_focusing
from pairsim.lab.inertia import Inertia
from pairsim.lab.input_draws import range_of_draws
from pairsim.lab.load import load
from pairsim.physics.softest import beyond_steady_shapes, beyond_tension
from pairsim.quantities.kinds import LENGTH, VELOCITY
from pairsim.quantities.text import in_unit
from pairsim.questions.compute import Computation
from pairsim.questions.registry import QUESTIONS
from pairsim.record.columns import DISTANCE, DU, DU_ERROR
from pairsim.record.record import Record
from pairsim.record.run_entries import DRAWN, NOTES, STATUS, WARNINGS
from pairsim.runtime.errors import InputError

SOURCE = "pairsim ask"
POINTS = 9  # distances given to a curve that is computed; it adds others


def ask(
    case: AnyCase | None = None,
    *,
    atlas: Path | str | None = None,
    compute: bool = False,
    folder: Path | str | None = None,
    progress: bool = False,
    **given: Any,
) -> Any:
    """Say at once what a pair of beads does, from an atlas of master curves.

    The beads may differ in size and modulus, by no more than the ratios of the atlas.

    Args:
        case: A case, as for `load`; or else the quantities of an experiment are `given`.
        atlas: File of an atlas, the atlas.npz of `pairsim atlas`; None: the atlases that ship, of which the one for the
            law of the liquid answers.
        compute: Compute the curve where the atlas has no answer.
        folder: Folder of this curve; None: a temporary one.
        progress: Whether to show the progress of its computation.
        given: As for `units`: `tube="50um"`, `particle="20um"`, `flow_rate="1ul/min"`, and others; or keys of a case,
            which replace those of `case`.

    Returns:
        A curve, as from `pairsim.curve`, with `findings()`, `dU(d)` and `travel(start, stop)`. The effect of
        half-widths of quantities, such as `modulus="1.5 +- 0.3 kPa"`, is computed by Monte Carlo on the atlas:
        `record["dU_inputs"]` has the ends, `least` and `largest` [um/s], of the range that holds dU for 95 % of the
        draws at distances `d` [D_c], and the fraction of draws `outside` of the atlas.

    Raises:
        InputError: A quantity is wrong; or the atlas has no answer, and the curve is not to be computed.

    Example:
        >>> beads = dict(tube="50um", particle="20um", flow_rate="1ul/min", viscosity="1Pa.s", modulus="5kPa")
        >>> print(*pairsim.ask(**beads).findings())
    """
    question, atlases = QUESTIONS["curve"], _atlases(atlas)
    asked = _case_of(atlases[0], case, **given)
    chosen, reasons, others = _of_its_law(asked, atlases, unequal=True)
    if reasons:
        if not compute:
            cost = f"pairsim curve computes it ({question.estimate(asked)}), and `compute` does that here"
            doubts = "".join(f"; {each}" for each in _doubts(asked))
            raise InputError(SOURCE, "", None, f"the atlas has no answer: {', and '.join(reasons)}; {cost}{doubts}")
        return Computation[Any](question, answers=False)(asked, folder=folder, progress=progress)
    curve = _curve_of(asked, chosen)
    warnings = [*_disagreements(asked, curve, others), *_inertia(asked)]
    record = Record.of({STATUS: "finished", WARNINGS: warnings}) | units_of(asked)
    notes = [f"The liquid of the atlas is {liquid_of_atlas(chosen, type(asked))}."] if asked.De else []
    if asked.De and asked.liquid is None:
        taken = asked.liquid_model.modes[0].label
        fit = "pairsim units --rheology FILE fits one to a flow curve"
        notes.append(f"No law of the liquid is given, so {taken} is assumed: {fit}.")
    notes += [f"On the axis, {said}." for said in first_order_focusing(asked, asked.reynolds_number)]
    if notes:
        record = record.with_entries({NOTES: notes})
    record = record.with_entries(spread_entry(asked))
    if any(each.half_width for each in record.inputs):
        record = record.with_entries({DRAWN: vars(range_of_draws(asked, chosen))})
    content = Content({"curve": curve.table, "equilibria": curve.equilibria}, record, asked)
    result = question.result(question, content=content, source=SOURCE)
    result.curve = curve.named(SOURCE, record)  # its interpolant has been made already
    return result


def _curve_of(case: SceneCase, atlas: Atlas) -> Curve:
    """The curve of an atlas for a case of a pair in its box."""
    of_moduli = isinstance(case, SpreadCase) and bool(case.spread.modulus)
    return curve_of_atlas(atlas, beta=case.betas, De=case.De, Ca_e=case.Ca_es, stiffness=of_moduli)


def asked_of(
    case: AnyCase | None = None, *, atlas: Path | str | None = None, **given: Any
) -> tuple[Atlas, SceneCase, list[str]]:
    """The atlas that answers, the case of the pair's curve over its distances, and the reasons why it has no answer.

    The reasons are empty where it has one. Arguments are those of `ask`.

    Raises:
        InputError: A quantity or the file is wrong.
    """
    atlases = _atlases(atlas)
    found = _case_of(atlases[0], case, **given)
    chosen, reasons, _ = _of_its_law(found, atlases)
    return chosen, found, reasons


def _atlases(file: Path | str | None) -> list[Atlas]:
    return [Atlas.load(Path(each)) for each in ([file] if file else SHIPPED)]


def _of_its_law(
    case: SceneCase, atlases: Sequence[Atlas], *, unequal: bool = False
) -> tuple[Atlas, list[str], list[Atlas]]:
    """Choose the atlas for the law of the liquid.

    At De = 0 an atlas of viscoelastic liquids has answers, too, but most of its curves are elsewhere.

    Args:
        case: The case of a curve of a pair.
        atlases: At least one.
        unequal: Whether the beads may differ.

    Returns:
        The atlas, the reasons why it has no answer (empty if it has one), and the others that have an answer, too.
    """
    answers = [(atlas, beyond(case, atlas, unequal=unequal)) for atlas in atlases]
    chosen, reasons = min(answers, key=lambda each: (bool(each[1]), not is_of_its_law(case, each[0]), len(each[1])))
    return chosen, reasons, [atlas for atlas, why in answers if atlas is not chosen and not why]


def _doubts(case: SceneCase) -> Iterator[str]:
    """Reasons why the computation of a case may not find the answer."""
    if beyond_checked(case):
        yield f"above De = {MOST_DE:g} dU was not compared with finer meshes, and there may be no steady state"
    yield from beyond_steady_shapes(case.betas, case.Ca_es)
    yield from beyond_tension(case.liquid_model, case.betas, case.Ca_es)


def _inertia(case: SceneCase) -> Iterator[str]:
    """Warnings that inertia may matter; none where the density of the liquid is not known."""
    if (Re := case.reynolds_number) is not None and not (inertia := Inertia.of(case, Re)).is_negligible:
        for text in inertia.warnings:
            yield f"{text} ({inertia.sentence.partition(': ')[2]})"


def _disagreements(case: SceneCase, curve: Curve, others: Sequence[Atlas]) -> list[str]:
    """Sentences on other atlases whose dU differs from that of the curve by more than the sum of both half-widths."""
    found, (d, ours, error_of_ours) = [], (curve.table[each] for each in (DISTANCE, DU, DU_ERROR))
    for other in others:
        theirs = _curve_of(case, other).of()
        shared = (d >= theirs.d[0]) & (d <= theirs.d[-1])
        values, half_widths = (
            np.where(shared, each(np.clip(d, *theirs.ends)), np.nan) for each in (theirs.values, theirs.half_widths)
        )
        apart = np.abs(values - ours) - half_widths - error_of_ours
        if not np.any(apart > 0):
            continue
        at = int(np.nanargmax(apart))
        one, two = (
            in_unit(case.scales, VELOCITY, float(dU[at]), float(error[at]), "+")
            for dU, error in ((ours, error_of_ours), (values, half_widths))
        )
        place = in_unit(case.scales, LENGTH, float(d[at]))
        found.append(
            f"two atlases disagree: at d = {place} that of the law of the liquid, from which this answer is, has "
            f"dU = {one}, another one {two}; pairsim curve shows which is right"
        )
    return found


def _case_of(atlas: Atlas, case: AnyCase | None, **given: Any) -> SceneCase:
    """The validated case of a pair's curve over the distances of an atlas; other arguments are those of `ask`.

    Raises:
        InputError: A quantity is wrong, the case is not that of a pair, or it has a key that matters but that curves do
            not have.
    """
    ends = {"ends": "developed", "length": "auto"}
    more = {"d": dict(zip(("start", "stop"), atlas.box["d"], strict=True), num=POINTS)}
    if case is None and given and not given.keys() & {BLOCK, *Physical.model_fields}:
        case = {}  # all of its keys are in `given`
    if case is None:
        found = case_of_experiment(kind="curve", **{**ends, **given, **more}).case
    else:
        loaded = _loaded(case, **given)
        if loaded.n != 2:
            raise InputError(SOURCE, "", None, f"must be the case of a pair, not one of pairsim {loaded.kind}")
        keys, of_curve = loaded.model_dump(mode="json", exclude_unset=True), QUESTIONS["curve"].model.model_fields
        block = {key: value for key, value in keys.pop("physical", {}).items() if key not in ("distance", "end")}
        declared = keys_of(type(loaded))
        for key in keys.keys() - of_curve.keys():  # where and when a run begins and ends does not matter
            if declared[key].of_problem and getattr(loaded, key) != declared[key].default:
                raise InputError(SOURCE, key, keys[key], "must be left out: atlases do not cover it")
        known = {key: value for key, value in keys.items() if key in of_curve}
        found = load({**ends, **known, **more, **({"physical": block} if block else {})}, kind="curve")
    if found.n != 2:
        raise InputError(SOURCE, "particles", found.n, "must be 2: an atlas answers for pairs")
    return found


def _loaded(case: AnyCase, **given: Any) -> SceneCase:
    """A case; with quantities alone it may be of a run or, where it has several distances, of a curve."""
    try:
        return load(case, **given)
    except InputError as error:
        with suppress(InputError):
            return load(case, kind="curve", **given)
        raise error
