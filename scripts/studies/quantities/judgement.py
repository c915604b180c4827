"""Which printed quantities are inside their half-widths, and whether their accuracy was kept or said to be missed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from book import comparison, pages
from book.half_widths import BEYOND, half_widths_hold
from book.statements import Judged
from book.study import Part

from pairsim.solvers.goals import U

KNOWN = 1 / 3  # largest half-width of a reference, over that of the case that it judges
VERDICTS = ("inside", "outside", "beyond two", "not judged")
SCENE = ["question", "liquid", "scene"]


def percent(accuracy: pd.Series) -> pd.Series:
    """The numbers of percentages."""
    return accuracy.str.removesuffix("%").astype(float)


def judged(results: pd.DataFrame) -> pd.DataFrame:
    """The quantities of all cases beside those of the finest solution of their scene that is finer.

    A reference judges if its half-width is at most `KNOWN` of that of the case, or if both half-widths together do not
    explain the difference; where there is none the verdict is "not judged", too. The velocity of a particle that is
    moved is given.
    """
    given = (results["question"] == "dragged") & (results["quantity"] == U.name)
    answered = results[results["ended"].isna() & ~given]
    found = answered.assign(percent=percent(answered["accuracy"]), said=answered["said"].astype(bool))
    key = [*SCENE, "quantity"]
    finest = found.sort_values("percent").drop_duplicates(key)[[*key, "percent", "value", "half_width", "unknowns"]]
    cases = found[found["kind"] == "case"].merge(finest, on=key, suffixes=("", "_of_reference"))
    none = cases["percent_of_reference"] == cases["percent"]
    cases.loc[none, ["value_of_reference", "half_width_of_reference", "unknowns_of_reference"]] = np.nan
    error = (cases["value_of_reference"] - cases["value"]).abs()
    ratio, known = error / cases["half_width"], cases["half_width_of_reference"] / cases["half_width"]
    found_by = [~((known <= KNOWN) | (ratio > 1 + known)), ratio <= 1, ratio <= BEYOND]
    verdict = np.select(found_by, ["not judged", "inside", "outside"], "beyond two")
    relative = 100 * cases["half_width"] / cases["value"].abs()
    kept = (100 * error <= cases["percent"] * cases["value_of_reference"].abs()) | (relative <= cases["percent"])
    return cases.assign(
        error=error, ratio=ratio, known=known, verdict=verdict, relative=relative, kept=kept, no_reference=none
    )


def statements(results: pd.DataFrame, parts: Sequence[Part]) -> dict[str, Judged]:
    """What the study states, judged by what is stored."""
    table = judged(results)
    able = table[table["verdict"] != "not judged"]
    silent = table[~table["kept"] & ~table["said"]]
    unanswered = results[results["ended"].notna()]
    names = ", ".join(unanswered["part"] + " (" + unanswered["ended"] + ")")
    return {
        **half_widths_hold(able["ratio"], able["known"], "the judged quantities"),
        "the accuracy of each is kept, or a warning says that it is not": Judged(
            ((0.5 - len(silent), 0.0),), f"{len(silent)} of {len(table)} are neither"
        ),
        "every case has an answer": Judged(
            ((0.5 - len(unanswered), 0.0),), f"{len(unanswered)} without{': ' if names else ''}{names}"
        ),
        "all is computed": Judged(
            ((results["part"].nunique() - len(parts) + 0.5, 0.0),),
            f"{results['part'].nunique()} of {len(parts)} solutions",
        ),
    }


def by(table: pd.DataFrame, keys: Sequence[str]) -> pd.DataFrame:
    """How many quantities are inside, a row for each value of some columns."""
    lines = []
    for values, part in table.groupby(list(keys), sort=False):
        able = part[part["verdict"] != "not judged"]
        line = dict(zip(keys, map(str, values), strict=True))
        line |= {"printed": str(len(part)), "judged": str(len(able))}
        line |= {name: str((part["verdict"] == name).sum()) for name in VERDICTS[:-1]}
        line["largest error over half-width"] = f"{able['ratio'].max():.2f}" if len(able) else ""
        line["its median"] = f"{able['ratio'].median():.2f}" if len(able) else ""
        over = part["relative"] > part["percent"]
        line["half-width above accuracy"] = str(over.sum())
        line["of these said"] = str(part["said"][over].sum()) if over.any() else ""
        lines.append(line)
    return pd.DataFrame(lines)


def outside(table: pd.DataFrame) -> pd.DataFrame:
    """The quantities outside their half-widths, one a row."""
    found = table[table["verdict"].isin(VERDICTS[1:3])].sort_values("ratio", ascending=False)
    text = {
        "case": found["part"],
        "quantity": found["quantity"],
        "value": found["value"].map("{:.6g}".format),
        "half-width": found["half_width"].map("{:.2g}".format),
        "error": found["error"].map("{:.2g}".format),
        "error over half-width": found["ratio"].map("{:.2f}".format),
        "of the reference": found["known"].map("{:.2f}".format),
        "said": found["said"].map({True: "yes", False: ""}),
    }
    return pd.DataFrame(text)


def computed(results: pd.DataFrame, parts: Sequence[Part]) -> pd.DataFrame:
    """How many scenes of each question are solved in each liquid, at the accuracies in turn."""
    names = pd.DataFrame({"part": [part.name for part in parts]})
    names[["question", "liquid", "accuracy"]] = names["part"].str.extract(r"^(\w+)-\d+-(.*)\+(.*)$")
    names["done"] = names["part"].isin(results["part"])
    counts = names.groupby(["question", "liquid", "accuracy"], sort=False)["done"].sum().astype(str)
    cells = counts.groupby(["question", "liquid"], sort=False).agg(", ".join)
    return cells.unstack("liquid", sort=False).reset_index()


def blocks(results: pd.DataFrame, parts: Sequence[Part]) -> Mapping[str, str]:
    """What stands between the marks of the page."""
    table = judged(results)
    made = f"{results['part'].nunique()} of {len(parts)} solutions, computed {' to '.join(days(results))}"
    states = results["code"].nunique()
    made += f" with {states} states of the code." if states > 1 else "."
    off = outside(table)
    return {
        "made": pages.prose(made),
        "computed": pages.markdown(computed(results, parts)),
        "statements": comparison.stated(statements(results, parts)),
        "quantities": pages.markdown(by(table, ("question", "quantity", "accuracy"))),
        "liquids": pages.markdown(by(table, ("liquid", "accuracy"))),
        "outside": pages.markdown(off) if len(off) else pages.prose("None."),
    }


def days(results: pd.DataFrame) -> list[str]:
    """The first and the last day on which results were computed."""
    known = sorted(results["computed"].unique())
    return [known[0], *known[-1:]] if len(known) > 1 else known
