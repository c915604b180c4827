"""`pairsim atlas`: master curves at places where they are needed most, each round a sweep, and their interpolant."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.stats import qmc

from pairsim.atlas import fit
from pairsim.atlas.atlas import Atlas
from pairsim.atlas.basis import BEND, PARAMETERS, nodes
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
from pairsim.sweeps.folder import read_sweep
from pairsim.sweeps.grid import grid_from, read_base
from pairsim.sweeps.sweep import Options, Workers, run_sweep

TABLE = "atlas.npz"
FIRST = 24  # curves of the first round, spread evenly
EVERY = 6  # curves of a later one, after which the interpolant is made anew
AT_EDGES = 0.35  # part of the values that are put on the nearer end of their range: interpolants err most there
CANDIDATES = 1024
LEAST_ENDS = 0.02  # of the range of De, Ca_e: both smaller than this tell nothing, since dU vanishes there


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
    options = replace(options, chain=1, flags={"sensitivities": True})
    code, message, number = 0, "", 0
    atlas: Atlas | None = None
    state: tuple[fit.Regression, fit.Samples] | None = None
    while True:
        round_ = directory / f"round-{number:02d}"
        done = len(curve_folders(directory)) if round_.exists() else 0
        places = _read_places(round_)
        if places is None:
            known = len(state[1].places) if state else 0
            count = min(FIRST if state is None else EVERY, file.curves - (done or known))
            if count <= 0:
                break
            places = _next_places(file, count, number, state)
        cases = [dict(zip(PARAMETERS, map(float, place), strict=True)) for place in places]
        grid = grid_from(path, {"name": round_.name, "command": "curve", "base": base, "cases": cases})
        code, message = run_sweep(grid, round_, options, workers)
        if code not in (0, 3):
            return code, message, directory
        box = {**{name: tuple(getattr(file, name)) for name in PARAMETERS}, "d": tuple(file.d)}
        atlas, state = atlas_of(curve_folders(directory), box)
        atlas.save(directory / TABLE)
        number += 1
    return code, f"{message}; {len(curve_folders(directory))} curves", directory


def _read_places(folder: Path) -> Array | None:
    """The places of a round that has begun."""
    if not (folder / "sweep.json").is_file():
        return None
    cases = read_sweep(folder, values=False)["cases"]
    found = [[case["parameters"].get(name) for name in PARAMETERS] for case in cases]
    return np.array(found, dtype=float)


def _next_places(file: AtlasFile, count: int, number: int, state: tuple[fit.Regression, fit.Samples] | None) -> Array:
    """Places for the next curves: spread evenly at first, then where the interpolant is least certain."""
    candidates = spread_places(file, FIRST if state is None else CANDIDATES, file.seed + number)
    if state is None:
        return candidates[:count]
    regression, samples = state
    return candidates[fit.predictions(regression, samples, candidates, count)]


def spread_places(file: AtlasFile, count: int, seed: int) -> Array:
    """Places spread evenly over the box and its edges, shape (count, 3)."""
    draws = qmc.Sobol(6, rng=np.random.default_rng(seed)).random_base2(int(np.ceil(np.log2(2 * count))))
    x, edge = draws[:, :3], draws[:, 3:] < AT_EDGES
    x = np.where(edge, np.round(x), x)
    x = x[(x[:, 1:] > LEAST_ENDS).any(axis=1)][:count]
    (b0, b1), (D0, D1), (C0, C1) = file.beta, file.De, file.Ca_e
    low, high = np.log1p(D0 / BEND), np.log1p(D1 / BEND)
    De = BEND * np.expm1(low + (high - low) * x[:, 1])
    return np.round(np.stack([b0 + (b1 - b0) * x[:, 0], De, C0 + (C1 - C0) * x[:, 2]], axis=1), 6)


def curve_folders(directory: Path) -> list[Path]:
    """The folders of all curves of an atlas that have finished, in the order of their rounds."""
    found = sorted(path.parent for path in directory.glob("round-*/*/run.json"))
    return [each for each in found if read_record(each).get("status") == "finished"]


def atlas_of(
    folders: Sequence[Path], box: Mapping[str, tuple[float, float]]
) -> tuple[Atlas, tuple[fit.Regression, fit.Samples]]:
    """Make an atlas of the curves of folders.

    Args:
        folders: The curves, with sensitivities.
        box: Its box.

    Raises:
        InputError: A curve does not reach the ends of the distances.
    """
    d = nodes(box["d"], fit.COLUMNS)
    places, rows = [], []
    for folder in folders:
        table, case = read_table(folder / "curve.csv"), read_yaml(folder / "case.yaml")
        if (curve := curve_of(table)) is None or curve.d[0] > d[0] or curve.d[-1] < d[-1]:
            raise InputError(str(folder), "", None, "must be a curve over all distances of the atlas")
        places.append([case[name] for name in PARAMETERS])
        x, at = np.log(table["d"]), np.log(d)

        def between(column: Array, x: Array = x, at: Array = at) -> Array:
            return np.asarray(PchipInterpolator(x, column)(at))

        gradients = [between(table[f"by_{name}"]) if f"by_{name}" in table else 0 * d + np.nan for name in PARAMETERS]
        rest = between(table["dU"] - table["dU_discrete"])
        mean = between((table["U_L"] + table["U_T"]) / 2)
        rows.append(
            [
                curve.values(d),
                curve.half_widths(d),
                *gradients,
                rest,
                between(table["t_relax"]),
                between(table["stretch"]),
                mean,
            ]
        )
    where, columns = np.array(places), np.array(rows).transpose(1, 0, 2)
    dU = fit.Samples(where, columns[0], columns[2:5], columns[1])
    others = {
        name: fit.Samples(where, each, None, 0 * each) for name, each in zip(fit.OFFSETS, columns[6:], strict=True)
    }
    provenance = {"pairsim": __version__, "curves": len(folders), "case": _common(folders)}
    atlas, regression = fit.fit({"dU": dU, **others}, columns[5], box, provenance)
    return atlas, (regression, dU)


def _common(folders: Sequence[Path]) -> dict[str, Any]:
    """What the cases of all curves have in common."""
    cases = [plain(read_yaml(folder / "case.yaml")) for folder in folders]
    return {key: value for key, value in cases[0].items() if all(case.get(key) == value for case in cases)}
