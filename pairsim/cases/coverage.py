"""Which cases an atlas can answer: those in its box that have the same physics."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

from pairsim.atlas.atlas import PARAMETERS, Atlas
from pairsim.cases.case import SceneCase
from pairsim.cases.differences import differ
from pairsim.cases.identity import identity_of
from pairsim.cases.keys import Part, keys_of

OF_BOX = {"De", "time", "weight"}  # numbers that descriptions of a liquid leave out: De is a parameter of the box
SAME = 1e-9  # relative difference of parameters up to which it is due to rounding


def beyond(case: SceneCase, atlas: Atlas, *, unequal: bool = False) -> list[str]:
    """The reasons, in words, why an atlas has no answer for the curve of a pair; empty if it has one.

    Args:
        case: The case of the curve.
        atlas: The atlas.
        unequal: Whether the beads may differ, provided that the atlas has such pairs.
    """
    numbers = {"beta": max(case.betas), "De": case.De, "Ca_e": max(case.Ca_es)}
    theirs = case_of(atlas, type(case), numbers)
    of_unequal = atlas.of_unequal if unequal and differ(case) else None
    found = ["the beads differ"] if differ(case) and of_unequal is None else []
    found += [*_other_liquid(case, theirs), *_other_solids(case, theirs), *_other_keys(case, theirs)]
    same = case.liquid_model.structure == theirs.liquid_model.structure
    if of_unequal is not None:
        return found + of_unequal.outside(case.betas, case.De if same else atlas.box["De"][0], case.Ca_es)
    if not same:
        del numbers["De"]  # which belongs to another liquid, or to none
    return found + atlas.outside(**numbers)


def is_of_its_law(case: SceneCase, atlas: Atlas) -> bool:
    """Whether an atlas has the law of the liquid of a case at all of its De, and not only at De = 0."""
    return case.liquid_model.structure == _far_corner(atlas, type(case)).liquid_model.structure


def liquid_of_atlas(atlas: Atlas, model: type[SceneCase]) -> str:
    """The liquid of an atlas in words, such as Giesekus with xi = 0.09 and alpha = 0.2."""
    liquid = _far_corner(atlas, model).liquid_model
    names = {name: f"{value:g}" for name, value in liquid.numbers.items() if name.rpartition(".")[2] not in OF_BOX}
    many = len(liquid.modes) > 1
    said = [f"{name if many else name.rpartition('.')[2]} = {value}" for name, value in names.items()]
    return liquid.label + (f" with {' and '.join(said)}" if said else "")


def case_of[C: SceneCase](atlas: Atlas, model: type[C], numbers: Mapping[str, float]) -> C:
    """The case of a curve of an atlas, at the place in its box that is the nearest one to these beta, De and Ca_e."""
    inside = {name: float(min(max(numbers[name], atlas.box[name][0]), atlas.box[name][1])) for name in PARAMETERS}
    return model.model_validate({**atlas.provenance["case"], **inside, "d": list(atlas.box["d"])})


def _far_corner[C: SceneCase](atlas: Atlas, model: type[C]) -> C:
    """The case in the corner of the box of an atlas at which beta, De and Ca_e are the largest."""
    return case_of(atlas, model, {name: atlas.box[name][1] for name in PARAMETERS})


def _other_liquid(case: SceneCase, theirs: SceneCase) -> Iterator[str]:
    """Yield in which law or parameters the liquids differ, apart from De, a parameter of the box."""
    one, other = case.liquid_model, theirs.liquid_model
    if one.structure != other.structure:
        yield f"the liquid is {one.label}, that of the atlas {other.label}"
        return
    yield from _other_numbers(
        {name: value for name, value in one.numbers.items() if name != "De"}, other.numbers, many=len(one.modes) > 1
    )


def _other_solids(case: SceneCase, theirs: SceneCase) -> Iterator[str]:
    """Yield in which law or parameters the beads differ, apart from Ca_e, a parameter of the box."""
    other, found = theirs.solid_models[0], list[str]()
    for one in case.solid_models:
        if one is None or other is None:  # rigid ones have no law
            continue
        if one.name != other.name:
            found.append(f"the beads are {one.label}, those of the atlas {other.label}")
        else:
            found += _other_numbers({**one.numbers, "Ca_e": other.Ca_e}, other.numbers)
    yield from dict.fromkeys(found)


def _other_numbers(one: Mapping[str, float], other: Mapping[str, float], many: bool = False) -> Iterator[str]:
    """Yield the parameters that differ; names are given without their law unless there are `many` modes."""
    for name, value in one.items():
        if not math.isclose(value, other[name], rel_tol=SAME):
            yield f"{name if many else name.rpartition('.')[2]} = {value:g}, but {other[name]:g} in the atlas"


def _other_keys(case: SceneCase, theirs: SceneCase) -> Iterator[str]:
    """Yield which other keys of the problem have other values; laws and their parameters are compared elsewhere."""
    one, other = identity_of(case), identity_of(theirs)
    for name, key in keys_of(type(case)).items():
        if key.part is Part.PROBLEM and "." not in name and name not in PARAMETERS and one.get(name) != other.get(name):
            ours, others = (_shown(each.get(name, key.default)) for each in (one, other))
            yield f"{name} is {ours}, but {others} in the atlas"


def _shown(value: Any) -> str:
    return "not given" if value is None else f"{value:g}" if isinstance(value, float) else str(value)
