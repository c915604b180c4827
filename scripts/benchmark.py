"""Measurements of docs/explanation/decisions.md, and the gain of each optimisation.

usage: scripts/benchmark [fig6] [fig3] [ends] [curve] [moving] [savings]     (default: fig6)

fig6     beta 0.4, d_0 0.1, Ca_e 0 to 0.15 as in Fig. 6 of the paper; writes runs/benchmark/fig6.png
fig3     beta 0.4, d_0 0.1, Ca_e 0.1, De 1 as in Fig. 3, on four meshes, with four tolerances; writes fig3.png there
ends     the pair of fig3 on the default mesh with developed and with periodic ends
curve    cost of a first point and of 20 quasi-steady points, in factorisations with assembly, Newtonian and De 1
moving   dU of curves compared with nineteen runs at the distances that they reach; the runs are kept in runs/moving
savings  time of a transient with each optimisation switched off in turn, Newtonian and De 1
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from measuring import every_matrix, with_one_thread
from scipy.interpolate import CubicSpline

import pairsim
import pairsim.runtime.fenicsx  # orders MPI ahead of everything compiled
from pairsim.commands import COMMANDS
from pairsim.drivers.problems import problem_of, steady_problem
from pairsim.fem.compilation.jit import JIT_OPTIONS
from pairsim.fem.phases import compiled_phase
from pairsim.inputs.case_files import parse_case
from pairsim.solvers.curves.branch import Branch
from pairsim.solvers.nonlinear.factors import MumpsOptions
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.problems import Problem
from pairsim.solvers.stepping.step import Step
from pairsim.solvers.transient.transient import Transient

PICTURES = Path(__file__).resolve().parent.parent / "runs" / "benchmark"
PAIR = {"beta": 0.4, "De": 0, "Ca_e": 0.1, "d0": 0.1}


def as_it_is(problem: Problem) -> Problem:
    """The problem with its default options."""
    return problem


def march(
    times: list[float], adapt: Callable[[Problem], Problem] = as_it_is, **changes: object
) -> tuple[list[Step], Transient, float]:
    """Integrate the pair in time.

    Args:
        times: Times at which a step must end, ascending.
        adapt: Function that changes the options of the solver.
        changes: Keys of the case.

    Returns:
        The steps, the transient, and the wall time including the setup [s].
    """
    begin = time.perf_counter()
    problem = adapt(problem_of(parse_case(COMMANDS["run"], {**PAIR, **changes}, "benchmark")))
    transient = Transient(problem)
    steps = list(transient.steps(iter(times)))
    return steps, transient, time.perf_counter() - begin


def dU(step: Step) -> float:
    return float(step.observation.dU[0])


def run(folder: Path | None = None, **changes: object) -> pairsim.RunResult:
    """The pair as a user computes it."""
    return pairsim.run({**PAIR, "output": {"fields": False}, **changes}, folder=folder).check()


def fig6() -> None:
    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(1, 2, figsize=(10, 4))
    print("Ca_e    dU least at t    dU least    D_T first peak at t    dU at t = 3")
    for Ca in (0, 0.01, 0.05, 0.1, 0.15):
        first = min(5e-4, Ca / 100) if Ca else 5e-4
        series = run(Ca_e=Ca, time={"end": 3.0, "first_step": first, "tol": 1e-4}).table
        t, u, leading, trailing = (series[name].to_numpy() for name in ("t", "dU", "D_L", "D_T"))
        axes[0].plot(t, u, label=f"{Ca:g}")
        if Ca >= 0.1:
            line = axes[1].plot(t, leading, label=f"{Ca:g}, leading")
            axes[1].plot(t, trailing, "--", color=line[0].get_color(), label=f"{Ca:g}, trailing")
        if Ca:
            print(f"{Ca:<5g}{extremum(t, u):13.4f}{u.min():16.4e}{extremum(t, -trailing):17.4f}{u[-1]:21.5e}")
        else:
            print(f"{Ca:<5g}  largest |dU| {np.abs(u).max():.1e}")
    for axis, label in zip(axes, (r"$\Delta U$ [$U_{av}$]", "$D$"), strict=True):
        axis.set(xlabel="$t$ [$D_c/U_{av}$]", ylabel=label)
        axis.axhline(0, color="0.7", linewidth=0.8, zorder=0)
        axis.legend(title=r"$\mathrm{Ca}_e$", frameon=False)
    figure.tight_layout()
    PICTURES.mkdir(parents=True, exist_ok=True)
    figure.savefig(PICTURES / "fig6.png", dpi=130)


def extremum(t: np.ndarray, values: np.ndarray) -> float:
    """Time of the minimum before t = 0.3, from a parabola through three steps."""
    k = int(np.argmin(values[t < 0.3]))
    a, b, _ = np.polyfit(t[k - 1 : k + 2], values[k - 1 : k + 2], 2)
    return float(-b / (2 * a))


VISCOELASTIC: dict[str, Any] = {"De": 1.0, "ends": "developed", "length": "auto"}
# Mesh of the reference solution.
FINE = {"Np": 56, "max_size": 0.035}


def curve(mesh: dict[str, float], tol: float, end: float = 6.0) -> CubicSpline:
    """Interpolant of dU(t) of the viscoelastic pair; prints the cost."""
    return reported(f"{mesh} tol {tol:.0e}", run(mesh=mesh, time={"end": end, "tol": tol}, **VISCOELASTIC))


def reported(title: str, result: pairsim.RunResult) -> CubicSpline:
    """Interpolant of dU(t) of a run; prints the cost."""
    record = result.record
    print(f"{title}: {record['unknowns']} unknowns, {record['steps']} steps, {record['wall_time']:.1f} s", flush=True)
    return CubicSpline(result.table["t"], result.table["dU"])


def off(found: CubicSpline, exact: CubicSpline) -> tuple[float, float]:
    """Largest and time-averaged difference at the steps of both curves, in % of the largest |dU|."""
    t = np.union1d(found.x, exact.x)
    difference, peak = np.abs(found(t) - exact(t)), np.abs(exact(exact.x)).max()
    return 100 * difference.max() / peak, 100 * float(np.trapezoid(difference, t)) / (t[-1] - t[0]) / peak


def fig3() -> None:
    matplotlib.use("Agg")
    from matplotlib import pyplot

    meshes = {f"$N_p$ = {Np}": curve({"Np": Np}, 1e-3) for Np in (14, 20, 28, 40)}
    times = {f"tol {tol:.0e}": curve({"Np": 14}, tol) for tol in (3e-3, 3e-4, 3e-5)}
    times = {"tol 3e-03": times["tol 3e-03"], "tol 1e-03": meshes["$N_p$ = 14"], **times}
    fine, finest = curve(FINE, 1e-3), times.pop("tol 3e-05")
    # Best estimate if both errors are additive: the fine mesh, plus the change by finer steps on a coarse mesh.
    t = np.union1d(fine.x, finest.x)
    best = CubicSpline(t, fine(t) + finest(t) - times["tol 1e-03"](t))
    print("differences in % of the largest |dU|: largest, time average")
    for label, run in meshes.items():
        print(label, "against the fine mesh, same tol: {:.3f} {:.3f}".format(*off(run, fine)), end="; ")
        print("against it with finer steps: {:.3f} {:.3f}".format(*off(run, best)))
    for label, run in times.items():
        print(label, "against tol 3e-5, N_p 14: {:.3f} {:.3f}".format(*off(run, finest)))
    panels = [
        (meshes | {"$N_p$ = 56, cells of .035": fine}, fine, "tol 1e-3"),
        (times | {"tol 3e-05": finest}, finest, "$N_p$ = 14"),
    ]
    figure, axes = pyplot.subplots(1, 2, figsize=(11, 4))
    for axis, (runs, exact, title) in zip(axes, panels, strict=True):
        for label, run in runs.items():
            error = "" if run is exact else f": {off(run, exact)[0]:.2f} % off"
            axis.plot(run.x, run(run.x), label=label + error, linewidth=1)
        axis.set(xlabel="$t$ [$D_c/U_{av}$]", ylabel=r"$\Delta U$ [$U_{av}$]", title=title)
        axis.axhline(0, color="0.7", linewidth=0.8, zorder=0)
        axis.legend(frameon=False)
    figure.tight_layout()
    PICTURES.mkdir(parents=True, exist_ok=True)
    figure.savefig(PICTURES / "fig3.png", dpi=110)


def ends() -> None:
    time = {"end": 6.0, "tol": 1e-3}
    developed = reported("developed ends, to t = 6", run(time=time, **VISCOELASTIC))
    periodic = reported("periodic, L = 50 D_p, to t = 6", run(time=time, De=1.0))
    largest, average = off(developed, periodic)
    print(f"difference of both, % of the largest |dU|: largest {largest:.3f}, average {average:.3f}")


def branch_of(d: float, mesh_error: bool, **changes: object) -> Branch:
    """Branch of the pair at distance d, on the mesh of a curve down to d = 0.02 or to d if that is smaller."""
    case = parse_case(COMMANDS["curve"], {"beta": 0.4, "De": 0, "Ca_e": 0.1, **changes, "d": (d,)}, "benchmark")
    start = Parameters((d,), case.solid_models, case.liquid_model)
    return Branch(steady_problem(case, min(d, 0.02)), start, mesh_error)


def curve_cost() -> None:
    short: dict[str, Any] = {"ends": "developed", "length": "auto"}
    for title, changes in (
        ("Newtonian", {}),
        ("Newtonian, developed ends", short),
        ("De 1, developed ends", {**short, "De": 1.0}),
    ):
        for cold in ("forms compiled before" if changes.get("De") else "cold", "warm"):
            begin = time.perf_counter()
            first = branch_of(0.1, False, **changes)
            first.at(first.fine.parameters)
            print(
                f"{title}: first point at d = .1, {cold}: {time.perf_counter() - begin:.2f} s, "
                f"{first.fine.constraints.size} unknowns",
                flush=True,
            )
            first.close()
        for mesh_error in (False, True):
            begin = time.perf_counter()
            branch = branch_of(0.8, mesh_error, **changes)
            ready = time.perf_counter()
            for d in np.geomspace(0.8, 0.02, 20):
                branch.at(branch.fine.parameters.with_gap(float(d)))
            seconds = (time.perf_counter() - ready) / 20
            units = []
            for _ in range(7):
                again = time.perf_counter()
                branch.fine.newton.factor_at(branch.fine.y)
                units.append(time.perf_counter() - again)
            unit = float(np.median(units))
            factorisations, meshes = (
                sum(getattr(s, n) for s in branch.scenes) / 20 for n in ("factorisations", "meshes")
            )
            print(
                f"{title}, 20 points, {'with' if mesh_error else 'without'} the coarser mesh: "
                f"first {ready - begin:.1f} s, then {seconds:.3f} s a point; "
                f"one factorisation with its assembly {unit:.3f} s ({branch.fine.constraints.size} unknowns): "
                f"{seconds / unit:.1f} of them; {factorisations:.1f} factorisations and {meshes:.2f} meshes a point",
                flush=True,
            )
            branch.close()
    reported(
        "one point by a Newtonian transient to t = 2, developed ends", run(**short, time={"end": 2.0, "tol": 1e-3})
    )
    reported(
        "one point by a De 1 transient to t = 6, developed ends", run(**VISCOELASTIC, time={"end": 6.0, "tol": 1e-3})
    )


# beta, De, Ca_e, d_0, t: ten pairs whose distance hardly changes while they relax, and nine whose distance does.
MOVING = [
    *((0.4, 0.0, 0.05, 0.2, 2.0), (0.4, 0.0, 0.02, 0.03, 2.0), (0.2, 0.0, 0.1, 0.2, 2.0), (0.3, 0.0, 0.1, 0.1, 2.0)),
    *((0.4, 0.25, 0.02, 0.3, 4.0), (0.2, 0.5, 0.05, 0.3, 5.0), (0.4, 1.0, 0.0, 0.2, 8.0), (0.4, 1.0, 0.0, 0.6, 8.0)),
    *((0.3, 1.0, 0.02, 0.2, 8.0), (0.3, 1.0, 0.02, 0.6, 8.0)),
    *((0.4, 0.0, 0.1, 0.1, 2.0), (0.4, 0.0, 0.1, 0.3, 2.0), (0.2, 0.0, 0.1, 0.05, 2.0), (0.6, 0.0, 0.05, 0.1, 2.0)),
    *((0.4, 0.5, 0.1, 0.1, 5.0), (0.4, 0.5, 0.1, 0.3, 5.0), (0.3, 0.5, 0.05, 0.1, 5.0), (0.4, 1.0, 0.1, 0.1, 8.0)),
    (0.4, 2.0, 0.0, 0.1, 16.0),
]
MOVING_RUNS = Path("runs") / "moving"  # kept: they take most of the time


def moving() -> None:
    print(
        "| beta | De | Ca_e | d_0 | t | d | t_relax | dU of the run | its dU_error | dU | dU_error | dU_held "
        "| run less dU_held, % of the peak | run less dU, % of the peak | run less dU, in dU_error |"
    )
    for beta, De, Ca_e, d_0, t in MOVING:
        same: dict[str, Any] = {
            "beta": beta,
            "De": De,
            "Ca_e": Ca_e,
            "ends": "developed",
            "length": "auto",
            "mesh": {"Np": 28},
        }
        folder = MOVING_RUNS / f"beta{beta:g}-De{De:g}-Ca{Ca_e:g}-d{d_0:g}"
        if not folder.is_dir():
            run(**same, d0=d_0, time={"end": t, "tol": 5e-5}, dU_error=True, folder=folder)
        d, dU, error = pairsim.open(folder).check().table[["d", "dU", "dU_error"]].iloc[-1]
        points = pairsim.curve(same, d=sorted({d, 0.02, 0.05, 0.1, 0.2, 0.3, 0.5}), tol=1).check().table
        point = points.loc[(points["d"] - d).abs().idxmin()]
        peak = points.loc[points["d"] >= min(d, 0.05), "dU"].abs().max()
        held, rest = dU - point["dU_held"], dU - point["dU"]
        print(
            f"| {beta:g} | {De:g} | {Ca_e:g} | {d_0:g} | {t:g} | {d:.4f} | {point['t_relax']:.2g} | {dU:.4e} | "
            f"{error:.1e} | {point['dU']:.4e} | {point['dU_error']:.1e} | {point['dU_held']:.4e} | "
            f"{held / peak * 100:.2f} | {rest / peak * 100:.2f} | {rest / point['dU_error']:.1f} |",
            flush=True,
        )


@contextmanager
def compiled_with(name: str, value: Any) -> Iterator[None]:
    """Context in which forms are compiled with another constant of `compiled_phase`, which no case sets."""
    own = getattr(compiled_phase, name)
    setattr(compiled_phase, name, value)
    compiled_phase._COMPILED.clear()
    try:
        yield
    finally:
        setattr(compiled_phase, name, own)
        compiled_phase._COMPILED.clear()


def savings() -> None:
    def mumps(**options: int) -> Callable[[Problem], Problem]:
        return lambda problem: replace(problem, newton=replace(problem.newton, mumps=MumpsOptions(**options)))

    def slow(rate: float) -> Callable[[Problem], Problem]:
        return lambda problem: replace(
            problem, newton=replace(problem.newton, matrix=replace(problem.newton.matrix, slow=rate))
        )

    def flags(*options: str) -> AbstractContextManager[None]:
        return compiled_with("JIT_OPTIONS", {**JIT_OPTIONS, "cffi_extra_compile_args": [*options]})

    solved: dict[str, Callable[[Problem], Problem]] = {
        "default": as_it_is,
        "a new matrix in every iteration": every_matrix,
        "matrix reused at rates up to 0.15": slow(0.15),
        "first guess is the last solution": lambda problem: replace(problem, extrapolated=1),
        "ordering by minimum degree (AMD)": mumps(ordering=0),
        "ordering by SCOTCH": mumps(ordering=3),
        "a maximum transversal first": mumps(transversal=5),
    }
    compiled: dict[str, Callable[[], AbstractContextManager[None]]] = {
        "forms compiled with -O2": lambda: flags("-O2"),
        "quadrature of degree 7": lambda: compiled_with("QUADRATURE_DEGREE", 7),
        "quadrature of degree 4": lambda: compiled_with("QUADRATURE_DEGREE", 4),
    }
    print("| | error of dU, % | steps | Newton iterations | factorisations | s | solver, s | relative to default |")
    for title, changes in (("Newtonian", {}), ("De 1", {"De": 1.0, "mesh": {"Np": 20}})):
        keys = {**changes, "ends": "developed", "length": "auto", "time": {"end": 0.3}}
        exact = base = 0.0
        for name in (*solved, *compiled):
            times = []
            for _ in range(3):
                with compiled.get(name, nullcontext)():
                    steps, made, seconds = march([0.3], solved.get(name, as_it_is), **keys)
                    inside = sum(made.clock.seconds[k] for k in ("symbolic", "assembly", "factorisation", "solve"))
                    times.append((inside, seconds))
                    made.close()
            inside, seconds = sorted(times)[1]
            found, exact, base = dU(steps[-1]), exact or dU(steps[-1]), base or inside
            counts = [sum(getattr(s.report, k) for s in steps) for k in ("iterations", "factorisations")]
            print(
                f"| {title}, {name} | {100 * (found / exact - 1):.4f} | {len(steps)} | {counts[0]} | {counts[1]} | "
                f"{seconds:.1f} | {inside:.1f} | {inside / base:.2f} |",
                flush=True,
            )


if __name__ == "__main__":
    with_one_thread()
    parts = {
        **{"fig6": fig6, "fig3": fig3, "ends": ends},
        **{"curve": curve_cost, "moving": moving, "savings": savings},
    }
    form = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(prog="benchmark", description=__doc__, formatter_class=form)
    parser.add_argument("parts", nargs="*", metavar="PART", choices=parts)
    for name in parser.parse_args().parts or ["fig6"]:
        parts[name]()
