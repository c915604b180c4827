"""The shapes of particles in words."""

from __future__ import annotations

from pairsim.record.columns import TAYLOR
from pairsim.record.table import Table

MOST_SHAPES = 4  # that an answer tells each


def shapes_in(table: Table, row: int, when: str) -> list[str]:
    """A sentence with the Taylor parameters in a row of a table; none if the table has none."""
    values = {name: float(column[row]) for name, column in table.each(TAYLOR).items()}
    said = [f"{name} = {values[name]:.3g}" for name in sorted(values, key=lambda name: values[name])]
    shapes = (
        f"from {said[0]} to {said[-1]}"
        if len(said) > MOST_SHAPES
        else ", ".join(f"{name} = {value:.3g}" for name, value in values.items())
    )
    return [f"Taylor parameters{f' {when}' if when else ''}: {shapes}."] if shapes else []


def ranges_of_shapes(table: Table) -> list[str]:
    """The least and the largest Taylor parameter of each particle in all rows."""
    both = {name: (f"{values.min():.3g}", f"{values.max():.3g}") for name, values in table.each(TAYLOR).items()}
    ranges = [f"{name} {f'from {a} to {b}' if a != b else f'= {a}'}" for name, (a, b) in both.items()]
    return [f"Taylor parameters: {', '.join(ranges)}."] if ranges else []
