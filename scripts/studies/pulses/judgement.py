"""Statements of the study, judged by its rows; one is made where the rows are there that it is about."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from book import statements as judge
from book.statements import Judged, Value
from book.study import Part

from studies.pulses import volume

EXACT = {"pressure": 1e-7, "profile": 1e-6}
"""Largest error of the flow without particles, of its pressure drop over the largest one."""
OF_RUNS = {"pressure": 1e-4, "profile": 1e-6}
"""The same of runs, of the profile on the finest cells."""
COLUMNS = ("mean", "half_width", "factor", "weight", "travel", "travel_error", "level", "length", "change")
"""Columns that only some topics have, and that are empty until a part of these is computed."""
AT_REST = 1e-10  # dU of equal rigid spheres
SAME_VOLUME = 1e-3  # of the motion by a displaced volume
SLOW = {"square": (400.0, 3e-3), "sine": (32.0, 5e-3)}  # long periods, and what is missing of the slow limit there
PER_TURN = 0.03  # of what a turn costs, which is the same at all periods
ALIKE = 5e-3  # of the drift of pairs that differ by 1 %
RIPPLE, LOG = 2e-3, 1e-2  # of the mean of dU at the bench


@dataclass(frozen=True)
class Rows:
    """The rows of the study of those parts that have finished."""

    table: pd.DataFrame

    @classmethod
    def of(cls, results: pd.DataFrame) -> Rows:
        """Those of stored results; without any if there are none."""
        if not len(results):
            return cls(results)
        known = results.reindex(columns=list(dict.fromkeys((*results.columns, *COLUMNS))))
        return cls(known[known["status"] == "finished"])

    def topic(self, name: str) -> pd.DataFrame:
        """The rows of a topic."""
        return self.table[self.table["topic"] == name] if len(self.table) else self.table

    def runs(self, topic: str, **where: object) -> pd.DataFrame:
        """Those of a topic with these values."""
        rows = self.topic(topic)
        for column, value in where.items():
            if not len(rows):
                break
            rows = rows[rows[column] == value]
        return rows


def mean_of(row: pd.Series) -> Value:
    """The mean of dU over a cycle, with its half-width where it is known."""
    return float(row["mean"]), float(np.nan_to_num(row["half_width"]))


def statements(results: pd.DataFrame, parts: Sequence[Part]) -> Mapping[str, Judged]:
    """What the study states, as far as its rows are there."""
    rows = Rows.of(results)
    found = {text: judged for make in MAKERS for text, judged in make(rows)}
    done = results["part"].nunique() if len(results) else 0
    failed = results[results["status"] != "finished"] if len(results) else results
    names = ", ".join(f"{row['part']} ({row['reason']})" for _, row in failed.iterrows())
    return {
        **found,
        "every part has an answer": Judged(((0.5 - len(failed), 0.0),), f"{len(failed)} without {names}".strip()),
        "all is computed": Judged(((done - len(parts) + 0.5, 0.0),), f"{done} of {len(parts)} parts"),
    }


type Made = Iterator[tuple[str, Judged]]


def _exact(rows: Rows) -> Made:
    pipe, tube = rows.topic("pipe"), rows.topic("tube")
    for kind, name in (("pressure", "pressure drop"), ("profile", "profile")):
        if len(pipe):
            text = f"the {name} of the flow without particles is exact to {EXACT[kind]:g}"
            yield text, _below(pipe[f"{kind}_error"], EXACT[kind])
    if not len(tube):
        return
    limit = OF_RUNS["pressure"]
    yield f"the pressure drop of runs is exact to {limit:g} of the largest one", _below(tube["pressure_error"], limit)
    cells = of_cells(tube)
    ratios = np.log(cells["profile_error"].iloc[:-1].to_numpy() / cells["profile_error"].iloc[1:])
    orders = ratios / np.log(cells["size"].iloc[:-1].to_numpy() / cells["size"].iloc[1:])
    text = "the profile converges with a power of the cells above 2.5"
    yield text, judge.above([(each, 0.0) for each in orders], 2.5, "powers")
    if cells["size"].iloc[-1] < 0.05:
        limit = OF_RUNS["profile"]
        yield f"the profile is exact to {limit:g} on the finest cells", _below(cells["profile_error"].iloc[-1:], limit)


def of_cells(tube: pd.DataFrame) -> pd.DataFrame:
    """Tubes without particles that differ in their cells alone, from coarse to fine."""
    return tube[tube["tol"] == tube["tol"].min()].sort_values("size", ascending=False)


def _rigid(rows: Rows) -> Made:
    if len(equal := rows.topic("rigid")):
        text = f"equal rigid spheres have |dU| below {AT_REST:g}"
        yield text, judge.below([(each, 0.0) for each in equal["largest"]], AT_REST, "largest")
    to_and_fro = rows.runs(volume.TOPIC, flow_mean=0.0)
    if len(to_and_fro):
        margins = tuple((row["half_width"] - abs(row["mean"]), 0.0) for _, row in to_and_fro.iterrows())
        largest = (to_and_fro["mean"].abs() / to_and_fro["half_width"]).max()
        text = "rigid particles come back to and fro within the half-width"
        yield text, Judged(margins, f"at most {largest:.2g} of it")
    loose, tight = (rows.runs(volume.TOPIC, flow_mean=0.0, tol=tol) for tol in volume.TOLERANCES)
    if len(tight) and len(tight) == len(loose):
        pairs = zip(loose["mean"].abs(), tight["mean"].abs(), strict=True)
        text = "what is left of it falls with the tolerance"
        numbers = f"{judge.listed(loose['mean'])} to {judge.listed(tight['mean'])}"
        yield text, Judged(tuple((a - b, 0.0) for a, b in pairs), numbers)


def _volume(rows: Rows) -> Made:
    travelled = rows.runs(volume.TOPIC, run="pair with a mean")
    if len(travelled) and np.isfinite(travelled["travel"].iloc[0]):
        off = travelled["travel"].iloc[0] / volume.MEAN - 1, travelled["travel_error"].iloc[0] / volume.MEAN
        text = f"with a mean a rigid pair moves as `travel` says for the volume, to {SAME_VOLUME:g}"
        yield text, judge.below([off], SAME_VOLUME, "off by")
    pulsed, flowed = (rows.runs(volume.TOPIC, run=f"three {name}") for name in ("with a mean", "steady flow"))
    if len(pulsed) and len(flowed):
        off = pulsed["moved"].to_numpy() / flowed["moved"].to_numpy() - 1
        text = f"three of them move as in a steady flow of the same volume, to {SAME_VOLUME:g}"
        yield text, judge.below([(each, 0.0) for each in off], SAME_VOLUME, "off by")


def slow_limit(rows: Rows, shape: str) -> float:
    """The mean of |Q| dU(d; Ca_e |Q|) over a cycle of unit amplitude; NaN where it is not computed."""
    steady = rows.runs("slow", shape=shape, period=np.inf)
    if not len(steady):
        return np.nan
    weights = steady["weight"].fillna(1.0)
    if not np.isclose(weights.sum(), 1.0):  # not all of them are there
        return np.nan
    return float((steady["mean"] * steady["factor"].fillna(1.0) * weights).sum())


def _slow(rows: Rows) -> Made:
    for shape, (period, limit) in SLOW.items():
        known, runs = slow_limit(rows, shape), rows.runs("slow", shape=shape)
        runs = runs[np.isfinite(runs["period"])] if len(runs) else runs
        if np.isnan(known) or not len(runs):
            continue
        if len(longest := runs[runs["period"] == period]):
            text = f"a soft pair in a {shape} of period {period:g} moves as slow pulses do, to {limit:g}"
            yield text, judge.below([(longest["mean"].iloc[0] / known - 1, 0.0)], limit, "off by")
        if shape == "square" and len(runs) > 1:
            short = runs[runs["period"] <= 32]
            missing = ((known - short["mean"]) * short["period"]).tolist()
            text = f"what a turn costs it does not depend on the period, to {PER_TURN:g} of it"
            yield text, judge.alike([(each, 0.0) for each in missing], PER_TURN * float(np.mean(missing)), "a cycle")


def _differing(rows: Rows) -> Made:
    one, equal = rows.runs("differing", period=np.inf), slow_limit(rows, "square")
    if len(one) and np.isfinite(equal):
        ratio = one["mean"].iloc[0] / equal
        text = "in one direction a difference of 1 % more than doubles dU"
        yield text, judge.above([(ratio, 0.0)], 2.0, "by a factor of")
    both = beside_equal(rows)
    if len(both):
        off = both["mean"] / both["mean_of_equal"] - 1
        text = f"to and fro the pair moves as equal beads, to {ALIKE:g}"
        yield text, judge.below([(each, 0.0) for each in off], ALIKE, "off by")


def beside_equal(rows: Rows) -> pd.DataFrame:
    """Pairs that differ, beside equal ones in the same flow."""
    some, equal = rows.runs("differing", shape="square"), rows.runs("slow", shape="square")
    if not len(some) or not len(equal):
        return pd.DataFrame()
    return some.merge(equal[["period", "mean"]], on="period", suffixes=("", "_of_equal"))


def _held(rows: Rows) -> Made:
    free = rows.topic("held")
    if len(free):
        off = (free["held_mean"] - free["mean"]).abs()
        margins = tuple((free["half_width"] + free["held_half_width"] - off).tolist())
        text = "the drift of a free pair is that at its mean distance, held, within their half-widths"
        numbers = f"off by {judge.listed(100 * off / free['mean'].abs(), '.2g')} %"
        yield text, Judged(tuple((margin, 0.0) for margin in margins), numbers)


def _giesekus(rows: Rows) -> Made:
    both = on_both(rows)
    if not len(both):
        return
    inside = tuple(
        (row["half_width"] - abs(row["mean"] - row["mean_fine"]), row["half_width_fine"]) for _, row in both.iterrows()
    )
    ratios = (both["mean"] - both["mean_fine"]).abs() / both["half_width"]
    text = "in a Giesekus liquid the finer mesh is inside the half-width of the coarser one"
    yield text, Judged(inside, f"differences over half-widths {judge.listed(ratios, '.2g')}")
    for Ca_e, name in ((0.0, "rigid"), (0.05, "soft")):
        finest = on_finest(rows, Ca_e)
        if len(finest):
            signs = tuple((abs(row["mean"]), row["half_width"]) for _, row in finest.iterrows())
            numbers = ", ".join(f"{row['mean']:.2g} at {row['period']:g}" for _, row in finest.iterrows())
            yield f"the sign of the drift of {name} beads is known at all periods", Judged(signs, numbers)


def on_finest(rows: Rows, Ca_e: float) -> pd.DataFrame:
    """Pairs in a Giesekus liquid over the period, each on the finer mesh where it is computed there."""
    found = rows.runs("giesekus", Ca_e=Ca_e, length=6.0)
    return found.sort_values(["period", "level"]).drop_duplicates("period", keep="last")


def on_both(rows: Rows) -> pd.DataFrame:
    """Pairs in a Giesekus liquid on the coarser mesh, beside the finer one."""
    levels = [rows.runs("giesekus", level=level, length=6.0) for level in ("coarse", "fine")]
    if not all(map(len, levels)):
        return pd.DataFrame()
    kept = ["period", "Ca_e", "mean", "half_width", "change"]
    found = levels[0].merge(levels[1][kept], on=["period", "Ca_e"], suffixes=("", "_fine"))
    return found.sort_values(["Ca_e", "period"])


def _bench(rows: Rows) -> Made:
    constant = rows.runs("bench", run="constant")
    for name, limit in (("ripple", RIPPLE), ("log", LOG)):
        found = rows.runs("bench", run=name)
        if len(found) and len(constant):
            off = found["mean"].iloc[0] / constant["mean"].iloc[0] - 1
            yield f"at the bench the {name} changes dU by less than {limit:g}", judge.below([(off, 0.0)], limit, "by")


def _random(rows: Rows) -> Made:
    found = rows.topic("random")
    if len(found):
        runs = found.groupby("run")["mean"].apply(lambda means: means.notna().all())
        margins = tuple((1.0 if known else -1.0, 0.0) for known in runs)
        yield "random waveforms end with a drift", Judged(margins, f"{runs.sum()} of {len(runs)}")


MAKERS: tuple[Callable[[Rows], Made], ...] = (
    *(_exact, _rigid, _volume, _slow, _differing, _held, _giesekus, _bench, _random),
)


def _below(values: Iterable[float], limit: float) -> Judged:
    return judge.below([(float(each), 0.0) for each in values], limit, "largest errors", ".1e")
