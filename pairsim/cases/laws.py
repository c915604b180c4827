"""The laws that a case names, as objects with their parameters, before and after the case is validated.

A value of `liquid` or `solid` is the name of a law, or a block with its parameters: `{law: ..., n: 0.6}`. The block of
a viscoelastic law may contain the blocks `solvent` and, for a yield stress, `yielding`; a liquid with several
relaxation times has `law: modes` and a list of them.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, Self

from pydantic import BaseModel

from pairsim.cases.values import is_finite
from pairsim.cases.yaml_file import Content
from pairsim.physics import liquids, solids
from pairsim.physics.declared import LAWS
from pairsim.physics.liquids import NEWTONIAN, ConformationLaw, Liquid, Newtonian, ViscousLaw
from pairsim.physics.material import Material, Parameter
from pairsim.physics.solids import Solid
from pairsim.runtime.plain import Plain

MODES = "modes"  # the law of a liquid of several modes in case files
VISCOUS = {name: law for name, law in liquids.LAWS.items() if issubclass(law, ViscousLaw)}
ELASTIC = {name: law for name, law in liquids.LAWS.items() if issubclass(law, ConformationLaw)}
OF_ALL = {**Liquid.OF_POLYMER, **Solid.OF_ALL}
"""The declarations of the parameters that all liquids with a polymer, or all solids, have."""


class Declared(NamedTuple):
    """A parameter of a law that a case names: its dotted key, declaration, and value, None if it is not given."""

    key: str
    parameter: Parameter
    value: Any


@dataclass(frozen=True)
class LawChoice:
    """A law that a case names, with the parameters given for it; both may be wrong until the case is validated.

    Attributes:
        key: Its dotted key in the case, such as liquid.solvent or solid[1].
        name: The name of the law, "" if the case does not give it as a text.
        given: The other entries of its block, as they are given.
    """

    key: str
    name: str
    given: Content

    @classmethod
    def of(cls, key: str, value: Any, default: str = "") -> Self:
        """The law in a value of a case, which may be validated or not; `default` is its name if the value is None."""
        if isinstance(value, BaseModel):
            value = value.model_dump(mode="json", exclude_unset=True)
        block = value if isinstance(value, Mapping) else {"law": default if value is None else value}
        name = block.get("law")
        given = {entry: each for entry, each in block.items() if each is not None and entry != "law"}
        return cls(key, name if isinstance(name, str) else "", given)

    def declared(self) -> Iterator[Declared]:
        """The parameters of the law; none if there is no law of this name."""
        law = LAWS.get(self.name)
        for name, parameter in law.parameters().items() if law is not None else ():
            yield Declared(f"{self.key}.{name}", parameter, self.given.get(name))

    def with_numbers(self, numbers: Mapping[str, float]) -> Self:
        """The same law with other parameters, by their dotted keys; those of other laws are ignored."""
        own = {key.removeprefix(f"{self.key}."): value for key, value in numbers.items()}
        return replace(self, given={**self.given, **{name: own[name] for name in self._names if name in own}})

    @property
    def _names(self) -> Iterable[str]:
        return LAWS[self.name].parameters() if self.name in LAWS else ()

    def numbers(self, names: Iterable[str]) -> dict[str, float]:
        """Those of the named parameters that are given as numbers, by name."""
        return {name: value for name in names if is_finite(value := self.given.get(name))}

    @property
    def block(self) -> dict[str, Plain]:
        """The law as a block of a case."""
        return {"law": self.name, **self.given}

    def made[M: Material](self, laws: Mapping[str, type[M]], *first: float, **more: float) -> M:
        """The law of a valid case as an object; `first` and `more` are arguments that are not in its block."""
        law = laws[self.name]
        return law(*first, **{name: self.given[name] for name in law.parameters() if name in self.given}, **more)


@dataclass(frozen=True)
class LiquidChoice(LawChoice):
    """The liquid that a case names."""

    @property
    def solvent(self) -> LawChoice | None:
        """The law of the solvent; None if none is given."""
        return self._part("solvent")

    @property
    def yielding(self) -> LawChoice | None:
        """The law by which a yield stress changes the relaxation of the polymer; None if none is given."""
        return self._part("yielding")

    def _part(self, name: str) -> LawChoice | None:
        return LawChoice.of(f"{self.key}.{name}", self.given[name]) if name in self.given else None

    @property
    def modes(self) -> tuple[LawChoice, ...]:
        """The modes of a liquid with several relaxation times; empty for other liquids."""
        listed = self.given.get(MODES)
        blocks = listed if isinstance(listed, list | tuple) else ()
        return tuple(LawChoice.of(f"{self.key}.{MODES}[{i}]", each) for i, each in enumerate(blocks))

    @property
    def parts(self) -> tuple[LawChoice, ...]:
        """The laws in its block: solvent, yielding and modes."""
        return (*filter(None, (self.solvent, self.yielding)), *self.modes)

    @property
    def is_viscous(self) -> bool:
        """Whether it is purely viscous, so that De does not belong to it."""
        return self.name in VISCOUS

    @property
    def viscosity_law(self) -> ViscousLaw:
        """The law that gives the unit of viscosity of the case."""
        law = VISCOUS.get(self.name, Newtonian)
        return law.anyhow().with_numbers(self.numbers(law.parameters()))

    def with_numbers(self, numbers: Mapping[str, float]) -> Self:
        found = super().with_numbers(numbers)
        parts = {name: part for name in ("solvent", "yielding") if (part := self._part(name)) is not None}
        blocks: dict[str, Plain] = {name: part.with_numbers(numbers).block for name, part in parts.items()}
        if self.modes:
            blocks[MODES] = [each.with_numbers(numbers).block for each in self.modes]
        return replace(found, given={**found.given, **blocks})

    def model(self, De: float, xi: float) -> Liquid:
        """The liquid of a valid case at these De and xi, which have no effect if the law is purely viscous."""
        if self.is_viscous:
            return Liquid(self.made(VISCOUS))
        if not De:
            return NEWTONIAN
        solvent = self.solvent or LawChoice.of("", Newtonian.name)
        yielding = None if self.yielding is None else self.yielding.made(liquids.YIELDING)
        return Liquid(solvent.made(VISCOUS), xi, De, self._relaxing(), yielding)

    def _relaxing(self) -> tuple[ConformationLaw, ...]:
        """The modes of the polymer, whose weights add up to 1."""
        if self.name != MODES:
            return (self.made(ELASTIC),)
        numbers = [each.numbers(("time", "weight")) for each in self.modes]
        total = sum(each["weight"] for each in numbers)
        own = zip(self.modes, numbers, strict=True)
        return tuple(mode.made(ELASTIC, time=its["time"], weight=its["weight"] / total) for mode, its in own)


@dataclass(frozen=True)
class Laws:
    """All laws that a case names.

    Attributes:
        liquid: The liquid.
        solids: The solid of all particles, or one of each from upstream.
    """

    liquid: LiquidChoice
    solids: tuple[LawChoice, ...]

    @classmethod
    def of(cls, liquid: Any, solid: Any) -> Self:
        """The laws in the values of `liquid` and `solid` of a case, which may be validated or not."""
        several = enumerate(solid) if isinstance(solid, list | tuple) else ()
        of_each = tuple(LawChoice.of(f"solid[{i}]", each, solids.DEFAULT.name) for i, each in several)
        one = LawChoice.of("solid", solid, solids.DEFAULT.name)
        return cls(
            LiquidChoice.of("liquid", liquid, liquids.DEFAULT.name),
            of_each if isinstance(solid, list | tuple) else (one,),
        )

    @classmethod
    def in_case(cls, case: Content) -> Self:
        """The laws of a case as keys and values, validated or not."""
        return cls.of(case.get("liquid"), case.get("solid"))

    def with_numbers(self, numbers: Mapping[str, float]) -> Laws:
        """The same laws with other parameters, by their dotted keys."""
        return Laws(self.liquid.with_numbers(numbers), tuple(each.with_numbers(numbers) for each in self.solids))

    def declared(self) -> Iterator[Declared]:
        """Yield the parameters of all laws."""
        for each in (self.liquid, *self.liquid.parts, *self.solids):
            yield from each.declared()

    def solid_models(self, Ca_es: tuple[float, ...]) -> tuple[Solid | None, ...]:
        """The solids of a valid case, one for each Ca_e of its particles; None for rigid ones."""
        each = self.solids if len(self.solids) == len(Ca_es) else self.solids[:1] * len(Ca_es)
        return tuple(one.made(solids.LAWS, Ca_e) if Ca_e > 0 else None for one, Ca_e in zip(each, Ca_es, strict=True))


def liquid_in(resolved: Content) -> Liquid:
    """The liquid of a resolved case, such as case.yaml in a folder of results."""
    De, xi = resolved.get("De"), resolved.get("xi")
    return Laws.in_case(resolved).liquid.model(De if is_finite(De) else 0.0, xi if is_finite(xi) else 1.0)
