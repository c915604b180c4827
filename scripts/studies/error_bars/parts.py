"""Scenes in which half-widths are compared with errors: a part for each, on all of its meshes.

There are two kinds, each with a file in `cases`:

- `scenes`: quasi-steady solutions on three given meshes, beside two finer ones of different kinds, which give the truth
  without any half-width, and the curve that has the largest |dU|;
- `runs`: all quantities of runs from rest at ten times, beside a finer run.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import pandas as pd
from book import yaml_files
from book.study import Part, Row, solved

from pairsim.solvers.goals import IN_TIME
from pairsim.sweeps.grid import SweepCase, grid_from

CASES = Path(__file__).with_name("cases")
KINDS = ("scenes", "runs")
TRUTHS = ("truth.1", "truth.2")
TIMES = 10  # at which runs are judged
LIMIT = 1800.0  # wall time of a case [s]


def read(kind: str, quick: bool = False) -> tuple[dict[str, Any], dict[str, Any], dict[str, Any]]:
    """What all scenes of a kind have, the scenes by their names, and the meshes of each class of liquids."""
    content = yaml_files.read((CASES / "quick" if quick else CASES) / f"{kind}.yaml")
    return content, content.pop("scenes"), content.pop("meshes")


def class_of(scene: Mapping[str, Any]) -> str:
    """The class of liquids by which a scene has its meshes."""
    return "viscoelastic" if scene["De"] else "thinning" if "liquid" in scene else "newtonian"


def cases(name: str, scene: Mapping[str, Any], meshes: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
    """A scene on all meshes."""
    for mesh, keys in meshes[class_of(scene)].items():
        case = {"name": f"{name}+{mesh}", **scene, **keys}
        if "d" in scene:
            places = sorted({*keys.get("d", ()), scene["d"]})
            yield case | {"d": places, "max_points": len(places)}
        else:
            yield case | {"output.times": times(scene)}


def times(scene: Mapping[str, Any]) -> list[float]:
    """The times at which a run is judged, evenly up to its end."""
    return [round(scene["time"]["end"] * k / TIMES, 10) for k in range(1, TIMES + 1)]


def parts(quick: bool) -> list[Part]:
    """All scenes, or one of each kind on coarse meshes."""
    found = []
    for kind in KINDS:
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
    about: Row = {"kind": kind, "scene": name, "law": law_of(scene), "De": scene["De"]}
    ended = [f"{mesh}: {each.reason or each.status}" for mesh, each in results.items() if each.status != "finished"]
    if ended:
        return [{**about, "ended": ", ".join(ended)}]
    found = by_meshes(results, scene.get("particles", 2) - 1) if kind == "scenes" else in_time(results, times(scene))
    return [{**about, **row, "ended": None} for row in found]


def _mesh(case: SweepCase) -> str:
    return case.folder.rpartition("-")[0].partition("+")[2]


def law_of(scene: Mapping[str, Any]) -> str:
    """The law of the liquid of a scene."""
    usual = "giesekus" if scene["De"] else "newtonian"
    liquid = scene.get("liquid", usual)
    return str(liquid["law"] if isinstance(liquid, Mapping) else liquid)


def by_meshes(results: Mapping[str, Any], gaps: int) -> Iterator[Row]:
    """The errors of dU of the gaps on every mesh whose half-width is judged, and how well each is known."""
    found = {mesh: _gaps(result, gaps) for mesh, result in results.items()}
    first, second = (found[mesh]["value"] for mesh in TRUTHS)
    for mesh in (mesh for mesh in found if mesh not in (*TRUTHS, "peak")):
        error, known = (first + second) / 2 - found[mesh]["value"], (first - second).abs()
        table = found[mesh].assign(mesh=mesh, peak=found["peak"]["peak"], error=error, known=known)
        rows: Any = table.to_dict("records")
        yield from rows


def _gaps(result: Any, gaps: int) -> pd.DataFrame:
    """dU of the gaps at the last point of a curve, and its half-width without the ends: all have the same tube."""
    last = result.table.iloc[-1]
    ends = {"dU": ""} if gaps == 1 else {f"dU_{gap}": f"_{gap}" for gap in range(1, gaps + 1)}
    rows = [
        {
            "quantity": "dU",
            "name": name,
            "value": last[f"dU_held{end}"],
            "half_width": last[f"dU_error{end}"] - last[f"ends_error{end}"],
            "peak": result.table[f"dU_held{end}"].abs().max(),
        }
        for name, end in ends.items()
    ]
    return pd.DataFrame(rows)


def in_time(results: Mapping[str, Any], at_times: Sequence[float]) -> Iterator[Row]:
    """The errors of all quantities of runs at some times, and the half-widths of the truth."""
    at = {mesh: _nearest(result.table, at_times) for mesh, result in results.items()}
    true = at.pop("truth")
    for mesh, table in at.items():
        for quantity, name, half_width in _quantities(table):
            own = pd.DataFrame({"t": table["t"], "value": table[name], "half_width": table[half_width]})
            own = own.assign(error=true[name] - table[name], known=true[half_width])
            rows: Any = own.assign(mesh=mesh, quantity=quantity, name=name).to_dict("records")
            yield from rows


def _nearest(series: pd.DataFrame, at_times: Sequence[float]) -> pd.DataFrame:
    """The rows that are nearest to some times."""
    return series.iloc[[int((series["t"] - t).abs().argmin()) for t in at_times]].reset_index(drop=True)


def _quantities(table: pd.DataFrame) -> Iterator[tuple[str, str, str]]:
    """Quantities with their columns and those of their half-widths; rigid particles have no shape."""
    for goal in IN_TIME:
        for column in map(str, table):
            found = re.fullmatch(rf"{goal.error_column}((_[LT]|_\d+)?)", column)
            if found and table[column].max() > 0:
                yield goal.name, f"{goal.name}{found[1]}", column
