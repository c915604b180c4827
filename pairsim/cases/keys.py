"""What is declared of a key of a case beside its pydantic field, so that no other file needs to know its name.

    gravity: Annotated[PerParticle[Force], Key("W", caption=10, slug="W", since="0.4")] = Field(0.0, description=...)

Captions, grids, hashes, folder names, messages and atlases ask these declarations; see docs/how-to/add-key.md. A
quantity of the `physical` block says itself which key it gives (`cases/physical.py`), and a law which parameters it
has.
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
    """What a key is part of."""

    PROBLEM = "the problem, which has one exact answer"
    MATERIAL = "the problem, as a law of the liquid or of the particles, or a number of one"
    START = "where and how a run begins"
    NUMERICS = "how exactly the problem is solved"
    REPORT = "what of the answer is computed and written, up to where, and in which units"


@dataclass(frozen=True)
class Count:
    """Which values a list of a key has: one for each of these."""

    of: str
    fewer: int  # than particles

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
        part: What it is part of; None in a group of keys: that of the group. An atlas compares all keys of the problem.
        caption: Its place among the keys of a caption, 0 where it is not in captions. Where cases differ in keys of
            captions is always said.
        slug: What its value comes after in names of folders, "" where it is not in them.
        required: Whether it must be given where there are particles, or gaps, that have it.
        identity: Whether it makes another case, with a hash and a folder of its own; or a function of a case that says
            where it does.
        idle: A function of a case that says why it has no effect there, "" where it has one. What has one value for
            each particle has none without particles.
        check: A function of a case that says what the key must be there beside the other keys, "" where it is right; or
            that yields mistakes, where these name another value. Lists have one value for each particle or gap then.
        first: Whether other keys are checked only if its check finds nothing, as they depend on it.
        models: What it brings into the model that is said to be left out where no key does, such as "gravity"
            (`cases/messages.py`).
        since: The version that brought it, where hashes of older cases are to stay: it is in the hash of those cases
            alone in which it is not its default.
        lengths: Whether its values, numbers of tube diameters, may be lengths such as "15 um" in a case with a
            `physical` block.
        usual: What `pairsim units` gives in a case that says nothing of it; None: nothing.
        name: Its name, with that of its group; from its field, as what follows.
        default: Its default; None in a key without one.
        count: How many values a list has; None in a key with one value for the case.
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
        """Whether it makes another case of one."""
        return self.identity if isinstance(self.identity, bool) else self.identity(case)

    def why_idle(self, case: Any, particles: int) -> str:
        """Why it has no effect in a case of so many particles; "" where it has one."""
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
    """The model of each group of keys, and of the top level under ""."""
    groups = {"": model}
    for name, field in model.model_fields.items():
        for kind in (field.annotation, *get_args(field.annotation)):
            if isinstance(kind, type) and issubclass(kind, BaseModel):
                groups[name] = kind
    return groups


@cache
def keys_of(model: type[BaseModel]) -> dict[str, Key]:
    """The keys of a model by their names, with a dot within a group; a group is a key, too.

    A key that is declared in a base class keeps its declaration where a field replaces the one of that class.
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
