"""The sweeps from which an atlas is made: curves of pairs, and single beads."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from pairsim.atlas.atlas import PARAMETERS, Atlas
from pairsim.cases.case import SceneCase
from pairsim.cases.coverage import beyond
from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import InputError
from pairsim.runtime.plain import Plain
from pairsim.sweeps.grid import Grid, grid_from

OF_BEADS = "5%"  # `accuracy` of single beads, with which their velocities are known to 3e-5


def grid_of_curves(path: Path, name: str, base: Mapping[str, Plain], cases: Iterable[Mapping[str, Plain]]) -> Grid:
    """The sweep of a name over curves of an atlas file.

    Args:
        path: The atlas file.
        name: The name of the sweep.
        base: Keys that all curves share.
        cases: The other keys of each curve.

    Raises:
        InputError: The base is not that of a curve, or a case is invalid.
    """
    return grid_from(path, {"name": name, "command": "curve", "base": base, "cases": list(cases)})


def grid_of_beads(path: Path, name: str, base: Mapping[str, Plain], places: Array) -> Grid:
    """The sweep of a name over single beads of an atlas file, at places (beta, De, Ca_e), shape (beads, 3)."""
    shared = {key: value for key, value in base.items() if key not in ("d", "tol")}
    coarse = {} if "mesh" in shared else {"accuracy": OF_BEADS}
    return grid_of_curves(path, name, {**shared, **coarse, "particles": 1}, map(keys_at, places))


def keys_at(place: Array) -> dict[str, Plain]:
    """The keys of the case at a place (beta, De, Ca_e), shape (3,)."""
    return dict(zip(PARAMETERS, map(float, place), strict=True))


def check_pairs(case: SceneCase, source: Path) -> None:
    """Raise an InputError about the base in an atlas file unless its cases, such as this one, are those of pairs."""
    if case.n != 2:
        allowed = "must be 2: the curves of an atlas are those of pairs"
        raise InputError(str(source), "base.particles", case.n, allowed)


def check_start(atlas: Atlas, case: SceneCase, source: Path, start: str | Sequence[str]) -> None:
    """Raise an InputError about `start` in an atlas file unless that atlas has the physics and the place of a case."""
    if why := beyond(case, atlas):
        allowed = f"must be an atlas of the same box and base: {' and '.join(why)}"
        raise InputError(str(source), "start", start, allowed)
