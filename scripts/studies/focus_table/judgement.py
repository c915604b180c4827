"""What the table says, the table that ships, and how far it reaches in one liquid."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from dataclasses import astuple
from pathlib import Path

import numpy as np
import pandas as pd
from book import comparison
from book.case_parts import complete
from book.comparison import Column, Table
from book.statements import Judged, falling, negative, positive
from book.study import Part
from scipy.optimize import brentq

from pairsim.atlas.focusing import FILE, WALL_RATE
from pairsim.atlas.focusing import Row as FileRow
from pairsim.physics.liquids import single
from pairsim.physics.liquids.giesekus import Giesekus
from pairsim.physics.slow_flow import departure

RATES, LIMITS = ("U", "by_Ca_e", "by_Psi_1", "by_Psi_2", "by_Re"), ("Ca_e_most", "De_most", "departure_most")
XI = 0.09


def of(results: pd.DataFrame, kind: str) -> pd.DataFrame:
    """Rates or limits by beta."""
    return results[results["kind"] == kind].set_index("beta").sort_index()


def statements(results: pd.DataFrame, parts: Sequence[Part]) -> dict[str, Judged]:
    """Signs of the rates, and that the range of first order shrinks with the bead's size."""
    rates, limits = of(results, "rates"), of(results, "limits")
    values = {name: [(float(each), 0.0) for each in rates[name]] for name in RATES}
    found = {
        "softness moves beads of every size to the axis": negative(values["by_Ca_e"]),
        "the first normal stress difference does, too": negative(values["by_Psi_1"]),
        "inertia drives them off": positive(values["by_Re"]),
    }
    found = {name: Judged(each.margins, f"{len(each.margins)} diameters") for name, each in found.items()}
    for name in LIMITS if len(limits) else ():
        ends = [(float(each), 0.0) for each in limits[name]]
        found[f"{name}, up to which first order holds, falls with the size of the bead"] = falling(ends, name)
    return found | complete(results, parts)


def De_most(De_m: float, delta_m: float) -> float:
    """De up to which first order holds around a rigid bead in a Giesekus liquid, alpha 0.2, xi 0.09."""

    def left(De: float) -> float:
        return 1 - (De / De_m) ** 2 - departure(single(Giesekus(alpha=0.2), De, XI), WALL_RATE) / delta_m

    return float(brentq(left, 1e-4, De_m))


def blocks(results: pd.DataFrame, parts: Sequence[Part]) -> dict[str, str]:
    """The table of how far first order reaches."""
    limits = of(results, "limits")
    pairs = zip(limits["De_most"], limits["departure_most"], strict=True)
    frame = limits.assign(most=[De_most(*each) for each in pairs])
    columns = [
        Column(r"$\mathrm{Ca}_m$", "Ca_e_most", shown=".3f"),
        Column(r"$\mathrm{De}_m$", "De_most", shown=".3f"),
        Column(r"$\delta_m$", "departure_most", shown=".3f"),
        Column("De up to which it holds in a Giesekus liquid, alpha 0.2, xi 0.09", "most", shown=".3f"),
    ]
    return comparison.blocks({"first-order": Table(frame, columns)})


def table_that_ships(results: pd.DataFrame, parts: Sequence[Part]) -> Mapping[Path, str]:
    """focusing.csv: rates at all diameters, and limits that are linear between theirs."""
    rates, limits = of(results, "rates"), of(results, "limits")
    if not len(limits):
        return {}
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(FileRow.names())
    for beta, row in rates.iterrows():
        between = (float(np.interp(float(str(beta)), limits.index, limits[name])) for name in LIMITS)
        found = FileRow(float(str(beta)), *(float(row[name]) for name in RATES), *between)
        writer.writerow([f"{each:.6g}" for each in astuple(found)])
    return {FILE: text.getvalue()}
