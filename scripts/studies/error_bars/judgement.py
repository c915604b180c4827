"""How often half-widths hold the errors, in which scenes, and how large they are beside them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any

import numpy as np
import pandas as pd
from book import pages
from book.case_parts import complete
from book.made import made
from book.statements import Judged
from book.study import Part

from studies.error_bars.parts import KINDS, read

KNOWN, NEGLIGIBLE = 0.2, 2e-4
"""An error is judged if the fine solutions differ by less than a part of it, and it is no smaller part of the peak."""
TRUTH = 1 / 3
"""Largest half-width of the truth of curves and random scenes, over that by default."""
COVERED = 0.95
"""Part of the errors that half-widths are to hold."""
DE_CLASSES = {"De 0": 0.0, "De to 0.5": 0.5, "De to 1": 1.0, "De to 2": 2.0, "De to 3": 3.0}
PARTICLES = {1: "one particle", 2: "two", 3: "three", 4: "four"}


@cache
def fixing() -> frozenset[str]:
    """The scenes on which the factors of the half-widths were determined: every second one."""
    return frozenset(list(read("scenes")[1])[::2])


def judged(results: pd.DataFrame) -> pd.DataFrame:
    """All errors with their verdicts: inside the half-width or outside; undecided or negligible ones decide nothing."""
    columns = ["part", "kind", "scene", "law", "N", "De", "soft", "mesh", "d", "at", "value", "half_width", "error"]
    table = results.reindex(columns=[*columns, "known", "peak", "correction", "cancels", "ended"])
    table = table[table["ended"].isna()]
    error, by_two = table["error"].abs(), table["kind"].isin(["scenes", "runs"])
    unknown = np.where(by_two, table["known"] > KNOWN * error, table["known"] > TRUTH * table["half_width"])
    conditions: Any = [by_two & (error < NEGLIGIBLE * table["peak"]), unknown, error <= table["half_width"]]
    verdict = np.select(conditions, ["negligible", "undecided", "inside"], "outside")
    fixes = (table["kind"] == "scenes") & table["scene"].isin(fixing())
    both = error <= table["half_width"] + table["known"]
    return table.assign(verdict=verdict, fixes=fixes, both=both, ratio=error / table["half_width"])


def able(table: pd.DataFrame) -> pd.DataFrame:
    """The errors that can be judged."""
    return table[table["verdict"].isin(["inside", "outside"])]


def statements(results: pd.DataFrame, parts: Sequence[Part]) -> dict[str, Judged]:
    """What the study states, judged by what is stored."""
    found, table = dict[str, Judged](), judged(results)
    for kind in KINDS:
        own = able(table[(table["kind"] == kind) & ~table["fixes"]])
        if own.empty:
            continue
        inside = int((own["verdict"] == "inside").sum())
        text = f"{inside} of {len(own)}, the largest error is {own['ratio'].max():.2f} half-widths"
        what = f"{kind}: half-widths hold {100 * COVERED:.0f} % of the errors that determined none of their factors"
        found[what] = Judged(((inside / len(own) - COVERED, 0.0),), text)
    return found | complete(results, parts)


def groups(table: pd.DataFrame) -> dict[str, pd.DataFrame]:
    """The errors by kind; those of scenes by what they were used for, those of random scenes by what they are of."""
    found = {kind: table[table["kind"] == kind] for kind in KINDS}
    scenes, random = found["scenes"], found["random"]
    found |= {"scenes, determining": scenes[scenes["fixes"]], "scenes, testing": scenes[~scenes["fixes"]]}
    found |= {f"scenes, {law}": own for law, own in scenes.groupby("law")}
    classes = pd.cut(random["De"].astype(float), [-1.0, *DE_CLASSES.values()], labels=list(DE_CLASSES))
    for by in (classes, random["N"].map(PARTICLES), random["law"]):
        found |= {f"random, {name}": own for name, own in random.groupby(by, observed=True)}
    return {f"curves, {name}": own for name, own in found["curves"].groupby("scene")} | found


def summary(results: pd.DataFrame) -> pd.DataFrame:
    """How many errors are inside, by kind and group."""
    lines = []
    found = groups(judged(results))
    for name in sorted(found, key=lambda each: (KINDS.index(each.partition(",")[0]), "," in each)):
        own = found[name]
        if own.empty:
            continue
        good = able(own)
        line = {"errors": name, "scenes": own["scene"].nunique(), "number": len(own)}
        line |= {"inside both": f"{100 * own['both'].mean():.0f} %", "judged": len(good)}
        line["inside"] = f"{100 * (good['verdict'] == 'inside').mean():.0f} %" if len(good) else ""
        line["half-width over error, median"] = f"{(1 / good['ratio']).median():.1f}" if len(good) else ""
        line["largest error over half-width"] = f"{good['ratio'].max():.2f}" if len(good) else ""
        lines.append({key: str(value) for key, value in line.items()})
    return pd.DataFrame(lines)


def blocks(results: pd.DataFrame, parts: Sequence[Part]) -> Mapping[str, str]:
    """What stands between the marks of the page."""
    return {"error-bars": pages.markdown(summary(results)), "error-bars-made": pages.prose(made(results, parts))}
