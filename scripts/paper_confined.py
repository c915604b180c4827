"""Statements of section 3.2 of the paper on confinement, fields and shapes, and those of its summary."""

from __future__ import annotations

import math

import numpy as np
from paper_results import Curve, NotComputed, Results, listed
from paper_statements import (
    NEARLY,
    SOFT,
    Finding,
    by_softness,
    deviations,
    drawn,
    falling,
    in_time,
    numbers,
    rising,
    rising_dU,
    smallest,
    speeds,
    statement,
    statements,
)
from paper_viscoelastic import DES, distances


def confined(results: Results) -> list[Curve]:
    """The curves of Fig. 12: beta .2, .4 and .6."""
    return [results.curve(beta=beta, De=2, Ca_e=0.1) for beta in (0.2, 0.4, 0.6)]


@statement("fig12", "A larger confinement speeds the dynamics up.")
def _(results: Results) -> Finding:
    peaks = [c.extreme(1) for c in confined(results)]
    return Finding(
        tuple(rising_dU(peaks)),
        f"largest dU {speeds(peaks)}",
    )


@statement("fig12", "The repulsive peak grows by two orders of magnitude from beta .2 to .6.")
def _(results: Results) -> Finding:
    curves = confined(results)
    ratio = curves[2].extreme(1)[1] / curves[0].extreme(1)[1]
    return Finding(((0.5 - abs(math.log10(ratio) - 2), 0.01),), f"by a factor of {ratio:.0f} (as stated: 32 to 320)")


@statement("fig12", "At low confinement pairs attract each other even at De 2.")
def _(results: Results) -> Finding:
    curve = confined(results)[0]
    least = curve.extreme(-1)
    return Finding(((-least.dU, drawn(curve, least.error)),), f"beta .2: least dU {smallest(curve)}")


HIGHER = "At higher confinement (beta .4 and .6) they do not."


@statement("fig12", HIGHER)
def _(results: Results) -> Finding:
    curves = [curve for beta in (0.4, 0.6) for curve in results.curves(beta=beta, De=2, Ca_e=0.1)]
    if not curves:
        raise NotComputed("curves of beta .4 and .6")
    least = [c.extreme(-1) for c in curves]
    text = "; ".join(f"beta {listed(c.parameters['beta'])[0]:g}: least dU {smallest(c)}" for c in curves)
    return Finding(tuple((p.dU, drawn(c, p.error)) for c, p in zip(curves, least, strict=True)), text)


@in_time(HIGHER)
def _(results: Results) -> Finding:
    run = results.run(beta=0.4, De=2, Ca_e=0.1, d0=0.03)
    dU = run.last("dU")
    return Finding(((dU, 0.0),), f"beta .4 from d = .03: dU {dU:.2e} at t = {run.last('t'):g}")


@statement("fig13", "The effect of softness is reversed at high confinement (De 1, d = .2, beta .2 and .6).")
def _(results: Results) -> Finding:
    checks, parts = [], []
    for beta, sign in ((0.2, -1), (0.6, 1)):
        values, errors = at_distance(by_softness(results, beta=beta, De=1), 0.2)
        checks.append((sign * (values[-1] - values[0]), errors[-1] + errors[0]))
        parts.append(f"beta {beta:g}: {numbers(values)}")
    return Finding(tuple(checks), "dU by Ca_e, " + "; ".join(parts))


def at_distance(curves: list[Curve], d: float) -> tuple[list[float], list[float]]:
    """dU of curves at a distance, and its errors."""
    return [float(c.at("dU", d)) for c in curves], [float(c.at("dU_error", d)) for c in curves]


def largest_extra(results: Results, name: str) -> tuple[list[float], list[float]]:
    """Largest absolute value, and the one that .5 % of the nodes near the pair exceed, at beta .4 and .6."""
    most, typical = [], []
    for beta in (0.4, 0.6):
        frame = results.curve_with_fields(0.1, beta=beta, De=0.5, Ca_e=0.15).frame(0.1)
        nodes = np.unique(frame.cells[frame.region == 0])
        nodes = nodes[np.abs(frame.points[nodes, 0] - frame.points[frame.cells[frame.region > 0], 0].mean()) < 1]
        values = np.abs(frame.point_data[name][nodes])
        most.append(float(values.max()))
        typical.append(float(np.quantile(values, 0.995)))
    return most, typical


def stronger_when_confined(results: Results, name: str) -> Finding:
    """Whether a perturbation is larger at beta .6."""
    most, typical = largest_extra(results, name)
    checks = ((most[1] - most[0], 0.0), (typical[1] - typical[0], 0.0))
    return Finding(
        checks, f"largest value at beta .4, .6: {numbers(most)}; exceeded by .5 % of the nodes: {numbers(typical)}"
    )


@statement("fig14", "The axial viscoelastic stress around the particles is larger in the more confined case.")
def _(results: Results) -> Finding:
    return stronger_when_confined(results, "tau_p_zz_extra")


@statement("fig14", "The larger stress at beta .6 promotes deformation and increases the relative velocity.")
def _(results: Results) -> Finding:
    curves = [results.curve_with_fields(0.1, beta=beta, De=0.5, Ca_e=0.15) for beta in (0.4, 0.6)]
    shapes = [deviations(c.frame(0.1)) for c in curves]
    fast = [abs(float(c.at("dU", 0.1))) for c in curves]
    checks = [(b - a, 0.0) for a, b in zip(*shapes, strict=True)]
    checks += rising(fast, [float(c.at("dU_error", 0.1)) for c in curves])
    text = "; ".join(f"beta {b:g}: {numbers(v, '.2%')}" for b, v in zip((0.4, 0.6), shapes, strict=True))
    return Finding(tuple(checks), f"rms deviation from a sphere (trailing, leading) {text}; |dU| {numbers(fast)}")


@statement("fig15", "The pressure perturbation is larger in the more confined case.")
def _(results: Results) -> Finding:
    return stronger_when_confined(results, "pressure_extra")


def shapes_over_De(results: Results) -> list[Curve]:
    """The curves of Fig. 16."""
    return [results.curve_with_fields(0.1, beta=0.4, De=De, Ca_e=0.15) for De in (0.0, *DES)]


@statements(
    "fig16",
    {
        "The particles are deformed less and less as De increases: the trailing one.": 0,
        "The particles are deformed less and less as De increases: the leading one.": 1,
    },
)
def less_deformed(results: Results, place: int) -> Finding:
    """Whether a particle's shape comes nearer to a sphere with De."""
    curves = shapes_over_De(results)
    off = [deviations(c.frame(0.1))[place] for c in curves]
    name = ("D_T", "D_L")[place]
    D = [float(c.at(name, 0.1)) for c in curves]
    checks = tuple(falling(off, [1e-4] * len(off)))
    return Finding(checks, f"rms deviation from a sphere at De 0 to 2: {numbers(off, '.2%')}; {name} {numbers(D)}")


@statement("fig17", "Confinement promotes deformation (De .5).")
def _(results: Results) -> Finding:
    shapes = [deviations(results.curve_with_fields(0.1, beta=b, De=0.5, Ca_e=0.15).frame(0.1)) for b in (0.2, 0.4, 0.6)]
    checks = [check for column in zip(*shapes, strict=True) for check in rising(column, [1e-4] * 3)]
    text = "; ".join(f"beta {b:g}: {numbers(v, '.2%')}" for b, v in zip((0.2, 0.4, 0.6), shapes, strict=True))
    return Finding(tuple(checks), f"rms deviation from a sphere (trailing, leading): {text}")


@statement("fig17", "At beta .2 particles are nearly spherical.")
def _(results: Results) -> Finding:
    found = deviations(results.curve_with_fields(0.1, beta=0.2, De=0.5, Ca_e=0.15).frame(0.1))
    return Finding(tuple((NEARLY / 2 - v, 0.0) for v in found), f"rms deviation from a sphere {numbers(found, '.2%')}")


LEADING = "In all these cases the leading particle is deformed more than the trailing one (Figs. 16 and 17)."


@statement("fig17", LEADING)
def _(results: Results) -> Finding:
    curves = shapes_over_De(results) + [results.curve_with_fields(0.1, beta=b, De=0.5, Ca_e=0.15) for b in (0.2, 0.6)]
    checks, parts = [], []
    for curve in curves:
        trailing, leading = deviations(curve.frame(0.1))
        checks.append((leading - trailing, 1e-4))
        beta, De = listed(curve.parameters["beta"])[0], curve.parameters["De"]
        parts.append(f"beta {beta:g}, De {De:g}: {trailing:.2%}, {leading:.2%}")
    return Finding(tuple(checks), "rms deviation from a sphere (trailing, leading), " + "; ".join(parts))


@in_time(LEADING)
def _(results: Results) -> Finding:
    run = results.run(beta=0.4, De=0, Ca_e=0.15, d0=0.1)
    D = [run.last(name) for name in ("D_T", "D_L")]
    text = f"beta .4, De 0 from d = .1, t = {run.last('t'):g}: D_T {D[0]:.4f}, D_L {D[1]:.4f}"
    return Finding(((abs(D[1]) - abs(D[0]), 1e-4),), text)


CAUSE = "The difference of the deformations is what makes dU differ from 0."


@statement("fig17", CAUSE)
def _(results: Results) -> Finding:
    curve = results.curve(beta=0.4, De=0.5, Ca_e=0)
    text = f"rigid spheres at De .5, which do not deform, have dU up to {curve.peak:.2e}; Newtonian ones have none"
    return Finding(((-curve.peak, float(curve.table["dU_error"].max())),), text)


@in_time(CAUSE)
def _(results: Results) -> Finding:
    run = results.run(beta=0.4, De=0.5, Ca_e=0, d0=0.1)
    dU = run.last("dU")
    return Finding(((-abs(dU), 0.0),), f"rigid spheres at De .5 from d = .1: dU {dU:.2e} at t = {run.last('t'):g}")


@statement("fig07", "Summary: in a Newtonian liquid, depending on beta, pairs have a stable distance or repel at any.")
def _(results: Results) -> Finding:
    small, large = (by_softness(results, beta=beta, De=0) for beta in (0.2, 0.4))
    zeros = [c.zero(stable=True) for c in small]
    none = [c.zero(stable=True) for c in large]
    checks = [(-1.0 if math.isnan(z.d) else z.d, z.error) for z in zeros]
    checks += [(1.0 if math.isnan(z.d) else -1.0, 0.0) for z in none]
    return Finding(
        tuple(checks), f"stable distance at beta .2: {numbers(z.d for z in zeros)}; at .4: {numbers(z.d for z in none)}"
    )


@statement("fig09", "Summary: where elasticity dominates, soft pairs behave as rigid ones do (De .5 and 1).")
def _(results: Results) -> Finding:
    checks, parts = [], []
    for De in (0.5, 1.0):
        rigid, *soft = distances([results.curve(beta=0.4, De=De, Ca_e=Ca_e) for Ca_e in (0, *SOFT)])
        checks += [(z.d, z.error) for z in (rigid, *soft)]
        parts.append(f"De {De:g}: rigid {rigid.d:.3f}, soft {numbers(z.d for z in soft)}")
    return Finding(tuple(checks), "d_cr, below which they attract: " + "; ".join(parts))


@statement(
    "fig13", "Conclusion: elasticity and softness together promote repulsion at high confinement (De 1, beta .6)."
)
def _(results: Results) -> Finding:
    curves = by_softness(results, beta=0.6, De=1)
    values, errors = at_distance(curves, 0.2)
    zeros = numbers(zero.d for zero in distances(curves))
    return Finding(tuple(rising(values, errors)), f"dU at d = .2: {numbers(values)}; d_cr {zeros}")
