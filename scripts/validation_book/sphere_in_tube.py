"""A sphere dragged along the axis of a tube through liquid at rest: the benchmark of viscoelastic flows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf, pi
from typing import Any

import matplotlib

matplotlib.use("Agg")
from matplotlib import pyplot

import pairsim
from pairsim.commands import COMMANDS
from pairsim.config.yaml_file import read_yaml
from pairsim.drivers.problems import steady_problem
from pairsim.inputs.case_files import parse_case
from pairsim.results.units import with_error
from pairsim.runtime.errors import MeshFailure, NoSteadyState
from pairsim.solvers.curves.branch import Branch
from pairsim.solvers.parameters import Parameters
from validation_book.comparisons import (
    CONFIGS,
    Found,
    Keys,
    Setting,
    against,
    reference,
    rows_of,
    text_table,
)

CASE = CONFIGS / "sphere-in-tube.yaml"
BETA = 0.5
RADIUS = BETA / 2  # [D_c]: De_b = lambda U/a is De over this
UNIT = 3 * pi * BETA  # 6 pi eta_0 a U
PLACES = (0.3, 0.6, 0.9, 1.2, 1.5, 1.8, 2.1, 2.4, 2.7, 3.0, 3.3, 3.6)  # De_b
# Meshes of `accuracy`, with the last De_b that is asked for; on an earlier one for 0.1% steps shrank near 2.35.
LAST = {"5%": PLACES[-1], "1%": PLACES[-1], "0.1%": 2.1}
QUICK: Keys = {"mesh": {"Np": 14, "max_size": 0.12}}
type Points = dict[float, dict[str, float]]


@dataclass(frozen=True)
class Line:
    """Solutions on one mesh.

    Attributes:
        points: By De_b, K and half-width, and indicators of the stress.
        end: The last De_b of the continuation.
        lost: Whether it ended there before the last De_b that was asked for.
        unknowns: Number of unknowns.
    """

    points: Points
    end: float
    lost: bool
    unknowns: int


def along(mesh: Keys, places: Sequence[float]) -> Line:
    """Solve at ascending De_b, each continued from the last."""
    case = parse_case(COMMANDS["curve"], {**read_yaml(CASE), **mesh, "De": places[0] * RADIUS}, CASE.name)
    points: Points = {}
    start = Parameters((), case.solid_models, case.liquid_model)
    branch = Branch(steady_problem(case, inf), start)
    try:
        for place in places:
            point = branch.at(Parameters((), case.solid_models, case.liquid_model.with_De(place * RADIUS)))
            stress = point.observation.conformation
            assert stress is not None
            points[place] = {
                "K": float(point.observation.F[0]) / UNIT,
                "error": float(point.estimate.F_error[0]) / UNIT,
                "c_max": stress.c_max,
                "z": stress.c_max_z,
                "r": stress.c_max_r,
                "s_jump": stress.s_jump,
            }
    except (NoSteadyState, MeshFailure):
        pass
    end, unknowns = branch.scene.parameters.De / RADIUS, branch.scene.constraints.size
    branch.close()
    return Line(points, end, len(points) < len(places), unknowns)


def compute(setting: Setting) -> Found:
    """K over De_b on every mesh, and where the continuation ends."""
    (newtonian,) = rows_of(pairsim.curve(CASE, De=0, liquid=None, xi=0.09))
    K = newtonian["F_1"] / UNIT
    error = newtonian["F_error_1"] / UNIT
    known = reference("sphere in tube, Newtonian", "K")
    rows = [against(known, "Newtonian", "K", K, 2e-5, error=error, headline=True)]
    if setting.quick:
        found = {"coarse": along(QUICK, PLACES[:1])}
    else:
        found = {
            name: along({"accuracy": name}, [place for place in PLACES if place <= last]) for name, last in LAST.items()
        }
    picture(setting, found)
    return Found(rows, tables(found), {"ends": ends(found)})


def tables(found: dict[str, Line]) -> dict[str, Any]:
    """K on all meshes, how well values agree, and the stress on the finest mesh that has a solution."""
    head = ["De_b", *(f"{name}, {line.unknowns:,} unknowns" for name, line in found.items())]
    lines, stress = [], []
    for place in PLACES:
        there = {name: line.points[place] for name, line in found.items() if place in line.points}
        if not there:
            break
        cells = [with_error(there[name]["K"], there[name]["error"]) if name in there else "" for name in found]
        lines.append([f"{place:g}", *(cell.replace("+-", "±") for cell in cells)])
        name, last = list(there.items())[-1]
        wake = f"{last['c_max']:.3g} at {last['z']:.3f}, {last['r']:.3f}"
        stress.append([f"{place:g}", name, f"{last['s_jump']:.2g}", wake])
    parts = {"meshes": text_table(head, lines), "agreement": agreement(found)}
    return parts | {"stress": text_table(["De_b", "mesh", "`s_jump`", "largest tr **c**, at z, r"], stress)}


def agreement(found: dict[str, Line]) -> dict[str, Any]:
    """How far K of the finest mesh is from that of the next coarser one, in percent."""
    rows = []
    before, finest = [Line({}, 0.0, True, 0), *found.values()][-2:]
    for place, point in finest.points.items():
        if place in before.points:
            parts = point["error"], point["K"] - before.points[place]["K"]
            rows.append([f"{place:g}", *(f"{100 * part / point['K']:.2g}" for part in parts)])
    return text_table(["De_b", "half-width, % of K", "minus the next coarser mesh, %"], rows)


def ends(found: dict[str, Line]) -> str:
    """Where the continuation ended on each mesh."""
    parts = [
        f"De_b {line.end:.2f} on the mesh of {name}{'' if line.lost else ', and was not asked to go on'}"
        for name, line in found.items()
    ]
    return f"The continuation reached {', '.join(parts)}."


def picture(setting: Setting, found: dict[str, Line]) -> None:
    """K against De_b."""
    figure, axis = pyplot.subplots(figsize=(5, 3.6))
    for (name, line), marker in zip(found.items(), "sdo", strict=False):
        K, errors = ([point[key] for point in line.points.values()] for key in ("K", "error"))
        axis.errorbar(list(line.points), K, errors, marker=marker, ms=4, capsize=2, label=f"mesh of {name}")
    axis.set(xlabel=r"$\mathrm{De}_b = \lambda U/a$", ylabel=r"$K = F/(6\pi\eta_0 a U)$")
    axis.legend()
    figure.tight_layout()
    figure.savefig(setting.pictures / "sphere-in-tube.png", dpi=150)
    pyplot.close(figure)
