"""Statements of section 3.2 of the paper, pairs in a viscoelastic liquid, and of its summary."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
from paper_newtonian import ALONE, always_repulsive, collapse, vanished
from paper_results import Curve, NotComputed, Results, Zero
from paper_statements import (
    NEARLY,
    SOFT,
    Check,
    Finding,
    by_softness,
    common_distances,
    drawn,
    falling,
    falls_along,
    in_time,
    nearly,
    not_opposite,
    numbers,
    rising,
    rising_dU,
    smallest,
    speeds,
    statement,
    statements,
)
from scipy.integrate import trapezoid
from scipy.interpolate import PchipInterpolator

DES = (0.125, 0.25, 0.5, 1.0, 2.0)
"""The paper's De."""
FAR = 1.5
"""Far apart: the largest distance of the curves [D_c]."""
FIXED: dict[str, Any] = {"mesh.Np": 28, "time.tol": 1e-3}
"""What stays the same in Fig. 3 while the other is varied."""
OTHER = {"mesh.Np": "time.tol", "time.tol": "mesh.Np"}
AGREED = 0.0068, 0.0054
"""Largest and mean discrepancy of the paper's two finer meshes in Fig. 3."""
ABSENT = 0.02
"""Least distance that was looked at; below it an attraction counts as gone."""


def distances(curves: list[Curve]) -> list[Zero]:
    """Critical distances; 0 where the pair repels at every distance from `ABSENT` on."""
    found = [curve.zero(stable=False) for curve in curves]
    return [Zero(0.0, 0.0) if math.isnan(zero.d) else zero for zero in found]


def over_De(results: Results, Ca_e: float) -> list[Curve]:
    """The curves of one Ca_e at beta .4, from De .125 to 2."""
    return [results.curve(beta=0.4, De=De, Ca_e=Ca_e) for De in DES]


def critical_over_softness(results: Results, De: float) -> tuple[list[float], list[float], list[float]]:
    """Ca_e, d_cr and its error along the first branch of unstable distances, in ascending Ca_e."""
    rows = [row for row in results.critical(De).rows if row["kind"] == "wanted" and not row["stable"]]
    if not rows:
        raise NotComputed(f"no critical distance at De {De:g}")
    rows = sorted((row for row in rows if row["branch"] == rows[0]["branch"]), key=lambda row: row["Ca_e"])
    return [r["Ca_e"] for r in rows], [r["d_cr"] for r in rows], [float(r["d_error"]) for r in rows]


@statements(
    "fig03",
    {
        "dU(t) on the two finer of three meshes differs by .68 % at most, by .54 % on average.": "mesh.Np",
        "dU(t) with the two smaller of three time steps superposes fairly.": "time.tol",
    },
)
def converged(results: Results, key: str) -> Finding:
    """Whether runs with the two finer meshes or tolerances agree as in the paper, relative to the largest |dU|."""
    known = [run for run in results.runs(De=1, **{"time.end": 6}) if run.parameters[OTHER[key]] == FIXED[OTHER[key]]]
    if len(known) < len(FIXED) + 1:
        raise NotComputed(f"three runs with different {key}")
    runs = sorted(known, key=lambda run: run.parameters[key], reverse=key == "time.tol")
    t = np.geomspace(max(run.table["t"][0] for run in runs), min(run.last("t") for run in runs), 500)
    dU = [PchipInterpolator(run.table["t"], run.table["dU"])(t) for run in runs]
    scale = float(np.abs(dU[-1]).max())
    apart = [np.abs(a - b) / scale for a, b in itertools.pairwise(dU)]
    most = [float(each.max()) for each in apart]
    mean = [float(trapezoid(each, t) / (t[-1] - t[0])) for each in apart]
    text = f"{key} {numbers(run.parameters[key] for run in runs)}: at most {numbers(most, '.2%')}, on average "
    return Finding(((AGREED[0] - most[-1], 0.0), (AGREED[1] - mean[-1], 0.0)), text + numbers(mean, ".2%"))


@statement("fig09", "There are master curves of dU in a viscoelastic liquid, too.")
def _(results: Results) -> Finding:
    return collapse(results, "dU", newtonian=False)


@statement("fig09", "At De .125 stiff pairs (Ca_e .01) attract each other below a critical distance.")
def _(results: Results) -> Finding:
    curve = results.curve(beta=0.4, De=0.125, Ca_e=0.01)
    least, zero = curve.extreme(-1), distances([curve])[0]
    return Finding(((-least.dU, least.error), (zero.d, zero.error)), f"dU {smallest(curve)}; d_cr {zero.d:.3f}")


@statement("fig09", "At De .125 a larger Ca_e first makes the range of attraction smaller, then removes it.")
def _(results: Results) -> Finding:
    curves = by_softness(results, beta=0.4, De=0.125)
    zeros = distances(curves)
    checks = [(a.d - b.d if b.d or a.d else 1.0, a.error + b.error) for a, b in itertools.pairwise(zeros)]
    near = curves[-1].d < ALONE  # beyond it dU decays to zero
    dU, errors = curves[-1].table["dU"][near], curves[-1].table["dU_error"][near]
    checks += [(float(value), float(error)) for value, error in zip(dU, errors, strict=True)]
    return Finding(
        tuple(checks), f"d_cr {numbers(z.d for z in zeros)}; least dU up to d = .6 at Ca_e .15 {dU.min():.1e}"
    )


@statement("fig09", "At De .25 all pairs attract each other at small and repel each other at larger distances.")
def _(results: Results) -> Finding:
    curves = by_softness(results, beta=0.4, De=0.25)
    ends = [(-float(c.table["dU"][0]), float(c.table["dU_error"][0])) for c in curves]
    peaks = [c.extreme(1) for c in curves]
    text = f"dU at d = .02: {numbers(-v for v, _ in ends)}; largest dU {speeds(peaks)}"
    return Finding((*ends, *((v, e) for _, v, e in peaks)), text)


@statement("fig09", "At De .25 there is an unstable equilibrium distance.")
def _(results: Results) -> Finding:
    zeros = distances(by_softness(results, beta=0.4, De=0.25))
    return Finding(tuple((z.d, z.error) for z in zeros), f"d_cr {numbers(z.d for z in zeros)}")


@statement("fig09", "At De .25 a larger Ca_e reduces the equilibrium distance.")
def _(results: Results) -> Finding:
    zeros = distances(by_softness(results, beta=0.4, De=0.25))
    checks = falling([z.d for z in zeros], [z.error for z in zeros])
    return Finding(tuple(checks), f"d_cr {numbers(z.d for z in zeros)}")


@statement("fig09", "At De .25 the critical distance of Ca_e -> 0 is that of rigid pairs.")
def _(results: Results) -> Finding:
    soft, rigid = distances([results.curve(beta=0.4, De=0.25, Ca_e=Ca_e) for Ca_e in (0.01, 0)])
    return Finding((nearly((soft.d, rigid.d), rigid.d, soft.error),), f"Ca_e .01: {soft.d:.4f}, rigid: {rigid.d:.4f}")


@statement("fig09", "Far apart the relative velocity has decreased to 0, whatever Ca_e (De .25, d = 1.5).")
def _(results: Results) -> Finding:
    return vanished(by_softness(results, beta=0.4, De=0.25), FAR)


@statements(
    "fig09",
    {
        "At De .5 the curves of all Ca_e are nearly superimposed.": 0.5,
        "At De 1 the curves of all Ca_e are nearly superimposed.": 1.0,
        "At De 2 the curves of all Ca_e are nearly superimposed.": 2.0,
    },
)
def superimposed(results: Results, De: float) -> Finding:
    """Whether the curves of all Ca_e are nearly the same."""
    curves = by_softness(results, beta=0.4, De=De)
    places, peak = common_distances(curves), max(c.peak for c in curves)
    spreads = np.ptp(np.array([c.at("dU", places) for c in curves]), axis=0) / peak
    d, spread = float(places[spreads.argmax()]), float(spreads.max())
    error = sum(sorted(float(c.at("dU_error", d)) for c in curves)[-2:]) / peak
    text = f"they differ by up to {spread:.0%} ± {error:.0%} of the largest |dU| (at d = {d:.2f})"
    return Finding(((NEARLY - spread, error),), text)


@in_time("At De .5 the curves of all Ca_e are nearly superimposed.")
def _(results: Results) -> Finding:
    runs = [results.run(beta=0.4, De=0.5, Ca_e=Ca_e, d0=0.08) for Ca_e in (SOFT[0], SOFT[-1])]
    peak = max(curve.peak for curve in by_softness(results, beta=0.4, De=0.5))
    dU, d = ([run.last(name) for run in runs] for name in ("dU", "d"))
    apart = f"{abs(dU[0] - dU[1]) / peak:.0%} of the largest |dU| apart"
    text = f"Ca_e .01 and .15 from d = .08: dU {numbers(dU)} at d = {numbers(d)}, {apart}"
    return Finding((nearly(dU, peak),), text)


@statement("fig09", "From De .5 to 2 the critical distance shifts to lower values.")
def _(results: Results) -> Finding:
    checks: list[Check] = []
    parts = []
    for Ca_e in SOFT:
        zeros = distances(over_De(results, Ca_e)[2:])
        checks += falling([z.d for z in zeros], [z.error for z in zeros])
        parts.append(f"Ca_e {Ca_e:g}: {numbers(z.d for z in zeros)}")
    return Finding(tuple(checks), "; ".join(parts))


@statement("fig09", "At De 2 there is no attraction any more.")
def _(results: Results) -> Finding:
    curves = by_softness(results, beta=0.4, De=2)
    least = [c.extreme(-1) for c in curves]
    text = "; ".join(f"Ca_e {Ca_e:g}: least dU {smallest(c)}" for Ca_e, c in zip(SOFT, curves, strict=True))
    return Finding(tuple((p.dU, drawn(c, p.error)) for c, p in zip(curves, least, strict=True)), text)


@in_time("At De 2 there is no attraction any more.")
def _(results: Results) -> Finding:
    runs = [results.run(beta=0.4, De=2, Ca_e=Ca_e, d0=0.03) for Ca_e in (0.1, 0.15)]
    dU = [run.last("dU") for run in runs]
    return Finding(
        tuple((v, 0.0) for v in dU), f"from d = .03 at Ca_e .1, .15: dU {numbers(dU)} at t = {runs[0].last('t'):g}"
    )


@statement("fig09", "At high De the attractive range shrinks and the repulsive peak grows.")
def _(results: Results) -> Finding:
    checks: list[Check] = []
    parts = []
    for Ca_e in SOFT:
        peaks = [c.extreme(1) for c in over_De(results, Ca_e)[2:]]
        checks += rising_dU(peaks)
        parts.append(f"Ca_e {Ca_e:g}: {speeds(peaks)}")
    return Finding(tuple(checks), "largest dU at De .5, 1, 2: " + "; ".join(parts))


@statement("fig09", "At low De softness promotes repulsion (De .125 and .25, d = .1).")
def _(results: Results) -> Finding:
    checks: list[Check] = []
    parts = []
    for De in (0.125, 0.25):
        curves = by_softness(results, beta=0.4, De=De)
        values = [float(c.at("dU", 0.1)) for c in curves]
        checks += rising(values, [float(c.at("dU_error", 0.1)) for c in curves])
        parts.append(f"De {De:g}: {numbers(values)}")
    return Finding(tuple(checks), "; ".join(parts))


@statement("fig10", "The Newtonian dynamics (De = 0) is always repulsive.")
def _(results: Results) -> Finding:
    return always_repulsive([results.curve(beta=0.4, De=0, Ca_e=Ca_e) for Ca_e in (0.01, 0.1, 0.15)])


@statements(
    "fig10",
    {
        "For stiff particles (Ca_e .01) the attractive range first grows with De, then contracts.": 0.01,
        "For softer particles (Ca_e .1) d_cr first grows with De, up to De .5, then shrinks.": 0.1,
        "For softer particles (Ca_e .15) d_cr first grows with De, up to De .5, then shrinks.": 0.15,
    },
)
def enlarges_then_contracts(results: Results, Ca_e: float) -> Finding:
    """Whether d_cr first grows with De from 0, where there is none, and then shrinks."""
    zeros = [Zero(0.0, 0.0), *distances(over_De(results, Ca_e))]
    top = max(range(len(zeros)), key=lambda i: zeros[i].d)
    checks = rising([z.d for z in zeros[: top + 1]], [z.error for z in zeros[: top + 1]])
    checks = [check for check in checks if check != (0.0, 0.0)]  # none at either De
    checks += falling([z.d for z in zeros[top:]], [z.error for z in zeros[top:]])
    return Finding(tuple(checks), f"d_cr at De 0, .125, .25, .5, 1, 2: {numbers(z.d for z in zeros)}")


@statement("fig10", "For stiff particles (Ca_e .01) the attraction is gone at De 2.")
def _(results: Results) -> Finding:
    curve = results.curve(beta=0.4, De=2, Ca_e=0.01)
    least = curve.extreme(-1)
    return Finding(((least.dU, drawn(curve, least.error)),), f"least dU {smallest(curve)}")


@statement("fig10", "For stiff particles a larger De gives a higher peak of the relative velocity.")
def _(results: Results) -> Finding:
    peaks = [c.extreme(1) for c in over_De(results, 0.01)]
    newtonian = results.curve(beta=0.4, De=0, Ca_e=0.01).extreme(1)
    checks = rising_dU(peaks)
    return Finding(tuple(checks), f"largest dU from De .125 on: {speeds(peaks)} (De 0: {newtonian.dU:.3g})")


def peaks_in_time(results: Results, Ca_e: float) -> Finding:
    """The same from transients alone: one at De .5, and larger dU at De 0."""
    runs = [run for De in (0, 0.5) for run in results.runs(particles=2, beta=0.4, De=De, Ca_e=Ca_e)]
    most = [max((r.last("dU") for r in runs if r.parameters["De"] == De), default=math.nan) for De in (0, 0.5)]
    if math.isnan(most[0] + most[1]):
        raise NotComputed(f"runs of Ca_e {Ca_e:g} at De 0 and .5")
    return Finding(((most[1] - most[0], 0.0),), f"largest dU at the end of a transient at De 0, .5: {numbers(most)}")


@statements(
    "fig10",
    {
        "The repulsive peak, too, grows with De up to .5 and shrinks then (Ca_e .1).": 0.1,
        "The repulsive peak, too, grows with De up to .5 and shrinks then (Ca_e .15).": 0.15,
    },
)
def peak_grows_then_falls(results: Results, Ca_e: float) -> Finding:
    """Whether the repulsive peak grows with De up to .5 and falls from there on, over the De that were computed."""
    found = {De: results.curves(beta=0.4, De=De, Ca_e=Ca_e) for De in (0.0, *DES)}
    known = {De: curves[0] for De, curves in found.items() if curves}
    if not {0.0, 0.5} <= known.keys():
        raise NotComputed(f"curves of Ca_e {Ca_e:g} at De 0 and .5")
    most = {De: curve.extreme(1) for De, curve in known.items()}
    up, down = [p for De, p in most.items() if De <= 0.5], [p for De, p in most.items() if De >= 0.5]
    checks = rising_dU(up) + falling([p.dU for p in down], [p.error for p in down])
    least = (curve.extreme(-1).dU for curve in known.values())
    text = f"largest dU at De {numbers(most)}: {speeds(most.values())}; least {numbers(least)}"
    return Finding(tuple(checks), text)


@in_time("The repulsive peak, too, grows with De up to .5 and shrinks then (Ca_e .1).")
def _(results: Results) -> Finding:
    return peaks_in_time(results, 0.1)


@in_time("The repulsive peak, too, grows with De up to .5 and shrinks then (Ca_e .15).")
def _(results: Results) -> Finding:
    return peaks_in_time(results, 0.15)


@statement("fig11", "The critical distances of Ca_e -> 0 are those of rigid pairs.")
def _(results: Results) -> Finding:
    checks, parts = [], []
    for De in (0.125, 0.25, 0.5, 1.0):
        _, d_cr, errors = critical_over_softness(results, De)
        rigid = distances([results.curve(beta=0.4, De=De, Ca_e=0)])[0]
        checks.append(nearly((d_cr[0], rigid.d), rigid.d, errors[0] + rigid.error))
        parts.append(f"De {De:g}: {d_cr[0]:.4f}, rigid {rigid.d:.4f}")
    return Finding(tuple(checks), "Ca_e .005 at " + "; ".join(parts))


@statements(
    "fig11",
    {
        "A larger Ca_e always reduces d_cr: De .125.": 0.125,
        "A larger Ca_e always reduces d_cr: De .25.": 0.25,
        "A larger Ca_e always reduces d_cr: De .5.": 0.5,
        "A larger Ca_e always reduces d_cr: De 1.": 1.0,
    },
)
def softness_reduces(results: Results, De: float) -> Finding:
    """Whether d_cr falls with Ca_e."""
    Ca_es, d_cr, errors = critical_over_softness(results, De)
    text = (
        f"d_cr {d_cr[0]:.4f} ± {errors[0]:.4f} at Ca_e {Ca_es[0]:g}, {d_cr[-1]:.4f} ± {errors[-1]:.4f} at {Ca_es[-1]:g}"
    )
    return Finding(tuple(falls_along(d_cr, errors)), text)


@in_time("A larger Ca_e always reduces d_cr: De 1.")
def _(results: Results) -> Finding:
    return not_opposite(results, 0.185, beta=0.4, De=1)


@statement("fig11", "The effect of Ca_e is the stronger the lower De.")
def _(results: Results) -> Finding:
    slopes, errors, ends = [], [], []
    for De in (0.125, 0.25, 0.5, 1.0):
        Ca_es, d_cr, error = critical_over_softness(results, De)
        ends.append(Ca_es[-1])
        slopes.append(abs(d_cr[-1] - d_cr[0]) / (Ca_es[-1] - Ca_es[0]))
        errors.append((error[-1] + error[0]) / (Ca_es[-1] - Ca_es[0]))
    text = f"mean |slope| from Ca_e .005 to {numbers(ends)}: {numbers(slopes)} ± {numbers(errors, '.1g')}"
    return Finding(tuple(falling(slopes, errors)), text)


@statement("fig11", "At De 1 d_cr is almost independent of Ca_e.")
def _(results: Results) -> Finding:
    _, d_cr, errors = critical_over_softness(results, 1.0)
    return Finding((nearly(d_cr, min(d_cr), max(errors)),), f"d_cr from {min(d_cr):.4f} to {max(d_cr):.4f}")


@statement("fig11", "The critical distance is unstable: attraction below, repulsion above.")
def _(results: Results) -> Finding:
    rows = [row for De in (0.125, 0.25, 0.5, 1.0) for row in results.critical(De).rows if row["kind"] == "wanted"]
    unstable = sum(not row["stable"] for row in rows)
    checks = tuple((float(row["slope"]), 0.0) for row in rows)
    return Finding(checks, f"{unstable} of {len(rows)} are; least slope {min(row['slope'] for row in rows):.2g}")


@statement("fig11", "The first line is at De .0125.")
def _(results: Results) -> Finding:
    curves = [results.curve(beta=0.4, De=0.0125, Ca_e=Ca_e) for Ca_e in (0.01, 0.05)]
    zeros = distances(curves)
    text = f"d_cr at Ca_e .01, .05: {numbers(zero.d for zero in zeros)}; Figs. 9 and 10 have De .125"
    return Finding(tuple((zero.d - ABSENT, zero.error) for zero in zeros), text)
