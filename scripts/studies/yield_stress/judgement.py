"""What is said of spheres and pairs in liquids with a yield stress, judged by the stored results."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from math import hypot, pi, sqrt
from typing import Any

import pandas as pd
from book import comparison, pages
from book.case_parts import complete
from book.comparison import Column, Table, cell
from book.statements import Judged, Value, falling, negative, positive, rising
from book.study import Part

from studies.yield_stress.cases import MESHES

BERIS = 0.143
"""Yield number above which a sphere does not move: Beris, Tsamopoulos, Armstrong and Brown (1985)."""
SCALE = 1e3  # velocities are shown in 1e-3 U_av


def drags(results: pd.DataFrame) -> pd.DataFrame:
    """K = F/(3 pi eta_p D_p V), its half-width and the yield number of the spheres."""
    rows = results[results["kind"] == "sphere"]
    unit = 3 * pi * rows["beta"]
    return rows.assign(K=rows["F_1"] / unit, error=rows["F_error_1"] / unit)


def held(results: pd.DataFrame, Bn: float, Ca_e: float, d: float, t: float = 4.0) -> Value:
    """dU of a pair that is held, in `SCALE`; nothing is known where it is not computed."""
    rows = results[(results["kind"] == "pair") & results["dU"].notna()]
    here = rows.query("Bn == @Bn and Ca_e == @Ca_e and d == @d and t == @t")
    return _value(here)


def at(results: pd.DataFrame, beta: float, alpha: float, d: float) -> Value:
    """dU of a curve at a distance, in `SCALE`."""
    rows = results[(results["kind"] == "curve") & (results["dU"] != 0)]
    return _value(rows.query("beta == @beta and alpha == @alpha and d == @d"))


def zero(results: pd.DataFrame, beta: float, alpha: float) -> Value:
    """The first zero of a curve."""
    rows = results[(results["kind"] == "curve") & (results["dU"] == 0)].query("beta == @beta and alpha == @alpha")
    return (float(rows["d"].iloc[0]), float(rows["dU_error"].iloc[0])) if len(rows) else (0.0, float("inf"))


def _value(rows: pd.DataFrame) -> Value:
    if not len(rows):
        return 0.0, float("inf")
    error = rows["dU_error"].iloc[0]
    return SCALE * float(rows["dU"].iloc[0]), SCALE * float(error) if pd.notna(error) else 0.0


def statements(results: pd.DataFrame, parts: Sequence[Part]) -> dict[str, Judged]:
    """What the page says of spheres and pairs."""
    found = _of_spheres(drags(results))
    if (results["kind"] == "curve").any():
        found |= _of_pairs(results)
    return found | complete(results, parts)


def _of_spheres(rows: pd.DataFrame) -> dict[str, Judged]:
    wide: Any = rows.pivot(index=["beta", "Bn", "m"], columns="mesh", values=["K", "error"])
    names = [name for name in MESHES if ("K", name) in wide]
    margins = [
        (float(wide["error"][coarse][place] - abs(wide["K"][coarse][place] - wide["K"][fine][place])), 0.0)
        for coarse, fine in pairwise(names)
        for place in wide.index[wide["K"][[coarse, fine]].notna().all(axis=1)]
    ]
    found = {}
    if margins:
        text = f"{sum(margin >= 0 for margin, _ in margins)} of {len(margins)}"
        found["the interval of the drag on a sphere holds the value on the next smaller cells"] = Judged(
            tuple(margins), text
        )
    limit, error = yield_limit(rows)
    if limit:
        text = f"{limit:.3f} ± {error:.3f}"
        judged = Judged(((error - abs(limit - BERIS), 0.0),), text)
        found[f"the yield number from which a sphere does not move is {BERIS:g} within its half-width"] = judged
    return found


def yield_limit(rows: pd.DataFrame) -> Value:
    """Bn/(6 K) for large Bn, from two spheres, as it falls as Bn^(-1/2)."""
    fine = rows[(rows["mesh"] == "N_p 80") & (rows["beta"] == 0.25)].set_index("Bn")
    if not {100.0, 2500.0} <= set(fine.index):
        return 0.0, 0.0
    values = [(Bn / (6 * fine["K"][Bn]), sqrt(Bn), fine["error"][Bn] / fine["K"][Bn]) for Bn in (100.0, 2500.0)]
    (y, x, e), (z, w, f) = values
    return float((z * w - y * x) / (w - x)), float(hypot(z * w * f, y * x * e) / (w - x))


def _of_pairs(results: pd.DataFrame) -> dict[str, Judged]:
    """What the abstract of Esposito, Tsamopoulos, Villone and D'Avino (2025) says, and what softness does."""
    softness = (0.0, 0.05, 0.1)
    near, far = held(results, 0.1, 0.0, 0.1), held(results, 0.1, 0.0, 0.4)
    stopped = [held(results, 5.0, Ca_e, d) for d in (0.1, 0.4) for Ca_e in softness]
    within = Judged(
        tuple((error - abs(value), 0.0) for value, error in stopped),
        f"{sum(abs(value) <= error for value, error in stopped)} of {len(stopped)} intervals hold 0",
    )
    distances = (0.05, 0.1, 0.2, 0.4, 0.8, 1.6)
    peaks = {
        place: max(at(results, *place, d) for d in distances)
        for place in ((0.3, 0.2), (0.4, 0.2), (0.5, 0.2), (0.4, 0.05))
    }
    least = {place: min(at(results, *place, d) for d in distances) for place in ((0.4, 0.2), (0.4, 0.05))}
    by_softness = {
        (Bn, d): [held(results, Bn, Ca_e, d) for Ca_e in softness] for Bn, d in ((0.0, 0.1), (0.1, 0.1), (1.0, 0.4))
    }
    return {
        "a small yield stress (Bn 0.1): attraction near": negative([near], "dU at d 0.1"),
        "a small yield stress: repulsion far": positive([far], "dU at d 0.4"),
        "a small yield stress weakens the attraction": rising([held(results, 0.0, 0.0, 0.1), near], "dU at Bn 0, 0.1:"),
        "a large one (Bn 5): standstill": within,
        "plasticity with elasticity strengthens repulsion (Bn 1, d 0.4)": rising(
            [held(results, 0.0, 0.0, 0.4), held(results, 1.0, 0.0, 0.4)], "dU at Bn 0, 1:"
        ),
        "confinement strengthens repulsion": rising([peaks[beta, 0.2] for beta in (0.3, 0.4, 0.5)], "largest dU"),
        "less shear thinning amplifies the largest dU": rising([peaks[0.4, 0.2], peaks[0.4, 0.05]], "largest dU"),
        "less shear thinning amplifies attraction": falling([least[0.4, 0.2], least[0.4, 0.05]], "least dU"),
        "less shear thinning expands the attractive region": rising(
            [zero(results, 0.4, 0.2), zero(results, 0.4, 0.05)], "its end"
        ),
        "softness weakens the attraction at Bn 0": rising(by_softness[0.0, 0.1], "dU"),
        "softness weakens the attraction at Bn 0.1": rising(by_softness[0.1, 0.1], "dU"),
        "softness strengthens the repulsion at Bn 1, d 0.4": rising(by_softness[1.0, 0.4], "dU"),
    }


def blocks(results: pd.DataFrame, parts: Sequence[Part]) -> dict[str, str]:
    """The tables of the page."""
    return {
        "spheres": pages.markdown(_spheres(drags(results)).shown()),
        "pairs": pages.markdown(_pairs(results[results["kind"] == "pair"])),
        "curves": pages.markdown(_curves(results)),
        "statements": comparison.stated(statements(results, parts)),
    }


def _spheres(rows: pd.DataFrame) -> Table:
    wide: Any = rows.pivot(index=["beta", "Bn", "m"], columns="mesh", values=["K", "error"])
    frame = pd.DataFrame(index=wide.index.rename([r"$\beta$", r"$\mathrm{Bn}^*$", "$m$"]))
    for name in (each for each in MESHES if ("K", each) in wide):
        frame[name], frame[f"error {name}"] = wide["K"][name].to_numpy(), wide["error"][name].to_numpy()
    frame["number"] = frame.index.get_level_values(1) / (6 * frame["N_p 80"])
    columns = [Column(f"$K$, {name}", name, f"error {name}") for name in MESHES if name in frame]
    return Table(
        frame.sort_index(ascending=[False, True, True]),
        [*columns, Column(r"$\mathrm{Bn}^*/(6K)$", "number", shown=".4f")],
    )


def _pairs(rows: pd.DataFrame) -> pd.DataFrame:
    lines = []
    for (d, Bn), own in rows.groupby(["d", "Bn"]):
        line = {"Bn": f"{Bn:g}", "d": f"{d:g}"}
        for Ca_e, each in own.groupby("Ca_e"):
            *before, last = [(SCALE * dU, SCALE * error) for dU, error in each[["dU", "dU_error"]].to_numpy()]
            texts = [f"{value:.2f}" for value, _ in before]
            line[f"Ca_e {Ca_e:g}"] = ", ".join([*texts, cell(*last, ".2f")])
        lines.append(line)
    return pd.DataFrame(lines)


def _curves(results: pd.DataFrame) -> pd.DataFrame:
    lines = []
    for (alpha, beta), own in results[results["kind"] == "curve"].groupby(["alpha", "beta"]):
        line = {"beta": f"{beta:g}", "alpha": f"{alpha:g}"}
        for _, row in own[own["dU"] != 0].iterrows():
            line[f"d {row['d']:g}"] = cell(SCALE * row["dU"], SCALE * row["dU_error"], ".2f")
        lines.append(line | {"zero": cell(*zero(results, float(str(beta)), float(str(alpha))), ".3f")})
    return pd.DataFrame(lines)
