"""Errors on meshes and with time steps of several sizes, each a part."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path

import numpy as np
from book.apart import apart
from book.study import Part, Row

from studies.manufactured.run import errors

CELLS, STEPS = (4, 8, 16), (24, 48)
"""Numbers of cells across the radius and of time steps."""


def in_space(n: int) -> dict[str, float]:
    """Errors of u, p and s on n cells across the radius."""
    return errors("general", n, list(np.linspace(0.0, 0.2, 17)))


def in_time(n: int) -> dict[str, float]:
    """Errors after n steps that grow and shrink by 1.4 in turn, with sources that leave no error in space."""
    t = np.cumsum([0.0, *np.tile([1.0, 1.4], n // 2)])
    return errors("general", 4, list(0.5 * t / t[-1]), discrete=True)


def parts(quick: bool) -> list[Part]:
    """All meshes and steps; the quick form has the two coarsest meshes."""
    space = [
        Part(f"{n} cells", f"general flow, {n} cells", partial(_rows, "space", n)) for n in CELLS[: 2 if quick else 3]
    ]
    time = [Part(f"{n} steps", f"general flow, {n} steps", partial(_rows, "time", n)) for n in STEPS]
    return space if quick else [*space, *time]


def _rows(kind: str, n: int, folder: Path) -> Sequence[Row]:
    found = apart(in_space if kind == "space" else in_time, n)
    return [{"kind": kind, "count": n, "field": name, "error": error} for name, error in found.items()]
