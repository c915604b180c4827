"""Checks that involve several keys of a case: required keys, and combinations that are not allowed."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from pydantic import BaseModel

from pairsim.cases.case import FREE_ENDS, SceneCase
from pairsim.cases.keys import keys_of
from pairsim.cases.material_keys import written
from pairsim.cases.mistakes import Mistake, missing
from pairsim.cases.physical import BLOCK, EXPERIMENT
from pairsim.cases.values import is_finite
from pairsim.cases.yaml_file import Content


def missing_numbers(model: type[SceneCase], data: Content, origins: Mapping[str, str]) -> Iterator[Mistake]:
    """Yield the numbers of particles and gaps that a case lacks, which need not be validated yet, as mistakes.

    Those that follow from quantities (`origins`) are checked elsewhere.
    """
    n = data.get("particles", model.model_fields["particles"].default)
    for name, key in keys_of(model).items() if is_finite(n) else ():
        count = key.count(n) if key.required and key.count is not None else 0
        if count > 0 and data.get(name) is None and name not in origins:
            several = f" or a list of {count}" if count > 1 else ""
            of = [f", or be given by {BLOCK}.{each.key}" for each in EXPERIMENT if name in each.gives]
            yield missing(name, f"must be a number{several}{of[0] if BLOCK in data else ''}")


def check_scene(case: SceneCase) -> Iterator[Mistake]:
    """Check the keys that run, curve and critical share against each other; yields a mistake for each wrong key."""
    fits = True
    for name, key in keys_of(type(case)).items():
        if key.count is None or not isinstance(value := getattr(case, name), tuple):
            continue
        if len(value) != (count := key.count(case.n)):
            of_laws = any(isinstance(each, BaseModel) for each in value)
            given = [written(each) if isinstance(each, BaseModel) else each for each in value]
            one = "a law" if of_laws else "a number"
            yield Mistake(name, given, f"must be {one} or a list of {count}, one for each of the {key.count.of}")
            fits = False
    yield from _check_law(case)
    if case.length == "auto" and case.ends != "developed":
        yield Mistake("length", "auto", "must be a number with ends: periodic; auto requires ends: developed")
    elif fits and case.n and not case.closed and case.tube_length < case.cluster + 2 * FREE_ENDS:
        least = case.cluster + 2 * FREE_ENDS
        allowed = f"must be at least {least:g}: {case.cluster:g} for the particles and {FREE_ENDS:g} at each end"
        yield Mistake("length", case.tube_length, allowed)


def _check_law(case: SceneCase) -> Iterator[Mistake]:
    """Find laws that do not go with De; yields mistakes."""
    liquid = case.laws.liquid
    named = [name for name, law in (("solvent", liquid.solvent), ("yielding", liquid.yielding)) if law is not None]
    if liquid.is_viscous:
        if case.De > 0:
            yield Mistake(
                "liquid",
                liquid.name,
                "has no memory: leave out De (or physical.relaxation), or name a viscoelastic law",
            )
    elif case.De == 0:
        if case.liquid is not None and "De" not in case.model_fields_set:
            yield missing("De", f"must be given with liquid: {liquid.name}")
        elif named:
            without = f"must be above 0 with a liquid.{named[0]}; a liquid without elasticity has none"
            yield Mistake("De", case.De, without)
    elif case.xi == 0:
        yield Mistake("xi", case.xi, "must be above 0 in a viscoelastic liquid")
    elif liquid.yielding is not None and (why := _not_yielding(case)):
        yield Mistake(liquid.yielding.key, liquid.yielding.name, f"must be left out: {why}")


def _not_yielding(case: SceneCase) -> str:
    """Why the liquid of a case cannot have a yield stress, or not in this question; "" where it can."""
    mode, *others = case.liquid_model.modes
    if others:
        return "the laws of a yield stress are those of the stress of one mode"
    if mode.follows_rate:
        return f"the viscosity of {mode.name} is that of a flow curve, which a yield stress would change"
    return (
        ""
        if case.has_history
        else "below a yield stress no state is steady: use `pairsim run`, or the key after of a curve"
    )
