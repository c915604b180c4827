"""Cases as pictures read them: case.yaml, and the values of keys by which cases are told apart."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

from pairsim.cases.experiment import USUAL_COUNT, Experiment
from pairsim.cases.laws import Laws
from pairsim.cases.quantity_text import numbers_in_one_unit
from pairsim.cases.yaml_file import flat
from pairsim.physics.declared import LAWS
from pairsim.physics.liquids import Liquid
from pairsim.runtime.plain import Plain
from pairsim.runtime.text import printable


def plain_text(text: str) -> str:
    """Text that matplotlib can draw, and does not read as TeX."""
    return printable(text).replace("$", r"\$")


def shown(value: object) -> str:
    """A value of a parameter as text; a list of equal entries is shown as one of them."""
    if isinstance(value, list | tuple):
        entries = list(value)
        return shown(entries[0]) if len(set(map(str, entries))) == 1 else ", ".join(map(shown, entries))
    if isinstance(value, str):
        return LAWS[value].label if value in LAWS else plain_text(value)
    if isinstance(value, Mapping):
        return ", ".join(f"{k} {shown(v)}" if k != "law" else shown(v) for k, v in value.items())
    return f"{value:.4g}" if isinstance(value, float) else plain_text(str(value))


def hashable(value: object) -> Hashable:
    """A value of a parameter as a key of a mapping."""
    if isinstance(value, list | tuple):
        return tuple(map(hashable, value))
    return shown(value) if isinstance(value, dict) else value


def measured(values: Sequence[object]) -> tuple[list[float], str] | None:
    """Values of a parameter as numbers, and the unit of quantities such as "2 ms"; None if one of them is neither."""
    numbers = [value for value in values if isinstance(value, int | float) and not isinstance(value, bool)]
    if len(numbers) == len(values):
        return numbers, ""
    try:
        return numbers_in_one_unit(values)
    except ValueError:
        return None


class Parameters(Mapping[str, Hashable]):
    """Values of keys of a case by their dotted names, by which colours, styles and panels of its lines are chosen.

    They are hashable: lists become tuples. By `get` a key that the case does not have is None.
    """

    def __init__(self, values: Mapping[str, object] | None = None) -> None:
        self._values = {key: hashable(value) for key, value in (values or {}).items()}

    def __getitem__(self, key: str) -> Hashable:
        return self._values[key]

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def __len__(self) -> int:
        return len(self._values)

    def __hash__(self) -> int:
        return hash(frozenset(self._values.items()))

    def __or__(self, more: Mapping[str, object]) -> Parameters:
        return Parameters({**self._values, **more})

    def __repr__(self) -> str:
        return f"Parameters({self._values})"

    def at(self, keys: Iterable[str]) -> tuple[Hashable, ...]:
        """The values of some keys, in their order."""
        return tuple(self.get(key) for key in keys)


NO_PARAMETERS = Parameters()


@dataclass(frozen=True)
class ShownCase:
    """A case as it stands in case.yaml, which an older version may have written; empty where there is no such file."""

    content: Mapping[str, Plain] = field(default_factory=dict)

    @cached_property
    def parameters(self) -> Parameters:
        """The values of all keys."""
        return Parameters(flat(self.content))

    @cached_property
    def laws(self) -> Laws:
        """The laws of its liquid and particles."""
        return Laws.in_case(self.content)

    @cached_property
    def experiment(self) -> Experiment | None:
        """The quantities of its `physical` block; None without one."""
        return Experiment.in_case(self.content)

    @property
    def quantities(self) -> Mapping[str, Plain]:
        """The quantities of its `physical` block, by key, as they are written."""
        return self.experiment.given if self.experiment is not None else {}

    @property
    def De(self) -> float:
        """Its Deborah number, 0 where it has none."""
        return self._number("De", 0.0)

    @property
    def liquid(self) -> Liquid:
        """Its liquid."""
        return self.liquid_at(self.De)

    def liquid_at(self, De: float) -> Liquid:
        """Its liquid with another De."""
        return self.laws.liquid.model(De, self._number("xi", 1.0))

    @property
    def Ca_es(self) -> list[float]:
        """The one Ca_e of all particles, or that of each; none where they have none."""
        values = self.content.get("Ca_e")
        return [each for each in (values if isinstance(values, list) else [values]) if isinstance(each, int | float)]

    def softened(self, De: float, factor: float) -> ShownCase:
        """The case with another De, and all Ca_e multiplied by a factor."""
        values = [factor * each for each in self.Ca_es]
        one_for_all = not isinstance(self.content.get("Ca_e"), list)
        return ShownCase({**self.content, "De": De, "Ca_e": values[0] if one_for_all else [*values]})

    @property
    def particles(self) -> int:
        """The number of particles."""
        return int(self._number("particles", USUAL_COUNT))

    @property
    def followed(self) -> str:
        """The key that is followed along its values, "" where there is none."""
        along = self.content.get("along")
        return next(iter(along), "") if isinstance(along, dict) else ""

    @property
    def values_followed(self) -> list[Plain]:
        """The values of this key that are asked for."""
        along = self.content.get("along")
        values = along.get(self.followed) if isinstance(along, dict) else None
        return values if isinstance(values, list) else []

    def _number(self, key: str, default: float) -> float:
        value = self.content.get(key)
        return float(value) if isinstance(value, int | float) else default
