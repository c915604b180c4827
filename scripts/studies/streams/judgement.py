"""What the streams say of order, contact and drops."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import hypot, log
from typing import Any

import pandas as pd
from book import comparison, pages
from book.case_parts import all_computed
from book.statements import Judged, Value, above, below, ratio, rising
from book.study import Part

from pairsim.questions.stream import IN_CONTACT, POSITION_OF_STREAM, SINGLE, SPREAD
from pairsim.record.column import Column
from pairsim.record.columns import DISTANCE, DU, DU_ERROR

NONE = Judged(((0.0, 1.0),), "none is computed")
POISSON_OF_ONE = "poisson"
FOURTH = 4  # the power of beta


def outlet(results: pd.DataFrame, shows: str) -> pd.DataFrame:
    """The last rows of the cases that show something."""
    if SPREAD.name not in results:
        return results[:0]
    return results[(results["shows"] == shows) & results[SPREAD.name].notna()].drop_duplicates("case", keep="last")


def value(row: Mapping[Any, Any], column: Column) -> Value:
    """A number with its half-width by the streams and by the model of rows."""
    name = column.name
    return float(row[name]), hypot(float(row[f"{name}_error"]), float(row[f"{name}_model"]))


def _values(table: pd.DataFrame, column: Column) -> dict[str, Value]:
    return {row["case"]: value(row, column) for row in table.to_dict("records")}


def statements(results: pd.DataFrame, parts: Sequence[Part]) -> dict[str, Judged]:
    """What the study states of what is stored."""
    every = {
        "a spread of sizes harms order more than one of stiffness": _size_against_stiffness(results),
        "the nearer the beads, the more of them touch at the outlet (De 1)": _contact(results),
        "drops of equal rigid beads in a Newtonian liquid are those of the arrivals": _exact(results),
        "drops get exactly one bead more often than by Poisson (De 1 and 2, equal beads)": _drops(results, 1.0),
        "they get it twice as often": _drops(results, 2.0),
        "dU of rigid pairs grows with the fourth power of beta, within a tenth of that (De 0.5)": _power(results),
        "all is computed": all_computed(results, parts),
    }
    return {text: judged for text, judged in every.items() if judged is not NONE}


def _size_against_stiffness(results: pd.DataFrame) -> Judged:
    spread = _values(outlet(results, "order"), SPREAD)
    pairs = [(f"{size} % of size", f"{stiff} % of stiffness") for size, stiff in ((2, 2), (5, 5), (2, 20))]
    found = [rising([spread[stiff], spread[size]]) for size, stiff in pairs if {size, stiff} <= spread.keys()]
    numbers = ", ".join(f"{name} {_percent(each)}" for name, each in spread.items())
    margins = tuple(margin for each in found for margin in each.margins)
    return Judged(margins, f"standard deviation of the distances in % of their mean: {numbers}") if found else NONE


def _contact(results: pd.DataFrame) -> Judged:
    table, found = outlet(results, "contact"), list[Judged]()
    for name in ("equal", "2 % of size"):
        of = table[table["case"].str.endswith(name)].sort_values("d", ascending=False)
        if len(of) > 1:
            found.append(rising([value(row, IN_CONTACT) for row in of.to_dict("records")], f"{name}:"))
    margins = tuple(margin for each in found for margin in each.margins)
    return Judged(margins, "; ".join(each.numbers for each in found)) if found else NONE


def _exact(results: pd.DataFrame) -> Judged:
    if not len(table := outlet(results, "exact")):
        return NONE
    first = results[(results["shows"] == "exact")].drop_duplicates("case").set_index("case")
    margins, texts = [], []
    for row in table.to_dict("records"):
        (now, error), before = value(row, SINGLE), float(first.loc[row["case"], SINGLE.name])
        margins.append((error - abs(now - before), 0.0))
        texts.append(f"d {row['d']:g}: one bead in {100 * before:.3g} %, then {100 * now:.3g} ± {100 * error:.1g} %")
    return Judged(tuple(margins), "; ".join(texts))


def _drops(results: pd.DataFrame, factor: float) -> Judged:
    table = outlet(results, "drops")
    table = table[table["case"].str.endswith("equal")]
    if not len(table):
        return NONE
    ratios = {row["case"]: ratio(value(row, SINGLE), (row[POISSON_OF_ONE], 0.0)) for row in table.to_dict("records")}
    text = "; ".join(f"{name}: {each:.2f} ± {error:.2f}" for name, (each, error) in ratios.items())
    return Judged(above(list(ratios.values()), factor).margins, text)


def of_pairs(results: pd.DataFrame) -> pd.DataFrame:
    """dU of pairs with its half-width, a row for each beta and distance."""
    if DU.name not in results:
        return results[:0]
    return results[(results["shows"] == "pair") & results[DU.name].notna()].sort_values(["beta", DISTANCE.name])


def power(smaller: Mapping[Any, Any], larger: Mapping[Any, Any]) -> Value:
    """The power of beta by which dU grows from one pair to another one."""
    growth, error = ratio(*((row[DU.name], row[DU_ERROR.name]) for row in (larger, smaller)))
    octaves = log(larger["beta"] / smaller["beta"])
    return log(growth) / octaves, error / growth / octaves


def powers(results: pd.DataFrame) -> dict[float, Value]:
    """The power from the smallest to the largest beta at each distance."""
    every = of_pairs(results).groupby(DISTANCE.name)
    ends = {float(str(d)): [each.iloc[0].to_dict(), each.iloc[-1].to_dict()] for d, each in every if len(each) > 1}
    return {d: power(*each) for d, each in ends.items()}


def _power(results: pd.DataFrame) -> Judged:
    if not (found := powers(results)):
        return NONE
    text = ", ".join(f"d {d:g}: {each:.2f} ± {error:.2f}" for d, (each, error) in found.items())
    return Judged(below([(each - FOURTH, error) for each, error in found.values()], FOURTH / 10).margins, text)


def pairs(results: pd.DataFrame) -> pd.DataFrame:
    """dU over the fourth power of beta."""
    lines = []
    for d, each in of_pairs(results).groupby(DISTANCE.name):
        line = {"d": f"{d:g}"}
        for row in each.to_dict("records"):
            scale = 100 / row["beta"] ** FOURTH
            line[f"beta {row['beta']:g}"] = comparison.cell(scale * row[DU.name], scale * row[DU_ERROR.name], ".3g")
        lines.append(line)
    return pd.DataFrame(lines)


def _percent(number: Value) -> str:
    return comparison.cell(100 * number[0], 100 * number[1], ".3g")


def shown(results: pd.DataFrame, shows: str) -> pd.DataFrame:
    """The cases that show something, at the inlet and at the outlet."""
    lines, last = [], outlet(results, shows)
    first = results[results["shows"] == shows].drop_duplicates("case").set_index("case")
    for row in last.to_dict("records"):
        inlet = first.loc[row["case"]]
        line = {"case": row["case"], "tube": f"{row[POSITION_OF_STREAM.name]:.0f}"}
        line |= {"spread of distances at first, %": f"{100 * inlet[SPREAD.name]:.3g}"}
        line |= {"at the outlet": _percent(value(row, SPREAD)), "in contact, %": _percent(value(row, IN_CONTACT))}
        if row[SINGLE.name] == row[SINGLE.name]:
            line |= {"one bead at first, %": f"{100 * inlet[SINGLE.name]:.3g}"}
            line |= {"one bead at the outlet": _percent(value(row, SINGLE))}
            line |= {"by Poisson": f"{100 * row[POISSON_OF_ONE]:.3g}"}
        lines.append(line)
    return pd.DataFrame(lines)


def blocks(results: pd.DataFrame, parts: Sequence[Part]) -> Mapping[str, str]:
    """What stands between the marks of the page."""
    days = dict.fromkeys(sorted(results["computed"].unique()))
    tables = {name: shown(results, name) for name in ("order", "contact", "drops", "exact")}
    tables["pairs"] = pairs(results)
    written = {name: pages.markdown(table) if len(table) else "None.\n" for name, table in tables.items()}
    return {
        "made": pages.prose(f"{results['part'].nunique()} of {len(parts)} streams, computed {' to '.join(days)}."),
        "statements": comparison.stated(statements(results, parts)),
        **written,
    }
