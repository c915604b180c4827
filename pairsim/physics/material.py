"""What a law declares about itself: its parameters, with ranges, symbols, descriptions and measurable quantities.

Case files, `pairsim units`, the schema, messages, pictures and reference pages are made from these declarations;
nothing outside its file knows the name of a law or of its parameters. This module imports neither numpy nor UFL, since
the checks of case files use it.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Container, Iterable, Mapping
from dataclasses import dataclass
from importlib import import_module
from pkgutil import iter_modules
from typing import TYPE_CHECKING, Any, ClassVar, Self

from pairsim.quantities.measurable import Measurable

if TYPE_CHECKING:
    from ufl.core.expr import Expr


@dataclass(frozen=True)
class Parameter:
    """A dimensionless parameter of a law.

    Attributes:
        symbol: Its symbol (TeX).
        words: What it is.
        least: Least value.
        most: Largest value.
        open: Whether the least value itself is excluded.
        default: Its default, None if it must be given.
        dimension: The measurable quantity that it follows from, None if it is a pure number.
    """

    symbol: str
    words: str
    least: float
    most: float
    open: bool = False
    default: float | None = None
    dimension: Measurable | None = None


def parameter(
    symbol: str,
    words: str,
    least: float,
    most: float,
    *,
    open: bool = False,
    default: float | None = None,
    dimension: Measurable | None = None,
) -> Any:
    """Declare a parameter of a law as a field of its dataclass; the arguments are those of `Parameter`."""
    metadata = {"parameter": Parameter(symbol, words, least, most, open, default, dimension)}
    if default is None:
        return dataclasses.field(metadata=metadata, kw_only=True)
    return dataclasses.field(default=default, metadata=metadata, kw_only=True)


@dataclass(frozen=True)
class LawField:
    """A field that a law adds to fields.xdmf and to pictures, a pure number in the liquid.

    Attributes:
        symbol: Its symbol (TeX).
        value: Function that returns the field, from the law, the magnitude |tau| of its stress, |tau|^2 = tau : tau/2
            [eta_0 U_av/D_c], and the shear rate [U_av/D_c].
        level: Value at which all pictures of fields have a contour; None: no contour.
    """

    symbol: str
    value: Callable[[Any, Any, Any], Any]
    level: float | None = None


NAMED: list[type[Material]] = []
"""All laws in the order of their definition, that is all classes with a name: those of the program and of users."""


@dataclass(frozen=True)
class Material:
    """Base of all laws: a frozen dataclass whose fields are parameters.

    A parameter is a number, or a constant of a form: forms are compiled with constants in place of the numbers of a
    law, so that its methods must work with both.

    Attributes:
        name: Name of the law in case files.
        label: Its name in pictures and sentences.
        words: What the law describes, in a line.
        default: Whether it is the law of a case that names none.
        regularisation: Name of the parameter that rounds off a kink of the stress, with an error proportional to its
            inverse; "" in a law without a kink. Solutions are continued in its logarithm, with a new matrix in each
            iteration.
        fields: The fields that it adds, by name.
    """

    name: ClassVar[str]
    label: ClassVar[str]
    words: ClassVar[str]
    default: ClassVar[bool] = False
    regularisation: ClassVar[str] = ""
    fields: ClassVar[Mapping[str, LawField]] = {}

    def __init_subclass__(cls, **more: Any) -> None:
        super().__init_subclass__(**more)
        if isinstance(vars(cls).get("name"), str):
            NAMED.append(cls)

    @classmethod
    def parameters(cls) -> dict[str, Parameter]:
        """The parameters by name, in the order of their declaration."""
        return {f.name: f.metadata["parameter"] for f in dataclasses.fields(cls) if "parameter" in f.metadata}

    @classmethod
    def anyhow(cls) -> Self:
        """The law with arbitrary permitted values of its parameters, for uses in which only its equations matter."""
        return cls(**{name: p.least if p.default is None else p.default for name, p in cls.parameters().items()})

    @property
    def numbers(self) -> dict[str, float]:
        """The values of the parameters by name."""
        return {name: getattr(self, name) for name in self.parameters()}

    def with_numbers(self, numbers: Mapping[str, float | Expr]) -> Self:
        """The same law with other values, or with constants of a form in place of them."""
        return dataclasses.replace(self, **numbers)


def laws_of[L: Material](package: str, path: Iterable[str], *kinds: type[L]) -> dict[str, type[L]]:
    """The laws of the given kinds that the modules of a package define, by name."""
    for entry in iter_modules(path):
        import_module(f"{package}.{entry.name}")
    return {law.name: law for law in NAMED if issubclass(law, kinds) and law.__module__.startswith(f"{package}.")}


def apart(a: Mapping[str, float], b: Mapping[str, float]) -> float:
    """Largest relative difference between the parameters, by name, of two materials of the same laws."""
    sizes = {name: max(abs(a[name]), abs(b[name])) for name in a}
    return max((abs(a[name] - b[name]) / size for name, size in sizes.items() if size), default=0.0)


def between(a: Mapping[str, float], b: Mapping[str, float], tau: float, geometric: Container[str]) -> dict[str, float]:
    """Numbers interpolated between a (tau = 0) and b (tau = 1), geometrically for some names, linearly for others."""
    return {
        name: a[name] * (b[name] / a[name]) ** tau
        if name in geometric and a[name] > 0
        else a[name] + (b[name] - a[name]) * tau
        for name in a
    }
