"""What a pair of an experiment does, read from an atlas: `ask`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from pairsim.api.cases import AnyCase, load
from pairsim.api.compute import Computation
from pairsim.api.units import units
from pairsim.atlas.atlas import PARAMETERS, SHIPPED, Atlas
from pairsim.cases.case import SceneCase
from pairsim.cases.inputs import drawn, units_of
from pairsim.computing import QUESTIONS
from pairsim.results.curve_table import zeros_of
from pairsim.results.units import LENGTH, VELOCITY
from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import InputError

SOURCE = "pairsim ask"
POINTS = 9  # asked for of a curve that is computed, which adds others
DRAWS = 2000  # of the inputs, for the part that they have in intervals: to 2 % of it
SAME_PHYSICS = "liquid_model", "driven", "length", "ends", "after"


def ask(
    case: AnyCase | None = None,
    *,
    atlas: Path | str | None = None,
    compute: bool = False,
    folder: Path | str | None = None,
    progress: bool = False,
    **given: Any,
) -> Any:
    """What a pair of equal beads does, from an atlas of master curves and so at once.

    Args:
        case: A case, as for `load`; or else the quantities of an experiment are `given`.
        atlas: File of an atlas, atlas.npz of `pairsim atlas`; None: those that ship.
        compute: Compute the curve where the atlas has no answer.
        folder: Folder of this curve; None: a temporary one.
        progress: Whether its progress is shown.
        given: As for `units`: `tube="50um"`, `particle="20um"`, `flow_rate="1ul/min"`, and others; or keys to replace.

    Returns:
        A curve, as of `pairsim.curve`, with `findings()`, `dU(d)` and `travel(start, stop)`. Half-widths of quantities
        such as `modulus="1.5 +- 0.3 kPa"` have their own part in the answer, by Monte Carlo on the atlas:
        `record["dU_inputs"]` [um/s], at the distances of its table.

    Raises:
        InputError: A quantity is wrong; or the atlas has no answer, and the curve is not to be computed.

    Example:
        >>> beads = dict(tube="50um", particle="20um", flow_rate="1ul/min", viscosity="1Pa.s", modulus="5kPa")
        >>> print(*pairsim.ask(**beads).findings())
    """
    question, (book, asked, reasons) = QUESTIONS["curve"], asked_of(case, given, atlas)
    if reasons:
        if not compute:
            cost = f"pairsim curve computes it ({question.estimate(asked)}), and --compute does that here"
            raise InputError(SOURCE, "", None, f"the atlas has no answer: {' and '.join(reasons)}; {cost}")
        return Computation[Any](question, "Compute.")(asked, folder=folder, progress=progress)
    table = book.table(asked.betas[0], asked.De, asked.Ca_es[0])
    record = {"status": "finished", **units_of(asked)}
    if any(each["half_width"] for each in record.get("inputs", ())):
        record["dU_inputs"] = _spread(asked, book)
    return question.result.of_tables({"curve": table, "equilibria": zeros_of(table)}, record, SOURCE)


def asked_of(
    case: AnyCase | None, given: Mapping[str, Any], file: Path | str | None
) -> tuple[Atlas, SceneCase, list[str]]:
    """The atlas that answers, the checked case of a curve of a pair over its distances, and why it has no answer.

    Arguments are those of `ask`. Of the atlases that ship, it is the one whose intervals are the narrowest.

    Raises:
        InputError: A quantity or the file is wrong.
    """
    atlases = [Atlas.load(Path(each)) for each in ([file] if file else SHIPPED)]
    ends = {"ends": "developed", "length": "auto"}
    more = {"d": dict(zip(("start", "stop"), atlases[0].box["d"], strict=True), num=POINTS)}
    if case is None:
        found = units(kind="curve", **{**ends, **given, **more}).case
    else:
        loaded = _loaded(case, given)
        if loaded.n != 2:
            raise InputError(SOURCE, "", None, f"must have a pair: this is a case of pairsim {loaded.kind}")
        keys = loaded.model_dump(mode="json", exclude_unset=True)
        block = {key: value for key, value in keys.pop("physical", {}).items() if key not in ("distance", "end")}
        known = {key: value for key, value in keys.items() if key in QUESTIONS["curve"].model.model_fields}
        found = load({**ends, **known, **more, **({"physical": block} if block else {})}, kind="curve")
    if found.n != 2:
        raise InputError(SOURCE, "particles", found.n, "must be 2: the answers are those of pairs")

    answers = [(atlas, list(_beyond(found, atlas))) for atlas in atlases]

    def rank(answer: tuple[Atlas, list[str]]) -> tuple[int, float]:
        atlas, reasons = answer
        if reasons:  # those of the wider one are named
            return len(reasons), -float(np.ptp(atlas.box["beta"]))
        return 0, float(atlas.table(found.betas[0], found.De, found.Ca_es[0])["dU_error"].mean())

    atlas, reasons = min(answers, key=rank)
    return atlas, found, reasons


def _loaded(case: AnyCase, given: Mapping[str, Any]) -> SceneCase:
    """A case; with quantities alone it may be of a run or, where it has several distances, of a curve."""
    try:
        return load(case, **given)
    except InputError as error:
        with suppress(InputError):
            return load(case, kind="curve", **given)
        raise error


def _beyond(case: SceneCase, atlas: Atlas) -> Iterator[str]:
    """Why an atlas has no answer for a case."""
    numbers = dict(zip(PARAMETERS, (max(case.betas), case.De, max(case.Ca_es)), strict=True))
    theirs = load({**atlas.provenance["case"], **numbers, "d": list(atlas.box["d"])}, kind="curve")
    if len({*case.betas}) > 1 or len({*case.Ca_es}) > 1:
        yield "the beads differ"
    yield from atlas.outside(**numbers)
    if case.solid_models[0] != theirs.solid_models[0]:
        yield "the beads have another law"
    for name in SAME_PHYSICS:
        if getattr(case, name) != getattr(theirs, name):
            yield f"{name.replace('_model', '')} is another one than in the atlas"


def _spread(case: SceneCase, atlas: Atlas) -> Array:
    """Half-widths of dU at the distances of an atlas, constant in units, by those of the inputs [um/s]."""
    scales, numbers = drawn(case, DRAWS)
    assert case.scales is not None
    given = {"beta": case.betas[0], "De": case.De, "Ca_e": case.Ca_es[0]}
    places = np.stack([np.broadcast_to(numbers.get(name, each), DRAWS) for name, each in given.items()], axis=1)
    low, high = np.array([atlas.box[name] for name in PARAMETERS]).T
    inside = ((places >= low) & (places <= high)).all(axis=1)
    dU, x = atlas.velocities(np.clip(places, low, high))[0], np.log(atlas.d)
    shift = np.broadcast_to(np.log(LENGTH.factor(case.scales) / LENGTH.factor(scales)), DRAWS)
    moved = np.array([np.interp(x + by, x, row) for by, row in zip(shift, dU, strict=True)])
    values = moved * np.broadcast_to(VELOCITY.factor(scales), DRAWS)[:, None]
    least, most = np.quantile(values[inside], (0.025, 0.975), axis=0)
    return np.asarray((most - least) / 2 if inside.mean() > 0.95 else np.full_like(x, np.inf))
