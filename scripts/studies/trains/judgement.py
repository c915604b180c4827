"""Which rates of trains are inside their half-widths, and how far those of runs in time are from them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from book import comparison, pages
from book.case_parts import complete
from book.comparison import cell
from book.half_widths import half_widths_hold
from book.made import made
from book.statements import Judged
from book.study import Part

from pairsim.cases.accuracy import percent

OF_RUNS = 1.0  # what a rate of a run may be off besides the half-width of the train, in per cent of its largest rate
QUANTITIES = ("growth", "frequency")
SHORTEST = 2  # beads of the shortest wave, which does not travel: its frequency is 0
WAVE = ["train", "beads", "quantity"]
YES = {True: "yes", False: ""}


def rates(results: pd.DataFrame) -> pd.DataFrame:
    """Growth rates and frequencies of all waves, one a row, with `largest`, the largest rate of their solution."""
    answered = results[results["ended"].isna()]
    sizes = (answered["growth"] ** 2 + answered["frequency"] ** 2) ** 0.5
    largest = sizes.groupby(answered["part"]).transform("max")
    shared = answered[["part", "train", "kind", "accuracy", "beads", "said", "verdict", "seconds"]]
    columns = {name: answered.get(f"{name}_error", np.nan) for name in QUANTITIES}
    found = [
        shared.assign(largest=largest, quantity=name, value=answered[name], half_width=columns[name])
        for name in QUANTITIES
    ]
    table = pd.concat(found, ignore_index=True)
    return table[(table["quantity"] != "frequency") | (table["beads"] != SHORTEST)]


def judged(results: pd.DataFrame) -> pd.DataFrame:
    """The rates of trains that have a reference.

    Further columns: `ratio`, the difference from the reference over the half-width; `known`, the half-width of the
    reference over that; `error_percent` and `known_percent`, of the largest rate; `run`, the rate that a run in time
    shows, NaN without one; and `off_percent`, by how much this differs, of the largest rate.
    """
    table = rates(results)
    cases, references, runs = (table[table["kind"] == kind] for kind in ("case", "reference", "run"))
    columns = [*WAVE, "value", "half_width", "verdict", "seconds"]
    found = cases.merge(references[columns], on=WAVE, suffixes=("", "_of_reference"))
    found = found.merge(runs[[*WAVE, "value"]].rename(columns={"value": "run"}), on=WAVE, how="left")
    error, size = (found["value"] - found["value_of_reference"]).abs(), 100 / found["largest"]
    return found.assign(
        ratio=error / found["half_width"],
        known=found["half_width_of_reference"] / found["half_width"],
        error_percent=size * error,
        known_percent=size * found["half_width_of_reference"],
        half_width_percent=size * found["half_width"],
        off_percent=size * (found["run"] - found["value"]).abs(),
        said=found["said"].astype(bool),
    )


def statements(results: pd.DataFrame, parts: Sequence[Part]) -> dict[str, Judged]:
    """What the study states, judged by what is stored."""
    table = judged(results)
    if table.empty:
        return complete(results, parts)
    wanted = percent(str(table["accuracy"].iloc[0]))
    silent = table[~table["said"]]
    warn = table.drop_duplicates("train")["said"]
    margins = zip(wanted - silent["error_percent"], silent["known_percent"], strict=True)
    largest = f"largest {silent['error_percent'].max():.2g} %; " if len(silent) else ""
    verdicts = table.drop_duplicates("train")
    same = verdicts["verdict"] == verdicts["verdict_of_reference"]
    found = {
        **half_widths_hold(table["ratio"], table["known"], "the rates"),
        f"no error of a train is above {wanted:g} % of its largest rate without a warning": Judged(
            tuple(margins) or ((1.0, 0.0),), f"{largest}{warn.sum()} of {len(warn)} trains warn"
        ),
        "each train does the same on finer meshes": Judged(
            ((same.sum() - len(same) + 0.5, 0.0),),
            "; ".join(verdicts["train"] + ": " + verdicts["verdict"].where(same, verdicts["verdict"] + ", not so")),
        ),
    }
    beside = table.dropna(subset=["run"])
    if len(beside):
        within = (OF_RUNS + beside["half_width_percent"] - beside["off_percent"]).tolist()
        text = f"{len(beside)} rates, {beside['off_percent'].max():.2g} % at most"
        what = f"rates of waves in runs differ by at most {OF_RUNS:g} % of the largest rate and the half-width"
        found[what] = Judged(tuple((margin, 0.0) for margin in within), text)
    return found | complete(results, parts)


def by_train(table: pd.DataFrame) -> pd.DataFrame:
    """A row for each train."""
    rows = []
    for name, waves in table.groupby("train", sort=False):
        first = waves.iloc[0]
        rows.append(
            {
                "train": str(name),
                "verdict": str(first["verdict"]),
                "rates": str(len(waves)),
                "inside": str((waves["ratio"] <= 1).sum()),
                "half-width, largest": f"{waves['half_width_percent'].max():.2g}",
                "error, largest": f"{waves['error_percent'].max():.2g}",
                "error over half-width, largest": f"{waves['ratio'].max():.2f}",
                "warns": YES[bool(first["said"])],
                "seconds": f"{first['seconds']:.3g}",
                "of the reference": f"{first['seconds_of_reference']:.3g}",
            }
        )
    return pd.DataFrame(rows)


def by_wave(table: pd.DataFrame) -> pd.DataFrame:
    """A row for each rate of each wave."""
    order = table.assign(place=table.groupby("train", sort=False).ngroup())
    order = order.sort_values(["place", "beads", "quantity"], ascending=[True, True, False])
    found = {
        "train": order["train"],
        "beads of the wave": order["beads"].map("{:.3g}".format),
        "rate": order["quantity"],
        "train's": _cells(order["value"], order["half_width"]),
        "finer": _cells(order["value_of_reference"], order["half_width_of_reference"]),
        "error over half-width": order["ratio"].map("{:.2f}".format),
        "in runs": order["run"].map(lambda rate: cell(rate, 0.0, ".4g")),
        "off, % of the largest rate": order["off_percent"].map(lambda off: cell(off, 0.0, ".2g")),
    }
    return pd.DataFrame(found)


def _cells(values: pd.Series, half_widths: pd.Series) -> list[str]:
    return [cell(*each, ".4g") for each in zip(values, half_widths, strict=True)]


def blocks(results: pd.DataFrame, parts: Sequence[Part]) -> Mapping[str, str]:
    """What stands between the marks of the page."""
    table = judged(results)
    return {
        "made": pages.prose(made(results, parts)),
        "statements": comparison.stated(statements(results, parts)),
        "trains": pages.markdown(by_train(table)),
        "waves": pages.markdown(by_wave(table)),
    }
