"""Spheres that are dragged, pairs that are held, and curves from rest: the parts of the study.

`pairsim sweep` takes the files of the pairs and of the curves, too.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from book import yaml_files
from book.case_parts import LIMIT, case_of, case_part, grid
from book.study import Part, Row, computed

HERE = Path(__file__).parent
PAIRS, CURVES = (yaml_files.read(HERE / f"{name}.yaml") for name in ("pairs", "curves"))
TIMES = (1.0, 2.0, 4.0)
"""At which the velocities of held pairs are compared [D_c/U_av]."""
SPHERE = {"particles": 1, "Ca_e": 0, "velocity": 1, "flow": 0, "ends": "developed", "length": "auto"}
MESHES: Mapping[str, dict[str, Any]] = {
    "5%": {"accuracy": "5%"},
    "N_p 40": {"mesh": {"Np": 40}},
    "N_p 80": {"mesh": {"Np": 80}},
}
SPHERES = (
    (0.5, 1.0, 1e3, ("5%", "N_p 40", "N_p 80")),
    *((0.5, 10.0, m, ("N_p 40",)) for m in (10.0, 100.0, 1e4)),
    (0.5, 10.0, 1e3, ("5%", "N_p 40", "N_p 80")),
    (0.25, 100.0, 1e3, ("5%", "N_p 40", "N_p 80")),
    (0.1, 100.0, 1e3, ("N_p 80",)),
    (0.25, 1000.0, 1e3, ("5%", "N_p 40", "N_p 80")),
    (0.25, 2500.0, 1e3, ("N_p 80",)),
)
"""Diameter, yield stress over eta_p V/D_p, regularisation, and meshes of the spheres."""
COARSE = {"mesh.Np": 10, "mesh.max_size": 0.2}


def parts(quick: bool) -> list[Part]:
    """All of these; in the quick form one sphere and one pair, on coarse cells."""
    wanted = [(beta, Bn, m, mesh) for beta, Bn, m, meshes in SPHERES for mesh in meshes]
    pairs = grid(**PAIRS["grid"])
    if quick:
        return [_sphere(*wanted[0]), _pair({"liquid.yielding.Bn": 0.1, "Ca_e": 0, "d0": 0.4}, (0.05, 0.1), COARSE)]
    spheres, curves = [_sphere(*each) for each in wanted], [_curve(each) for each in CURVES["cases"]]
    return [*spheres, *(_pair(each, TIMES, {}) for each in pairs), *curves]


def _sphere(beta: float, Bn: float, m: float, mesh: str) -> Part:
    """A sphere that is dragged; its yield stress is given over eta_p V/D_p, which is beta times Bn."""
    liquid = {"law": "bingham", "Bn": Bn / beta, "m": m}
    about: Row = {"kind": "sphere", "beta": beta, "Bn": Bn, "m": m, "mesh": mesh}
    name = f"sphere, beta {beta:g}, Bn {Bn:g}, m {m:g}, {mesh}"
    return case_part(
        name, "curve", case_of(SPHERE, beta=beta, liquid=liquid, **MESHES[mesh]), ("F_1", "F_error_1"), about
    )


def _pair(point: Mapping[str, Any], times: Sequence[float], more: Mapping[str, Any]) -> Part:
    """A pair that is held, from rest."""
    case = case_of(PAIRS["base"], **point, **more, **{"time.end": times[-1], "output.times": list(times)})
    about = {"kind": "pair", "Bn": float(point["liquid.yielding.Bn"]), "Ca_e": float(point["Ca_e"]), "d": point["d0"]}
    name = f"pair, Bn {about['Bn']:g}, Ca_e {about['Ca_e']:g}, d {about['d']:g}"
    return Part(name, json.dumps({"command": "run", **case}, sort_keys=True), partial(_held, case, about, times))


def _held(case: Mapping[str, Any], about: Row, times: Sequence[float], folder: Path) -> list[Row]:
    result = computed("run", case, folder, LIMIT)
    if result.status != "finished":
        return [{**about, "ended": result.reason or result.status}]
    table = result.table
    rows = table[table["t"].round(9).isin(times)]
    points = zip(rows["t"], rows["dU"], rows["dU_error"], strict=True)
    return [{**about, "t": float(t), "dU": float(dU), "dU_error": float(e), "ended": None} for t, dU, e in points]


def _curve(changes: Mapping[str, Any]) -> Part:
    """A curve of rigid pairs from rest, and its zero with its half-width, where dU is 0."""
    case = case_of(CURVES["base"], **changes)
    about = {"kind": "curve", "beta": case["beta"], "alpha": case["liquid"]["alpha"]}
    name = f"curve, beta {case['beta']:g}, alpha {case['liquid']['alpha']:g}"
    return Part(name, json.dumps({"command": "curve", **case}, sort_keys=True), partial(_from_rest, case, about))


def _from_rest(case: Mapping[str, Any], about: Row, folder: Path) -> list[Row]:
    result = computed("curve", case, folder, LIMIT)
    if result.status != "finished":
        return [{**about, "ended": result.reason or result.status}]
    table, zeros = result.table, result.zeros
    points = [*zip(table["d"], table["dU"], table["dU_error"], strict=True)]
    points += [(d, 0.0, error) for d, error in zip(zeros["d"], zeros["d_error"], strict=True)]
    return [{**about, "d": float(d), "dU": float(dU), "dU_error": float(e), "ended": None} for d, dU, e in points]
