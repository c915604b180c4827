"""Words of the statements of the paper: what the expressions in cases/*/statements.yaml are made of.

A statement has the words of the paper (`says`), an expression over the results `r` (`check`) and, where it does not
hold (`found` has the verdict that docs/paper.md discusses), one over runs in time (`in_time`) and one over the fewer
cases on other meshes and ends (`again`), with the words of `book.statements` and of this module. Words of the paper
that need a number: "almost", "nearly", "substantially the same" is a difference below `NEARLY`, "decreased to zero" is
below `VANISHED` of the peak, and signs of a dU below `DRAWN` of the peak, which a drawing does not show, are not told
apart.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from itertools import pairwise
from math import copysign
from typing import Any

import numpy as np
import pandas as pd
from book import statements
from book.cases import Case, Cases, NotComputed
from book.statements import Judged, Value, above, alike, below, each, falling, listed, of_sign, positive, rising
from scipy.interpolate import LinearNDInterpolator, PchipInterpolator

from pairsim.plots.frames import outlines
from pairsim.plots.labels import varying_keys
from pairsim.plots.parameters import Parameters
from pairsim.record.xdmf import FieldFrame

NEARLY, VANISHED, DRAWN = 0.1, 0.05, 3e-3
ACCURACY, SHAPE = 0.01, 1e-4
"""Errors of dU of a run over its largest |dU|, and of distances, Taylor parameters and deviations from a sphere."""
SOFT, ENDS, DES = (0.01, 0.05, 0.1, 0.15), (0.01, 0.15), (0.125, 0.25, 0.5, 1.0, 2.0)
"""The paper's Ca_e of soft particles, the least and the largest of them, and its De."""
ALONE, FAR, ABSENT = 0.6, 1.5, 0.02
"""Where particles do not interact any more, the largest and the least distance of the curves [D_c]."""
NEAR = np.geomspace(ABSENT, ALONE, 40)
SIDES = ("trailing", "leading")


def judged(expression: str, r: Cases) -> Judged:
    """What an expression says of results.

    Raises:
        NotComputed: It looks at results that are not there, or has nothing to compare.
    """
    found: Judged = eval(expression, vars(statements) | globals() | {"r": r})
    if not found.margins:
        raise NotComputed("nothing to compare")
    return found


# Values, each with its error.


def fig6(r: Cases, *Ca_es: float) -> list[Case]:
    """Runs of Fig. 6."""
    return r.runs(beta=0.4, De=0, d0=0.1, particles=2, Ca_e=Ca_es)


def values(runs: Iterable[Case], name: str = "dU", which: Callable[[pd.Series], float] | None = None) -> list[Value]:
    """The last value of a column of each run, or what else `which` takes, such as `min`."""
    found = [(run, run.last(name) if which is None else float(which(run.table[name]))) for run in runs]
    return [(value, ACCURACY * run.peak if name == "dU" else SHAPE) for run, value in found]


def extreme(case: Case, name: str, sign: int = 1, beyond: float = 0.0) -> pd.Series:
    """The row in which a column is largest (sign 1) or least (-1), beyond a distance."""
    table = case.table[case.table["d"] > beyond]
    return table.iloc[int((sign * table[name].to_numpy()).argmax())]


def tops(curves: Iterable[Case], sign: int = 1, beyond: float = 0.0, least: float = 0.0) -> list[Value]:
    """The largest (sign 1) or least dU of curves beyond a distance; the error is at least a part of the peak."""
    rows = [(extreme(curve, "dU", sign, beyond), least * curve.peak) for curve in curves]
    return [(float(row["dU"]), max(float(row["dU_error"]), error)) for row, error in rows]


def far(curves: Iterable[Case], d: float) -> list[Value]:
    """The largest |dU| of curves from a distance on, over their peaks."""
    return [max((abs(c.dU(at)[0]) / c.peak, c.dU(at)[1] / c.peak) for at in (d, *c.d[c.d > d])) for c in curves]


def distances(curves: Iterable[Case], *, stable: bool = False) -> list[Value]:
    """First distances of equilibrium with a |dU| of more than 1 % of the peak beyond them; 0 where there is none."""
    found = []
    for zeros in (curve.result.zeros for curve in curves):
        kind = zeros[(zeros["stable"].astype(bool) == stable) & (zeros["peak"].fillna(1.0) >= 0.01)].fillna(0.0)
        found.append((float(kind["d"].iloc[0]), float(kind["d_error"].iloc[0])) if len(kind) else (0.0, 0.0))
    return found


class CriticalDistances(dict[float, Value]):
    """Values by Ca_e; one that is not there was not computed."""

    def __missing__(self, Ca_e: float) -> Value:
        raise NotComputed(f"no critical distance at Ca_e {Ca_e:g}")


def critical(r: Cases, De: float) -> CriticalDistances:
    """Unstable distances by Ca_e, along their first branch."""
    table = r.all("critical", De=De)[0].table
    table = table[(table["kind"] == "wanted") & ~table["stable"].astype(bool)]
    if table.empty:
        raise NotComputed(f"no critical distance at De {De:g}")
    table = table[table["branch"] == table["branch"].iloc[0]].sort_values("Ca_e")
    return CriticalDistances(zip(table["Ca_e"], zip(table["d_cr"], table["d_error"], strict=True), strict=True))


def slope(d_cr: dict[float, Value]) -> Value:
    """The mean |slope| of d_cr over Ca_e."""
    if len(d_cr) < 2:
        raise NotComputed("two critical distances")
    (softest, (d, error)), (stiffest, (other, another)) = max(d_cr.items()), min(d_cr.items())
    return abs(d - other) / (softest - stiffest), (error + another) / (softest - stiffest)


def deviation(curves: Iterable[Case], side: str) -> list[Value]:
    """Deviations of the trailing or leading particle from a sphere at d = .1."""
    return [(deviations(curve.frame(0.1))[SIDES.index(side)], SHAPE) for curve in curves]


def deviations(frame: FieldFrame) -> list[float]:
    """Root mean square of the distance between each particle's outline and the sphere of its volume, over its radius.

    Spheres are centred where the particle has its centre of volume; from upstream.
    """
    found = []
    for z, r in (line.T for line in outlines(frame)):
        slices = np.pi * ((r[1:] + r[:-1]) / 2) ** 2 * np.diff(z)
        centre = np.sum(slices * (z[1:] + z[:-1]) / 2) / np.sum(slices)
        radius = (0.75 * np.sum(slices) / np.pi) ** (1 / 3)
        squares, lengths = (np.hypot(z - centre, r) - radius) ** 2, np.hypot(np.diff(z), np.diff(r))
        found.append(float(np.sqrt(np.average((squares[1:] + squares[:-1]) / 2, weights=lengths)) / radius))
    return found


def settled(run: Case, curve: Case) -> Value:
    """Until when dU of a run is off the curve by more than a twentieth of its peak; the error is the step."""
    off = (run.table["dU"] - curve.at("dU", run.table["d"])).abs() > 0.05 * curve.peak
    return max(zip(run.table["t"][off], run.table["dt"][off], strict=True), default=(0.0, 0.0))


def axial_stress(curve: Case) -> pd.DataFrame:
    """Elastic tau_zz at the nodes of the particles at d = .1 [G_p], by places before deformation in radii.

    `z` is that from the trailing particle's centre and 10 more than that from the leading one's, `radius` the distance
    from either.
    """
    frame, found = curve.frame(0.1), []
    for number in (0, 1):
        nodes = np.unique(frame.cells[frame.region == number + 1])
        place = (frame.points[nodes] - frame.point_data["displacement"][nodes]) * 2 / curve.parameters["beta"]
        z, r = place[:, 0] - (place[:, 0].min() + place[:, 0].max()) / 2, place[:, 1]
        tau = frame.point_data["tau_s"][nodes, 0] * curve.parameters["Ca_e"]
        found.append(pd.DataFrame({"z": z + 10 * number, "r": r, "radius": np.hypot(z, r), "tau": tau}))
    return pd.concat(found, ignore_index=True)


def correlation(one: pd.DataFrame, other: pd.DataFrame) -> Value:
    """Correlation of two stresses in the particles, at the places of the first."""
    interpolated = LinearNDInterpolator(other[["z", "r"]], other["tau"])(one[["z", "r"]])
    return float(one["tau"].corr(pd.Series(interpolated))), 0.0


def around(curves: Iterable[Case], name: str, part: float) -> list[Value]:
    """The quantile of the size of a field at the nodes of the liquid around a pair at d = .1."""
    found = []
    for frame in (curve.frame(0.1) for curve in curves):
        z, solid = frame.points[:, 0], frame.region > 0
        nodes = np.unique(frame.cells[~solid])
        nodes = nodes[np.abs(z[nodes] - z[np.unique(frame.cells[solid])].mean()) < 1]
        found.append((float(np.quantile(np.abs(frame.point_data[name][nodes]), part)), 0.0))
    return found


def transients(r: Cases) -> pd.DataFrame:
    """By how much the runs of all figures' markers end off the curves of their cases.

    In parts of the largest value of the curve, dU also in half-widths of its interval.
    """
    rows = []
    for run in (run for name in r.names if name.endswith("/markers") for run in r.of(name)):
        row = {key: run.parameters[key] for key in ("beta", "De", "Ca_e")}
        with suppress(NotComputed):
            (curve,), d = r.curves(**row), run.last("d")
            row |= {"d_0": run.parameters["d0"], "t": run.last("t"), "d": d, "dU": run.last("dU")}
            for name in ("dU", "D_L", "D_T"):
                row[f"{name} off"] = (run.last(name) - float(curve.at(name, d))) / curve.table[name].abs().max()
            rows.append(row | {"intervals off": (row["dU"] - curve.dU(d)[0]) / curve.dU(d)[1]})
    if not rows:
        raise NotComputed("no transient with its curve")
    return pd.DataFrame(rows)


# Judgements.


def by(items: Sequence[Any], judge: Callable[[Any], Judged], key: str = "") -> Judged:
    """A statement about each of several items: cases, which are told apart by what varies, or values of a parameter."""
    keys = varying_keys([Parameters(case.parameters) for case in items]) if isinstance(items[0], Case) else []

    def label(item: Any) -> str:
        if isinstance(item, Case):
            return ", ".join(f"{each} {item.parameters[each]:g}" for each in keys)
        return f"{key} {item:g}" if key else item

    return each(items, judge, label)


def nearly(values: Sequence[Value], name: str = "", scale: float | None = None) -> Judged:
    """Values are nearly the same, compared with the least magnitude of them or with a scale."""
    return alike(values, NEARLY * (min(abs(value) for value, _ in values) if scale is None else scale), name)


def same_sign(one: Value, other: Value, name: str) -> Judged:
    """Two values have the same sign, whatever their errors."""
    margin = copysign(min(abs(one[0]), abs(other[0])), one[0] * other[0])
    return Judged(((margin, 0.0),), f"{name} {listed((one[0], other[0]))}")


def up_and_down(values: Sequence[Value], name: str, top: int | None = None) -> Judged:
    """Values rise up to the largest one, or that of a number, and fall from there on; two that are 0 decide nothing."""
    top = values.index(max(values)) if top is None else top
    margins = (rising(values[: top + 1]) & falling(values[top:])).margins
    return Judged(
        tuple(each for each in margins if each != (0.0, 0.0)), f"{name} {listed(value for value, _ in values)}"
    )


def repulsive(curves: Sequence[Case]) -> Judged:
    """dU is positive everywhere, as far as a drawing shows."""
    return by(curves, lambda curve: of_sign(curve.result, 1, least=DRAWN * curve.peak))


def superimposed(curves: Sequence[Case]) -> Judged:
    """Curves are nearly the same, compared with the largest |dU| of all."""
    places = np.geomspace(max(curve.d[0] for curve in curves), min(curve.d[-1] for curve in curves), 60)
    spread = np.ptp([curve.at("dU", places) for curve in curves], axis=0)
    d, peak = float(places[spread.argmax()]), max(curve.peak for curve in curves)
    error = sum(sorted(curve.dU(d)[1] for curve in curves)[-2:])
    return below([(float(spread.max()) / peak, error / peak)], NEARLY, f"difference/peak at d = {d:.2f}:")


def elongates(runs: Sequence[Case], name: str) -> Judged:
    """A particle is elongated when dU is least; the pair first comes closer, then separates."""
    D = [(float(extreme(run, "dU", -1)[name]), SHAPE) for run in runs]
    apart = above(values(runs, "d"), 0.1, "then")
    return positive(D, f"{name} when dU is least") & below(values(runs, "d", min), 0.1, "d", ".4f") & apart


def collapse(r: Cases, name: str, *, newtonian: bool = True) -> Judged:
    """Transients from different d_0 end on the curve."""
    table = transients(r)
    off = table.loc[(table["De"] == 0) == newtonian, f"{name} off"].abs()
    margins = below([(value, 0.0) for value in off], NEARLY).margins
    return Judged(margins, f"{len(off)} ends, off by {off.max():.1%} of the largest value at most")


def deforms_closer(table: pd.DataFrame) -> Judged:
    """Both |D| fall with the distance, from row to row."""
    table = table.sort_values("d")
    judged = each(("D_L", "D_T"), lambda name: falling([(abs(D), SHAPE) for D in table[name]]))
    shown = table.iloc[:: -(-len(table) // 5)]
    return Judged(judged.margins, "; ".join(f"{name} {listed(shown[name])}" for name in ("d", "D_L", "D_T")))


def softness_reduces(d_cr: dict[float, Value]) -> Judged:
    """d_cr falls with Ca_e: its ends differ by more than their errors, of neighbours the sign decides."""
    values = list(d_cr.values())
    steps = tuple((a - b, 0.0 if a > b else e + f) for (a, e), (b, f) in pairwise(values))
    text = ", ".join(f"{value:.4f} ± {error:.4f}" for value, error in (values[0], values[-1]))
    name = f"d_cr at Ca_e {min(d_cr):g}, {max(d_cr):g}:"
    return Judged(falling([values[0], values[-1]]).margins + steps, f"{name} {text}")


def converged(r: Cases, key: str, other: str, value: float) -> Judged:
    """Runs with the two finer meshes or tolerances agree as in the paper: to .68 % at most, .54 % on average."""
    runs = r.all("run", De=1, **{"time.end": 6, other: value})
    if len(runs) < 3:
        raise NotComputed(f"three runs with different {key}")
    runs.sort(key=lambda run: run.parameters[key], reverse=key == "time.tol")
    t = np.geomspace(max(run.table["t"].min() for run in runs), min(run.last("t") for run in runs), 500)
    dU = pd.DataFrame({run.parameters[key]: PchipInterpolator(run.table["t"], run.table["dU"])(t) for run in runs})
    apart = dU.diff(axis=1).iloc[:, 1:].abs() / dU.iloc[:, -1].abs().max()
    most, mean = apart.max(), apart.apply(np.trapezoid, x=t) / (t[-1] - t[0])
    text = f"differences at most {listed(most, '.2%')}, on average {listed(mean, '.2%')}"
    margins = ((0.0068 - most.iloc[-1], 0.0), (0.0054 - mean.iloc[-1], 0.0))
    return Judged(margins, f"{key} {listed(run.parameters[key] for run in runs)}: {text}")
