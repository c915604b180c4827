"""What each accuracy costs and leaves, beside the discretisation of the paper: tables, statements and the picture."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import cache
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from book import pages, yaml_files
from book.case_parts import complete
from book.computing import DOCS
from book.made import made
from book.statements import Judged
from book.study import Part
from matplotlib.figure import Figure

from pairsim.cases.accuracy import SETTINGS, Cells, percent
from studies.accuracy.parts import CASES, SCENES

TITLES = dict(zip(SCENES, ("Newtonian, soft", "De 1, soft", "De 2, rigid", "De 1, soft, gap .02"), strict=True))
FASTER = 50
"""So many times less than with the discretisation of the paper a run takes at least."""
COLUMNS = ["kind", "study", "cells", "Np", "max_size", "wanted", "percent", "reference", "unknowns", "seconds"]
COLUMNS += ["mean_seconds", "steps", "iterations", "factorisations", "step_seconds", "spread"]
COLUMNS += ["graded_unknowns", "graded_seconds"]
MOVING = {
    **dict.fromkeys(("beta", "De", "Ca_e", "d_0", "t"), "{:g}"),
    "d": "{:.4f}",
    "t_relax": "{:.2g}",
    "dU of the run": "{:.4e}",
    "its dU_error": "{:.1e}",
    "dU": "{:.4e}",
    "dU_error": "{:.1e}",
    "dU_held": "{:.4e}",
    "run less dU_held, % of the peak": "{:.2f}",
    "run less dU, % of the peak": "{:.2f}",
}
"""Columns of the table of runs beside curves, and their formats."""


@cache
def keys_of(study: str) -> tuple[float, float, float]:
    """beta, De and Ca_e of a study."""
    base = yaml_files.read(CASES / f"{study}.yaml")["base"]
    return base["beta"], base["De"], base["Ca_e"]


def table_of(results: pd.DataFrame, *kinds: str) -> pd.DataFrame:
    """The rows of studies of some kinds."""
    rows = results.reindex(columns=["part", *COLUMNS])
    return rows[rows["kind"].isin(kinds)].assign(reference=rows["reference"].eq(True))


def number(value: float, digits: int = 2) -> str:
    """A number with so many digits, as an integer from 100 on; empty for NaN."""
    return "" if math.isnan(value) else f"{value:.0f}" if value >= 100 else f"{value:.{digits}g}"


def seconds_of(table: pd.DataFrame) -> pd.Series:
    """Seconds of rows; those that are known in the mean over the curves of a mesh alone have this."""
    return table["seconds"].fillna(table["mean_seconds"])


def of_curves(results: pd.DataFrame) -> pd.DataFrame:
    """Curves on graded cells with the keys of their scenes."""
    table = table_of(results, "curve")
    keys = pd.DataFrame([keys_of(each) for each in table["study"]], table.index, ["beta", "De", "Ca_e"])
    found = table.join(keys)
    return found[found["cells"] == "graded"]


def curves(results: pd.DataFrame, liquid: str) -> pd.DataFrame:
    """Errors and times of master curves in Newtonian or viscoelastic liquids, but on meshes of references alone."""
    table = of_curves(results)
    here = table[(table["De"] == 0) == (liquid == "newtonian")]
    scene = here[["beta", "De", "Ca_e"]].map("{:g}".format).agg(", ".join, axis=1)
    mesh = here["Np"].map("{:g}, ".format) + here["max_size"].map("{:g}".format)
    cell = here["percent"].map(number).where(~here["reference"], "reference")
    here = here.assign(scene=scene, mesh=mesh, cell=cell)
    cells = here.pivot_table(index="scene", columns="mesh", values="cell", aggfunc="first", sort=False)
    cells.loc["mean s"] = seconds_of(here).groupby(here["mesh"]).mean().map("{:.1f}".format)
    cells.index.name = "beta, De, Ca_e"
    order = sorted(cells.columns, key=lambda mesh: (int(mesh.split(", ")[0]), -float(mesh.split(", ")[1])))
    shown = [mesh for mesh in order if not set(cells[mesh].iloc[:-1].dropna()) <= {"reference"}]
    return cells[shown].fillna("").reset_index()


def on_cells(table: pd.DataFrame, cells: Cells) -> pd.DataFrame:
    """The curves on cells of a setting, which depend on beta."""
    largest = table["beta"].map(cells.largest).astype(float)
    return table[(table["Np"] == cells.Np) & np.isclose(table["max_size"].astype(float), largest)]


def liquids(results: pd.DataFrame, name: str) -> dict[str, pd.DataFrame]:
    """The curves on the cells that runs with an accuracy have in each liquid."""
    table, cells = of_curves(results), SETTINGS[name].in_time
    return {
        "Newtonian": on_cells(table[table["De"] == 0], cells["newtonian"]),
        "viscoelastic": on_cells(table[table["De"] > 0], cells["thinning"]),
    }


def settings(results: pd.DataFrame) -> pd.DataFrame:
    """Cells of runs by `accuracy`, with the largest error of a curve on them."""
    lines = []
    for name, chosen in SETTINGS.items():
        line, own = {"`accuracy`": f"`{name}`"}, chosen.in_time
        for kind, here in liquids(results, name).items():
            worst = number(here.loc[~here["reference"], "percent"].max())
            worst = worst or "reference" * bool(here["reference"].any())
            line[kind] = size(own["newtonian" if kind == "Newtonian" else "thinning"])
            line[f"{kind}: worst curve, %"] = worst
        lines.append(line | {"hardening": size(own["hardening"]), "`time.tol`": f"{chosen.time_tol:g}"})
    return pd.DataFrame(lines)


def size(cells: Cells) -> str:
    """Np, max_size with its bound, and rows of a mesh, as text."""
    bound = f" ({cells.per_beta:g} beta)" if cells.per_beta < math.inf else ""
    return f"{cells.Np}, {cells.max_size:g}{bound}, {cells.rows:g}"


def adapted(results: pd.DataFrame) -> pd.DataFrame:
    """What adaptation reached, in brackets the fewest unknowns of graded cells for the same error."""
    rows = table_of(results, "curve", "run")
    rows = rows[rows["cells"] == "adapted"]
    cells = []
    for row in rows.to_dict("records"):
        own, graded = (cost(row[f"{kind}unknowns"], row[f"{kind}seconds"]) for kind in ("", "graded_"))
        cells.append(f"{number(row['percent'])}: {own} ({graded})")
    table = rows.assign(cell=cells).pivot(index="study", columns="wanted", values="cell")
    order = sorted(table.columns, key=percent, reverse=True)
    return table[order].fillna("").reset_index()


def beside_fixed_cells(results: pd.DataFrame) -> str:
    """How adapted meshes keep the accuracy, and their seconds over those of fixed cells, in a sentence."""
    rows = table_of(results, "curve", "run")
    rows = rows[rows["cells"] == "adapted"]
    better = rows["wanted"].map(percent) / rows["percent"]
    ratio = rows["seconds"] / rows["graded_seconds"]
    times = {kind: ratio[(rows["kind"] == kind) & np.isfinite(ratio) & (ratio > 0)] for kind in ("curve", "run")}
    curves_, runs = (f"{each.min():.1f} to {each.max():.1f}" for each in times.values())
    return (
        f"Errors are {better.min():.0f} to {better.max():.0f} times smaller than requested. Curves take {curves_} "
        f"times as long as on fixed cells, runs {runs} times."
    )


def cost(unknowns: float, seconds: float) -> str:
    """Unknowns and seconds; "none" for no mesh."""
    return "none" if math.isinf(unknowns) else f"{unknowns:.0f}, {number(seconds, 3)}"


def paper(results: pd.DataFrame) -> dict[str, tuple[pd.Series, pd.Series]]:
    """The row of the paper's discretisation and that of its plain steps, of the scenes that have both."""
    table, found = table_of(results, "run", "plain"), {}
    for scene in SCENES:
        own = table[table["study"] == f"run-{scene}"]
        fixed, steps = own[own["cells"] == "paper"], own[own["kind"] == "plain"]
        if len(fixed) and len(steps):
            found[scene] = fixed.iloc[0], steps.iloc[0]
    return found


def best(results: pd.DataFrame, study: str, error: float) -> pd.Series:
    """The fastest row of a study whose error is no larger, or else the most accurate one."""
    table = table_of(results, "run", "point")
    table = table[(table["study"] == study) & (table["cells"] != "paper") & (table["percent"] > 0)]
    good = table[table["percent"] <= error]
    return (good.nsmallest(1, "seconds") if len(good) else table.nsmallest(1, "percent")).iloc[0]


def scenes(results: pd.DataFrame) -> pd.DataFrame:
    """Cost relative to the discretisation of the paper."""
    lines = []
    for scene, (fixed, steps) in paper(results).items():
        line = {"scene": TITLES[scene], "unknowns": f"{fixed['unknowns']:.0f}", "steps": f"{fixed['steps']:.0f}"}
        line["iterations, factorisations"] = f"{fixed['iterations']:.0f}, {fixed['factorisations']:.0f}"
        line["s, factorisation reused"] = f"{fixed['seconds']:.0f}"
        each = f"{steps['step_seconds']:.2f} ({steps['spread']:.2f})"
        line["one factorisation per step: s each (spread), s in all"] = f"{each}, {steps['seconds']:.0f}"
        line["error, %"] = number(fixed["percent"])
        for kind, title in (("run", "our transient"), ("point", "our point")):
            row = best(results, f"{kind}-{scene}", fixed["percent"])
            parts = ", ".join(f"1/{whole / row['seconds']:.0f}" for whole in (steps["seconds"], fixed["seconds"]))
            line[title] = f"{number(row['seconds'], 3)} s, {number(row['percent'])} %: {parts}"
        lines.append(line)
    return pd.DataFrame(lines)


def moving(results: pd.DataFrame) -> pd.DataFrame:
    """Runs beside the curves of their cases, with the differences in the half-widths of both."""
    rows = results.reindex(columns=["kind", *MOVING])
    rows = rows[rows["kind"] == "moving"].drop(columns="kind").astype(float)
    apart, known = (rows["dU of the run"] - rows["dU"]).abs(), rows["dU_error"] + rows["its dU_error"]
    return rows.assign(apart=apart, known=known, ratio=apart / known)


def statements(results: pd.DataFrame, parts: Sequence[Part]) -> dict[str, Judged]:
    """What the study states, judged by what is stored."""
    found, beside = dict[str, Judged](), moving(results)
    for name in SETTINGS:
        for liquid, here in liquids(results, name).items():
            worst = here.loc[~here["reference"], "percent"].max()
            if worst == worst:
                text = f"a curve on the cells of {name} in {liquid} liquids is off by less"
                found[text] = Judged(((percent(name) - float(worst), 0.0),), f"{worst:.2g} % at most")
    rows = table_of(results, "curve", "run")
    rows = rows[rows["cells"] == "adapted"]
    over = rows["percent"] / rows["wanted"].map(percent)
    text = f"errors are {1 / over.max():.1f} to {1 / over.min():.0f} times smaller"
    found["adapted meshes keep the accuracy wanted"] = Judged(tuple((1 - each, 0.0) for each in over), text)
    ratios = [
        steps["seconds"] / best(results, f"run-{scene}", fixed["percent"])["seconds"]
        for scene, (fixed, steps) in paper(results).items()
    ]
    if parts[-1].name.startswith("moving"):
        found[f"runs take {FASTER} times less than the discretisation of the paper at equal error"] = Judged(
            tuple((each - FASTER, 0.0) for each in ratios), ", ".join(f"{each:.0f}" for each in ratios) + " times"
        )
    if len(beside):
        found["a run ends on the curve of its case, within the half-widths of both"] = Judged(
            tuple((1 - each, 0.0) for each in beside["ratio"]),
            f"off by {beside['ratio'].max():.2f} of them at most, {len(beside)} runs",
        )
    return found | complete(results, parts)


def blocks(results: pd.DataFrame, parts: Sequence[Part]) -> Mapping[str, str]:
    """What stands between the marks of the page."""
    both = (pages.markdown(curves(results, liquid)) for liquid in ("newtonian", "viscoelastic"))
    rows = moving(results)
    shown = pd.DataFrame({name: rows[name].map(form.format) for name, form in MOVING.items()})
    shown["run less dU, over both half-widths"] = rows["ratio"].map("{:.2f}".format)
    return {
        "made": pages.prose(made(results, parts)),
        "settings": pages.markdown(settings(results)),
        "curves": "\n".join(both),
        "promises": pages.markdown(adapted(results)),
        "times": pages.prose(beside_fixed_cells(results)),
        "scenes": pages.markdown(scenes(results)),
        "moving": pages.markdown(shown),
    }


def files(results: pd.DataFrame, parts: Sequence[Part]) -> Mapping[Path, bytes]:
    """The picture of error against wall time, where all discretisations of the runs and points are there."""
    table = table_of(results, "run", "point")
    for study in (f"{kind}-{scene}" for kind in ("run", "point") for scene in SCENES):
        wanted = len(yaml_files.read(CASES / f"{study}.yaml")["discretisations"])
        if (table["study"] == study).sum() < wanted:
            return {}
    figure = Figure(figsize=(10, 7.5))
    for (scene, title), axis in zip(TITLES.items(), figure.subplots(2, 2).flat, strict=True):
        fixed, steps = paper(results)[scene]
        for kind, look, label in (("run", "oC0", "transient"), ("point", "sC1", "quasi-steady point")):
            own = table[(table["study"] == f"{kind}-{scene}") & (table["percent"] > 0)]
            _draw(axis, own[own["cells"] != "paper"], look, label)
        for marker, row, label in zip(
            "*P", (steps, fixed), ("one factorisation per step", "factorisation reused"), strict=True
        ):
            name = f"discretisation of the paper, {label}"
            axis.loglog([row["seconds"]], [fixed["percent"]], marker, markersize=10, label=name)
        axis.set(title=title, xlabel="wall time [s]", ylabel="error of $\\Delta U$ [% of its largest]")
    handles = figure.axes[0].get_legend_handles_labels()
    figure.legend(*handles, loc="lower center", ncol=3, frameon=False, fontsize="small")
    figure.tight_layout(rect=(0, 0.06, 1, 1))
    drawn = BytesIO()
    figure.savefig(drawn, format="png", dpi=110)
    return {DOCS / "images" / "accuracy.png": drawn.getvalue()}


def _draw(axis: Any, table: pd.DataFrame, look: str, label: str) -> None:
    """Markers of a study, open where the mesh was adapted."""
    for is_adapted, fill in ((False, look[1:]), (True, "none")):
        part = table[(table["cells"] == "adapted") == is_adapted]
        name = f"{label}, accuracy: X%" if is_adapted else label
        axis.loglog(part["seconds"], part["percent"], look, markerfacecolor=fill, linestyle="none", label=name)
