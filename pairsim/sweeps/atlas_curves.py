"""Reads the curves of an atlas from folders: sampled at its distances, with their derivatives."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self, cast

import numpy as np
from scipy.interpolate import CubicSpline

from pairsim.analysis.master_curve import Curve
from pairsim.atlas.atlas import PARAMETERS, Curves
from pairsim.atlas.unequal import Beads, UnequalCurves, gradients_of
from pairsim.cases.yaml_file import read_yaml
from pairsim.record.columns import (
    BY_BETA,
    BY_CA_E,
    BY_DE,
    BY_DIFFERENCE,
    BY_STIFFNESS,
    SENSITIVITIES,
    STRETCH,
    T_RELAX,
    U,
)
from pairsim.record.record import Record
from pairsim.record.table_files import read_table
from pairsim.runtime.arrays import Array, Flags
from pairsim.runtime.errors import InputError

FINISHED = "finished"


def curve_folders(sweep: Path) -> list[Path]:
    """The folders of all curves of a sweep that have finished."""
    found = sorted(path.parent for path in sweep.glob("*/run.json"))
    return [each for each in found if Record.read(each).status == FINISHED]


@dataclass(frozen=True)
class Sampled:
    """A curve of a folder, sampled at given distances, all of which it covers.

    Attributes:
        case: The content of its case file.
        curve: The curve.
        inside: The distances [D_c], clipped to the ends of the curve against rounding, shape (distances,).
    """

    case: Mapping[str, Any]
    curve: Curve
    inside: Array

    @classmethod
    def read(cls, folder: Path, d: Array) -> Self:
        """Read the curve of a folder, to be sampled at the distances `d` [D_c], shape (distances,).

        Raises:
            InputError: The curve does not cover all distances.
        """
        found, case = Curve.read(folder, missing_ok=True), read_yaml(folder / "case.yaml")
        curve = found.interpolant()
        if curve is None or curve.d[0] > d[0] * (1 + 1e-9) or curve.d[-1] < d[-1] * (1 - 1e-9):
            message = found.record.message
            allowed = f"must be a curve over all distances of the atlas ({message}): choose a smaller box"
            raise InputError(str(folder), "", None, allowed)
        return cls(case, found, np.clip(d, *curve.ends))

    @property
    def dU(self) -> tuple[Array, Array]:
        """dU and its half-widths [U_av], shape (distances,) each."""
        curve = self.curve.of()
        return curve.values(self.inside), curve.half_widths(self.inside)

    def smooth(self, values: Array | None) -> Array:
        """Interpolate values from the points of the curve to the distances; all are nan if any value is unknown."""
        if values is None or not np.isfinite(values).all():
            return np.full_like(self.inside, np.nan)
        return np.asarray(CubicSpline(np.log(self.curve.of().d), values)(np.log(self.inside)))


def curves_in(folders: Sequence[Path], d: Array, drawn: Array) -> Curves:
    """The data of an atlas from folders of curves.

    Args:
        folders: The folders, whose curves have sensitivities.
        d: The distances at which curves are sampled [D_c], shape (distances,).
        drawn: The places (beta, De, Ca_e) that were drawn at random, shape (places, 3).

    Raises:
        InputError: A curve does not cover all distances.
    """
    places, rows = [], []
    for each in (Sampled.read(folder, d) for folder in folders):
        table = each.curve.table
        by = [table.known(column) for column in (*(SENSITIVITIES[name] for name in PARAMETERS), BY_DIFFERENCE)]
        others = [(table.of(U, "_L") + table.of(U, "_T")) / 2, table[STRETCH], table[T_RELAX]]
        places.append([float(cast("float", each.case[name])) for name in PARAMETERS])
        rows.append([*each.dU, *map(each.smooth, (*by[:3], *others, by[3]))])
    by_curve, where = np.array(rows), np.array(places)
    random = among(where, drawn)
    return Curves(where, random, by_curve[:, 0], by_curve[:, 1], by_curve[:, 2:5], by_curve[:, 5:8], by_curve[:, 8])


def unequal_curves_in(folders: Sequence[Path], d: Array) -> UnequalCurves:
    """The data of an atlas from folders of curves of pairs whose beads differ; all count as drawn at random.

    Curves are sampled at the distances `d` [D_c], shape (distances,).

    Raises:
        InputError: A curve does not cover all distances.
    """
    names = {"beta": BY_BETA, "De": BY_DE, "Ca_e": BY_CA_E, "difference": BY_DIFFERENCE, "stiffness": BY_STIFFNESS}
    found = [Sampled.read(folder, d) for folder in folders]
    cases = [each.case for each in found]
    beta, De, Ca_e = (np.array([case[name] for case in cases], dtype=float) for name in PARAMETERS)
    beads = Beads(beta, De, Ca_e)
    by = {
        name: np.array([each.smooth(each.curve.table.known(column)) for each in found])
        for name, column in names.items()
    }
    dU, errors = np.array([each.dU for each in found]).swapaxes(0, 1)
    ends = np.array([[each.curve.table.of(U, side)[-1] for side in ("_T", "_L")] for each in found])
    random = np.ones(len(found), dtype=bool)
    return UnequalCurves(*beads, random, dU, errors, gradients_of(beads, by).swapaxes(0, 1), ends)


def beads_in(folders: Sequence[Path]) -> tuple[Array, Array]:
    """Read single beads from folders: beta, De and Ca_e, shape (beads, 3), and velocities [U_av], shape (beads,)."""
    places, velocities = [], []
    for folder in folders:
        case = read_yaml(folder / "case.yaml")
        places.append([float(cast("float", case[name])) for name in PARAMETERS])
        velocities.append(_velocity(folder))
    return np.array(places).reshape(-1, 3), np.array(velocities)


def _velocity(folder: Path) -> float:
    table = read_table(folder / "curve.csv")
    return float(table.of(U, table.suffixes(U)[0])[0])


def among(places: Array, known: Array) -> Flags:
    """Which rows of `places`, shape (places, n), are rows of `known`, shape (others, n), too; shape (places,)."""
    return np.asarray((places[:, None] == known).all(axis=2).any(axis=1))
