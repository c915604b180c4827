"""Whether distances by the model are those of runs, and beads meet in the same order."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import pandas as pd
from book import comparison, pages
from book.case_parts import all_computed
from book.statements import Judged, listed
from book.study import Part

ROW = ["material", "beads", "spread"]
RUN = "run"
NONE = Judged(((0.0, 1.0),), "none is computed")


def compared(results: pd.DataFrame) -> pd.DataFrame:
    """Distances by each model beside those of the run, one a row.

    `off` is their difference over `allowed`, the sum of the half-widths of both.
    """
    known = results[results["t"].notna()]
    key = [*ROW, "gap", "t"]
    runs = known[known["by"] == RUN][[*key, "d", "half_width"]]
    found = known[known["by"] != RUN].merge(runs, on=key, suffixes=("", "_of_run"))
    allowed = found["half_width"] + found["half_width_of_run"]
    return found.assign(allowed=allowed, off=(found["d"] - found["d_of_run"]).abs())


def orders(results: pd.DataFrame) -> pd.DataFrame:
    """In which order gaps come near, by the run and by each model; `same` where that of the run is the model's."""
    lines, names = [], [*ROW, "by"]
    near = results[results["near"].notna()].sort_values("near")
    found = {key: list(map(int, rows["gap"])) for key, rows in near.groupby(names)}
    for *row, by in results[names].drop_duplicates().itertuples(index=False):
        if by != RUN and (results[ROW].eq(row).all(axis=1) & (results["by"] == RUN)).any():
            run, model = found.get((*row, RUN), []), found.get((*row, by), [])
            lines.append([*row, by, run, model, model[: len(run)] == run])
    return pd.DataFrame(lines, columns=[*names, "run", "model", "same"])


def statements(results: pd.DataFrame, parts: Sequence[Part]) -> dict[str, Judged]:
    """What the study states, judged by what is stored."""
    table, order = compared(results), orders(results)
    inside = int((table["off"] <= table["allowed"]).sum())
    ratio = table["off"] / table["allowed"]
    met, same = order[order["run"].map(len) > 0], order["same"].sum()
    return {
        "every distance by the model is that of the run within the half-widths of both": Judged(
            tuple((1.0 - each, 0.0) for each in ratio),
            f"{inside} of {len(table)}; largest difference over half-widths {ratio.max():.2f}",
        )
        if len(table)
        else NONE,
        "beads come near in the order of the run": Judged(
            ((same - len(order) + 0.5, 0.0),), f"{same} of {len(order)} rows, in {len(met)} of which some do"
        )
        if len(order)
        else NONE,
        "all is computed": all_computed(results, parts),
    }


def by_row(results: pd.DataFrame) -> pd.DataFrame:
    """How the model does in each row."""
    lines = []
    for (*row, by), of in compared(results).groupby([*ROW, "by"], sort=False):
        ratio = of["off"] / of["allowed"]
        line = dict(zip(ROW, map(str, row), strict=True)) | {"model": str(by), "until t": f"{of['t'].max():g}"}
        line |= {"distances": str(len(of)), "inside": str((ratio <= 1).sum()), "off, most": f"{of['off'].max():.4f}"}
        line |= {"half-widths of the model, most": f"{of['half_width'].max():.4f}"}
        line |= {
            "of the run, most": f"{of['half_width_of_run'].max():.4f}",
            "off over both, most": f"{ratio.max():.2f}",
        }
        lines.append(line)
    return pd.DataFrame(lines)


def at_the_end(results: pd.DataFrame) -> pd.DataFrame:
    """First and last distances of each row."""
    lines = []
    for (*row, by), of in compared(results).groupby([*ROW, "by"], sort=False):
        last = of[of["t"] == of["t"].max()].sort_values("gap")
        line = dict(zip(ROW, map(str, row), strict=True)) | {"t": f"{of['t'].max():g}"}
        texts = {"run": last["d_of_run"], str(by): last["d"], "half-widths of both": last["allowed"]}
        lines.append(line | {name: listed(values, ".3f") for name, values in texts.items()})
    return pd.DataFrame(lines)


def _gaps(numbers: Sequence[int]) -> str:
    return ", ".join(map(str, numbers)) or "none"


def blocks(results: pd.DataFrame, parts: Sequence[Part]) -> Mapping[str, str]:
    """What stands between the marks of the page."""
    order = orders(results)
    near = order.assign(run=order["run"].map(_gaps), model=order["model"].map(_gaps), same=order["same"].map(str))
    days = sorted(results["computed"].unique())
    runs = results[results["by"] == RUN].drop_duplicates(ROW)
    seconds = f" Runs took {runs['seconds'].min():.0f} to {runs['seconds'].max():.0f} s beside other work."
    made = f"{results['part'].nunique()} of {len(parts)} parts, computed {' to '.join(dict.fromkeys(days))}."
    return {
        "made": pages.prose(made + (seconds if len(runs) else "")),
        "statements": comparison.stated(statements(results, parts)),
        "rows": pages.markdown(by_row(results)),
        "end": pages.markdown(at_the_end(results)),
        "order": pages.markdown(near),
    }
