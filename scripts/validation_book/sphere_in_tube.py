"""A sphere dragged along the axis of a tube through liquid at rest: the benchmark of viscoelastic flows."""

from __future__ import annotations

from math import inf, pi
from typing import Any

import matplotlib

matplotlib.use("Agg")
from matplotlib import pyplot

import pairsim
from pairsim.config.case_file import curve_from_dict
from pairsim.config.yaml_file import read_yaml
from pairsim.drivers.problems import steady_problem
from pairsim.runtime.errors import MeshFailure, NoSteadyState
from pairsim.runtime.fenicsx import MPI
from pairsim.solvers.branch import Branch
from pairsim.solvers.parameters import Parameters
from validation_book.comparisons import (
    CONFIGS,
    Comparison,
    Found,
    Setting,
    Subject,
    Table,
    against,
    number,
    reference,
    references,
)

CASE = CONFIGS / "sphere-in-tube.yaml"
BETA = 0.5
RADIUS = BETA / 2  # [D_c]: De_b = lambda U/a is De over this
UNIT = 3 * pi * BETA  # 6 pi eta_0 a U
PUBLISHED = "sphere in tube, Oldroyd-B"
# Meshes by name: those of `accuracy`, and one that is finer in the wake.
MESHES: dict[str, dict[str, Any]] = {
    "5%": {"accuracy": "5%"},
    "1%": {"accuracy": "1%"},
    "0.1%": {"accuracy": "0.1%"},
}
PLACES = (0.3, 0.6, 0.9, 1.2, 1.5, 1.8, 2.1, 2.4, 2.7, 3.0, 3.3, 3.6)
STEP = 0.3


def along(mesh: dict[str, Any], places: tuple[float, ...]) -> tuple[dict[float, dict[str, float]], float, int]:
    """Solve at ascending De_b, each continued from the last.

    Returns:
        By De_b, K with its correction and half-width and indicators of the stress; the last De_b that the continuation
        reached; and the number of unknowns.
    """
    case = curve_from_dict({**read_yaml(CASE), **mesh, "De": places[0] * RADIUS}, CASE.name)
    found: dict[float, dict[str, float]] = {}
    branch = Branch(MPI.COMM_WORLD, steady_problem(case, inf), Parameters((), case.Ca_es, case.De), mesh_error=False)
    unknowns = branch.fine.constraints.size
    try:
        for place in places:
            point = branch.at(Parameters((), case.Ca_es, place * RADIUS))
            stress = point.observation.conformation
            assert stress is not None
            found[place] = {
                "K": float(point.observation.F[0]) / UNIT,
                "correction": float(point.estimate.F[0]) / UNIT,
                "error": float(point.estimate.F_error[0]) / UNIT,
                "c_max": stress.c_max,
                "z": stress.c_max_z,
                "r": stress.c_max_r,
                "s_jump": stress.s_jump,
            }
    except (NoSteadyState, MeshFailure):
        pass
    end = branch.fine.parameters.De / RADIUS
    branch.close()
    return found, end, unknowns


def compute(setting: Setting) -> Found:
    """K at rest-state De_b on every mesh, and where the continuation ends."""
    newtonian = pairsim.curve(CASE, De=0, liquid=None, xi=0.09).check().table.iloc[0]
    K = (newtonian["F_1"] + newtonian["F_correction_1"]) / UNIT
    error = newtonian["F_error_1"] / UNIT
    known = reference("sphere in tube, Newtonian", "K")
    rows = [against(known, "Newtonian", "K", K, 2e-5, error=error, headline=True)]
    meshes = {"coarse": {"mesh": {"Np": 14, "max_size": 0.12}}} if setting.quick else MESHES
    places = PLACES[:1] if setting.quick else PLACES
    found = {name: along(mesh, places) for name, mesh in meshes.items()}
    finest = found[list(meshes)[-1]][0]
    published = {
        float(key.removeprefix("K De_b ")): value
        for key, value in references()["groups"][PUBLISHED]["values"].items()
    }
    rows += [
        against(
            reference(PUBLISHED, f"K De_b {place:g}"),
            f"Oldroyd-B, De_b {place:g}",
            "K",
            point["K"] + point["correction"],
            3e-3 if setting.quick else 1e-3 if place < 1.5 else 5e-3,
            error=point["error"],
            headline=place in (0.3, 0.6, 0.9, 1.2),
        )
        for place, point in finest.items()
        if place in published
    ]
    return Found(rows, tables(found, published), notes(found) | picture(setting, found, published))


def tables(found: dict[str, Any], published: dict[float, float]) -> dict[str, Table]:
    """K on all meshes, and the stress on the finest."""
    head = ["De_b", "De", *(f"{name} ({unknowns:,} unknowns)" for name, (_, _, unknowns) in found.items())]
    head += ["published", "s_jump", "largest tr c, at z, r"]
    lines = []
    for place in PLACES:
        points = [points.get(place) for points, _, _ in found.values()]
        if not any(points):
            break
        cells = ["" if p is None else f"{p['K'] + p['correction']:.5f} ± {p['error']:.1g}" for p in points]
        last = points[-1]
        stress = ["", ""] if last is None else [f"{last['s_jump']:.2g}", wake(last)]
        lines.append([f"{place:g}", number(place * RADIUS), *cells, f"{published.get(place, '')}", *stress])
    return {"meshes": Table(head, lines), "agreement": agreement(found, published)}


def agreement(found: dict[str, Any], published: dict[float, float]) -> Table:
    """How far K of the finest mesh is from that of the next finer and from the published value, in percent."""
    lines = []
    *_, second, (finest, _, _) = [({}, 0.0, 0), *found.values()]
    for place, point in finest.items():
        K = point["K"] + point["correction"]
        other, known = second[0].get(place), published.get(place)
        cells = [100 * point["error"] / K, None if other is None else 100 * (K - other["K"] - other["correction"]) / K]
        cells.append(None if known is None else 100 * (K - known) / K)
        signs = ("", "+", "+")
        lines.append([f"{place:g}", *("" if c is None else f"{c:{s}.2g}" for c, s in zip(cells, signs, strict=True))])
    return Table(["De_b", "half-width, % of K", "minus the next finer mesh, %", "minus published, %"], lines)


def wake(point: dict[str, float]) -> str:
    """The largest trace of c and where it is."""
    return f"{point['c_max']:.3g} at {point['z']:.3f}, {point['r']:.3f}"


def notes(found: dict[str, Any]) -> dict[str, str]:
    """Where the continuation ended on each mesh."""
    ends = ", ".join(f"{end:.2f} ({name})" for name, (_, end, _) in found.items())
    return {"ends": f"The last solutions of the continuation are at De_b {ends}."}


def picture(setting: Setting, found: dict[str, Any], published: dict[float, float]) -> dict[str, str]:
    """K against De_b."""
    figure, axis = pyplot.subplots(figsize=(5, 3.6))
    for (name, (points, _, _)), marker in zip(found.items(), "sdo", strict=False):
        K = [p["K"] + p["correction"] for p in points.values()]
        axis.errorbar(list(points), K, [p["error"] for p in points.values()], marker=marker, ms=4, capsize=2, label=name)
    axis.plot(list(published), list(published.values()), "kx", ms=7, label="Lunsmann et al.")
    axis.set(xlabel=r"$\mathrm{De}_b = \lambda U/a$", ylabel=r"$K = F/(6\pi\eta_0 a U)$")
    axis.legend()
    figure.tight_layout()
    figure.savefig(setting.pictures / "sphere-in-tube.png", dpi=150)
    pyplot.close(figure)
    return {}


SUBJECT = Subject("sphere-in-tube", "Sphere dragged through a tube", compute)
__all__ = ["SUBJECT", "Comparison"]
