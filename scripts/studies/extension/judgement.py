"""Taylor parameters, stretches and the fold beside the exact ones, and the picture of the start-up."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from book import comparison
from book.case_parts import complete
from book.comparison import Column, Table
from book.computing import DOCS
from book.drawing import png
from book.statements import Judged
from book.study import Part
from matplotlib import pyplot
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from pairsim.runtime.arrays import Array
from studies.extension import references as exact
from studies.extension.cases import CA
from studies.extension.spheroid import K, steady_Ca

SOURCE = "the exact spheroid"


def start_up(times: Sequence[float]) -> Array:
    """The exact stretch from rest; the elastic stress of a neo-Hookean sphere is l^2 - 1/l."""

    def rate(_: float, x: Array) -> Array:
        return np.asarray(x * (K(x[0]) * CA - x**2 + 1 / x) / (K(x[0]) - 3))

    return np.asarray(solve_ivp(rate, (0, max(times)), [1.0], t_eval=times, rtol=1e-9, atol=1e-10).y[0])


def tables(results: pd.DataFrame) -> dict[str, Table]:
    """The tables of the page; that of the fold if it is computed."""
    kinds = {str(kind): rows for kind, rows in results.groupby("kind")}
    steady = kinds["steady"].set_index("Ca")
    times = {kind: kinds[kind].set_index("t")["stretch"] for kind in ("start-up", "relaxation")}
    in_time = pd.DataFrame(times).sort_index()
    in_time["exact start-up"] = pd.Series(start_up(times["start-up"].index.tolist()), times["start-up"].index)
    in_time["exact relaxation"] = pd.Series(exact.RELAXATION)
    found = {
        "steady": Table(
            steady.assign(exact=pd.Series(exact.STEADY)),
            [Column("D", to="exact", allowed=2e-3, source=SOURCE)],
        ),
        "in-time": Table(
            in_time,
            [Column(kind, to=f"exact {kind}", allowed=1e-3, source=SOURCE) for kind in ("start-up", "relaxation")],
        ),
    }
    if "fold" in kinds:
        columns = [Column("Ca of the fold", "Ca", to=exact.FOLD, allowed=5e-3, source=SOURCE)]
        found["fold"] = Table(kinds["fold"].reset_index(drop=True), columns)
    return found


def statements(results: pd.DataFrame, parts: Sequence[Part]) -> dict[str, Judged]:
    """That all are as close as is allowed."""
    return comparison.statements(tables(results)) | complete(results, parts)


def blocks(results: pd.DataFrame, parts: Sequence[Part]) -> dict[str, str]:
    """The tables of the page."""
    return comparison.blocks(tables(results))


def pictures(results: pd.DataFrame, parts: Sequence[Part]) -> Mapping[Path, bytes]:
    """The stretch from rest."""
    found = results[results["kind"] == "start-up"]
    t = np.linspace(0.01, max(found["t"]), 200)
    figure, axis = pyplot.subplots(figsize=(5, 3.4))
    axis.plot(t, start_up(list(t)), "k-", lw=1, label="exact")
    axis.plot(found["t"], found["stretch"], "o", ms=5, label="pairsim")
    end = brentq(lambda x: steady_Ca(x) - CA, 1.1, 2.0)
    axis.axhline(end, color="grey", lw=0.8, ls="--", label="steady")
    axis.set(xlabel=r"$t\,G/\eta$", ylabel="axial stretch $l$")
    axis.legend()
    return {DOCS / "validation" / "images" / "extension.png": png(figure)}
