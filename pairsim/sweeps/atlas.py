"""`pairsim atlas`: master curves at places where they are needed most, each round a sweep, and their interpolant."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import ceil
from pathlib import Path
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.stats import qmc

from pairsim.atlas import fit
from pairsim.atlas.atlas import BEND, PARAMETERS, Atlas, scaled
from pairsim.cases.identity import RUNS
from pairsim.cases.yaml_file import read_yaml
from pairsim.computing.case_files import parse_file
from pairsim.computing.many_cases import AtlasFile, check_atlas
from pairsim.results.curve_table import curve_of
from pairsim.results.folder import plain, read_record
from pairsim.results.table_files import read_table
from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import InputError
from pairsim.runtime.version import __version__
from pairsim.sweeps.grid import grid_from, read_base
from pairsim.sweeps.sweep import Options, Workers, run_sweep

TABLE = "atlas.npz"
FIRST = 24  # curves of the first round, spread evenly
EVERY = 6  # curves of a later one, after which the interpolant is made anew
DISTANCES = 41  # at which curves are interpolated, equally far apart in log d: a ratio of 1.12 from .02 to 2
AT_EDGES = 0.35  # part of the values that are put on the nearer end of their range: interpolants err most there
CANDIDATES = 1024
LEAST_ENDS = 0.02  # of the largest De and Ca_e: both smaller than this tell nothing, since dU vanishes there


def build(path: Path, folder: Path | None, options: Options, workers: Workers) -> tuple[int, str, Path]:
    """Compute the curves of an atlas that are not there yet, and make it of them after each round.

    Args:
        path: The file.
        folder: Folder of the atlas; made, or continued.
        options: Those of its sweeps.
        workers: What computes the curves.

    Returns:
        Exit code and message of the last sweep, and the folder, in which `TABLE` is the atlas.

    Raises:
        InputError: The file is invalid, or the folder belongs to another one.
    """
    data = read_yaml(path)
    file = parse_file("atlas", AtlasFile, check_atlas, data, str(path))
    directory = folder or RUNS / (file.name or path.stem)
    base = {**read_base(path, data), "d": {"start": file.d[0], "stop": file.d[1], "num": 2}}
    options = replace(options, flags={"sensitivities": True})
    box = {**{name: tuple(getattr(file, name)) for name in PARAMETERS}, "d": tuple(file.d)}
    candidates, places, errors = _candidates(box, file.seed), np.empty((0, 3)), np.empty(0)
    code, message = 0, ""
    for number in range(1 + ceil(max(file.curves - FIRST, 0) / EVERY)):
        wanted = EVERY if number else min(FIRST, file.curves)
        chosen = candidates[fit.farthest(scaled(box, places)[0], errors, scaled(box, candidates)[0], wanted)]
        cases = [dict(zip(PARAMETERS, map(float, place), strict=True)) for place in chosen]
        round_ = directory / f"round-{number:02d}"
        grid = grid_from(path, {"name": round_.name, "command": "curve", "base": base, "cases": cases})
        code, message = run_sweep(grid, round_, options, workers)
        if code not in (0, 3):
            return code, message, directory
        atlas, curves, errors = atlas_of(curve_folders(directory)[: len(places) + wanted], box)
        atlas.save(directory / TABLE)
        places = curves.places
    size = 100 * np.median(errors)
    return code, f"{message}; {len(places)} curves, each off by {size:.2g} % of its peak without itself", directory


def _candidates(box: Mapping[str, tuple[float, float]], seed: int) -> Array:
    """Places spread evenly over the box and its edges, shape (places, 3)."""
    draws = qmc.Sobol(6, rng=np.random.default_rng(seed)).random(CANDIDATES)
    x = np.where(draws[:, 3:] < AT_EDGES, np.round(draws[:, :3]), draws[:, :3])
    low, high = np.array([box[name] for name in PARAMETERS]).T
    found = low + (high - low) * x
    bent = np.log1p(low[1] / BEND), np.log1p(high[1] / BEND)
    found[:, 1] = BEND * np.expm1(bent[0] + (bent[1] - bent[0]) * x[:, 1])
    found = np.round(found, 6)
    return found[(found[:, 1:] > LEAST_ENDS * high[1:]).any(axis=1)]


def curve_folders(directory: Path) -> list[Path]:
    """The folders of all curves of an atlas that have finished, in the order of their rounds."""
    found = sorted(path.parent for path in directory.glob("round-*/*/run.json"))
    return [each for each in found if read_record(each).get("status") == "finished"]


def atlas_of(folders: Sequence[Path], box: Mapping[str, tuple[float, float]]) -> tuple[Atlas, fit.Curves, Array]:
    """Make an atlas of the curves of folders.

    Args:
        folders: The curves, with sensitivities.
        box: Its box.

    Returns:
        The atlas, the curves, and the root mean square of the error of each without itself, over its peak.

    Raises:
        InputError: A curve does not reach the ends of the distances.
    """
    d = np.geomspace(*box["d"], DISTANCES)
    curves = curves_in(folders, d)
    provenance = {"pairsim": __version__, "curves": len(folders), "case": _common(folders)}
    atlas, errors = fit.fit(curves, d, box, provenance)
    return atlas, curves, np.sqrt(np.mean(errors**2, axis=1))


def curves_in(folders: Sequence[Path], d: Array) -> fit.Curves:
    """The curves of folders at given distances; errors as of `atlas_of`."""
    places, rows = [], []
    for folder in folders:
        table, case = read_table(folder / "curve.csv"), read_yaml(folder / "case.yaml")
        curve = curve_of(table)
        if curve is None or curve.d[0] > d[0] * (1 + 1e-9) or curve.d[-1] < d[-1] * (1 - 1e-9):
            raise InputError(str(folder), "", None, "must be a curve over all distances of the atlas")
        inside, unknown = np.clip(d, *curve.ends), np.full_like(table["d"], np.nan)
        columns = [table.get(f"by_{name}", unknown) for name in PARAMETERS]
        columns += [(table["U_L"] + table["U_T"]) / 2, table["stretch"], table["t_relax"]]
        x, at = np.log(table["d"]), np.log(inside)
        smooth = [CubicSpline(x, each)(at) if np.isfinite(each).all() else np.full_like(d, np.nan) for each in columns]
        places.append([float(case[name]) for name in PARAMETERS])
        rows.append([curve.values(inside), curve.half_widths(inside), *smooth])
    by_column = np.array(rows).transpose(1, 0, 2)
    return fit.Curves(np.array(places), by_column[0], by_column[1], by_column[2:5], by_column[5:])


def _common(folders: Sequence[Path]) -> dict[str, Any]:
    """What the cases of all curves have in common."""
    cases = [plain(read_yaml(folder / "case.yaml")) for folder in folders]
    return {key: value for key, value in cases[0].items() if all(case.get(key) == value for case in cases)}
