"""The shapes of particles in words."""

from __future__ import annotations

from pairsim.quantities.text import with_error
from pairsim.record.columns import TAYLOR
from pairsim.record.table import Table

MOST_SHAPES = 4  # largest number of shapes that an answer lists one by one


def shapes_in(table: Table, row: int, when: str) -> list[str]:
    """A sentence with the Taylor parameters in a row of a table, and their errors if it has them; none without any."""
    values = {suffix: float(table.of(TAYLOR, suffix)[row]) for suffix in table.suffixes(TAYLOR)}
    if not values:
        return []
    if len(values) > MOST_SHAPES:
        ends = (min(values, key=values.__getitem__), max(values, key=values.__getitem__))
        shapes = "from {} to {}".format(*(f"{TAYLOR.name}{suffix} = {values[suffix]:.3g}" for suffix in ends))
    else:
        known = ((suffix, table.half_widths(TAYLOR, suffix)) for suffix in values)
        errors = {suffix: None if each is None else float(each[row]) for suffix, each in known}
        said = (f"{TAYLOR.name}{suffix} = {with_error(values[suffix], errors[suffix], digits=3)}" for suffix in values)
        shapes = ", ".join(said)
    return [f"Taylor parameters{f' {when}' if when else ''}: {shapes}."]


def ranges_of_shapes(table: Table) -> list[str]:
    """A sentence with the least and the largest Taylor parameter of each particle in all rows; none without any."""
    both = {name: (f"{values.min():.3g}", f"{values.max():.3g}") for name, values in table.each(TAYLOR).items()}
    ranges = [f"{name} {f'from {a} to {b}' if a != b else f'= {a}'}" for name, (a, b) in both.items()]
    return [f"Taylor parameters: {', '.join(ranges)}."] if ranges else []
