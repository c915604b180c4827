"""Statements of section 3.1 of the paper: pairs in a Newtonian liquid."""

from __future__ import annotations

import numpy as np
from paper_results import Curve, NotComputed, Results, Transient, listed
from paper_statements import (
    NEARLY,
    SOFT,
    VANISHED,
    Check,
    Finding,
    by_softness,
    common_distances,
    deviations,
    drawn,
    falling,
    in_time,
    nearly,
    not_opposite,
    numbers,
    rising,
    run_error,
    smallest,
    speeds,
    statement,
    statements,
)
from scipy.interpolate import LinearNDInterpolator

from pairsim.runtime.arrays import Array

RIGID_AT_REST = 1e-8
"""dU of rigid pairs below this is zero [U_av]."""
SETTLED = 0.05
"""A transient lasts until dU stays within this part of the peak of the quasi-steady curve at the same distance."""
SIMILAR = 0.5
""""qualitatively similar": a correlation above this."""
ALONE = 0.6
"""Distance from which particles do not interact any more, as the paper has it [D_c]."""


def fig6(results: Results, Ca_e: float) -> Transient:
    """A run of Fig. 6."""
    return results.run(beta=0.4, De=0, d0=0.1, Ca_e=Ca_e, particles=2)


def soft_runs(results: Results) -> list[Transient]:
    """The soft ones of them."""
    return [fig6(results, Ca_e) for Ca_e in SOFT]


def early(run: Transient, name: str) -> tuple[float, float]:
    """Time and value of the first largest value of a column."""
    i = int(np.argmax(run.table[name]))
    return float(run.table["t"][i]), float(run.table[name][i])


@statement("fig06", "The rigid pair (Ca_e = 0) does not move relative to each other.")
def _(results: Results) -> Finding:
    largest = float(np.abs(fig6(results, 0).table["dU"]).max())
    return Finding(((RIGID_AT_REST - largest, 0.0),), f"largest dU {largest:.1e}")


@statement("fig06", "Soft pairs first have a negative relative velocity: they get closer.")
def _(results: Results) -> Finding:
    runs = soft_runs(results)
    least = [float(run.table["dU"].min()) for run in runs]
    return Finding(tuple((-v, run_error(r)) for v, r in zip(least, runs, strict=True)), f"least dU {numbers(least)}")


@statement("fig06", "After that soft pairs repel each other.")
def _(results: Results) -> Finding:
    runs = soft_runs(results)
    last = [run.last("dU") for run in runs]
    t = runs[0].last("t")
    checks = tuple((v, run_error(r)) for v, r in zip(last, runs, strict=True))
    return Finding(checks, f"dU at t = {t:g}: {numbers(last)}")


@statement("fig06", "The terminal velocity increases with Ca_e.")
def _(results: Results) -> Finding:
    runs = soft_runs(results)
    last = [run.last("dU") for run in runs]
    return Finding(tuple(rising(last, [run_error(run) for run in runs])), f"dU at the end {numbers(last)}")


@statement("fig06", "The duration of the transient increases monotonically with Ca_e.")
def _(results: Results) -> Finding:
    spans, steps = [], []
    for Ca_e, run in zip(SOFT, soft_runs(results), strict=True):
        curve, t = results.curve(beta=0.4, De=0, Ca_e=Ca_e), run.table["t"]
        off = np.abs(run.table["dU"] - curve.at("dU", run.table["d"])) > SETTLED * curve.peak
        spans.append(float(t[off][-1]) if off.any() else 0.0)
        steps.append(float(np.interp(spans[-1], t, run.table["dt"])))
    text = (
        f"dU is within {SETTLED:.0%} of the peak of the curve from t = {numbers(spans)} on (the runs' end: {t[-1]:g})"
    )
    return Finding(tuple(rising(spans, steps)), text)


@statement("fig06", "D is 0 at the start.")
def _(results: Results) -> Finding:
    runs = [fig6(results, Ca_e) for Ca_e in (0.1, 0.15)]
    first = [float(run.table[name][0]) for run in runs for name in ("D_L", "D_T")]
    t = max(float(run.table["t"][0]) for run in runs)
    return Finding(
        ((NEARLY * 0.04 - max(map(abs, first)), 0.0),), f"D after the first step (t = {t:.1g}) {numbers(first)}"
    )


@statement("fig06", "The D_L that Ca_e = .1 and .15 reach after the transient are substantially the same.")
def _(results: Results) -> Finding:
    runs = [fig6(results, Ca_e) for Ca_e in (0.1, 0.15)]
    most = [early(run, "D_L") for run in runs]
    steady = [float(results.curve(beta=0.4, De=0, Ca_e=Ca_e).at("D_L", 0.1)) for Ca_e in (0.1, 0.15)]
    text = f"largest D_L {numbers(v for _, v in most)} at t = {numbers(t for t, _ in most)}; steady at d = .1 they are "
    return Finding((nearly((v for _, v in most), most[0][1]),), f"{text}{numbers(steady)}")


@statement("fig06", "The magnitude of D_T increases with Ca_e.")
def _(results: Results) -> Finding:
    ends = [abs(fig6(results, Ca_e).last("D_T")) for Ca_e in (0.1, 0.15)]
    return Finding(((ends[1] - ends[0], 0.01 * ends[0]),), f"|D_T| {numbers(ends)}")


@statement("fig06", "D_T has its initial peak when the relative velocity is least.")
def _(results: Results) -> Finding:
    checks, parts = [], []
    for Ca_e in (0.1, 0.15):
        run = fig6(results, Ca_e)
        i = int(np.argmin(run.table["dU"]))
        least, (peak, _) = float(run.table["t"][i]), early(run, "D_T")
        checks.append(nearly((peak, least), least, float(run.table["dt"][i])))
        parts.append(f"Ca_e {Ca_e:g}: D_T at t = {peak:.3f}, dU at {least:.3f}")
    return Finding(tuple(checks), "; ".join(parts))


@statements(
    "fig06",
    {
        "The particles first elongate while their distance shrinks, then slowly separate: the trailing one.": "D_T",
        "The particles first elongate while their distance shrinks, then slowly separate: the leading one.": "D_L",
    },
)
def elongates(results: Results, name: str) -> Finding:
    """Whether a particle is elongated when dU is least, and the pair first comes closer, then separates."""
    checks: list[Check] = []
    parts = []
    for Ca_e in (0.1, 0.15):
        run = fig6(results, Ca_e)
        D, d = float(run.table[name][int(np.argmin(run.table["dU"]))]), run.table["d"]
        checks += [(D, 0.0), (0.1 - float(d.min()), 0.0), (float(d[-1]) - 0.1, 0.0)]
        parts.append(f"Ca_e {Ca_e:g}: {name} {D:.3g} when dU is least; d from .1 to {d.min():.4f} to {d[-1]:.4f}")
    return Finding(tuple(checks), "; ".join(parts))


@statements(
    "fig07",
    {
        "Terminal velocities from different d_0 collapse on a master curve (Newtonian).": "dU",
        "D_T from different d_0 collapses on a master curve (Newtonian).": "D_T",
        "D_L from different d_0 collapses on a master curve (Newtonian).": "D_L",
    },
)
def collapse(results: Results, name: str, newtonian: bool = True) -> Finding:
    """Whether transients from different d_0 end on the curve, within `NEARLY` of its largest value."""
    checks: list[Check] = []
    rests = []
    for marker in results.markers():
        if (marker.run.parameters["De"] == 0) == newtonian:
            if name == "dU":
                rest = abs(marker.rest) / marker.curve.peak
            else:
                scale = float(np.abs(marker.curve.table[name]).max())
                rest = abs(marker.run.last(name) - float(marker.curve.at(name, marker.d))) / scale
            rests.append(rest)
            checks.append((NEARLY - rest, 0.0))
    if not rests:
        raise NotComputed("no transient with its curve")
    return Finding(
        tuple(checks), f"{len(rests)} transients end within {numbers([max(rests)], '.1%')} of the largest value"
    )


@statement("fig07", "At beta .4 the dynamics is always repulsive.")
def _(results: Results) -> Finding:
    curves = by_softness(results, beta=0.4, De=0)
    return always_repulsive(curves)


def always_repulsive(curves: list[Curve]) -> Finding:
    """Whether dU is positive at all points."""
    pairs = [(c, v, e) for c in curves for v, e in zip(c.table["dU"], c.table["dU_error"], strict=True)]
    parts = [f"Ca_e {listed(curve.parameters['Ca_e'])[0]:g}: {smallest(curve)}" for curve in curves]
    return Finding(tuple((float(v), drawn(c, float(e))) for c, v, e in pairs), "least dU " + "; ".join(parts))


@statement("fig07", "At beta .4 dU increases with Ca_e (d up to .6).")
def _(results: Results) -> Finding:
    curves = by_softness(results, beta=0.4, De=0)
    places = [d for d in common_distances(curves) if d <= ALONE]
    checks = [c for d in places for c in rising([x.at("dU", d) for x in curves], [x.at("dU_error", d) for x in curves])]
    return Finding(tuple(checks), f"dU at d = .1: {numbers(x.at('dU', 0.1) for x in curves)}")


@statement("fig07", "At beta .4 the relative velocity has decreased to 0 from d = .6 on, whatever Ca_e.")
def _(results: Results) -> Finding:
    return vanished(by_softness(results, beta=0.4, De=0), ALONE)


def vanished(curves: list[Curve], distance: float) -> Finding:
    """Whether dU has decreased to zero at a distance."""
    checks, parts = [], []
    for curve in curves:
        places = np.array([distance, *curve.d[curve.d > distance]])
        values = np.abs(curve.at("dU", places)) / curve.peak
        parts.append(float(values.max()))
        checks.append((VANISHED - parts[-1], float(curve.at("dU_error", places[values.argmax()])) / curve.peak))
    return Finding(tuple(checks), f"largest |dU| beyond d = {distance:g}: {numbers(parts, '.2%')} of the peak")


@statement("fig07", "At beta .4, Ca_e .1 both |D| grow as the particles come closer.")
def _(results: Results) -> Finding:
    curve = results.curve(beta=0.4, De=0, Ca_e=0.1)
    checks: list[Check] = []
    for name in ("D_L", "D_T"):
        values = np.abs(curve.table[name])
        checks += falling(list(map(float, values)), [1e-4] * len(values))
    places = np.array([0.02, 0.1, 0.2, 0.3, 0.6])
    parts = [f"{name} {numbers(curve.at(name, places))}" for name in ("D_L", "D_T")]
    return Finding(tuple(checks), f"at d = {numbers(places)}: " + "; ".join(parts))


@in_time("At beta .4, Ca_e .1 both |D| grow as the particles come closer.")
def _(results: Results) -> Finding:
    runs = sorted(results.runs(particles=2, beta=0.4, De=0, Ca_e=0.1), key=lambda run: run.last("d"))
    checks = [c for name in ("D_L", "D_T") for c in falling([abs(r.last(name)) for r in runs], [1e-4] * len(runs))]
    parts = [f"{name} {numbers(run.last(name) for run in runs)}" for name in ("D_L", "D_T")]
    return Finding(tuple(checks), f"at d = {numbers(run.last('d') for run in runs)}: " + "; ".join(parts))


@statement("fig07", "At beta .4, Ca_e .1 both particles deform as isolated ones from d = .6 on.")
def _(results: Results) -> Finding:
    curve = results.curve(beta=0.4, De=0, Ca_e=0.1)
    checks, parts = [], []
    for name in ("D_L", "D_T"):
        ends = [float(curve.at(name, d)) for d in (ALONE, curve.d[-1])]
        checks.append(nearly(ends, float(np.abs(curve.table[name]).max())))
        parts.append(f"{name} {ends[0]:.4f} at .6, {ends[1]:.4f} at {curve.d[-1]:g}")
    return Finding(tuple(checks), "; ".join(parts))


@statement("fig07", "At beta .2 the dynamics is repulsive at short distances for every Ca_e.")
def _(results: Results) -> Finding:
    curves = by_softness(results, beta=0.2, De=0)
    ends = [(float(c.table["dU"][0]), float(c.table["dU_error"][0])) for c in curves]
    return Finding(tuple(ends), f"dU at d = .02: {numbers(v for v, _ in ends)}")


@statement("fig07", "At beta .2 the particles attract each other at larger distances.")
def _(results: Results) -> Finding:
    curves = by_softness(results, beta=0.2, De=0)
    least = [c.extreme(-1) for c in curves]
    text = f"least dU {speeds(least)} at d = {numbers(point.d for point in least)}"
    return Finding(tuple((-point.dU, point.error) for point in least), text)


@statement("fig07", "At beta .2 the particles attract each other at all larger distances.")
def _(results: Results) -> Finding:
    curves = by_softness(results, beta=0.2, De=0)
    beyond = [c.extreme(1, ALONE) for c in curves]
    checks = tuple((-v, drawn(c, e)) for c, (_, v, e) in zip(curves, beyond, strict=True))
    return Finding(checks, "largest dU beyond .6: " + "; ".join(f"{v:.1e} ± {e:.0e} at {d:.2f}" for d, v, e in beyond))


@statement("fig07", "At beta .2 there is a stable equilibrium distance.")
def _(results: Results) -> Finding:
    zeros = [c.zero(stable=True) for c in by_softness(results, beta=0.2, De=0)]
    checks = tuple((-1.0 if np.isnan(z.d) else z.d, z.error) for z in zeros)
    return Finding(checks, f"d = {numbers((z.d for z in zeros), '.4f')}")


@statement("fig07", "The stable equilibrium distance is almost independent of Ca_e.")
def _(results: Results) -> Finding:
    zeros = [c.zero(stable=True) for c in by_softness(results, beta=0.2, De=0)]
    spread = nearly([z.d for z in zeros], min(z.d for z in zeros), sum(z.error for z in zeros[::3]))
    return Finding((spread,), f"d = {numbers((z.d for z in zeros), '.4f')} at Ca_e {numbers(SOFT, 'g')}")


@in_time("The stable equilibrium distance is almost independent of Ca_e.")
def _(results: Results) -> Finding:
    return not_opposite(results, 0.058, beta=0.2, De=0)


@statement("fig07", "At beta .2 both the positive and the negative peak of dU increase with Ca_e.")
def _(results: Results) -> Finding:
    curves = by_softness(results, beta=0.2, De=0)
    checks: list[Check] = []
    parts = []
    for sign in (1, -1):
        found = [c.extreme(sign) for c in curves]
        checks += rising([sign * v for _, v, _ in found], [e for _, _, e in found])
        parts.append(numbers(v for _, v, _ in found))
    return Finding(tuple(checks), f"largest dU {parts[0]}; least {parts[1]}")


@statement("fig07", "Relative velocities at beta .2 are almost two orders of magnitude below those at beta .4.")
def _(results: Results) -> Finding:
    pairs = zip(by_softness(results, beta=0.4, De=0), by_softness(results, beta=0.2, De=0), strict=True)
    ratios = [a.peak / b.peak for a, b in pairs]
    checks = tuple((0.5 - abs(float(np.log10(ratio)) - 1.75), 0.01) for ratio in ratios)  # 10^1.25 to 10^2.25
    return Finding(checks, f"ratio of the peaks {numbers(ratios)}")


def in_particles(case: Curve) -> tuple[Array, Array]:
    """Undeformed positions about each particle's centre, over its radius, (n, 2), and tau_zz there in units of G_p."""
    frame, radius = case.frame(0.1), listed(case.parameters["beta"])[0] / 2
    place, stress = [], []
    for number in (1, 2):
        nodes = np.unique(frame.cells[frame.region == number])
        at = frame.points[nodes] - frame.point_data["displacement"][nodes]
        middle = (at[:, 0].max() + at[:, 0].min()) / 2
        place.append((at - [middle, 0]) / radius + [10.0 * number, 0])
        stress.append(frame.point_data["tau_s"][nodes, 0] * max(listed(case.parameters["Ca_e"])))
    return np.vstack(place), np.concatenate(stress)


def stresses(results: Results) -> list[tuple[Array, Array]]:
    """Those of Fig. 8, a and b."""
    return [in_particles(results.curve(beta=0.4, De=0, Ca_e=Ca_e)) for Ca_e in (0.05, 0.15)]


def radii(place: Array) -> Array:
    """Distances from the particles' centres, over their radius."""
    return np.hypot((place[:, 0] + 5) % 10 - 5, place[:, 1])


@statement("fig08", "The stress is distributed similarly in particles of Ca_e .05 and .15.")
def _(results: Results) -> Finding:
    (here, a), (there, b) = stresses(results)
    other = LinearNDInterpolator(there, b)(here)
    known = np.isfinite(other)
    correlation = float(np.corrcoef(a[known], other[known])[0, 1])
    return Finding(((correlation - SIMILAR, 0.0),), f"correlation of tau_zz at the same points {correlation:.3f}")


@statement("fig08", "At Ca_e .15 the core is under stronger compression.")
def _(results: Results) -> Finding:
    least = [float(tau[radii(place) < 0.5].min()) for place, tau in stresses(results)]
    checks = ((least[0] - least[1], 0.0), (-least[1], 0.0))
    return Finding(checks, f"least tau_zz within half of the radius {numbers(least)} G_p")


@statement("fig08", "At Ca_e .15 the surface is under stronger tension.")
def _(results: Results) -> Finding:
    most = [float(tau[radii(place) > 0.95].max()) for place, tau in stresses(results)]
    checks = ((most[1] - most[0], 0.0), (most[1], 0.0))
    return Finding(checks, f"largest tau_zz at the surface {numbers(most)} G_p")


@statement("fig08", "The softer particles are more deformed.")
def _(results: Results) -> Finding:
    found = [deviations(results.curve(beta=0.4, De=0, Ca_e=Ca_e).frame(0.1)) for Ca_e in (0.05, 0.15)]
    text = "; ".join(f"Ca_e {Ca_e:g}: {numbers(v, '.2%')}" for Ca_e, v in zip((0.05, 0.15), found, strict=True))
    checks = tuple((b - a, 0.0) for a, b in zip(*found, strict=True))
    return Finding(checks, f"rms deviation from a sphere (trailing, leading): {text}")
