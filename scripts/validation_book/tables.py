"""Tables of pages that are more than the columns of their cases."""

from __future__ import annotations

import json
import subprocess
import sys
from math import inf, pi
from typing import Any

import numpy as np
import pandas as pd
from book.cases import Case
from book.computing import ROOT
from matplotlib import pyplot
from scipy.interpolate import CubicHermiteSpline

from pairsim.quantities.text import with_error
from validation_book.page import BOOK, Page, rows_of, verification

BALANCES = ROOT / "scripts" / "field_balances.py"
FALLS = [(1, "yes"), (0, "yes, in part within the intervals"), (-1, "undecided"), (-inf, "no")]
"""Verdicts by the least difference of neighbours, in sums of their half-widths."""
RADIUS = 0.25
"""Of the sphere in the tube [D_c]: De_b = lambda U/a is De over this."""
OF_PEAK = 5e-4
"""Allowed difference from pyoomph, relative to the largest |dU| of the curve, besides what their refinement changes."""


def benchmark(page: Page) -> pd.DataFrame:
    """K on all meshes and how far it is from that of the next coarser one; of the finest with a solution the stress."""
    rows = page.rows("oldroyd-b")
    unit, indicators = 6 * pi * RADIUS, ["s_jump", "c_max", "c_max_z", "c_max_r"]
    rows = rows.assign(De_b=(rows["De"] / RADIUS).round(9), K=rows["F_1"] / unit, error=rows["F_error_1"] / unit)
    wide: Any = rows.pivot(index="De_b", columns="accuracy", values=["K", "error", *indicators])
    wide = wide.iloc[:, ::-1]  # 5% first
    K, errors = wide["K"], wide["error"]
    figure, axis = pyplot.subplots(figsize=(5, 3.6))
    for name, marker in zip(K, "sdo", strict=True):
        axis.errorbar(K.index, K[name], errors[name], marker=marker, ms=4, capsize=2, label=f"mesh of {name}")
    axis.set(xlabel=r"$\mathrm{De}_b = \lambda U/a$", ylabel=r"$K = F/(6\pi\eta_0 a U)$", ylim=(4.8, 5.8))
    axis.legend()
    page.save_picture(figure)
    finest = {name: wide[name].ffill(axis=1).iloc[:, -1] for name in indicators}
    changes = 100 * (1 - K.shift(axis=1) / K)
    return K.join([errors.add_prefix("error of "), changes.add_prefix("change to ")]).assign(**finest).reset_index()


def unknowns(page: Page) -> pd.DataFrame:
    """The number of unknowns on each mesh, and the largest De_b that is asked for there."""
    rows = [{**case.parameters, **case.result.record} for case in page.cases("oldroyd-b")]
    largest = pd.DataFrame(rows).groupby("accuracy")[["unknowns", "De"]].max().iloc[::-1]
    return largest.assign(De_b=largest["De"] / RADIUS).reset_index()


def slopes(page: Page) -> pd.DataFrame:
    """dU/Ca_e at two small Ca_e, extrapolated to 0."""
    rows = page.rows("pairs")
    rows = rows.assign(slope=rows["dU"] / rows["Ca_e"], error=rows["dU_error"] / rows["Ca_e"])
    wide: Any = rows.pivot(index=["beta", "d"], columns="Ca_e", values=["slope", "error"])
    near, far = (wide["slope"].iloc[:, i] for i in (0, 1))
    found = pd.DataFrame({"far": far, "near": near, "limit": 2 * near - far, "error": wide["error"].max(axis=1)})
    return found.reset_index()


def single_sphere(page: Page) -> pd.DataFrame:
    """The Legendre modes of the outline of a single sphere at Ca_e 1e-3, from a run in time until it is steady."""
    f = verification("test_soft").single_sphere_modes(1e-3)
    return pd.DataFrame({"f_3": [f[3]], "f_5": [f[5]], "largest of f_2, f_4": [np.abs(f[[2, 4]]).max()]})


def drag(page: Page) -> pd.DataFrame:
    """F over 3 pi K V^n D_p^(2 - n) in power-law liquids, and the upper bound of that in an unbounded liquid."""
    rows = page.rows("dragged").rename(columns={"liquid.n": "n"})
    unit = 3 * pi * rows["beta"] ** (2 - rows["n"])
    unbounded = {n: verification("test_materials_in_scenes").ritz(n, (1, 3, 5, 7), 16) for n in rows["n"].unique()}
    return rows.assign(X=rows["F_1"] / unit, error=rows["F_error_1"] / unit, unbounded=rows["n"].map(unbounded))


def critical(page: Page) -> pd.DataFrame:
    """Critical distances along three lines through the first case, and whether they fall as each parameter grows."""
    rows, found = page.rows("lines").query("not stable").rename(columns={"liquid.alpha": "alpha"}), []
    first = page.cases("lines")[0].parameters
    centre = {"De": first["De"], "alpha": first["liquid.alpha"], "beta": first["beta"]}
    for key in centre:
        others = " and ".join(f"{other} == {value}" for other, value in centre.items() if other != key)
        line = rows.query(others).sort_values(key)
        if len(line) < 2:  # --quick
            continue
        d, e = line["d_cr"].to_numpy(), line["d_error"].to_numpy()
        least = min((d[:-1] - d[1:]) / (e[:-1] + e[1:]))
        cells = [with_error(*each).replace("+-", "±") for each in zip(d, e, strict=True)]
        row = {"varied": f"{key} {', '.join(f'{value:g}' for value in line[key])}", "d_cr": ", ".join(cells)}
        found.append(row | {"falls": next(word for bound, word in FALLS if least > bound)})
    return pd.DataFrame(found)


def balances(page: Page) -> pd.DataFrame:
    """What scripts/field_balances.py, which does not import pairsim, finds in the last fields of every pair."""
    return pd.DataFrame([balance(case) for sweep in ("soft", "rigid", "run") for case in page.cases(sweep)])


def balance(case: Case) -> dict[str, Any]:
    """Worst slice and worst volume, forces over that on a sphere in unbounded liquid at unit velocity, and powers."""
    done = subprocess.run([sys.executable, BALANCES, case.folder], capture_output=True, text=True, check=True)
    found, rows = json.loads(done.stdout)[-1], rows_of(case)
    row = rows.loc[(rows["t" if "t" in rows else "d"] - found["t"]).abs().idxmin()]
    Q, drag, volume = row.get("flow", 1) * pi / 4, 3 * pi * row["beta"], pi * row["beta"] ** 3 / 6
    outside = {particle: row.get(f"F_{particle}", 0.0) for particle in "TL"}
    line = {"pair": str(row["name"]).replace("-", " "), "beta": row["beta"], "pi": pi}
    if found["volumes"]:
        line["flow rate"] = max(found["flow_rates"], key=lambda rate: abs(rate - Q))
        line["volume of a particle"] = max(found["volumes"], key=lambda each: abs(each - volume))
    for (particle, known), force in zip(outside.items(), found["forces"], strict=True):
        line |= {particle: force / drag, f"outside {particle}": known / drag}
    line["power"] = found["liquid_power"] + found["particles_power"]
    return line | {"put in": row["dp"] * Q + sum(F * row[f"U_{particle}"] for particle, F in outside.items())}


def pyoomph(page: Page) -> pd.DataFrame:
    """dU_held and Taylor parameters beside those of pyoomph at every distance of its tracked table."""
    theirs, cases = pd.read_csv(BOOK / "pyoomph.csv"), page.cases("curves")
    coarse, fine = (theirs[theirs["cells"] == cells].set_index(["beta", "d"]) for cells in (40, 80))
    rows = pd.concat([rows_of(case) for case in cases]).set_index(["beta", "d"])
    change, peak = fine["dU"] - coarse["dU"], fine["dU"].abs().groupby("beta").max()
    rows = rows.join(fine[["dU", "D_T", "D_L"]].add_prefix("theirs "))
    rows["change"], rows["apart"] = 100 * change / peak, 100 * (rows["dU_held"] - fine["dU"]) / peak
    rows["allowed"] = (change.abs() + OF_PEAK * peak) / fine["dU"].abs()
    draw_curves(page, cases, fine)
    return rows.reset_index()


def draw_curves(page: Page, cases: list[Case], theirs: pd.DataFrame) -> None:
    """Both curves of every confinement; distances are held in both."""
    figure, axes = pyplot.subplots(1, len(cases), figsize=(4 * len(cases), 3.2), squeeze=False)
    for axis, case in zip(axes[0], cases, strict=True):
        beta, (d, held, slope) = case.parameters["beta"], case.table[["d", "dU_held", "slope"]].to_numpy().T
        if len(d) > 1:
            between = np.geomspace(d[0], d[-1], 200)
            axis.plot(between, 1e3 * CubicHermiteSpline(np.log(d), held, d * slope)(np.log(between)), label="pairsim")
        axis.plot(theirs.loc[beta].index, 1e3 * theirs.loc[beta, "dU"], "o", ms=5, mfc="none", label="pyoomph")
        axis.axhline(0, color="grey", lw=0.6)
        axis.set(xscale="log", xlabel=r"$d$", ylabel=r"$10^3\,\Delta U$ at held distance", title=rf"$\beta = {beta:g}$")
        axis.set_xticks(d, [f"{each:g}" for each in d])
        axis.minorticks_off()
        axis.legend()
    page.save_picture(figure)
