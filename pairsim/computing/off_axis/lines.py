"""Whether particles stay on the axis, as a line in the answer of a question with the key `focus`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pairsim.computing.off_axis.columns import NAME

if TYPE_CHECKING:
    from pairsim.computing.question import Tables
    from pairsim.record.record import Record


def lines_beside(tables: Tables, record: Record) -> list[str]:
    """The line, or one for each verdict along the distances; none if the case does not ask for rates."""
    table = tables[NAME]
    if not table.rows:
        return []
    from pairsim.computing.off_axis.answer import verdicts_in

    return verdicts_in(table, None if record.scales is None else [record.scales] * table.rows)
