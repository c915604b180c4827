"""Functions by which a law is written once, for numbers, numpy arrays (real or complex) and UFL expressions."""

from __future__ import annotations

from importlib import import_module
from typing import Any


def _library(x: Any) -> Any:
    """UFL for its expressions, numpy for all else; imported here as both are slow, and checks of cases need neither."""
    plain = isinstance(x, int | float | complex) or type(x).__module__.partition(".")[0] == "numpy"
    return import_module("numpy" if plain else "ufl")


def exp(x: Any) -> Any:
    """Exponential function."""
    return _library(x).exp(x)


def sqrt(x: Any) -> Any:
    """Square root."""
    return _library(x).sqrt(x)


def expm1(x: Any) -> Any:
    """exp(x) - 1, without cancellation for numbers and arrays; UFL has no such function."""
    library = _library(x)
    return library.exp(x) - 1 if library.__name__ == "ufl" else library.expm1(x)
