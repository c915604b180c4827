"""What stands between the marks of the page: tables of stored rows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np
import pandas as pd
from book import pages
from book.study import Part

from studies.pulses import volume
from studies.pulses.judgement import Rows, beside_equal, of_cells, on_both, slow_limit, statements

NOTHING = "Not computed yet."


def blocks(results: pd.DataFrame, parts: Sequence[Part]) -> Mapping[str, str]:
    """What stands between the marks of the page."""
    rows = Rows.of(results)
    judged = [
        {"statement": name, "": each.verdict, "numbers": each.numbers}
        for name, each in statements(results, parts).items()
    ]
    makers = (_pipe, _tube, _rigid, _volume, _slow, _differing, _held, _giesekus, _signs, _longer_tube, _random, _bench)
    tables = {make.__name__[1:].replace("_", "-"): make(rows) for make in makers}
    found = {name: pages.markdown(table) if len(table) else pages.prose(NOTHING) for name, table in tables.items()}
    return {"made": pages.prose(_made(results, parts)), "statements": pages.markdown(pd.DataFrame(judged)), **found}


def _made(results: pd.DataFrame, parts: Sequence[Part]) -> str:
    if not len(results):
        return NOTHING
    days, codes = sorted(results["computed"].unique()), results["code"].nunique()
    when = " to ".join(dict.fromkeys((days[0], days[-1])))
    states = f" with {codes} states of the code" if codes > 1 else ""
    return f"{results['part'].nunique()} of {len(parts)} parts, computed {when}{states}."


def _number(value: float, digits: int = 3) -> str:
    return "" if pd.isna(value) else f"{value:.{digits}g}"


def _scaled(value: float, power: int, digits: int = 3) -> str:
    """A number in units of a power of ten, with a fixed number of digits behind the point."""
    return "" if pd.isna(value) else f"{value / 10.0**power:+.{digits}f}"


def _period(value: float) -> str:
    return "steady flow" if np.isinf(value) else f"{value:g}"


def _pipe(rows: Rows) -> pd.DataFrame:
    found = rows.topic("pipe")
    lines = [
        {
            "De": f"{row['De']:g}",
            "xi": f"{row['xi']:g}",
            "error of dp, of the largest": f"{row['pressure_error']:.0e}",
            "error of the profile [U_av]": f"{row['profile_error']:.0e}",
        }
        for _, row in found.iterrows()
    ]
    return pd.DataFrame(lines)


def _tube(rows: Rows) -> pd.DataFrame:
    found = rows.topic("tube")
    if not len(found):
        return found
    cells = of_cells(found)
    lines = [
        {
            "cells": f"{row['size']:g}",
            "ends": row["ends"],
            "until": f"{row['end']:g}",
            "`time.tol`": f"{row['tol']:.0e}",
            "error of dp, of the largest": f"{row['pressure_error']:.1e}",
            "error of the profile [U_av]": f"{row['profile_error']:.1e}",
        }
        for _, row in pd.concat([cells, found.drop(cells.index)]).iterrows()
    ]
    return pd.DataFrame(lines)


def _rigid(rows: Rows) -> pd.DataFrame:
    return pd.DataFrame(
        [
            {"waveform": row["run"], r"largest \|dU\|": f"{row['largest']:.0e}"}
            for _, row in rows.topic("rigid").iterrows()
        ]
    )


def _volume(rows: Rows) -> pd.DataFrame:
    lines = []
    for _, row in rows.topic(volume.TOPIC).iterrows():
        scene, _, flow = row["run"].partition(" ")
        line = {"particles": scene, "gap": f"{row['gap']:.0f}", "flow": flow}
        line["moved [1e-6]"] = _scaled(row["moved"], -6, 1)
        line["half-width [1e-6]"] = _scaled(row["half_width"], -6, 1).lstrip("+")
        line["range of d in the cycle"] = _number(row["range"])
        line["`travel` over it takes"] = _number(row["travel"], 5)
        lines.append(line)
    return pd.DataFrame(lines)


def _slow(rows: Rows) -> pd.DataFrame:
    found = rows.topic("slow")
    found = found[np.isfinite(found["period"])] if len(found) else found
    lines = []
    for _, row in found.iterrows():
        limit = slow_limit(rows, row["shape"])
        missing = limit - row["mean"]
        line = {
            "waveform": row["shape"],
            "period": f"{row['period']:g}",
            "mean of dU [1e-3]": _scaled(row["mean"], -3, 4),
        }
        line |= {"half-width": _scaled(row["half_width"], -3).lstrip("+"), "slow limit": _scaled(limit, -3, 4)}
        line["missing, a cycle [1e-3]"] = _scaled(missing * row["period"], -3)
        line["missing, of the limit"] = f"{100 * missing / limit:.2f} %" if np.isfinite(limit) else ""
        lines.append(line)
    return pd.DataFrame(lines)


def _differing(rows: Rows) -> pd.DataFrame:
    one, both = rows.runs("differing", period=np.inf), beside_equal(rows)
    flows = [("in one direction", row["mean"], slow_limit(rows, "square")) for _, row in one.iterrows()]
    flows += [
        (f"to and fro, period {row['period']:g}", row["mean"], row["mean_of_equal"]) for _, row in both.iterrows()
    ]
    lines = [
        {"flow": flow, "mean of dU [1e-3]": _scaled(mean, -3), "of equal beads [1e-3]": _scaled(of_equal, -3)}
        for flow, mean, of_equal in flows
    ]
    return pd.DataFrame(lines)


def _held(rows: Rows) -> pd.DataFrame:
    lines = []
    for _, row in rows.topic("held").iterrows():
        moves = (row["d_largest"] - row["d_least"]) / row["d_mean"]
        line = {"pair": row["run"], "period": f"{row['period']:g}", "mean d": f"{row['d_mean']:.4f}"}
        line["d moves in the cycle by"] = f"{100 * moves:.0f} %"
        line["mean of dU, free [1e-3]"] = _scaled(row["mean"], -3, 4)
        line["held at the mean d"] = _scaled(row["held_mean"], -3, 4)
        line["half-width"] = _scaled(row["held_half_width"], -3, 4).lstrip("+")
        line["difference"] = f"{100 * (row['held_mean'] / row['mean'] - 1):+.2f} %"
        lines.append(line)
    return pd.DataFrame(lines)


def _giesekus(rows: Rows) -> pd.DataFrame:
    found = rows.topic("giesekus")
    if not len(found):
        return found
    lines = []
    for Ca_e, name in ((0.0, "rigid"), (0.05, "soft")):
        of_beads = found[(found["Ca_e"] == Ca_e) & (found["length"].isna() | (found["length"] == 6))]
        for period, group in of_beads.groupby("period"):
            line = {"beads": name, "period": _period(float(str(period)))}
            steady = group[group["level"].isna()]
            of_levels = {level: group[group["level"] == level] for level in ("coarse", "fine")}
            for level, those in {**of_levels, "fine": steady if len(steady) else of_levels["fine"]}.items():
                line[f"{level} [1e-4]"] = _with_half_width(those.iloc[0]) if len(those) else ""
            both = on_both(rows)
            if len(both):
                both = both[(both["Ca_e"] == Ca_e) & (both["period"] == period)]
            ratio = [abs(r["mean"] - r["mean_fine"]) / r["half_width"] for _, r in both.iterrows()]
            line["difference over the coarse half-width"] = f"{ratio[0]:.2f}" if ratio else ""
            changes = [each["change"].iloc[0] for each in of_levels.values() if len(each)]
            line["the last two cycles differ by [1e-4]"] = _scaled(changes[-1], -4).lstrip("+") if changes else ""
            lines.append(line)
    return pd.DataFrame(lines)


def _with_half_width(row: pd.Series) -> str:
    return f"{_scaled(row['mean'], -4)} ± {_scaled(row['half_width'], -4).lstrip('+')}"


def _signs(rows: Rows) -> pd.DataFrame:
    """Between which periods the drift changes its sign."""
    lines = []
    found = rows.topic("giesekus")
    for (Ca_e, level), group in found[found["length"] == 6].groupby(["Ca_e", "level"]) if len(found) else ():
        ordered = group.sort_values("period")
        for (_, one), (_, other) in pairwise(ordered.iterrows()):
            if one["mean"] * other["mean"] < 0:
                means, inverse = [one["mean"], other["mean"]], [1 / one["period"], 1 / other["period"]]
                zero = 1 / (inverse[0] - means[0] * (inverse[1] - inverse[0]) / (means[1] - means[0]))
                line = {"beads": "soft" if Ca_e else "rigid", "cells": level}
                line["between periods"] = f"{one['period']:g} and {other['period']:g}"
                lines.append(line | {"at, linear in 1/period": f"{zero:.3g}"})
    return pd.DataFrame(lines)


def _longer_tube(rows: Rows) -> pd.DataFrame:
    found = rows.runs("giesekus", level="coarse", period=2.0, Ca_e=0.0)
    lines = [
        {"length": f"{row['length']:g}", "mean of dU [1e-4]": _with_half_width(row)} for _, row in found.iterrows()
    ]
    return pd.DataFrame(lines)


def _random(rows: Rows) -> pd.DataFrame:
    found = rows.topic("random")
    lines = [
        {"ended by": f"{reason}", "runs": f"{those['run'].nunique()}"}
        for reason, those in (found.groupby("reason") if len(found) else [])
    ]
    return pd.DataFrame(lines)


def _bench(rows: Rows) -> pd.DataFrame:
    found, constant = rows.topic("bench"), rows.runs("bench", run="constant")
    lines = []
    for _, row in found.iterrows():
        line = {"flow": row["run"], "mean of dU [1e-3 U_av]": _scaled(row["mean"], -3, 4)}
        line["half-width"] = _scaled(row["half_width"], -3, 4).lstrip("+")
        if len(constant):
            line["beside the constant flow"] = f"{100 * (row['mean'] / constant['mean'].iloc[0] - 1):+.2f} %"
        line |= {"steps": f"{row['steps']:.0f}"}
        lines.append(line)
    return pd.DataFrame(lines)
