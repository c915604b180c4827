"""Checks that involve several keys of a case: required keys, and combinations that are not allowed."""

from __future__ import annotations

from collections.abc import Iterator

from pairsim.config.case import FREE_ENDS, MOST_OUTPUTS, Case, SceneCase
from pairsim.config.mistakes import Mistake, missing
from pairsim.physics.materials.polymer import PARAMETERS, Name


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
    if case.liquid == "newtonian" and case.De > 0:
        allowed = "must be a viscoelastic law at De > 0; a Newtonian liquid has De: 0"
        yield Mistake("liquid", case.liquid, allowed)
    if case.law is not None:
        yield from _check_law(case, case.law.name)
    fits = True
    for key, count in counts.items():
        value = getattr(case, key)
        if isinstance(value, tuple) and len(value) != max(count, 0):
            what = "gaps" if key == "d0" else "particles"
            allowed = f"must be a number or a list of {max(count, 0)}, one for each of the {what}"
            yield Mistake(key, list(value), allowed)
            fits = False
    if case.length == "auto" and case.ends != "developed":
        yield Mistake("length", "auto", "must be a number with ends: periodic; auto requires ends: developed")
    elif fits and case.n and case.tube_length < case.cluster + 2 * FREE_ENDS:
        least = case.cluster + 2 * FREE_ENDS
        allowed = f"must be at least {least:g}: {case.cluster:g} for the particles and {FREE_ENDS:g} at each end"
        yield Mistake("length", case.tube_length, allowed)


def _check_law(case: SceneCase, law: Name) -> Iterator[Mistake]:
    """Find parameters of another constitutive law, and missing ones of this law."""
    if case.xi == 0:
        yield Mistake("xi", case.xi, "must be above 0 in a viscoelastic liquid")
    for key, laws in PARAMETERS.items():
        value = getattr(case, key)
        if value is not None and law not in laws:
            allowed = f"must be left out: {key} is a parameter of {' and '.join(laws)}, but the liquid is {law}"
            yield Mistake(key, value, allowed)
        if value is None and law in laws and key != "alpha":
            yield missing(key, f"must be given with liquid: {law}")


def check_together(case: Case) -> Iterator[Mistake]:
    """Check the keys of a run against each other; yields mistakes as `check_scene` does."""
    yield from check_scene(case, {"d0": case.n - 1})
    end, every = case.time.end, case.output.every
    if case.time.first_step > end:
        yield Mistake("time.first_step", case.time.first_step, f"must be at most time.end = {end:g}")
    if case.time.max_step < case.time.first_step:
        allowed = f"must be at least time.first_step = {case.time.first_step:g}"
        yield Mistake("time.max_step", case.time.max_step, allowed)
    if case.time.fixed_step is not None and case.time.fixed_step > end:
        yield Mistake("time.fixed_step", case.time.fixed_step, f"must be at most time.end = {end:g}")
    if every is not None and end / every > MOST_OUTPUTS:
        yield Mistake(
            "output.every", every, f"must be at least {end / MOST_OUTPUTS:g}, which gives {MOST_OUTPUTS} outputs"
        )
    if late := [t for t in case.output.times if t > end]:
        yield Mistake("output.times", late[0], f"must be at most time.end = {end:g}")
    limits = case.limits
    if limits.max_gap is not None and case.gaps and limits.max_gap <= max(case.gaps):
        yield Mistake("limits.max_gap", limits.max_gap, f"must be above the initial distance {max(case.gaps):g}")
    if case.gaps and limits.min_gap >= min(case.gaps):
        yield Mistake("limits.min_gap", limits.min_gap, f"must be below the initial distance {min(case.gaps):g}")
