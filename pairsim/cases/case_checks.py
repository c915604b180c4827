"""Checks that involve several keys of a case: required keys, and combinations that are not allowed."""

from __future__ import annotations

from collections.abc import Iterator
from math import inf

from pairsim.cases.case import FREE_ENDS, Case, SceneCase
from pairsim.cases.groups import MOST_OUTPUTS
from pairsim.cases.materials import declared_in, is_viscous, liquid_block
from pairsim.cases.mistakes import Mistake, broken, missing


def check_scene(case: SceneCase, counts: dict[str, int]) -> Iterator[Mistake]:
    """Check the keys that run, curve and critical share against each other.

    Args:
        case: The case, each key of which is valid on its own.
        counts: For each key that takes one value for every particle or gap, the number of values.

    Yields:
        A mistake for each inconsistent key. If required keys are missing, only these.
    """
    counts = {"beta": case.n, "Ca_e": case.n, **counts}
    absent = [
        missing(key, "must be a number" + (f" or a list of {count}" if count > 1 else ""))
        for key, count in counts.items()
        if count > 0 and getattr(case, key) is None
    ]
    if absent:  # the other checks need them
        yield from absent
        return
    fits = True
    for key, count in {**counts, "solid": case.n}.items():
        value = getattr(case, key)
        if isinstance(value, tuple) and len(value) != max(count, 0):
            what, one = "gaps" if key == "d0" else "particles", "a law" if key == "solid" else "a number"
            allowed = f"must be {one} or a list of {max(count, 0)}, one for each of the {what}"
            yield Mistake(key, list(value), allowed)
            fits = False
    if mistakes := list(_check_laws(case)):
        yield from mistakes
        return  # without them there is no liquid
    if case.length == "auto" and case.ends != "developed":
        yield Mistake("length", "auto", "must be a number with ends: periodic; auto requires ends: developed")
    elif fits and case.n and case.tube_length < case.cluster + 2 * FREE_ENDS:
        least = case.cluster + 2 * FREE_ENDS
        allowed = f"must be at least {least:g}: {case.cluster:g} for the particles and {FREE_ENDS:g} at each end"
        yield Mistake("length", case.tube_length, allowed)


def _check_laws(case: SceneCase) -> Iterator[Mistake]:
    """Find missing parameters of laws, and laws that do not go with De."""
    keys, block = dict(case), liquid_block(dict(case))
    law = block["law"]
    if is_viscous(keys):
        if case.De > 0:
            yield Mistake(
                "liquid", law, "has no memory: leave out De (or physical.relaxation), or name a viscoelastic law"
            )
    elif case.De == 0:
        if case.liquid is not None and "De" not in case.model_fields_set:
            yield missing("De", f"must be given with liquid: {law}")
        elif "solvent" in block:
            yield Mistake("De", case.De, "must be above 0 with a liquid.solvent; a liquid without elasticity has none")
    elif case.xi == 0:
        yield Mistake("xi", case.xi, "must be above 0 in a viscoelastic liquid")
    idle = not case.De and not is_viscous(keys)  # the parameters of the liquid, which are noted
    for declared in declared_in(keys):
        if idle and not declared.key.startswith("solid"):
            continue
        if declared.parameter.default is None and declared.value is None:
            place, _, name = declared.key.rpartition(".")
            yield missing(declared.key, f"must be given with {place}: {{law: {declared.law}, {name}: ...}}")


def check_together(case: Case) -> Iterator[Mistake]:
    """Check the keys of a run against each other; yields mistakes as `check_scene` does."""
    yield from check_scene(case, {"d0": case.n - 1})
    time, output, limits, end = case.time, case.output, case.limits, case.time.end
    widest, narrowest = max(case.gaps, default=-inf), min(case.gaps, default=inf)
    in_time = f"must be at most time.end = {end:g}"
    outputs = f"must be at least {end / MOST_OUTPUTS:g}, which gives {MOST_OUTPUTS} outputs"
    yield from (Mistake("output.times", t, in_time) for t in [t for t in output.times if t > end][:1])
    yield from broken(
        case,
        ("time.first_step", time.first_step > end, in_time),
        ("time.max_step", time.max_step < time.first_step, f"must be at least time.first_step = {time.first_step:g}"),
        ("time.fixed_step", (time.fixed_step or 0.0) > end, in_time),
        ("output.every", (output.every or inf) < end / MOST_OUTPUTS, outputs),
        ("limits.max_gap", (limits.max_gap or inf) <= widest, f"must be above the initial distance {widest:g}"),
        ("limits.min_gap", limits.min_gap >= narrowest, f"must be below the initial distance {narrowest:g}"),
    )
