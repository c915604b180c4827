"""Which code takes less time for the same error."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from io import BytesIO
from itertools import product
from pathlib import Path

import pandas as pd
from book import pages
from book.case_parts import complete
from book.computing import DOCS
from book.made import made
from book.statements import Judged, below
from book.study import Part
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from studies.codes.parts import OWN, PEER

WANTED = (("point", 1.2), ("point", 0.15), ("point", 0.02), ("run", 0.1))
"""Errors at which times are compared [%], which the table has of both codes."""
NOISE = 0.1  # part of a processor time by which a median of three may be off where no spread is stored; chosen
TITLES = {"point": "Quasi-steady point", "run": "Run to t = 1"}


def statements(results: pd.DataFrame, parts: Sequence[Part]) -> dict[str, Judged]:
    """What the study states, judged by what is stored."""
    found = dict[str, Judged]()
    whole = results["seconds"] + results["set_up"]
    spread = _spread(results).fillna(NOISE)
    for (what, wanted), (words, seconds) in product(
        WANTED, {"": whole, "'s solution alone": results["seconds"]}.items()
    ):
        good = (results["what"] == what) & (results["error"] <= wanted)
        fastest = seconds[good].groupby(results["by"]).idxmin()
        if {OWN, PEER} <= set(fastest.index):
            own, peer = (seconds[fastest[code]] for code in (OWN, PEER))
            off = sum(float(spread[fastest[code]] * seconds[fastest[code]]) for code in (OWN, PEER))
            text = ", ".join(f"{code} {time:.3g} s" for code, time in ((OWN, own), (PEER, peer)))
            margin = (float(peer - own), off)
            statement = f"a {what} with an error of {wanted:g} % takes less time than with {PEER}{words}"
            found[statement] = Judged((margin,), text)
    points = results[results["what"] == "point"]
    other, own = (points[points["by"] == code] for code in (PEER, OWN))
    if len(other):
        error = (float(other.nlargest(1, "cells")["error"].iloc[0]), 0.0)
        found[f"dU of a point with {PEER} on its finest mesh is off by less than 0.01 %"] = below([error], 0.01, "by %")
    coarsest = (float(own.nsmallest(1, "cells")["error"].iloc[0]), 0.0)
    found["dU of a point on the coarsest mesh is off by less than 2 %"] = below([coarsest], 2.0, "by %")
    return found | complete(results, parts)


def blocks(results: pd.DataFrame, parts: Sequence[Part]) -> Mapping[str, str]:
    """What stands between the marks of the page."""
    tolerances = results["tol"].map(lambda tol: f", {tol:g}" if tol else "")
    columns = {
        "what, tol": results["what"] + tolerances,
        "cells": results["cells"].astype(int),
        "code": results["by"],
        "cell": [_cell(row) for _, row in results.iterrows()],
    }
    text = pd.DataFrame(columns)
    table = text.pivot(index=["what, tol", "cells"], columns="code", values="cell").fillna("").reset_index()
    return {"codes": pages.markdown(table), "codes-made": pages.prose(f"{made(results, parts)} {_of_medians(results)}")}


def _spread(results: pd.DataFrame) -> pd.Series:
    """The spread of the repetitions as a part of the median, NaN where it is not stored."""
    return results["spread"] if "spread" in results else pd.Series(float("nan"), results.index)


def _of_medians(results: pd.DataFrame) -> str:
    """How far the repetitions lie apart, in words."""
    spread = _spread(results)
    if spread.notna().any():
        return (
            "Half of what the longest of three processes took more than the shortest is up to "
            f"{100 * spread.max():.2g} % of the median; two times are taken to differ if they do by more than the sum "
            "of theirs."
        )
    return (
        "How far the three processes lay apart was not stored: two times are taken to differ if they do by more than "
        f"{100 * NOISE:g} % of their sum."
    )


def _cell(row: pd.Series) -> str:
    """Seconds of the solution and, kept apart, of the set-up; and the error."""
    return f"{row['seconds']:.3g}{f' + {row["set_up"]:.2g}' if row['set_up'] else ''}, {row['error']:.2g}"


def files(results: pd.DataFrame, parts: Sequence[Part]) -> Mapping[Path, bytes]:
    """The picture of error against time of points and runs."""
    figure = Figure(figsize=(10, 3.75))
    for axis, (what, title) in zip(figure.subplots(1, 2), TITLES.items(), strict=True):
        for marker, (code, rows) in zip("os^", results[results["what"] == what].groupby("by"), strict=False):
            (line,) = axis.loglog(rows["seconds"] + rows["set_up"], rows["error"], marker, label=code)
            if rows["set_up"].any():
                label = f"{code}, solution alone"
                axis.loglog(rows["seconds"], rows["error"], marker, mfc="none", color=line.get_color(), label=label)
        axis.xaxis.set_minor_formatter(NullFormatter())
        axis.set(title=title, xlabel="processor time [s]", ylabel="error of $\\Delta U$ [%]")
    figure.axes[0].legend(frameon=False)
    figure.tight_layout()
    drawn = BytesIO()
    figure.savefig(drawn, format="png", dpi=110)
    return {DOCS / "images" / "codes.png": drawn.getvalue()}
