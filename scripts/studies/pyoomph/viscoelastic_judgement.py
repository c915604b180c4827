"""Pairs in a Giesekus liquid beside those of pyoomph: whether it comes to the same dU as its cells become smaller."""

from __future__ import annotations

from math import nan

import pandas as pd
from book import pages
from book.comparison import Column, Table, cell
from book.statements import Judged

from studies.pyoomph.viscoelastic import ACCURACIES_FROM_REST, CELLS_FROM_REST

PAIR = ["De", "Ca_e", "d"]
SHAPES, OF_SHAPES = ("D_T", "D_L"), 0.01
"""Taylor parameters, and their allowed difference relative to those of pyoomph."""
FINEST = "pyoomph on its finest mesh"
SUPG = {0: "no", 1: "yes"}


def of_kind(results: pd.DataFrame, kind: str = "") -> pd.DataFrame:
    """The rows with an answer of one kind; without a kind those in a Newtonian liquid."""
    kinds = results.get("kind", pd.Series(None, results.index, dtype=object))
    same = kinds == kind if kind else kinds.isna()
    return results[same & results["ended"].isna()].dropna(axis=1, how="all")


def pairs(results: pd.DataFrame) -> pd.DataFrame:
    """Pairs by pyoomph, a row a mesh, with `dU_held` and `dU_error`; from few cells to many.

    `off` is the difference from `dU_held`, `change` what the last refinement has changed, NaN of the fewest cells.
    """
    theirs, ours = of_kind(results, "pair by pyoomph"), of_kind(results, "pair")
    if theirs.empty or ours.empty:
        return pd.DataFrame()
    columns = [*PAIR, "dU_held", "dU_error", *(name for name in SHAPES if name in ours)]
    ours = ours.assign(d=ours["d"].round(9))  # which a curve has to rounding
    table = theirs.merge(ours[columns], on=PAIR, suffixes=("", "_of_pairsim"))
    table = table.sort_values([*PAIR, "supg", "cells"], ignore_index=True)
    change = table.groupby([*PAIR, "supg"])["dU"].diff()
    return table.assign(off=(table["dU"] - table["dU_held"]).abs(), change=change.abs())


def finest(table: pd.DataFrame) -> pd.DataFrame:
    """The finest mesh of each pair; of two with as many cells that with SUPG."""
    return table.sort_values(["cells", "supg"]).drop_duplicates(PAIR, keep="last").sort_values(PAIR)


def from_rest(results: pd.DataFrame) -> pd.DataFrame:
    """dU of the pair from rest, a row a time: by the accuracy of pairsim, and by the cells of pyoomph."""
    ours, theirs = of_kind(results, "start-up"), of_kind(results, "start-up by pyoomph")
    if ours.empty or theirs.empty:
        return pd.DataFrame()
    values = ours.pivot(index="t", columns="accuracy", values="dU")
    errors = ours.pivot(index="t", columns="accuracy", values="dU_error").add_suffix(" half-width")
    theirs = theirs.assign(mesh=[_mesh(cells) for cells in theirs["cells"]])
    return values.join(errors).join(theirs.pivot(index="t", columns="mesh", values="dU"))


def _mesh(cells: float) -> str:
    return f"{cells:g} cells"


def shapes(results: pd.DataFrame) -> Table | None:
    """Taylor parameters of the soft pairs; None without any."""
    table = pairs(results)
    soft = table[table["Ca_e"] > 0] if len(table) and {*SHAPES} <= {*table} else pd.DataFrame()
    if soft.empty:
        return None
    columns = [Column(name, f"{name}_of_pairsim", to=name, allowed=OF_SHAPES, source=FINEST) for name in SHAPES]
    return Table(finest(soft).set_index(PAIR), columns)


def statements(results: pd.DataFrame) -> dict[str, Judged]:
    """What is stated of pairs in a Giesekus liquid, as far as they are computed."""
    found = dict[str, Judged]()
    if len(table := pairs(results)):
        best = finest(table).dropna(subset=["change"])
        margins = best["dU_error"] + best["change"] - best["off"]
        inside = (best["off"] <= best["dU_error"]).sum()
        relative = (best["off"] / best["dU"].abs()).max()
        what = "Giesekus: dU_held differs by at most its half-width and what their last refinement changes from "
        text = f"{len(best)} pairs, {inside} inside the half-width alone; largest {100 * relative:.2g} %"
        found[what + FINEST] = Judged(tuple((margin, 0.0) for margin in margins.tolist()), text)
        nearer = [
            (float(before) - float(after), 0.0)
            for _, mesh in table.groupby([*PAIR, "supg"])
            for before, after, width in zip(mesh["off"], mesh["off"][1:], mesh["dU_error"], strict=False)
            if before > width
        ]
        found["Giesekus: each refinement of pyoomph brings it closer, unless it was inside the half-width"] = Judged(
            tuple(nearer), f"{sum(margin > 0 for margin, _ in nearer)} of {len(nearer)} refinements"
        )
    if of_shapes := shapes(results):
        found |= {f"Giesekus: {text}": each for text, each in of_shapes.statements().items()}
    times = from_rest(results)
    meshes = [mesh for mesh in map(_mesh, CELLS_FROM_REST) if mesh in times]
    if (finer := ACCURACIES_FROM_REST[-1]) in times and len(meshes) > 1:
        coarse, fine = (times[mesh] for mesh in meshes[-2:])
        off = (times[finer] - fine).abs()
        margins = times[f"{finer} half-width"] + (fine - coarse).abs() - off
        what = "Giesekus, from rest: dU differs by at most its half-width and what their last refinement changes"
        text = f"{len(off)} times, largest {100 * (off / fine.abs()).max():.2g} %"
        found[what] = Judged(tuple((margin, 0.0) for margin in margins.tolist()), text)
    return found


def by_pair(table: pd.DataFrame) -> pd.DataFrame:
    """A row for each pair, without and with SUPG, with dU on each mesh."""
    rows = []
    for _, mesh in table.groupby([*PAIR, "supg"]):
        first, last = mesh.iloc[0], mesh.iloc[-1]
        row = {**{name: f"{first[name]:g}" for name in PAIR}, "SUPG": SUPG[int(first["supg"])]}
        values = dict(zip(mesh["cells"], mesh["dU"], strict=True))
        row |= {_mesh(cells): cell(values.get(cells, nan), 0.0, ".5g") for cells in sorted(table["cells"].unique())}
        row |= {"pairsim, dU_held": cell(first["dU_held"], first["dU_error"], ".5g")}
        row |= {"off, % of itself": f"{100 * last['off'] / abs(last['dU_held']):.2g}"}
        rows.append(row | {"off over half-width": f"{last['off'] / last['dU_error']:.2g}"})
    return pd.DataFrame(rows)


def by_time(times: pd.DataFrame) -> pd.DataFrame:
    """A row for each time of the pair from rest."""
    columns = {"t": [f"{t:g}" for t in times.index]}
    for mesh in (each for each in map(_mesh, CELLS_FROM_REST) if each in times):
        columns[f"pyoomph, {mesh}"] = [cell(dU, 0.0, ".5g") for dU in times[mesh]]
    for name in (each for each in ACCURACIES_FROM_REST if each in times):
        known = zip(times[name], times[f"{name} half-width"], strict=True)
        columns[f"pairsim, {name}"] = [cell(value, error, ".5g") for value, error in known]
    return pd.DataFrame(columns)


def blocks(results: pd.DataFrame) -> dict[str, str]:
    """The tables of the page."""
    table, times, of_shapes = pairs(results), from_rest(results), shapes(results)
    none = pages.prose("Not computed yet.")
    return {
        "giesekus": pages.markdown(by_pair(table)) if len(table) else none,
        "giesekus-shapes": pages.markdown(of_shapes.shown()) if of_shapes else none,
        "from-rest": pages.markdown(by_time(times)) if len(times) else none,
    }
