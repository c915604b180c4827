"""A run in time: its distances, velocities and shapes over time, and whether its start-up has decayed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any, Self

import numpy as np

from pairsim.analysis.quasi_steady_limit import NOTHING, Settled
from pairsim.quantities.scales import Scales
from pairsim.record.columns import (
    BRIDGE,
    DISTANCE,
    DU,
    SERIES_COLUMNS,
    T,
    Z,
)
from pairsim.record.folder import SERIES
from pairsim.record.record import Record
from pairsim.record.run_entries import CYCLES, HOLD, SETTLED, START, WholeCycles
from pairsim.record.table import Table
from pairsim.record.table_files import read_table
from pairsim.runtime.arrays import Array

CONTACT = "contact"  # the reason with which a run ends that closes a gap
OPEN = ("running", "interrupted", "failed")  # status of runs that were not compared with a quasi-steady solution


class Series:
    """The motion of particles over time: series.csv with the record of the run.

    Gaps are named by the suffixes of their columns, "" of a pair, "_1", "_2", ... of more particles, from upstream.

    Args:
        table: The columns of series.csv, shape (steps,) each.
        record: The record of the run.
    """

    def __init__(self, table: Mapping[str, Array], record: Record | None = None) -> None:
        self.table, self.record = Table(table, SERIES_COLUMNS), record if record is not None else Record()

    @classmethod
    def read(cls, folder: Path) -> Self:
        """The series of a folder of results.

        Raises:
            InputError: The table cannot be read.
        """
        return cls(read_table(folder / SERIES), Record.read(folder))

    def __reduce__(self) -> Any:
        """Pickled by its columns."""
        return type(self), (dict(self.table), self.record)

    def __repr__(self) -> str:
        return f"<series of {self.table.rows} steps>"

    @property
    def scales(self) -> Scales | None:
        """The units of the case; None without a `physical` block."""
        return self.record.scales

    def converted(self, scales: Scales | None) -> Series:
        """The series in um, s and um/s, by the scales of an experiment; unchanged without these."""
        return Series(self.table.converted(scales), self.record)

    @property
    def gaps(self) -> list[str]:
        """The suffixes of the gaps, from upstream; none with fewer than two particles."""
        return self.table.suffixes(DISTANCE)

    @property
    def t(self) -> Array:
        """Times [D_c/U_av], shape (steps,)."""
        return self.table[T]

    def d(self, gap: str = "") -> Array:
        """Distances of a gap [D_c], shape (steps,)."""
        return self.table.of(DISTANCE, gap)

    def dU(self, gap: str = "") -> Array:
        """Relative velocities of a gap [U_av], shape (steps,)."""
        return self.table.of(DU, gap)

    def distances_at(self, row: int) -> Array:
        """The distances of all gaps in a row [D_c], shape (gaps,)."""
        return np.array([self.d(gap)[row] for gap in self.gaps])

    @property
    def closed(self) -> int | None:
        """The gap whose closing has ended the run, counted from 0; None if the run did not end in this way."""
        if self.record.reason != CONTACT or not self.gaps:
            return None
        return int(np.argmin(self.distances_at(-1)))

    @property
    def held(self) -> bool:
        """Whether the distances are held."""
        return bool(HOLD.of(self.record))

    @property
    def starting_up(self) -> bool:
        """Whether a run from rest is not finished, so that it is not judged yet whether its start-up has decayed."""
        return START.of(self.record) != "steady" and self.record.status in OPEN

    @property
    def cycles(self) -> WholeCycles | None:
        """The entry of the record on the cycles of a flow that varies; None without one."""
        return CYCLES.of(self.record)

    @property
    def last_cycle(self) -> slice:
        """The rows of the last whole cycle; all rows if there is none."""
        entry = self.cycles or {}
        whole, cycle = entry.get("whole", 0), entry.get("cycle", np.inf)
        if not whole:
            return slice(None)
        ends = np.array([whole - 1, whole]) * cycle
        first, last = np.searchsorted(self.t, ends + 1e-9 * np.maximum(1.0, ends) * [-1, 1])
        return slice(int(first), int(last))

    def settled(self, gap: int) -> Settled | None:
        """How a gap, counted from 0, moves once the start-up has decayed; None where that is not known."""
        return Settled.of(self.record, gap)

    @property
    def why_not_settled(self) -> str:
        """Why `settled` is not known, in words; "" where it is known, or was not asked for."""
        return str((SETTLED.of(self.record) or {}).get("message", ""))

    @cached_property
    def start_up(self) -> float:
        """Time up to which a run from rest is starting up at least [D_c/U_av]; 0 of others, or if not known."""
        settled = self.settled(0)
        return settled.least_end if settled is not None else 0.0

    def last_dU(self, gap: str, settled: Settled | None) -> tuple[float, float | None]:
        """dU of a gap in the last row, and the half-width of its interval [U_av].

        If the run has not estimated the half-width, it is that of quasi-steady motion on the same cells once the
        start-up has decayed, and None before.
        """
        dU, errors = float(self.dU(gap)[-1]), self.table.half_widths(DU, gap)
        if errors is not None:
            return dU, float(errors[-1])
        known = settled is not None and abs(settled.dU) > NOTHING and settled.decayed(float(self.t[-1]), dU, None)
        return dU, settled.own(None) if settled is not None and known else None

    @property
    def places(self) -> Sequence[Array]:
        """Positions of the particles along the tube [D_c], shape (steps,) each; none in tables of old versions."""
        return list(self.table.each(Z).values())

    def moved(self, gap: int) -> float | None:
        """How far the middle of a gap, counted from 0, has moved along the tube [D_c]; None where not known."""
        if not (ends := self.places[gap : gap + 2]):
            return None
        z = np.mean(ends, axis=0)
        return float(z[-1] - z[0])

    @property
    def bridges(self) -> dict[str, float]:
        """Radii within which the liquid between neighbours is unyielded at the end [D_c], by gap."""
        return {gap: float(self.table.of(BRIDGE, gap)[-1]) for gap in self.table.suffixes(BRIDGE)}
