"""The modulus of two beads, or the relaxation time of their liquid, from a film of their distance: `fit`."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

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
PLACES, NEAR = 9, (-1.5, 0.0, 1.5)
"""Where the sum of squares is looked at: over the whole range, and beside its least value, in half-widths there."""
MOST = 3.0  # half-widths by which dU may be off
EXACT = 1e-4  # least noise of distances that is assumed [D_c]: errors of the atlas are of more than two kinds; chosen
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

    Intervals reach to the last values at which the film is as probable as its scatter, and the half-widths of the
    atlas, allow (the profile of its likelihood).

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

    seen = np.clip([d.min(), d.max()], *book.d[[0, -1]])
    way = np.interp(np.log(book.d), np.log(seen), [-1.0, 1.0])  # from one end of the film to the other
    count = len(unknown)

    def deviations(x: Array, noise: float) -> Array:
        """Of the distances, and of dU from the atlas.

        Args:
            x: The unknown numbers over their first guess, the first distance, and 1 more than by how many half-widths
                dU is off everywhere, and from one end of the film to the other.
            noise: Standard deviation of the distances, by which deviations of dU count.
        """
        there = numbers | {name: numbers[name] * ratio for (name, _), ratio in zip(follow, x, strict=False)}
        table, off = book.table(**there), x[-2:] - 1
        moved = path_of({**table, "dU": table["dU"] + (off[0] + off[1] * way) * table["dU_error"]}, x[count], t)
        return np.concatenate([moved - d, noise * scipy.stats.norm.ppf(0.975) * off])

    ends = [(LEAST, book.box[name][1] / numbers[name]) for name, _ in follow]
    bounds = np.array([*ends, book.d[[0, -1]], (1 - MOST, 1 + MOST), (1 - MOST, 1 + MOST)]).T
    start = np.array([*np.ones(count), np.clip(d[0], 1.01 * book.d[0], 0.99 * book.d[-1]), 1.0, 1.0])
    steps = np.array([*np.full(count + 1, 1e-4), 0.1, 0.1])  # of differences, relative

    def best(x: Array, noise: float, held: Sequence[int] = ()) -> Any:
        """The fit from given values on, some of which are held."""
        free = np.setdiff1d(np.arange(len(x)), held)

        def of_free(y: Array) -> Array:
            return deviations(np.concatenate([x[list(held)], y])[np.argsort([*held, *free])], noise)

        return scipy.optimize.least_squares(of_free, x[free], bounds=bounds[:, free], diff_step=steps[free], gtol=None)

    freedom = len(t) - count - 1
    noise = max(float(np.sqrt(2 * best(start, 0.0, (count + 1, count + 2)).cost / freedom)), EXACT)
    found = best(start, noise)
    fitted = d + found.fun[:-2]
    if not (book.d[0] <= fitted.min() and fitted.max() <= book.d[-1]):
        raise InputError(str(film), "", None, "must have distances of the atlas alone")
    limit = scipy.stats.t.ppf(0.975, freedom) * noise  # of the root of what is above the least sum of squares
    scatter = limit * np.sqrt(np.diag(np.linalg.pinv(found.jac.T @ found.jac)))
    values = {}
    for k, (name, (_, power), (low, high)) in enumerate(zip(unknown, follow, ends, strict=True)):

        def beyond(value: float, k: int = k) -> float:
            """The root of what the sum of squares is above the least one, with this number held, less the limit."""
            cost = best(np.concatenate([found.x[:k], [value], found.x[k + 1 :]]), noise, (k,)).cost
            return float(np.sqrt(max(2 * (cost - found.cost), 0.0))) - limit

        near = found.x[k] + scatter[k] * np.array(NEAR)
        places = np.unique(np.clip([*np.geomspace(low, high, PLACES), *near], low, high))
        inside = np.flatnonzero([beyond(value) <= 0 for value in places])
        pairs = (inside[0], inside[0] - 1), (inside[-1], inside[-1] + 1)
        interval = [
            float(scipy.optimize.brentq(beyond, places[i], places[out], rtol=1e-3))
            if 0 <= out < len(places)
            else places[i]
            for i, out in pairs
        ]
        guess, unit = as_given(block[name])
        values[name] = guess * found.x[k] ** power, *sorted(guess * x**power for x in interval), unit
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
