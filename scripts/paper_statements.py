"""Words of the statements of the paper: what the expressions in configs/paper/*/statements.yaml are made of.

A statement has the words of the paper (`says`), an expression over the results `r` (`check`) and, where it does not
hold, one over runs in time (`in_time`). Words that need a number: "almost", "nearly", "substantially the same" is a
difference below `NEARLY`, "decreased to zero" is below `VANISHED` of the peak, and signs of a dU below `DRAWN` of the
peak, which a drawing does not show, are not told apart.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from itertools import pairwise
from math import isnan, log10
from typing import Any, NamedTuple

import numpy as np
from book.cases import Case, Cases, NotComputed, first
from book.fields import deviations, in_particles, near
from scipy.integrate import trapezoid
from scipy.interpolate import LinearNDInterpolator, PchipInterpolator

from pairsim.api import statements
from pairsim.api.statements import (
    Judged,
    Value,
    alike,
    below,
    each,
    falling,
    listed,
    negative,
    of_sign,
    positive,
    rising,
)

NEARLY, VANISHED, DRAWN = 0.1, 0.05, 3e-3
SOFT, DES = (0.01, 0.05, 0.1, 0.15), (0.125, 0.25, 0.5, 1.0, 2.0)
"""The paper's Ca_e of soft particles, and its De."""
SCENES = tuple((0.4, De) for De in (0.0, *DES))
"""beta and De of Fig. 16."""
ALONE, FAR, ABSENT = 0.6, 1.5, 0.02
"""Where particles do not interact any more, the largest and the least distance of the curves [D_c]."""
SHAPE = 1e-4
"""Error of a Taylor parameter and of a deviation from a sphere."""
NOT_COMPUTED = "not computed"


def judged(expression: str, r: Cases) -> tuple[str, str]:
    """Verdict of an expression over results, and its numbers."""
    try:
        found = eval(expression, vars(statements) | globals() | {"r": r})
    except NotComputed as lacking:
        return NOT_COMPUTED, str(lacking)
    return found.verdict, found.numbers


# What statements are about.


def soft(r: Cases, **where: Any) -> list[Case]:
    """The curves of the paper's four Ca_e."""
    return [r.curve(Ca_e=Ca_e, **where) for Ca_e in SOFT]


def over_De(r: Cases, Ca_e: float, *De: float) -> list[Case]:
    """The curves of one Ca_e at beta .4."""
    return [r.curve(beta=0.4, De=each, Ca_e=Ca_e) for each in De]


def fig6(r: Cases, *Ca_es: float) -> list[Case]:
    """Runs of Fig. 6."""
    return [r.run(beta=0.4, De=0, d0=0.1, Ca_e=Ca_e, particles=2) for Ca_e in Ca_es]


def confined(r: Cases, *betas: float) -> list[Case]:
    """The curves of Fig. 12."""
    return [r.curve(beta=beta, De=2, Ca_e=0.1) for beta in betas]


def shapes(r: Cases, *scenes: tuple[float, float], Ca_e: float = 0.15) -> list[Case]:
    """Curves with fields at d = .1, by beta and De."""
    return [r.curve_with_fields(0.1, beta=beta, De=De, Ca_e=Ca_e) for beta, De in scenes]


def ends(runs: Iterable[Case], name: str = "dU", part: float = 0.01) -> list[Value]:
    """A column at the end of runs; the error is the accuracy of the runs."""
    return [(run.last(name), part * float(run.table[name].abs().max())) for run in runs]


def tops(curves: Iterable[Case], sign: int = 1, beyond: float = 0.0, least: float = 0.0) -> list[Value]:
    """The largest (sign 1) or least dU of curves; the error is no less than a part of the peak."""
    found = [(curve.extreme(sign, beyond)[1], least * curve.peak) for curve in curves]
    return [(value, max(error, at_least)) for (value, error), at_least in found]


def distances(curves: Iterable[Case]) -> list[Value]:
    """Critical distances; 0 where the pair repels at every distance from `ABSENT` on."""
    zeros = [curve.zero(stable=False) for curve in curves]
    return [(0.0, 0.0) if isnan(d) else (d, error) for d, error in zeros]


def stable(curves: Iterable[Case]) -> list[Value]:
    """Stable distances; NaN where there are none."""
    return [curve.zero(stable=True) for curve in curves]


def available(r: Cases, *scenes: dict[str, float]) -> list[Case]:
    """Those curves of some parameters that were computed, at least one.

    Raises:
        NotComputed: There is none.
    """
    found = []
    for where in scenes:
        with suppress(NotComputed):
            found.append(r.curve(**where))
    if not found:
        raise NotComputed(f"curves with {scenes}")
    return found


def deviation(curves: Sequence[Case]) -> list[list[Value]]:
    """Deviations from a sphere at d = .1 of the trailing and of the leading particles."""
    found = [deviations(curve.result.fields(0.1)) for curve in curves]
    return [[(value, SHAPE) for value in column] for column in zip(*found, strict=True)]


def scene(case: Case) -> str:
    """The parameters of a case."""
    return ", ".join(f"{key} {first(case.parameters[key]):g}" for key in ("beta", "De", "Ca_e"))


def along_softness(r: Cases, De: float) -> tuple[list[float], list[Value]]:
    """Ca_e and d_cr along the first branch of unstable distances."""
    table = r.all("critical", De=De)[0].table
    table = table[(table["kind"] == "wanted") & ~table["stable"].astype(bool)]
    if not len(table):
        raise NotComputed(f"no critical distance at De {De:g}")
    table = table[table["branch"] == table["branch"].iloc[0]].sort_values("Ca_e")
    return list(table["Ca_e"]), list(zip(table["d_cr"], table["d_error"], strict=True))


# How they are judged, where that is more than an expression.


def nearly(values: Sequence[Value], name: str, scale: float | None = None) -> Judged:
    """Values are nearly the same, compared with the least of them or with a scale."""
    return alike(values, NEARLY * (min(values)[0] if scale is None else scale), name)


def repulsive(curves: Iterable[Case]) -> Judged:
    """dU is positive everywhere, as far as a drawing shows."""
    return each(curves, lambda c: of_sign(c.result, 1, least=DRAWN * c.peak), scene)


def vanished(curves: Iterable[Case], distance: float) -> Judged:
    """dU has decreased to zero at a distance."""

    def one(curve: Case) -> Judged:
        places = np.array([distance, *curve.d[curve.d > distance]])
        values = np.abs(curve.at("dU", places)) / curve.peak
        worst = int(values.argmax())
        error = float(curve.at("dU_error", places[worst])) / curve.peak
        return below([(float(values[worst]), error)], VANISHED, f"|dU|/peak from d = {distance:g} on")

    return each(curves, one, scene)


def superimposed(curves: Sequence[Case]) -> Judged:
    """The curves are nearly the same."""
    places, peak = common(curves), max(c.peak for c in curves)
    spreads = np.ptp(np.array([c.at("dU", places) for c in curves]), axis=0) / peak
    worst = int(spreads.argmax())
    d = float(places[worst])
    error = sum(sorted(float(c.at("dU_error", d)) for c in curves)[-2:]) / peak
    return below([(float(spreads[worst]), error)], NEARLY, f"largest difference/largest |dU| (d = {d:.2f})")


def rises_with_softness(curves: Sequence[Case]) -> Judged:
    """dU is larger for softer pairs at all distances at which particles interact."""
    places = [float(d) for d in common(curves) if d <= ALONE]
    margins = each(places, lambda d: rising([curve.dU(d) for curve in curves])).margins
    return Judged(margins, f"dU at d = .1: {listed(curve.dU(0.1)[0] for curve in curves)}")


def peak_ratios(curves: Sequence[Case], others: Sequence[Case]) -> list[Value]:
    """Ratios of the largest |dU|."""
    return [(a.peak / b.peak, 0.0) for a, b in zip(curves, others, strict=True)]


def common(curves: Sequence[Case]) -> np.ndarray[Any, Any]:
    """Distances that all curves cover, (60,)."""
    return np.geomspace(max(c.d[0] for c in curves), min(c.d[-1] for c in curves), 60)


def durations(r: Cases) -> Judged:
    """Until when dU is off the curve by more than a twentieth of its peak."""
    found = []
    for Ca_e, run in zip(SOFT, fig6(r, *SOFT), strict=True):
        curve, t = r.curve(beta=0.4, De=0, Ca_e=Ca_e), run.column("t")
        off = np.abs(run.column("dU") - curve.at("dU", run.column("d"))) > 0.05 * curve.peak
        end = float(t[off][-1]) if off.any() else 0.0
        found.append((end, float(np.interp(end, t, run.column("dt")))))
    return rising(found, "dU is within 5 % of the peak of the curve from t =")


def peaks_of_D(r: Cases) -> Judged:
    """D_T has its first largest value when dU is least."""

    def one(run: Case) -> Judged:
        t, least = run.column("t"), int(run.table["dU"].argmin())
        peak, off = float(t[run.table["D_T"].argmax()]), float(run.column("dt")[least])
        text = f"largest D_T at t = {peak:.3f}, least dU at {t[least]:.3f}"
        return Judged(((NEARLY * float(t[least]) - abs(peak - float(t[least])), off),), text)

    return each(fig6(r, 0.1, 0.15), one, scene)


def elongates(r: Cases, name: str) -> Judged:
    """A particle is elongated when dU is least; the pair first comes closer, then separates."""

    def one(run: Case) -> Judged:
        D, d = float(run.column(name)[run.table["dU"].argmin()]), run.column("d")
        text = f"{name} {D:.3g} when dU is least; d from .1 to {d.min():.4f} to {d[-1]:.4f}"
        return Judged(((D, 0.0), (0.1 - float(d.min()), 0.0), (float(d[-1]) - 0.1, 0.0)), text)

    return each(fig6(r, 0.1, 0.15), one, scene)


class Marker(NamedTuple):
    """A transient beside the curve of its case."""

    run: Case
    curve: Case

    @property
    def rest(self) -> float:
        """dU of the transient minus that of the curve."""
        return self.run.last("dU") - float(self.curve.at("dU", self.run.last("d")))


def markers(r: Cases, least: int = 1) -> list[Marker]:
    """All transients of the figures' markers that have a curve, no fewer than asked for."""
    found = []
    for run in (run for name in r.names if name.endswith("/markers") for run in r.of(name)):
        keys = {key: run.parameters[key] for key in ("beta", "De", "Ca_e")}
        curves = [c for c in r.some("curve", **keys) if c.d[0] <= run.last("d") <= c.d[-1]]
        if curves:
            found.append(Marker(run, max(curves, key=lambda case: len(case.d))))
    if len(found) < least:
        raise NotComputed("no transient with its curve")
    return found


def collapse(r: Cases, name: str, newtonian: bool = True) -> Judged:
    """Transients from different d_0 end on the curve."""
    rests = []
    for run, curve in (pair for pair in markers(r) if (pair.run.parameters["De"] == 0) == newtonian):
        rest = run.last(name) - float(curve.at(name, run.last("d")))
        rests.append((abs(rest) / float(curve.table[name].abs().max()), 0.0))
    if not rests:
        raise NotComputed("no transient with its curve")
    text = f"{len(rests)} transients end within {max(rests)[0]:.1%} of the largest value"
    return Judged(below(rests, NEARLY).margins, text)


def deforms_closer(curve: Case) -> Judged:
    """Both |D| grow as particles come closer."""
    places = (0.02, 0.1, 0.2, 0.3, 0.6)
    text = "; ".join(f"{name} {listed(curve.at(name, places))}" for name in ("D_L", "D_T"))
    falls = each(("D_L", "D_T"), lambda name: falling([(abs(D), SHAPE) for D in curve.column(name)]))
    return Judged(falls.margins, f"at d = {listed(places)}: {text}")


def closer_in_time(r: Cases) -> Judged:
    """The same by the ends of runs."""
    runs = sorted(r.all("run", particles=2, beta=0.4, De=0, Ca_e=0.1), key=lambda run: run.last("d"))
    judged = each(("D_L", "D_T"), lambda name: falling([(abs(run.last(name)), SHAPE) for run in runs]))
    text = "; ".join(f"{name} {listed(run.last(name) for run in runs)}" for name in ("d", "D_L", "D_T"))
    return Judged(judged.margins, text)


def as_alone(curve: Case) -> Judged:
    """Shapes no longer change with the distance."""

    def one(name: str) -> Judged:
        values = [(float(curve.at(name, d)), 0.0) for d in (ALONE, curve.d[-1])]
        return alike(values, NEARLY * float(curve.table[name].abs().max()), f"{name} at .6 and {curve.d[-1]:g}")

    return each(("D_L", "D_T"), one)


def not_opposite(r: Cases, d0: float, **where: Any) -> Judged:
    """The stiffest and the softest pair do not go opposite ways from one distance."""
    runs = [r.run(d0=d0, Ca_e=Ca_e, **where) for Ca_e in (SOFT[0], SOFT[-1])]
    dU = [run.last("dU") for run in runs]
    opposite = -float(np.sign(dU[0] * dU[1])) * min(map(abs, dU))
    return Judged(((-opposite, 0.0),), f"from d = {d0:g}, Ca_e .01 and .15: dU {listed(dU)}")


def orders(ratios: Iterable[Value], low: float, high: float, name: str) -> Judged:
    """Ratios between powers of ten."""
    known = list(ratios)
    margins = tuple(((high - low) / 2 - abs(log10(value) - (high + low) / 2), 0.01) for value, _ in known)
    return Judged(margins, f"{name} {listed(value for value, _ in known)}")


def stress(r: Cases, part: Callable[[Any, Any], float], sign: int, name: str) -> Judged:
    """A value of the elastic stress has a sign, and is larger at Ca_e .15 than at .05; in units of G_p."""
    found = [part(*axial_stress(r, Ca_e)) for Ca_e in (0.05, 0.15)]
    return Judged(((sign * (found[1] - found[0]), 0.0), (sign * found[1], 0.0)), f"{name} {listed(found)} G_p")


def axial_stress(r: Cases, Ca_e: float) -> tuple[Any, Any]:
    """Places in the particles over their radius, 10 apart, and the axial elastic stress there in units of G_p."""
    case = r.curve(beta=0.4, De=0, Ca_e=Ca_e)
    grid = case.result.fields(0.1)
    place, nodes = in_particles(grid, first(case.parameters["beta"]) / 2)
    return place, grid.point_data["tau_s_zz"][nodes] * Ca_e


def radii(place: Any) -> Any:
    """Distances from the particles' centres."""
    return np.hypot((place[:, 0] + 5) % 10 - 5, place[:, 1])


def similar(r: Cases) -> Judged:
    """The stresses at Ca_e .05 and .15 are correlated."""
    (here, a), (there, b) = (axial_stress(r, Ca_e) for Ca_e in (0.05, 0.15))
    other = LinearNDInterpolator(there, b)(here)
    known = np.isfinite(other)
    correlation = float(np.corrcoef(a[known], other[known])[0, 1])
    return positive([(correlation - 0.5, 0.0)]) & Judged((), f"correlation of tau_zz {correlation:.3f}")


def stronger(r: Cases, name: str) -> Judged:
    """A perturbation around the pair is larger at beta .6 than at .4: at its largest, and at .5 % of the nodes."""
    values = [np.abs(grid.point_data[name][near(grid, 1.0)]) for grid in perturbed(r)]
    most = [(float(v.max()), 0.0) for v in values]
    typical = [(float(np.quantile(v, 0.995)), 0.0) for v in values]
    return rising(most, "largest at beta .4, .6:") & rising(typical, "exceeded by .5 % of the nodes:")


def perturbed(r: Cases) -> list[Any]:
    """Fields of Figs. 14 and 15 at beta .4 and .6."""
    return [case.result.fields(0.1) for case in shapes(r, (0.4, 0.5), (0.6, 0.5))]


def converged(r: Cases, key: str, other: str, value: float) -> Judged:
    """Runs with the two finer meshes or tolerances agree as in the paper: to .68 % at most, .54 % on average."""
    runs = r.all("run", De=1, **{"time.end": 6, other: value})
    if len(runs) < 3:
        raise NotComputed(f"three runs with different {key}")
    runs.sort(key=lambda run: run.parameters[key], reverse=key == "time.tol")
    t = np.geomspace(max(run.column("t")[0] for run in runs), min(run.last("t") for run in runs), 500)
    dU = [PchipInterpolator(run.column("t"), run.column("dU"))(t) for run in runs]
    apart = [np.abs(a - b) / np.abs(dU[-1]).max() for a, b in pairwise(dU)]
    mean = [(float(trapezoid(off, t) / (t[-1] - t[0])), 0.0) for off in apart]
    text = f"{key} {listed(run.parameters[key] for run in runs)}: differences at most"
    margins = below([(float(apart[-1].max()), 0.0)], 0.0068) & below(mean[-1:], 0.0054)
    numbers = f"{text} {listed((v.max() for v in apart), '.2%')}, on average {listed((v for v, _ in mean), '.2%')}"
    return Judged(margins.margins, numbers)


def removed(r: Cases) -> Judged:
    """d_cr falls with Ca_e until there is none, and the softest pair repels up to d = .6."""
    curves = soft(r, beta=0.4, De=0.125)
    zeros = distances(curves)
    falls = tuple((a[0] - b[0] if a[0] or b[0] else 1.0, a[1] + b[1]) for a, b in pairwise(zeros))
    return Judged(falls, f"d_cr {listed(d for d, _ in zeros)}") & of_sign(curves[-1].result, 1, high=ALONE)


def attract_then_repel(curves: Sequence[Case]) -> Judged:
    """Pairs attract each other at the least distance and repel each other at some larger one."""
    least = [(float(c.column("dU")[0]), float(c.column("dU_error")[0])) for c in curves]
    return negative(least, "dU at d = .02:") & positive(tops(curves), "largest dU")


def first_grows(zeros: list[Value], name: str) -> Judged:
    """Values first rise from 0 and then fall; both zero decides nothing."""
    top = max(range(len(zeros)), key=lambda i: zeros[i])
    rises = tuple(margin for margin in rising(zeros[: top + 1]).margins if margin != (0.0, 0.0))
    return Judged(rises + falling(zeros[top:]).margins, f"{name} {listed(d for d, _ in zeros)}")


def peak_grows(r: Cases, Ca_e: float) -> Judged:
    """The repulsive peak grows with De up to .5 and falls from there on, over the De that were computed."""
    curves = available(r, *({"beta": 0.4, "De": De, "Ca_e": Ca_e} for De in (0.0, *DES)))
    known = {float(curve.parameters["De"]): curve for curve in curves}
    if not {0.0, 0.5} <= known.keys():
        raise NotComputed(f"curves of Ca_e {Ca_e:g} at De 0 and .5")
    up = rising(tops(curve for De, curve in known.items() if De <= 0.5))
    down = falling(tops(curve for De, curve in known.items() if De >= 0.5))
    text = f"at De {listed(known)}: largest dU {listed(v for v, _ in tops(known.values()))}"
    return Judged(up.margins + down.margins, f"{text}, least {listed(v for v, _ in tops(known.values(), -1))}")


def peaks_in_time(r: Cases, Ca_e: float) -> Judged:
    """The same from transients alone: one at De .5, and larger dU at De 0."""
    most = [
        (max(run.last("dU") for run in r.all("run", particles=2, beta=0.4, De=De, Ca_e=Ca_e)), 0.0) for De in (0, 0.5)
    ]
    return rising(most, "largest dU at the end of a transient at De 0, .5:")


def as_rigid(r: Cases) -> Judged:
    """The critical distance at the least Ca_e is that of rigid pairs."""

    def one(De: float) -> Judged:
        soft_d, (rigid,) = along_softness(r, De)[1][0], distances([r.curve(beta=0.4, De=De, Ca_e=0)])
        return alike([soft_d, rigid], NEARLY * rigid[0], f"De {De:g}, Ca_e .005 and rigid: d_cr")

    return each(DES[:4], one)


def softness_reduces(r: Cases, De: float) -> Judged:
    """d_cr falls with Ca_e: its ends differ by more than their errors, of neighbours the sign decides."""
    Ca_es, d = along_softness(r, De)
    steps = tuple((a[0] - b[0], 0.0 if a[0] > b[0] else a[1] + b[1]) for a, b in pairwise(d))
    text = f"d_cr at Ca_e {Ca_es[0]:g}, {Ca_es[-1]:g}: " + ", ".join(f"{v:.4f} ± {e:.4f}" for v, e in (d[0], d[-1]))
    return Judged(falling([d[0], d[-1]]).margins + steps, text)


def slopes(r: Cases) -> Judged:
    """The mean slope of d_cr over Ca_e falls with De."""
    found = []
    for De in DES[:4]:
        Ca_es, d = along_softness(r, De)
        width = Ca_es[-1] - Ca_es[0]
        found.append((abs(d[-1][0] - d[0][0]) / width, (d[-1][1] + d[0][1]) / width))
    return falling(found, "mean |slope| of d_cr at De .125, .25, .5, 1:")


def all_unstable(r: Cases) -> Judged:
    """dU rises with d at all critical distances."""
    tables = [r.all("critical", De=De)[0].table for De in DES[:4]]
    slope = [float(v) for table in tables for v in table.loc[table["kind"] == "wanted", "slope"]]
    return Judged(tuple((v, 0.0) for v in slope), f"{sum(v > 0 for v in slope)} of {len(slope)}, {min(slope):.2g}")


def softness_reversed(r: Cases) -> Judged:
    """Softness changes dU at d = .2 in opposite ways at beta .2 and .6."""
    small, large = ([curve.dU(0.2) for curve in soft(r, beta=beta, De=1)] for beta in (0.2, 0.6))
    text = "; ".join(f"beta {b}: dU {listed(v for v, _ in dU)}" for b, dU in ((".2", small), (".6", large)))
    return Judged(falling([small[0], small[-1]]).margins + rising([large[0], large[-1]]).margins, text)


def leading_more(curves: Sequence[Case]) -> Judged:
    """The leading particle is deformed more than the trailing one."""

    def one(curve: Case) -> Judged:
        trailing, leading = deviations(curve.result.fields(0.1))
        return Judged(((leading - trailing, SHAPE),), f"{trailing:.2%}, {leading:.2%}")

    return each(curves, one, scene)


def leading_in_time(r: Cases) -> Judged:
    """The same by Taylor parameters at the end of a run."""
    run = r.run(beta=0.4, De=0, Ca_e=0.15, d0=0.1)
    D = [(run.last(name), SHAPE / 2) for name in ("D_T", "D_L")]
    return Judged(rising([(abs(v), e) for v, e in D]).margins, f"De 0 from d = .1: D_T, D_L {listed(v for v, _ in D)}")


def no_zero(zeros: list[Value], name: str) -> Judged:
    """There is no such distance."""
    text = f"{name} {listed(d for d, _ in zeros)}"
    return Judged(tuple((1.0 if isnan(d) else -1.0, 0.0) for d, _ in zeros), text)


def some_zero(zeros: list[Value], name: str) -> Judged:
    """There is such a distance."""
    text = f"{name} {listed((d for d, _ in zeros), '.4f')}"
    return Judged(tuple((-1.0 if isnan(d) else d, error) for d, error in zeros), text)


def least_in_time(r: Cases, *Ca_es: float) -> Judged:
    """Pairs at De 2 repel each other from d = .03 on."""
    runs = [r.run(beta=0.4, De=2, Ca_e=Ca_e, d0=0.03) for Ca_e in Ca_es]
    return positive(ends(runs, part=0.0), f"from d = .03 at Ca_e {listed(Ca_es)}: dU")


def over_softness(r: Cases, De: float) -> list[Case]:
    """Rigid and soft pairs at beta .4."""
    return [r.curve(beta=0.4, De=De, Ca_e=Ca_e) for Ca_e in (0, *SOFT)]


def magnitudes(values: Iterable[Value]) -> list[Value]:
    """Magnitudes of values."""
    return [(abs(value), error) for value, error in values]


def by(name: str, curves: Iterable[tuple[Any, list[Value]]], judge: Callable[[list[Value], str], Judged]) -> Judged:
    """A statement about each of several lists of values, which belong to values of a parameter."""
    return each(curves, lambda pair: judge(pair[1], f"{name} {pair[0]:g}:"))


def spheres_first(r: Cases) -> Judged:
    """D is nothing after the first step, compared with .04."""
    runs = fig6(r, 0.1, 0.15)
    first_D = [(float(run.column(name)[0]), 0.0) for run in runs for name in ("D_L", "D_T")]
    return below(first_D, NEARLY * 0.04, "D after the first step")


def superimposed_in_time(r: Cases) -> Judged:
    """Runs of the stiffest and the softest pair from d = .08 differ by little of the largest |dU|."""
    dU = ends([r.run(beta=0.4, De=0.5, Ca_e=Ca_e, d0=0.08) for Ca_e in (SOFT[0], SOFT[-1])], part=0.0)
    peak = max(curve.peak for curve in soft(r, beta=0.4, De=0.5))
    return alike(dU, NEARLY * peak, f"largest |dU| {peak:.3g}; Ca_e .01 and .15 from d = .08: dU")
