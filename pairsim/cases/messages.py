"""Translates the errors that pydantic finds in a file into mistakes, named by the keys of the file."""

from __future__ import annotations

import difflib
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from pydantic import BaseModel, ValidationError

from pairsim.cases.allowed import allowed_in
from pairsim.cases.experiment import follows_in
from pairsim.cases.keys import groups_of, keys_of
from pairsim.cases.laws import Laws
from pairsim.cases.material_keys import BLOCKS
from pairsim.cases.mistakes import Mistake, missing
from pairsim.cases.physical import BLOCK
from pairsim.cases.quantity_text import QUANTITY
from pairsim.cases.values import Range
from pairsim.cases.yaml_file import Content
from pairsim.physics import liquids, solids
from pairsim.physics.declared import PARAMETERS
from pairsim.physics.own_laws import OPTION
from pairsim.runtime.text import as_typed

CLOSE = 0.65  # least similarity (difflib) at which a key counts as a misspelling of another
LEFT_OUT = {"inertia": r"inertia|reynolds|^re$", "gravity": r"gravity"}
"""Effects that the model leaves out unless a key adds them (`Key.models`), with patterns of keys that ask for them."""
OTHER_SCENES = r"off_?(axis|set)|eccentric|lateral|channel|wall|square"
"""Pattern of keys that ask for scenes that are not modelled."""
ADAPTED = {
    r"^Value error, ": "",
    r"^Input should be ": "must be ",
    r"^Field required": "must have more values",
    r"a valid dictionary.*": "keys with their values",
    r"a valid number": "a number",
    r"a valid integer": "a whole number",
    r"a valid string": "text",
    r"a valid (tuple|list)": "a list",
    r"^\w+ should have (at (least|most) \d+) items? after validation": r"the number of entries must be \1",
    r"^Input tag .* does not match any of the expected tags: ": "must be one of ",
    r"^Unable to extract tag using discriminator 'law'": "must be the name of a law, or a group with the key law",
}
"""Replacements for phrases in pydantic's messages, by regular expression."""


def mistakes_of(error: ValidationError, model: type[BaseModel], data: Content) -> list[Mistake]:
    """The mistakes in a validation error of pydantic, one for each key of the content of a file."""
    file = _File(model, data)
    problems: dict[str, list[Any]] = {}
    for problem in error.errors(include_url=False, include_context=False):
        problems.setdefault(file.key_of(problem), []).append(problem)
    wrong_inside = {key[: place.start()] for key in problems for place in re.finditer(r"[.\[]", key)}
    return [file.mistake(key, each) for key, each in problems.items() if key not in wrong_inside]


@dataclass(frozen=True)
class _File:
    """A file that pydantic has refused: the model of its keys, and its content."""

    model: type[BaseModel]
    data: Content

    def key_of(self, problem: Any) -> str:
        """The dotted key of a problem, without the names of alternatives that pydantic inserts into its location."""
        key, place = "", problem["loc"]
        inner: Any = self.data
        for i, part in enumerate(place):
            if isinstance(part, int):
                if isinstance(inner, list | tuple) and part < len(inner):
                    key, inner = f"{key}[{part}]", inner[part]
            elif isinstance(inner, Mapping) and part in inner:
                key, inner = f"{key}.{part}" if key else part, inner[part]
            elif problem["type"] == "missing" and i == len(place) - 1:
                key = f"{key}.{part}" if key else part
        return key

    def mistake(self, key: str, problems: list[Any]) -> Mistake:
        """The mistake in a key, from the problems that pydantic found with each of the alternatives that it allows."""
        value, kind = problems[0]["input"], problems[0]["type"]
        known = self._known(key, problems[0])
        if kind == "missing" and isinstance(problems[0]["loc"][-1], str):
            group, _, name = key.rpartition(".")
            law = value.get("law") if group else None
            given = f"must be given with {group}: {{law: {law}, {name}: ...}}" if law else "must be given"
            return missing(key, "; ".join(filter(None, (given, known))))
        if kind == "extra_forbidden":
            return Mistake(key, value, f"unknown key; {self._hint(key, problems[0])}")
        adapted = ", or ".join(dict.fromkeys(_adapted(each["msg"]) for each in problems)).replace(
            ", or must be", ", or"
        )
        allowed = known or adapted
        if isinstance(value, str) and QUANTITY.fullmatch(value):
            stem = re.sub(r"\[\d+\]$|\.(start|stop)$", "", key)
            for each in [each for each in follows_in(Laws.in_case(self.data)) if stem in each.keys][:1]:
                return Mistake(key, value, f"{allowed}; with a unit it is {BLOCK}.{each.quantity.key}")
        if isinstance(value, str) and kind in ("float_type", "int_type") and re.search(r"\d", value):
            allowed += "; numbers are written as 90, 0.4 or 1e-3, without quotes or units"
        if kind == "int_type" and isinstance(value, float):
            allowed += ", without a decimal point"
        if kind == "string_type" and isinstance(value, int | float):
            allowed += ", in quotes if it looks like a number"
        if kind == "union_tag_invalid":
            value, allowed = value["law"], f"{allowed}; {OPTION} FILE adds laws of your own"
        return Mistake(key, value, allowed)

    def _known(self, key: str, problem: Any) -> str:
        """What the schema of a key allows; "" if it has no schema, or if pydantic's own message is as good."""
        group, _, name = key.rpartition(".")
        home, groups = self._home(group, problem["loc"]), groups_of(self.model)
        if home is None or home is Range or name not in home.model_fields:
            return ""
        if problem["type"] in ("value_error", "literal_error"):
            return ""
        if key in groups:
            return f"allowed: a group of {', '.join(groups[key].model_fields)}"
        return f"allowed: {allowed_in(home, name)}"

    def _home(self, group: str, place: Sequence[Any]) -> type[BaseModel] | None:
        """The model in which a problem lies: that of a block, a range, or a group of the file; None if unknown."""
        of = re.sub(r"\[\d+\]$", "", group).rpartition(".")[2]
        if of in BLOCKS:
            return BLOCKS[of].get(place[-2])
        return Range if "range" in place[-2:-1] else groups_of(self.model).get(group)

    def _hint(self, key: str, problem: Any) -> str:
        """What an unknown key may have been meant to be, or which keys are allowed."""
        name = problem["loc"][-1]
        groups, group, value = (
            groups_of(self.model),
            key.removesuffix(name).removesuffix("."),
            as_typed(problem["input"]),
        )
        block, _, last = name.rpartition(".")
        if key in PARAMETERS and "liquid" in self.model.model_fields:
            return self._in_its_law(key, value)
        if block and block in groups and last in groups[block].model_fields:
            return f"write it in its group, as {block}: {{{last}: {value}}}"
        home = self._home(group, problem["loc"]) or self.model
        if home not in groups.values():
            return f"allowed: {', '.join(home.model_fields)}"
        if meant := _similar(name, group, groups):
            return f"did you mean {meant}?"
        if not group and (beyond := self._beyond(name.lower())):
            return beyond
        return f"allowed: {', '.join(home.model_fields)}"

    def _beyond(self, name: str) -> str:
        """What the program models, if an unknown key asks for something that it does not; "" for other keys."""
        modelled = {key.models for key in keys_of(self.model).values()}
        left = [each for each in LEFT_OUT if each not in modelled]
        if not re.search("|".join((OTHER_SCENES, *(LEFT_OUT[each] for each in left))), name):
            return ""
        without = f", without {' and '.join(left)}" if left else ""
        return f"pairsim computes spheres on the axis of a round tube{without} (docs/explanation/limits.md)"

    def _in_its_law(self, key: str, value: str) -> str:
        """How to write a parameter in the block of its law, if it is given outside of it."""
        laws = PARAMETERS[key].laws
        place = "liquid" if laws[0] in liquids.LAWS else "solid" if laws[0] in solids.LAWS else "liquid.yielding"
        named = Laws.in_case(self.data)
        given = [each.name for each in (named.liquid, *named.solids)]
        law = next((law for law in given if law in laws), laws[0])
        block = f"{place}: {{law: {law}, {key}: {value}}}"
        return f"it is a parameter of the law: write {block}, or {place}.{key} in grids and after --set"


def _adapted(text: str) -> str:
    for expression, other in ADAPTED.items():
        text = re.sub(expression, other, text)
    return text


def _similar(name: str, group: str, groups: Mapping[str, type[BaseModel]]) -> str:
    """The known key most similar to an unknown one, preferably from the same group; "" if there is none."""
    leaves: dict[str, str] = {}
    for place in sorted(groups, key=lambda each: (each != group, each == BLOCK)):
        for field in groups[place].model_fields:
            leaves.setdefault(field.lower(), f"{place}.{field}" if place else field)
    close = difflib.get_close_matches(name.lower(), leaves, 2, CLOSE)
    # The quantity of something else, such as bead_viscosity: either key may be meant.
    alike = [each for each in close if "_" in name and each.endswith(name.lower().rpartition("_")[2])]
    return " or ".join(leaves[each] for each in (alike if len(alike) > 1 else close[:1]))
