"""The modulus of two beads, or the relaxation time of their liquid, from a film of their distance: `fit`."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
import scipy

from pairsim.api.ask import asked_of
from pairsim.api.cases import AnyCase
from pairsim.cases.quantities import as_given, unit_in
from pairsim.results.curve_table import FORGOTTEN
from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import InputError

GIVES = {"modulus": ("Ca_e", -1), "relaxation": ("De", 1)}
"""What may be unknown, the number that follows from it, and the power of it."""
WIDE = 2.0  # ratio to its value at which an interval ends of which it is said that the data do not determine it; chosen
CHANCE = 3.0  # standard errors that the correlation of neighbouring residuals may have by chance; chosen


@dataclass(frozen=True)
class FilmFit:
    """A fit to a film.

    Attributes:
        values: By quantity, its value, the least and the largest one of its interval of 95 %, and their unit.
        times: Times of the frames that were used, from the first one on [D_c/U_av], shape (frames,).
        residuals: Distances of the model less those of the frames [D_c], of the same shape.
    """

    values: Mapping[str, tuple[float, float, float, str]]
    times: Array
    residuals: Array

    def __str__(self) -> str:
        lines = []
        for name, (value, least, most, unit) in self.values.items():
            unknown = ": these data do not determine it" if max(most / value, value / least) > WIDE else ""
            lines.append(f"{name} = {value:.4g} {unit}, 95 %: {least:.4g} to {most:.4g}{unknown}")
        lines.append(f"{len(self.times)} frames, off by {self.residuals.std():.2g} D_c")
        r = self.residuals - self.residuals.mean()
        if r[1:] @ r[:-1] / (r @ r) > CHANCE / np.sqrt(len(r)):
            lines.append("A bad fit: neighbouring frames are off in the same direction, so this model is not theirs.")
        return "\n".join(lines)


def fit(
    film: Path | str, case: AnyCase, *, unknown: Sequence[str] = ("modulus",), atlas: Path | str | None = None
) -> FilmFit:
    """Fit quantities of an experiment to a film of two equal beads, from when they have forgotten their start.

    Intervals have the part of the scatter of the film and that of the atlas.

    Args:
        film: CSV file with times and distances between the surfaces: columns such as "t [s]" and "d [um]".
        case: The experiment, with a first guess of what is unknown in its `physical` block.
        unknown: "modulus", "relaxation" or both.
        atlas: File of an atlas; None: those that ship.

    Raises:
        InputError: A file or key is wrong, or the atlas has no answer for the first guess.
    """
    book, asked, reasons = asked_of(case, {}, atlas)
    scales, block = asked.scales, dict(asked.physical or {})
    if scales is None or not all(name in GIVES and block.get(name) for name in unknown):
        reasons = [f"there must be a first guess of {' and '.join(unknown)} in the physical block"]
    if scales is None or reasons:
        raise InputError("pairsim fit", "", None, f"the atlas has no answer: {' and '.join(reasons)}")
    t, d = (each / scale for each, scale in zip(_columns(Path(film)), (scales.time, scales.length), strict=True))
    numbers = {"beta": asked.betas[0], "De": asked.De, "Ca_e": asked.Ca_es[0]}
    used = t >= t[0] + FORGOTTEN * np.interp(d[0], book.d, book.table(**numbers)["t_relax"])
    t, d, follow = t[used] - t[0], d[used], [GIVES[name] for name in unknown]
    if len(t) < len(unknown) + 3 or not (book.d[0] < d.min() and d.max() < book.d[-1]):
        raise InputError(str(film), "", None, "must have more frames, with distances of the atlas")

    def deviations(x: Array, part: float) -> Array:
        """Of the distances, by the unknowns over their first guess and the first distance, with dU + part dU_error."""
        ratios = {name: ratio**power for (name, power), ratio in zip(follow, x, strict=False)}
        there = {name: number * ratios.get(name, 1.0) for name, number in numbers.items()}
        table = book.table(**there)
        z, rate = np.log(table["d"]), (table["dU"] + part * table["dU_error"]) / table["stretch"] / table["d"]
        path = scipy.integrate.solve_ivp(
            lambda _, now: np.interp(now, z, rate), t[[0, -1]], np.log(x[-1:]), "LSODA", t, rtol=1e-9, atol=1e-11
        )
        return np.asarray(np.exp(path.y[0]) - d)

    ends = [sorted((1e-3**power, (book.box[name][1] / numbers[name]) ** power)) for name, power in follow]
    bounds = np.array([*ends, book.d[[0, -1]]]).T
    start = np.array([*np.ones(len(unknown)), d[0]])
    best, more, less = (
        scipy.optimize.least_squares(deviations, start, bounds=bounds, diff_step=1e-4, args=(part,))
        for part in (0.0, 1.0, -1.0)
    )
    free = len(t) - len(start)
    covariance = np.linalg.pinv(best.jac.T @ best.jac) * (best.fun @ best.fun) / free
    half = scipy.stats.t.ppf(0.975, free) * np.sqrt(np.diag(covariance)) + np.abs(more.x - less.x) / 2
    values = {}
    for name, ratio, width, (low, high) in zip(unknown, best.x, half, ends, strict=False):
        guess, unit = as_given(block[name])
        interval = np.clip(ratio * np.exp([-width / ratio, width / ratio]), low, high)
        values[name] = guess * ratio, *map(float, guess * interval), unit
    return FilmFit(values, t, best.fun)


def _columns(film: Path) -> tuple[Array, ...]:
    """Times [s] and distances [m] of a film, in ascending time."""
    if not film.is_file():
        raise InputError(str(film), "", None, "no such file")
    table, found = pd.read_csv(film), []
    for name, unit in (("t", "s"), ("d", "m")):
        heading = next((each for each in map(str, table) if re.fullmatch(rf"\s*{name}\s*\[.+\]\s*", each)), "")
        if not heading:
            raise InputError(str(film), name, None, f"must be a column with its unit, such as {name} [{unit}]")
        values = pd.to_numeric(table[heading], errors="coerce")
        if values.isna().any():
            wrong = int(np.flatnonzero(values.isna())[0])
            raise InputError(f"{film}:{wrong + 2}", heading.strip(), table[heading].iloc[wrong], "must be a number")
        found.append(values.to_numpy(dtype=float) * unit_in(unit, heading.partition("[")[2].strip(" ]")))
    return tuple(each[np.argsort(found[0])] for each in found)
