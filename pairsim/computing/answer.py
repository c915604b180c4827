"""What the answers of several questions say: shapes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pairsim.results.columns import suffixes_in

MOST_SHAPES = 4  # that are all told


def shapes_in(table: Mapping[str, Any], row: int, when: str) -> list[str]:
    """The Taylor parameters in a row."""
    values = {f"D{each}": float(table[f"D{each}"][row]) for each in suffixes_in(table, "D")}
    said = [f"{name} = {values[name]:.3g}" for name in sorted(values, key=lambda name: values[name])]
    shapes = (
        f"from {said[0]} to {said[-1]}"
        if len(said) > MOST_SHAPES
        else ", ".join(f"{name} = {value:.3g}" for name, value in values.items())
    )
    return [f"Taylor parameters{f' {when}' if when else ''}: {shapes}."] if shapes else []
