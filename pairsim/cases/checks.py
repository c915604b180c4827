"""Checks that involve several keys of a case: required keys, and what keys and questions demand of others."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from operator import attrgetter

from pydantic import BaseModel

from pairsim.cases.case import SceneCase
from pairsim.cases.keys import Key, keys_of
from pairsim.cases.material_keys import written
from pairsim.cases.mistakes import Mistake, missing
from pairsim.cases.physical import BLOCK, EXPERIMENT
from pairsim.cases.values import is_finite
from pairsim.cases.yaml_file import Content


def missing_numbers(model: type[SceneCase], data: Content, origins: Mapping[str, str]) -> Iterator[Mistake]:
    """Yield a mistake for each number of the particles or gaps that a case lacks; it need not be validated yet.

    Numbers that follow from physical quantities (`origins`) are checked elsewhere.
    """
    n = data.get("particles", model.model_fields["particles"].default)
    for name, key in keys_of(model).items() if is_finite(n) else ():
        count = key.count(n) if key.required and key.count is not None else 0
        if count > 0 and data.get(name) is None and name not in origins:
            several = f" or a list of {count}" if count > 1 else ""
            of = [f", or follow from {BLOCK}.{each.key}" for each in EXPERIMENT if name in each.gives]
            yield missing(name, f"must be a number{several}{of[0] if BLOCK in data else ''}")


def mistakes_in[C: SceneCase](case: C, check: Callable[[C], Iterable[Mistake]]) -> list[Mistake]:
    """The mistakes between the keys of a case, each of which is valid by itself.

    If a key on which others depend is wrong, such as the number of particles, the others are not checked.

    Args:
        case: The case.
        check: Yields the mistakes that its question finds in keys that other kinds of cases have, too.
    """
    of_question = list(check(case))
    if any(mistake.key == "particles" for mistake in of_question):
        return of_question
    keys = keys_of(type(case)).values()
    wrong = [mistake for key in keys for mistake in _wrong_count(key, case)]
    wrong = wrong or [mistake for key in keys if key.first for mistake in asked_by(key, case)]
    wrong = wrong or [mistake for key in keys if not key.first for mistake in asked_by(key, case)]
    return wrong + of_question


def _wrong_count(key: Key, case: SceneCase) -> Iterator[Mistake]:
    """Yield a mistake if the list of a key does not have one value for each particle or gap."""
    value = None if key.count is None else getattr(case, key.name)
    if key.count is None or not isinstance(value, tuple) or len(value) == (count := key.count(case.n)):
        return
    of_laws = any(isinstance(each, BaseModel) for each in value)
    given = [written(each) if isinstance(each, BaseModel) else each for each in value]
    one = "a law" if of_laws else "a number"
    yield Mistake(key.name, given, f"must be {one} or a list of {count}, one for each of the {key.count.of}")


def asked_by(key: Key, case: SceneCase) -> Iterator[Mistake]:
    """Yield the mistakes that the check of a key finds in a case (`Key.check`)."""
    found = key.check(case) if key.check is not None else ()
    if not isinstance(found, str):
        yield from found
    elif found:
        yield Mistake(key.name, attrgetter(key.name)(case), found)
