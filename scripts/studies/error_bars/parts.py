"""Scenes in which dU_error is compared with the error: a part for each, with its coarse and its fine solutions.

Scenes of four kinds, each with a file in `cases`:

- `scenes`: quasi-steady solutions on three meshes, beside two fine ones of different kinds, which give the truth, and
  the curve that has the largest |dU|;
- `runs`: the same for runs in time, at ten times;
- `random`: curves of one point, drawn with seeds, with default settings and finely, which gives the truth; a single
  particle has no dU: its velocity is compared;
- `curves`: the same at all distances of curves in liquids that thin without a memory.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import pandas as pd
from book import draws, yaml_files
from book.cases import Case
from book.study import Part, Row, solved

from pairsim.sweeps.grid import SweepCase, grid_from

CASES = Path(__file__).with_name("cases")
KINDS = ("scenes", "random", "curves", "runs")
FINE = ("fine.1", "fine.2")
TIMES = 10
"""Times at which runs are judged."""
LIMIT = 1200.0  # wall time of a case [s]


def read(kind: str, quick: bool = False) -> tuple[dict[str, Any], dict[str, Any], dict[str, Any]]:
    """What all scenes of a kind have, the scenes by their names, and the meshes of each."""
    content = yaml_files.read((CASES / "quick" if quick else CASES) / f"{kind}.yaml")
    meshes = content.pop("meshes")
    scenes = content.pop("scenes", {})
    for draw in content.pop("draws", ()):
        scenes |= draws.scenes(**draw)
    return content, scenes, meshes


def cases(name: str, scene: Mapping[str, Any], meshes: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
    """A scene on all meshes."""
    liquid = "viscoelastic" if scene.get("De", 0) else "newtonian"
    for kind, keys in meshes.get(liquid, meshes.get("any", {})).items():
        case = {"name": f"{name}+{kind}", **scene, **keys}
        if "any" in meshes:
            yield case
        elif "d" in scene:
            places = sorted({*keys.get("d", ()), scene["d"]})
            yield case | {"d": places, "max_points": len(places)}
        else:
            yield case | {"output.times": [round(scene["time"]["end"] * k / TIMES, 10) for k in range(1, TIMES + 1)]}


def parts(quick: bool) -> list[Part]:
    """All scenes, or one of each kind but curves on coarse meshes."""
    found = []
    for kind in KINDS[:2] + KINDS[3:] if quick else KINDS:
        content, scenes, meshes = read(kind, quick)
        for name, scene in scenes.items():
            found.append(_part(kind, name, scene, {**content, "cases": [*cases(name, scene, meshes)]}))
    return found


def _part(kind: str, name: str, scene: Mapping[str, Any], grid: Mapping[str, Any]) -> Part:
    identity = json.dumps(grid, sort_keys=True)
    return Part(f"{kind}-{name}", identity, partial(_rows, kind, name, grid, scene))


def _rows(kind: str, name: str, content: Mapping[str, Any], scene: Mapping[str, Any], folder: Path) -> list[Row]:
    """An error a row; one row that says why, where there is none."""
    grid = grid_from(CASES / f"{kind}.yaml", dict(content))
    results = {
        _mesh(case): solved(grid.question.name, case.case, folder.with_name(f"{folder.name}+{_mesh(case)}"), LIMIT)
        for case in grid.cases
    }
    about: Row = {"kind": kind, "scene": name, "law": law_of(scene), "N": scene.get("particles", 2)}
    about = {**about, "De": scene.get("De", 0.0), "soft": scene["Ca_e"] != 0}
    ended = [f"{mesh}: {each.reason or each.status}" for mesh, each in results.items() if each.status != "finished"]
    if ended:
        return [{**about, "ended": ", ".join(ended)}]
    found = errors_of(results) if kind in ("scenes", "runs") else by_default(results["default"], results["fine"])
    return [{**about, **row, "ended": None} for row in found]


def _mesh(case: SweepCase) -> str:
    return case.folder.rpartition("-")[0].partition("+")[2]


def law_of(scene: Mapping[str, Any]) -> str:
    """The law of the liquid of a scene."""
    liquid = scene.get("liquid", {})
    usual = "giesekus" if scene.get("De", 0) else "newtonian"
    return str(liquid.get("law", usual) if isinstance(liquid, Mapping) else liquid)


def points(case: Case) -> pd.DataFrame:
    """dU and what is said of it: the last point of a curve with a row for every gap, or a run at `TIMES`."""
    if case.kind == "run":
        nearest = [int((case.table["t"] - t).abs().argmin()) for t in case.parameters["output.times"]]
        return case.table.iloc[nearest].rename(columns={"t": "at"}).reset_index(drop=True).assign(cancels=False)
    last, gaps = case.table.iloc[-1], case.parameters["particles"] - 1
    ends = [""] if gaps == 1 else [f"_{gap + 1}" for gap in range(gaps)]
    table = pd.DataFrame({"at": range(1, gaps + 1), "dU": [last[f"dU_held{end}"] for end in ends]})
    table["dU_correction"] = [last[f"dU_correction{end}"] for end in ends]
    table["dU_error"] = [last[f"dU_error{end}"] - last[f"ends_error{end}"] for end in ends]  # all have the same tube
    table["peak"] = [case.table[f"dU_held{end}"].abs().max() for end in ends]
    return table.assign(cancels=not last["corrected"])


def errors_of(results: Mapping[str, Any]) -> Iterator[Row]:
    """The errors on every mesh that is not fine, and what is said of them."""
    found = {mesh: points(Case(each)) for mesh, each in results.items()}
    first, second = (found[mesh]["dU"] for mesh in FINE)
    peak = found["peak"]["peak"] if "peak" in found else Case(results[FINE[0]]).peak
    for mesh in (mesh for mesh in found if mesh not in (*FINE, "peak")):
        table = found[mesh].reindex(columns=["at", "dU", "dU_correction", "dU_error", "cancels"])
        table = table.rename(columns={"dU": "value", "dU_correction": "correction", "dU_error": "half_width"})
        known, error = (first - second).abs(), (first + second) / 2 - table["value"]
        rows: Any = table.assign(mesh=mesh, peak=peak, error=error, known=known).to_dict("records")
        yield from rows


def by_default(default: Any, fine: Any) -> Iterator[Row]:
    """What default settings say at each distance and gap, and how far it is from the truth."""
    peak = default.record.get("adaptation", {}).get("reference_dU")
    about: Row = {"ends": Case(default).parameters["ends"], "mesh": "default", "peak": peak}
    for said, true in zip(*(each.table.to_dict("records") for each in (default, fine)), strict=True):
        values = [(key, key.replace("dU", "dU_error")) for key in said if re.fullmatch(r"dU(_\d+)?", key)]
        for key, error in values or [("U_1", "U_error_1")]:
            one: Row = {"d": said.get("d"), "at": key, "value": said[key], "half_width": abs(said[error])}
            yield {**about, **one, "error": true[key] - said[key], "known": abs(true[error])}
