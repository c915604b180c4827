"""`pairsim atlas`: master curves at random places and where the interpolant is least certain, and the interpolant."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import product
from math import ceil
from pathlib import Path

import numpy as np
from scipy.stats import qmc

from pairsim.atlas import fit
from pairsim.atlas.atlas import PARAMETERS, Atlas, Curves, scaled
from pairsim.cases.case import SceneCase
from pairsim.cases.coverage import beyond
from pairsim.cases.identity import RUNS
from pairsim.cases.yaml_file import read_yaml
from pairsim.questions.registry import QUESTIONS
from pairsim.record.folder import plain
from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import InputError
from pairsim.runtime.plain import Plain
from pairsim.runtime.version import __version__
from pairsim.sweeps.atlas_curves import among, curve_folders, curves_in
from pairsim.sweeps.atlas_file import PER_ROUND, AtlasFile, check_atlas
from pairsim.sweeps.atlas_grids import check_pairs, check_start, grid_of_curves, keys_at
from pairsim.sweeps.atlas_recomputation import Recomputation
from pairsim.sweeps.files import parse_file
from pairsim.sweeps.grid import Grid, read_base
from pairsim.sweeps.sweep import Ending, Options, Workers, run_sweep
from pairsim.sweeps.unequal_building import UnequalBuilding

TABLE = "atlas.npz"
DISTANCES = 41  # distances at which the curves are sampled, evenly in log d: by a ratio of 1.12 from 0.02 to 2
CANDIDATES = 512  # places among which those where the interpolant is least certain are chosen
AT_EDGES = 0.35  # fraction of the coordinates of candidates that are moved to the nearer end of their range
SAME_PLACE = 1e-3  # differences of scaled coordinates below which a place counts as known already; chosen
LEAST_ENDS = 0.02  # fraction of the largest De and Ca_e: where both are smaller, dU nearly vanishes and tells nothing


def build(path: Path, folder: Path | None, options: Options, workers: Workers) -> tuple[Ending, Path]:
    """Compute the curves of an atlas file that have not been computed yet, and fit the atlas anew after each round.

    Args:
        path: The atlas file.
        folder: The folder to begin or to continue; None for one named after the file.
        options: How the curves are computed.
        workers: The executors that compute them.

    Returns:
        How the last sweep has ended, and the folder, in which the atlas is the file `TABLE`.

    Raises:
        InputError: The file is invalid, the folder belongs to another file, or the atlas in `start` has another box.
    """
    data = read_yaml(path)
    file = parse_file("atlas", AtlasFile, check_atlas, data, str(path))
    directory = folder or RUNS / (file.name or path.stem)
    of_file = read_base(path, data, QUESTIONS["curve"].model)
    base: dict[str, Plain] = {**of_file.content, "d": {"start": file.d[0], "stop": file.d[1], "num": 2}}
    options = replace(options, flags={"sensitivities": True})
    box = {name: list(getattr(file, name)) for name in (*PARAMETERS, "d")}
    inner = box | {name: list(each) for name, each in file.within.items()}
    random, spread = (qmc.Halton(dimensions, rng=np.random.default_rng(file.seed)) for dimensions in (3, 6))
    draws = spread.random(CANDIDATES)
    candidates = _places(inner, np.where(draws[:, 3:] < AT_EDGES, np.round(draws[:, :3]), draws[:, :3]))

    def grid_of(places: Array, name: str) -> Grid:
        return grid_of_curves(path, name, base, map(keys_at, places))

    atlas = None
    if file.start:
        atlas, *others = (Atlas.load(path.parent / each) for each in file.starts)
        if atlas.box != box:
            allowed = "must be an atlas of the same box and base: its box is different"
            raise InputError(str(path), "start", file.start, allowed)
        if file.recompute:
            again = Recomputation(path, file.start, base, atlas, options)
            return again.build(directory, TABLE, workers), directory
        if file.of_unequal:
            building = UnequalBuilding(path, file, base, atlas, others, options)
            return building.build(directory, TABLE, workers), directory
        random.fast_forward(int(atlas.curves.random.sum()))
        for other in others:
            atlas = joined(atlas, other, lambda place: grid_of(place, "start").cases[0].case, str(path))
    for number in range(ceil(file.curves / PER_ROUND)):
        drawn = _places(inner, random.random(PER_ROUND // 2))
        if atlas is None:
            chosen = _places(box, np.array([*product((0, 1), repeat=3)]))
        else:
            chosen = fit.least_sure(atlas, candidates, PER_ROUND // 2)
        if atlas is not None:
            drawn = drawn[~among(drawn, atlas.curves.places)]
        candidates = candidates[~among(candidates, np.concatenate([drawn, chosen]))]
        round_ = directory / f"round-{number:02d}"
        grid = grid_of(np.concatenate([drawn, chosen]), round_.name)
        common = _common(grid, atlas, file, path)
        ending = run_sweep(grid, round_, options, workers)
        if not ending.to_the_end:
            return ending, directory
        d = np.geomspace(*file.d, DISTANCES)
        curves = curves_in(curve_folders(round_), d, drawn if inner == box else drawn[:0])
        if atlas is not None:
            curves = atlas.curves + curves
        atlas = fit.fit(curves, d, box, {"pairsim": __version__, "case": common})
        atlas.save(directory / TABLE)
    assert atlas is not None
    return ending.saying(_known(atlas)), directory


def _common(grid: Grid, atlas: Atlas | None, file: AtlasFile, source: Path) -> Mapping[str, Plain]:
    """The keys whose values all curves of a round share with each other, and with the atlas so far.

    Raises:
        InputError: The curves are not those of pairs, or not of the box and physics of the atlas.
    """
    pair = grid.cases[0].case
    check_pairs(pair, source)
    others = [plain(each.case.resolved()) for each in grid.cases[1:]]
    if atlas is not None:
        check_start(atlas, pair, source, file.start)
        others.append(atlas.provenance["case"])
    first: dict[str, Plain] = plain(pair.resolved())
    return {key: value for key, value in first.items() if all(each.get(key) == value for each in others)}


def _known(atlas: Atlas) -> str:
    """The number of curves of an atlas, and the median over them of its leave-one-out error, in words."""
    size = 100 * np.sqrt(np.median(np.mean(fit.left_out(atlas) ** 2, axis=1)))
    return f"{len(atlas.curves.places)} curves; left out, half of them are off by up to {size:.2g} % of their peak"


def _places(box: Mapping[str, Sequence[float]], x: Array) -> Array:
    """The places at coordinates `x` in the box, from 0 to 1, without those where dU nearly vanishes.

    Both have the shape (places, 3), but the result may have fewer rows.
    """
    low, high = np.array([box[name] for name in PARAMETERS]).T
    found = np.unique(np.round(low + (high - low) * x, 6), axis=0)
    return np.asarray(found[(found[:, 1:] > LEAST_ENDS * high[1:]).any(axis=1)])


def joined(atlas: Atlas, other: Atlas, case_at: Callable[[Array], SceneCase], source: str) -> Atlas:
    """An atlas with those curves of another one that lie in its box, and not where it has a curve of its own.

    They do not count as curves at random places, since they may fill only a part of the box.

    Args:
        atlas: The atlas.
        other: The other one.
        case_at: The case of the atlas at a place, shape (1, 3), in which the physics of both are compared.
        source: The file that messages name.

    Raises:
        InputError: The other one has other distances, or other physics.
    """
    places = other.curves.places
    inside = np.array([not atlas.outside(**dict(zip(PARAMETERS, each, strict=True))) for each in places])
    theirs, ours = (scaled(atlas.box, each.places)[0] for each in (other.curves, atlas.curves))
    known = (np.abs(theirs[:, None] - ours) < SAME_PLACE).all(axis=2).any(axis=1)
    new = inside & ~known
    if not new.any():
        return atlas
    why = beyond(case_at(places[new][:1]), other)
    if len(other.d) != len(atlas.d) or not np.allclose(other.d, atlas.d):
        why.append("its curves are at other distances")
    if why:
        raise InputError(source, "start", None, f"must be atlases of the same curves: {' and '.join(why)}")
    more = Curves(*(each[new] for each in vars(other.curves).values()))
    more = replace(more, random=np.zeros(int(new.sum()), dtype=bool))
    return fit.fit(atlas.curves + more, atlas.d, atlas.box, atlas.provenance)
