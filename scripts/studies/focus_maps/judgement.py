"""What the maps say of beads and of pairs, their tables and their picture."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf
from typing import Any

import pandas as pd
from book import comparison, pages
from book.case_parts import complete
from book.comparison import Column, Table
from book.statements import Judged, Value, below, falling, negative, positive
from book.study import Part

OSCILLATING = ("oscillates", "leaves")


def of(results: pd.DataFrame, name: str) -> pd.DataFrame:
    """The places of a map."""
    return results[(results["map"] == name) & results["ended"].isna()]


def growth(rows: pd.DataFrame) -> list[Value]:
    """Growth rates with their half-widths."""
    return list(zip(rows["growth"].tolist(), rows["growth_error"].fillna(inf).tolist(), strict=True))


def largest(rows: pd.DataFrame, keys: Sequence[str]) -> pd.DataFrame:
    """The places with the largest growth rate, one for each value of some parameters."""
    return rows.loc[rows.groupby(list(keys))["growth"].idxmax()]


def statements(results: pd.DataFrame, parts: Sequence[Part]) -> dict[str, Judged]:
    """What the page says in words."""
    soft, elastic = (of(results, name) for name in ("soft-bead", "elastic-bead"))
    found = {
        "every soft bead in a Newtonian liquid moves to the axis": negative(growth(soft), "growth"),
        "every rigid bead in a Giesekus liquid moves to the axis": negative(growth(elastic), "growth"),
    }
    found = {name: Judged(each.margins, f"{len(each.margins)} places") for name, each in found.items()}
    small = soft[soft["Ca_e"].isin([0.002, 0.005])]
    if small["Ca_e"].nunique() == 2:
        rates = (small["growth"] / small["Ca_e"]).groupby(small["beta"])
        percent = [(100 * float(each.iloc[1] / each.iloc[0] - 1), 0.0) for _, each in rates]
        name = "the rate of a soft bead is proportional to Ca_e from 0.002 to 0.005, within 1 %"
        found[name] = below(percent, 1.0, "change of rate/Ca_e, %", ".1g")
    if len(rigid := of(results, "rigid-pairs")):
        found |= _of_rigid_pairs(rigid)
    for name, key in (("soft-pairs", "Ca_e"), ("elastic-pairs", "De")):
        for beta, rows in largest(of(results, name), ("beta", key)).groupby("beta"):
            text = f"{name}: the largest growth rate falls with {key} at beta {beta:g}"
            found[text] = falling(growth(rows.sort_values(key)), "growth")
    return found | complete(results, parts)


def _of_rigid_pairs(rows: pd.DataFrame) -> dict[str, Judged]:
    leaving, others = rows[rows["verdict"] == "leaves"], rows[rows["verdict"] == "oscillates"]
    odd = rows[~rows["verdict"].isin(OSCILLATING)]
    return {
        "rigid pairs in a Newtonian liquid oscillate about the axis or leave it": Judged(
            ((0.5 - len(odd), 0.0),), f"{len(others)} oscillate, {len(leaving)} leave, {len(odd)} neither"
        ),
        "rigid pairs that leave the axis grow by more than their half-widths": positive(growth(leaving), "growth"),
        "they leave it at some distance at beta 0.1 to 0.4, and at none at 0.5 and 0.6": Judged(
            tuple(
                (0.5 if (beta in set(leaving["beta"])) == (beta < 0.45) else -0.5, 0.0)
                for beta in rows["beta"].unique()
            ),
            "leave at beta " + ", ".join(f"{each:g}" for each in sorted(leaving["beta"].unique())),
        ),
    }


def over(rows: pd.DataFrame, key: str, column: str, form: str) -> Table:
    """A column over beta and another parameter."""
    wide = rows.pivot(index="beta", columns=key, values=column)
    names = {value: f"{value:g}" for value in wide}
    frame = wide.rename(columns=names).rename_axis(index=rf"beta \ {key}", columns=None)
    return Table(frame, [Column(name, shown=form) for name in names.values()])


def ratios(results: pd.DataFrame) -> Table:
    """The rate of a soft bead in a Giesekus liquid over the sum of those of softness and of elasticity alone."""
    keys = ["beta", "De", "Ca_e"]
    both, soft, elastic = (of(results, name) for name in ("bead", "soft-bead", "elastic-bead"))
    alone: Any = soft.set_index(["beta", "Ca_e"])["growth"]
    rigid: Any = elastic.set_index(["beta", "De"])["growth"]
    sums = [alone.get((beta, Ca_e)) + rigid.get((beta, De)) for beta, De, Ca_e in both[keys].to_numpy()]
    rows = both.assign(ratio=both["growth"] / sums)
    wide = rows.pivot(index=["beta", "De"], columns="Ca_e", values="ratio")
    frame = wide.rename(columns={value: f"Ca_e {value:g}" for value in wide}).rename_axis(columns=None)
    return Table(frame, [Column(str(name), shown=".2f") for name in frame])


def windows(rows: pd.DataFrame) -> str:
    """At which distances rigid pairs leave the axis, and how fast at most."""
    leaving = rows[rows["verdict"] == "leaves"]
    places = [
        f"{', '.join(f'{d:g}' for d in sorted(each['d']))} (beta {beta:g})" for beta, each in leaving.groupby("beta")
    ]
    rates = [f"{each['growth'].max():.3f}" for _, each in leaving.groupby("beta")]
    none = [f"{beta:g}" for beta in sorted(set(rows["beta"]) - set(leaving["beta"]))]
    return pages.prose(
        f"They leave it at d {'; '.join(places)}, of the {rows['d'].nunique()} distances from {rows['d'].min():g} to "
        f"{rows['d'].max():g}; at beta {' and '.join(none)} at none of these. The largest growth rates there are "
        f"{', '.join(rates)} $U_{{av}}/D_c$."
    )


def blocks(results: pd.DataFrame, parts: Sequence[Part]) -> dict[str, str]:
    """The tables of the page."""
    soft, elastic = (of(results, name) for name in ("soft-bead", "elastic-bead"))
    tables = {
        "soft-length": over(soft, "Ca_e", "tube", ".4g"),
        "soft-Re": over(soft, "Ca_e", "Re_c", ".2g"),
        "elastic-length": over(elastic, "De", "tube", ".4g"),
        "elastic-Re": over(elastic, "De", "Re_c", ".2g"),
        "ratios": ratios(results),
        "soft-pairs": over(largest(of(results, "soft-pairs"), ("beta", "Ca_e")), "Ca_e", "growth", "+.4f"),
        "elastic-pairs": over(largest(of(results, "elastic-pairs"), ("beta", "De")), "De", "growth", "+.4f"),
    }
    found = comparison.blocks(tables)
    return found | {
        "rigid-pairs": windows(of(results, "rigid-pairs")),
        "statements": comparison.stated(statements(results, parts)),
    }
