"""Conversion of the physical quantities of a case into numbers before validation, and removal of these numbers again.

The latter is needed when a case of a folder of results is changed.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Collection
from contextlib import suppress
from typing import Any, NamedTuple, cast

from pairsim.cases import kinds_of_cases as kinds
from pairsim.cases.experiment import Experiment, follows_in, group_of, one
from pairsim.cases.keys import Keys, keys_of
from pairsim.cases.laws import Laws
from pairsim.cases.mistakes import Mistake
from pairsim.cases.physical import BLOCK, QUANTITIES
from pairsim.cases.quantity_text import A_LENGTH, rounded, si
from pairsim.cases.unit_registry import has_unit
from pairsim.cases.values import is_finite
from pairsim.cases.yaml_file import Content, within
from pairsim.quantities.kinds import LENGTH
from pairsim.runtime.plain import Plain

SAME = 1e-9  # relative tolerance at which two numbers count as equal


class InNumbers(NamedTuple):
    """A case in which quantities have been converted into numbers, and the mistakes in its `physical` block.

    `origins` maps the dotted key of each converted number to the quantity from which it follows, right or wrong.
    `experiment` is None without a block.
    """

    data: dict[str, Plain]
    experiment: Experiment | None
    origins: dict[str, str]
    mistakes: list[Mistake]

    def named(self, mistake: Mistake) -> Mistake:
        """A mistake in a number as one in the quantity from which the number follows; other mistakes are unchanged."""
        origin = self.origins.get(mistake.key) or self.origins.get(mistake.key.partition("[")[0])
        if origin is None or mistake.value is None or self.experiment is None:
            return mistake
        given = self.experiment.given
        where = f"in a tube of {given['tube']} " if QUANTITIES[origin].kind == LENGTH else ""
        number = f"{where}this is {mistake.key} = {_shown(mistake.value)}"
        remarks = [f"; {each}" for each in self.experiment.remarks]
        return Mistake(f"{BLOCK}.{origin}", given[origin], f"{number}; {mistake.allowed}{''.join(remarks)}")


def in_numbers(given: Content, model: type[Keys]) -> InNumbers:
    """A copy of a case, with the numbers that follow from its `physical` block, and with lengths in lists converted.

    Args:
        given: The case as written, which need not be valid.
        model: The keys of this kind of case; a quantity that gives any other key is a mistake.
    """
    data, origins = copy.deepcopy(dict(given)), dict[str, str]()
    fields, keys = model.model_fields, keys_of(model)
    experiment = Experiment.in_case(given, keys["particles"].default)
    if experiment is None:
        return InNumbers(data, None, origins, [])
    mistakes, numbers = list(experiment.mistakes), experiment.numbers
    for each in follows_in(experiment.laws):
        if (quantity := each.quantity.key) not in experiment.given:
            continue
        key = each.key_in(fields)
        if group_of(key) not in fields:
            having = " and ".join(kinds.with_key(group_of(key)))
            allowed = f"must be left out: cases of this command have no {key}; those of {having} do"
            mistakes.append(Mistake(f"{BLOCK}.{quantity}", None, allowed))
            continue
        try:
            group, last = within(data, key)
        except ValueError:
            continue  # rejected by the validation
        if (own := group.get(last)) is None:
            group[last] = cast("Plain", numbers.get(each.key))
            origins[key] = quantity
        elif each.key in numbers and not _same(own, numbers[each.key]):
            allowed = f"must be left out, or be {_shown(numbers[each.key])}, as given by {BLOCK}.{quantity}"
            mistakes.append(Mistake(key, own, allowed))
    for key in (key.name for key in keys.values() if key.lengths):
        if isinstance(listed := data.get(key), list) and "tube" in experiment.values:
            data[key] = [_number(each, f"{key}[{i}]", experiment, mistakes) for i, each in enumerate(listed)]
    return InNumbers(data, experiment, origins, mistakes)


def given_by(case: Content, fields: Collection[str]) -> list[str]:
    """Which of the dotted keys `fields` follow from quantities in the `physical` block of a case."""
    if (experiment := Experiment.in_case(case)) is None:
        return []
    given = [each for each in follows_in(experiment.laws) if each.quantity.key in experiment.given]
    return [key for each in given if (key := each.key_in(fields)) in fields]


def forget_numbers(data: dict[str, Plain]) -> None:
    """Remove from a case, as read from a folder of results, the numbers computed from its `physical` block.

    They would contradict the block after a change of it. Numbers that differ from those of the block are kept, so that
    the contradiction is reported.
    """
    experiment = Experiment.in_case(data)
    numbers = experiment.numbers if experiment is not None else {}
    for each in follows_in(Laws.in_case(data)):
        for key in each.keys if each.key in numbers else ():
            with suppress(ValueError):  # its group is not a group of keys
                group, last = within(data, key) if group_of(key) in data else ({}, key)
                if last in group and _same(group[last], numbers[each.key]):
                    del group[last]
    if numbers and "De" not in numbers and data.get("De") == 0:
        del data["De"]


def _number(value: Any, place: str, experiment: Experiment, mistakes: list[Mistake]) -> Any:
    """A length as a number of tube diameters, and any other value unchanged; None, and a mistake added, if invalid."""
    if not has_unit(value):
        return value
    try:
        return rounded(si(value, A_LENGTH) / one(experiment.values, "tube"))
    except ValueError as error:
        mistakes.append(Mistake(place, value, f"{error}, or a number of tube diameters"))
        return None


def _same(given: Any, number: Any) -> bool:
    """Whether two numbers, or two lists of numbers, are equal within the relative tolerance `SAME`."""
    if isinstance(given, list | tuple) or isinstance(number, tuple):
        many = [value if isinstance(value, list | tuple) else (value,) for value in (given, number)]
        return len(many[0]) == len(many[1]) and all(_same(a, b) for a, b in zip(*many, strict=True))
    return is_finite(given) and math.isclose(given, number, rel_tol=SAME)


def _shown(number: Any) -> str:
    """A number or a list of numbers as text for a message."""
    if isinstance(number, tuple | list):
        return f"[{', '.join(map(_shown, number))}]"
    return f"{number:.4g}" if is_finite(number) else str(number)
