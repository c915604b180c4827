"""A case of a sweep before validation: the keys and values of the base, with the changes of one entry of the file."""

from __future__ import annotations

import copy
import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, Self

from pairsim.cases.case import SceneCase
from pairsim.cases.conversion import forget_numbers, given_by
from pairsim.cases.keys import groups_of, keys_of
from pairsim.cases.quantity_text import in_one_unit
from pairsim.cases.values import is_finite
from pairsim.cases.yaml_file import apply_settings, flat, merge
from pairsim.computing.case_files import parse_case
from pairsim.computing.question import Question
from pairsim.runtime.plain import Plain
from pairsim.sweeps.files import FILES

SAME = 1e-9  # relative difference up to which two numbers count as equal; chosen


@dataclass(frozen=True)
class Draft:
    """A case as it is written, before it is validated.

    Attributes:
        model: The model of its keys.
        content: Its keys and values, nested.
    """

    model: type[SceneCase]
    content: Mapping[str, Plain]

    @classmethod
    def base(cls, model: type[SceneCase], content: Mapping[str, Plain]) -> Self:
        """The draft of the base of a file, without the dimensionless numbers that follow from physical quantities."""
        found = dict(content)
        forget_numbers(found)
        return cls(model, {}).changed(found)

    def changed(self, changes: Mapping[str, Plain], settings: Sequence[str] = ()) -> Self:
        """A copy with other values for some keys, nested or dotted; settings key=value are applied last.

        Raises:
            InputError: A dotted key goes through a value that is not a group.
        """
        merged = copy.deepcopy(dict(self.content))
        merge(merged, changes, groups_of(self.model))
        apply_settings(merged, tuple(settings), groups_of(self.model))
        return type(self)(self.model, merged)

    @property
    def spelled(self) -> Mapping[str, Plain]:
        """Its values by dotted keys."""
        return flat(self.content)

    def gives(self) -> list[str]:
        """The keys whose values follow from its physical quantities."""
        return list(given_by(self.content, keys_of(self.model)))

    def matches(self, rule: Mapping[str, Plain]) -> bool:
        """Whether all keys of an exclusion have the value given there, or lie between its min and max."""
        values = {**self.content, **self.spelled}
        return all(_fits(values.get(key), wanted) for key, wanted in rule.items())

    def checked(self, question: Question[Any], source: str, entry: str) -> SceneCase:
        """The valid case of a question; messages name the file and the entry.

        Raises:
            InputError: It has mistakes.
        """
        return parse_case(question, self.content, source, entry, FILES)


def _fits(value: Plain, wanted: Plain) -> bool:
    """Whether a value equals that of an exclusion, or lies between its bounds, both inclusive."""
    if isinstance(wanted, dict) and wanted and set(wanted) <= {"min", "max"}:
        low, high = wanted.get("min", -math.inf), wanted.get("max", math.inf)
        return (
            is_finite(value) and isinstance(low, int | float) and isinstance(high, int | float) and low <= value <= high
        )
    if is_finite(value) and is_finite(wanted):
        return math.isclose(value, wanted, rel_tol=SAME)
    if isinstance(value, str) and isinstance(wanted, str):
        with suppress(ValueError):  # they are not quantities, or of different kinds
            (one, other), _ = in_one_unit([value, wanted])
            return math.isclose(one, other, rel_tol=SAME)
    return bool(value == wanted)
