"""The declaration of a key of a case, beside its pydantic field, so that no other file needs to know its name.

    gravity: Annotated[PerParticle[Force], Key("W", caption=10, slug="W", since="0.4")] = Field(0.0, description=...)

Captions, grids, hashes, folder names, messages and atlases read these declarations; see docs/how-to/add-key.md. Which
key a quantity of the `physical` block gives is declared with the quantity (`cases/physical.py`), and the parameters of
a law with the law.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from enum import Enum
from functools import cache
from typing import TYPE_CHECKING, Annotated, Any, Self, TypeVar, get_args

from pydantic import BaseModel, ConfigDict
from pydantic.fields import FieldInfo

from pairsim.cases.values import OneOrMany

if TYPE_CHECKING:
    from pairsim.cases.mistakes import Mistake


class Part(Enum):
    """The part of a computation that a key belongs to."""

    PROBLEM = "the problem, which has one exact answer"
    MATERIAL = "the problem, as a law of the liquid or of the particles, or a number of one"
    START = "where and how a run begins"
    NUMERICS = "how exactly the problem is solved"
    REPORT = "what of the answer is computed and written, up to where, and in which units"


@dataclass(frozen=True)
class Count:
    """The number of values in the list of a key: one for each particle, or for each gap."""

    of: str  # "particles" or "gaps"
    fewer: int  # how many fewer there are than particles

    def __call__(self, particles: int) -> int:
        """The number of values."""
        return max(particles - self.fewer, 0)


PARTICLES = Count("particles", 0)
GAPS = Count("gaps", 1)
NO_PARTICLES = "there are no particles"

T = TypeVar("T")
PerParticle = Annotated[OneOrMany[T], PARTICLES]
"""One value for all particles, or a list with one for each from upstream."""
PerGap = Annotated[OneOrMany[T], GAPS]
"""One value for all gaps, or a list with one for each from upstream."""


@dataclass(frozen=True)
class Key:
    """The declaration of a key of a case, in the `Annotated` type of its field.

    Attributes:
        symbol: Its symbol in captions and on axes (TeX).
        unit: Its unit there (TeX), "" for a pure number.
        part: The part of a computation that it belongs to; None for that of its group. An atlas compares all keys of
            the problem.
        caption: Its position among the keys in captions; 0 if it is not in captions. Captions always name such keys
            if cases differ in them.
        slug: The text before its value in names of folders; "" if they do not contain it.
        required: Whether it must be given if there are particles, or gaps, to which it applies.
        identity: Whether another value of it makes another case, with a hash and a folder of its own; or a function
            that says so for a given case.
        idle: A function that says why it has no effect in a given case, or "" if it has one. A key with one value for
            each particle never has an effect without particles.
        check: A function that says what the key must be in a given case, considering its other keys, or "" if it is
            right; or a function that yields mistakes, if these concern other values. It is called only if lists have
            the right number of values.
        first: Whether other keys are checked only if this check finds nothing, since they depend on this key.
        models: The effect that it adds to the model, such as "gravity". As long as no key adds this effect, messages
            say that the model leaves it out (`cases/messages.py`).
        since: The version that introduced it. It is then part of the hash of a case only if it differs from its
            default, so that older cases keep their hashes.
        lengths: Whether its values, numbers of tube diameters, may be lengths such as "15 um" in a case with a
            `physical` block.
        usual: The value with which `pairsim units` completes a case without it; None for none.
        name: Its name, with that of its group. This attribute and the following ones are taken from its field.
        default: Its default; None if it has none.
        count: The number of values in a list; None for a key with one value for the case.
    """

    symbol: str = ""
    unit: str = ""
    part: Part | None = None
    caption: int = 0
    slug: str = ""
    required: bool = False
    identity: bool | Callable[[Any], bool] = True
    idle: Callable[[Any], str] | None = None
    check: Callable[[Any], str | Iterable[Mistake]] | None = None
    first: bool = False
    models: str = ""
    since: str = ""
    lengths: bool = False
    usual: Any = None
    name: str = ""
    default: Any = None
    count: Count | None = None

    def in_identity(self, case: Any) -> bool:
        """Whether its value is part of the identity of a case, as another value would make another case."""
        return self.identity if isinstance(self.identity, bool) else self.identity(case)

    def why_idle(self, case: Any, particles: int) -> str:
        """Why it has no effect in a case with this number of particles; "" if it has one."""
        if not particles and self.count == PARTICLES:
            return NO_PARTICLES
        return self.idle(case) if self.idle is not None else ""

    @property
    def of_problem(self) -> bool:
        """Whether it changes the exact answer."""
        return self.part in (Part.PROBLEM, Part.MATERIAL)

    def is_default(self, value: Any) -> bool:
        """Whether a value, or each one in a list for particles or gaps, is the default."""
        listed = self.count is not None and isinstance(value, list | tuple)
        return all(each == self.default for each in (value if listed else (value,)))


class Keys(BaseModel):
    """A group of keys, which are the fields of the model; unknown keys are refused."""

    model_config = ConfigDict(extra="forbid", frozen=True, defer_build=True)

    def filled(self, values: Mapping[str, object], always: Collection[str] = ()) -> Self:
        """A copy with other values for keys that were not given; they still count as not given in the copy.

        Args:
            values: Values by key.
            always: Keys whose values are replaced even if they were given.
        """
        given = self.model_fields_set
        copy = self.model_copy(update={key: each for key, each in values.items() if key in always or key not in given})
        object.__setattr__(copy, "__pydantic_fields_set__", set(given))
        return copy


@cache
def groups_of(model: type[BaseModel]) -> dict[str, type[BaseModel]]:
    """The models of the groups of keys by name, and that of the top level under ""."""
    groups = {"": model}
    for name, field in model.model_fields.items():
        for kind in (field.annotation, *get_args(field.annotation)):
            if isinstance(kind, type) and issubclass(kind, BaseModel):
                groups[name] = kind
    return groups


@cache
def keys_of(model: type[BaseModel]) -> dict[str, Key]:
    """The keys of a model by name, dotted within a group; a group is itself a key, too.

    A field that replaces one of a base class without a declaration of its own keeps that of the base class.
    """
    found: dict[str, Key] = {}
    for group, of in groups_of(model).items():
        part = found[group].part if group else Part.PROBLEM
        for last, field in of.model_fields.items():
            key, name = _declared(of, last), f"{group}.{last}" if group else last
            default = None if field.is_required() else field.default
            found[name] = replace(key, name=name, default=default, part=key.part or part, count=_count(field))
    return found


def _declared(model: type[BaseModel], name: str) -> Key:
    fields = (base.model_fields.get(name) for base in model.__mro__ if issubclass(base, BaseModel))
    return next((each for field in fields if field for each in field.metadata if isinstance(each, Key)), Key())


def _count(field: FieldInfo) -> Count | None:
    return next((each for each in (*field.metadata, *_annotations(field.annotation)) if isinstance(each, Count)), None)


def _annotations(kind: Any) -> Iterator[Any]:
    """The metadata of a type, or of one of its alternatives."""
    yield from getattr(kind, "__metadata__", ())
    for each in get_args(kind):
        yield from getattr(each, "__metadata__", ())
