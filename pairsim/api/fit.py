"""The modulus of two beads, or the relaxation time of their liquid, from a film of their distance: `fit`."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
import scipy

from pairsim.api.ask import asked_of
from pairsim.api.cases import AnyCase
from pairsim.cases.quantities import as_given, unit_in
from pairsim.results.curve_table import FORGOTTEN
from pairsim.results.folder import kind_of, read_record
from pairsim.results.table_files import read_table
from pairsim.results.travel import path_of
from pairsim.results.units import scales_in
from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import InputError

if TYPE_CHECKING:
    from pairsim.plots.style import Page

GIVES = {"modulus": ("Ca_e", -1), "relaxation": ("De", 1)}
"""What may be unknown, the number that follows from it, and the power of it."""
LEAST = 1e-3  # such a number over its first guess, at least; chosen
WIDE = 2.0  # ratio to its value at which an interval ends of which it is said that the data do not determine it; chosen
CHANCE = 3.0  # standard errors that the correlation of neighbouring residuals may have by chance; chosen


@dataclass(frozen=True)
class FilmFit:
    """A fit to a film.

    Attributes:
        values: By quantity, its value, the least and the largest one of its interval of 95 %, and their unit.
        times: Times of the frames that were used [s], shape (frames,).
        distances: Distances of these frames [um], of the same shape.
        fitted: Those of the model [um], of the same shape.
    """

    values: Mapping[str, tuple[float, float, float, str]]
    times: Array
    distances: Array
    fitted: Array

    @property
    def residuals(self) -> Array:
        """Distances of the model less those of the frames [um], shape (frames,)."""
        return self.fitted - self.distances

    def plot(self, out: Path | str) -> list[Path]:
        """Draw film and fitted motion over time, and the residuals: film.png in a folder."""
        from pairsim.plots.films import draw_film
        from pairsim.plots.style import Page

        film, fitted = (self.times, self.distances), (self.times, self.fitted)
        return draw_film(film, {"fit": fitted}, Path(out), Page())

    def __str__(self) -> str:
        lines = []
        for name, (value, least, most, unit) in self.values.items():
            unknown = ": these data do not determine it" if max(most / value, value / least) > WIDE else ""
            lines.append(f"{name} = {value:.4g} {unit}, 95 %: {least:.4g} to {most:.4g}{unknown}")
        lines.append(f"{len(self.times)} frames, off by {self.residuals.std():.2g} um")
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
    seconds, metres = film_of(Path(film))
    t, d = seconds / scales.time, metres / scales.length
    numbers = {"beta": asked.betas[0], "De": asked.De, "Ca_e": asked.Ca_es[0]}
    used = t >= t[0] + FORGOTTEN * np.interp(d[0], book.d, book.table(**numbers)["t_relax"])
    seconds, t, d, follow = seconds[used], t[used] - t[0], d[used], [GIVES[name] for name in unknown]
    if len(t) < len(unknown) + 3:
        raise InputError(str(film), "", None, "must have more frames")

    def deviations(x: Array, parts: Array) -> Array:
        """Of the distances, by unknown numbers over their first guess and the first distance; dU + parts dU_error."""
        there = numbers | {name: numbers[name] * ratio for (name, _), ratio in zip(follow, x, strict=False)}
        table = book.table(**there)
        moved = path_of({**table, "dU": table["dU"] + parts * table["dU_error"]}, x[-1], t)
        return np.asarray(moved - d)

    ends = [(LEAST, book.box[name][1] / numbers[name]) for name, _ in follow]
    bounds = np.array([*ends, book.d[[0, -1]]]).T
    start = np.array([*np.ones(len(unknown)), np.clip(d[0], 1.01 * book.d[0], 0.99 * book.d[-1])])
    seen = np.clip([d.min(), d.max()], *book.d[[0, -1]])
    way = np.interp(np.log(book.d), np.log(seen), [-1.0, 1.0])  # from one end of the film to the other
    best, shifted, tilted = (
        scipy.optimize.least_squares(deviations, start, bounds=bounds, diff_step=1e-4, args=(parts,))
        for parts in (0 * way, way**0, way)
    )
    fitted, free = d + best.fun, len(t) - len(start)
    if not (book.d[0] <= fitted.min() and fitted.max() <= book.d[-1]):
        raise InputError(str(film), "", None, "must have distances of the atlas alone")
    covariance = np.linalg.pinv(best.jac.T @ best.jac) * (best.fun @ best.fun) / free
    half = scipy.stats.t.ppf(0.975, free) * np.sqrt(np.diag(covariance))
    half += np.hypot(shifted.x - best.x, tilted.x - best.x)
    values = {}
    for name, (_, power), ratio, width, (low, high) in zip(unknown, follow, best.x, half, ends, strict=False):
        guess, unit = as_given(block[name])
        interval = np.sort(guess * np.clip([ratio - width, ratio + width], low, high) ** power)
        values[name] = guess * ratio**power, *map(float, interval), unit
    um = 1e6 * scales.length
    return FilmFit(values, seconds, um * d, um * fitted)


def overlay_film(film: Path, folders: Sequence[Path], out: Path, page: Page) -> list[Path]:
    """Draw a film, runs from their start on, and motions by curves from its first distance on: `film`.

    Raises:
        InputError: The film is wrong, or a folder has no units, or is neither a run nor a curve that has its distance.
    """
    from pairsim.plots.films import draw_film

    t, d = film_of(film)
    t, lines = t - t[0], {}
    for folder in folders:
        kind, scales = kind_of(folder), scales_in(read_record(folder))
        if kind not in ("run", "curve") or scales is None:
            raise InputError(str(folder), "", None, "must be a run or a curve with a physical block, to go with a film")
        table = read_table(folder / f"{'series' if kind == 'run' else kind}.csv")
        if kind == "curve":
            if not table["d"][0] <= d[0] / scales.length <= table["d"][-1]:
                raise InputError(str(folder), "", None, "must be a curve that has the first distance of the film")
            table = {"t": t / scales.time, "d": path_of(table, d[0] / scales.length, t / scales.time)}
        lines[f"{kind} {folder.name}"] = scales.time * table["t"], 1e6 * scales.length * table["d"]
    return draw_film((t, 1e6 * d), lines, out, page)


def film_of(film: Path) -> tuple[Array, ...]:
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
