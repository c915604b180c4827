"""Options made from declarations: one for each quantity of an experiment, and one for each number of a law."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping
from inspect import Parameter
from typing import Annotated, Any

import typer

from pairsim.cases.physical import EXPERIMENT, QUANTITIES
from pairsim.physics.declared import DIMENSIONS, PARAMETERS
from pairsim.physics.material import Material
from pairsim.quantities.measurable import Measurable
from pairsim.runtime.errors import Argument, InputError

Text = str | None
REQUIRED = "tube", "particle"
"""Quantities without which beads in a tube have no dimensionless numbers."""
EXPONENT = 0.6
"""The exponent in the unit of an example, where this depends on a parameter of a law."""


SEVERAL = "may be repeated: one for each gap of a run, the points of a curve, or the ends of the range of critical"


def of_experiment() -> Iterator[Parameter]:
    """An option for each quantity that sets a scale, or gives a key of a case."""
    return map(_of_quantity, EXPERIMENT)


def of_laws(laws: Mapping[str, type[Material]], shared: Collection[str] = ()) -> Iterator[Parameter]:
    """An option for each quantity from which numbers of some laws follow, and for each of their numbers without a unit.

    Args:
        laws: The laws by name.
        shared: Keys of further quantities, on which the numbers of all these laws depend.
    """
    named = numbers_of(laws)
    follow = {name: p.dimension.key for law in laws.values() for name, p in law.parameters().items() if p.dimension}
    for key in DIMENSIONS:
        names = [name for name, of in follow.items() if of == key]
        if names or key in shared:
            yield _of_quantity(QUANTITIES[key], dict.fromkeys(law for name in names for law in named[name]))
    for name in pure_numbers(laws):
        words = next(law.parameters()[name].words for law in laws.values() if name in law.parameters())
        help_ = f"{_sentence(words)} ({', '.join(named[name])})."
        option = typer.Option(f"--{name.replace('_', '-')}", metavar="NUMBER", help=help_)
        yield Parameter(name, Parameter.KEYWORD_ONLY, default=None, annotation=Annotated[float | None, option])


def numbers_of(laws: Mapping[str, type[Material]]) -> dict[str, list[str]]:
    """For each number of some laws, by its name, the names of the laws that have it."""
    found: dict[str, list[str]] = {}
    for law in laws.values():
        for name in law.parameters():
            found.setdefault(name, []).append(law.name)
    return found


def pure_numbers(laws: Mapping[str, type[Material]]) -> list[str]:
    """The names of the numbers of some laws that have no unit."""
    every = {name: p for law in laws.values() for name, p in law.parameters().items() if p.dimension is None}
    return list(every)


def quantity(of: Measurable, laws: Collection[str] = (), several: bool = False) -> Any:
    """The option of a quantity, which some laws need; `several` if it is repeated for several values."""
    return typer.Option(of.option, metavar="QUANTITY", help=_help(of, laws, several))


def _of_quantity(of: Measurable, laws: Collection[str] = ()) -> Parameter:
    several = of.many or of.ranged
    kind: Any = list[str] if several else str
    option = quantity(of, laws, several)
    if of.key in REQUIRED:
        return Parameter(of.key, Parameter.KEYWORD_ONLY, annotation=Annotated[kind, option])
    return Parameter(of.key, Parameter.KEYWORD_ONLY, default=None, annotation=Annotated[kind | None, option])


def _help(of: Measurable, laws: Collection[str], several: bool) -> str:
    """The help of an option: what it is, an example, what follows from it, and the default."""
    words, *more = of.words.split("; ")
    gives = [each for each in more if each.startswith("gives ")]
    example = of.with_parameters(dict.fromkeys(of.of_unit, EXPONENT)).example
    for other in QUANTITIES.values():  # an option in place of the name of a key
        words = words.replace(f"in place of {other.key}", f"in place of {other.option}")
    said = [f"default: {of.default}"] if of.default else []
    said += [SEVERAL if of.ranged else "repeat it for one value per particle, from upstream"] if several else []
    said += [", ".join(laws)] if laws else []
    example = f"'{example}'" if "+-" in example else example.replace(" ", "")
    example += f" or {of.as_volume.replace(' ', '')}" if of.as_volume else ""
    return "; ".join([f"{_sentence(words)}, such as {example}", *gives]) + (f" ({'; '.join(said)})." if said else ".")


def _sentence(words: str) -> str:
    return words[:1].upper() + words[1:]


def of_option(command: str, error: InputError, options: Collection[str] | None = None) -> InputError:
    """An error of a case that names options of a command in place of the keys for which they stand.

    Args:
        command: The command.
        error: The error.
        options: Keys that have an option; others are named as they are set by --set. None: all keys have one.
    """

    def option(key: re.Match[str]) -> str:
        declared = PARAMETERS.get(key[1])
        dimension = None if declared is None else declared.parameter.dimension
        name = key[1] if dimension is None else dimension.key
        if options is not None and name not in options:
            return f"--set {name}"
        return QUANTITIES[name].option if name in QUANTITIES else f"--{name.replace('_', '-')}"

    key, allowed = (re.sub(r"\b(?:physical|liquid|solid)\.(\w+)", option, text) for text in (error.key, error.allowed))
    key = Argument(key) if isinstance(error.key, Argument) or key in ("liquid", "solid") else key
    return InputError(command, key, error.value, allowed.removesuffix(" in physical"))
