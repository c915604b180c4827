"""Which dU are inside their half-widths, and whether the accuracy of curves is kept or said to be missed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import pandas as pd
from book import comparison, pages
from book.case_parts import complete
from book.half_widths import half_widths_hold
from book.made import made
from book.statements import Judged
from book.study import Part

from pairsim.cases.accuracy import percent

KNOWN = 1 / 3  # half-width of a reference over that of the point, up to which it decides alone
YES = {True: "yes", False: ""}


def judged(results: pd.DataFrame) -> pd.DataFrame:
    """The points of curves that have a reference.

    Further columns: `error`, the difference from the reference; `ratio`, the error over the half-width; `known`, the
    half-width of the reference over that; and `half_width_percent`, `error_percent` and `known_percent`, of the peak.
    """
    answered = results[results["ended"].isna()]
    kinds = {kind: answered[answered["kind"] == kind] for kind in ("case", "reference")}
    reference = kinds["reference"][["curve", "d", "dU", "dU_error", "seconds"]]
    table = kinds["case"].merge(reference, on=["curve", "d"], suffixes=("", "_of_reference"))
    error, size = (table["dU"] - table["dU_of_reference"]).abs(), 100 / table["peak"]
    return table.assign(
        error=error,
        ratio=error / table["dU_error"],
        known=table["dU_error_of_reference"] / table["dU_error"],
        half_width_percent=size * table["dU_error"],
        error_percent=size * error,
        known_percent=size * table["dU_error_of_reference"],
        said=table["said"].astype(bool),
    )


def worst(table: pd.DataFrame, by: str) -> pd.DataFrame:
    """The point with the largest error in per cent of the peak of each curve or law."""
    return table.loc[table.groupby(by, sort=False)["error_percent"].idxmax()]


def statements(results: pd.DataFrame, parts: Sequence[Part]) -> dict[str, Judged]:
    """What the study states, judged by what is stored."""
    table = judged(results)
    if table.empty:
        return complete(results, parts)
    wanted = percent(table["accuracy"].iloc[0])
    curves, laws = worst(table, "curve"), worst(table, "law")
    silent = curves[~curves["said"]]
    margins = zip(wanted - silent["error_percent"], silent["known_percent"], strict=True)
    largest = f"largest {silent['error_percent'].max():.2g} %; " if len(silent) else ""
    by_law = zip(wanted - laws["error_percent"], laws["known_percent"], strict=True)
    return {
        **half_widths_hold(table["ratio"], table["known"], "dU"),
        f"no error of a curve is above {wanted:g} % of its peak without a warning": Judged(
            tuple(margins) or ((1.0, 0.0),), f"{largest}{len(curves) - len(silent)} of {len(curves)} curves warn"
        ),
        f"the largest error of each law is below {wanted:g} % of the peak": Judged(
            tuple(by_law),
            ", ".join(f"{law} {error:.2g} %" for law, error in zip(laws["law"], laws["error_percent"], strict=True)),
        ),
        **complete(results, parts),
    }


def by_law(table: pd.DataFrame) -> pd.DataFrame:
    """A row for each law, and one for all."""
    groups = [*table.groupby("law", sort=False), ("all", table)]
    return pd.DataFrame([{"law": str(law), **_line(points)} for law, points in groups])


def _line(points: pd.DataFrame) -> dict[str, str]:
    inside, sure = points["ratio"] <= 1, points["known"] <= KNOWN
    curves = points.drop_duplicates("curve")
    return {
        "curves": str(len(curves)),
        "points": str(len(points)),
        "inside": str(inside.sum()),
        "the same, well known": f"{(inside & sure).sum()} of {sure.sum()}",
        "half-width, median": f"{points['half_width_percent'].median():.2g}",
        "error, median": f"{points['error_percent'].median():.2g}",
        "error, largest": f"{points['error_percent'].max():.2g}",
        "error over half-width, largest": f"{points['ratio'].max():.2f}",
        "curves that warn": str(curves["said"].sum()),
        "seconds": f"{curves['seconds'].median():.3g}",
        "of the reference": f"{curves['seconds_of_reference'].median():.3g}",
    }


def by_curve(table: pd.DataFrame) -> pd.DataFrame:
    """A row for each curve."""
    rows = []
    for (number, law), points in table.groupby(["curve", "law"], sort=False):
        first = points.iloc[0]
        row = {"curve": str(number), "law": str(law)}
        row |= {name: f"{first[name]:g}" for name in ("beta", "De", "Ca_e")}
        row |= {"d": ", ".join(map("{:g}".format, points["d"])), "peak": f"{first['peak']:.3g}"}
        row |= {"inside": f"{(points['ratio'] <= 1).sum()} of {len(points)}"}
        row |= {"half-width, largest": f"{points['half_width_percent'].max():.2g}"}
        row |= {"error, largest": f"{points['error_percent'].max():.2g}", "warns": YES[bool(first["said"])]}
        rows.append(row)
    return pd.DataFrame(rows)


def outside(table: pd.DataFrame) -> str:
    """The points outside of their half-widths."""
    off = table[table["ratio"] > 1].sort_values("ratio", ascending=False)
    if off.empty:
        return pages.prose("None.")
    names = {"half_width_percent": "half-width", "error_percent": "error", "ratio": "error over half-width"}
    values = {shown: off[name].map("{:.2g}".format) for name, shown in names.items()}
    return pages.markdown(pd.DataFrame({"curve": off["part"], "d": off["d"].map("{:g}".format), **values}))


def blocks(results: pd.DataFrame, parts: Sequence[Part]) -> Mapping[str, str]:
    """What stands between the marks of the page."""
    table = judged(results)
    return {
        "made": pages.prose(made(results, parts)),
        "statements": comparison.stated(statements(results, parts)),
        "laws": pages.markdown(by_law(table)),
        "curves": pages.markdown(by_curve(table)),
        "outside": outside(table),
    }
