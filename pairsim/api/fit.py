"""The modulus of two beads, or the relaxation time of their liquid, from a film of their distance: `fit`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import scipy

from pairsim.api.ask import asked_of
from pairsim.api.cases import AnyCase
from pairsim.api.film import film_of
from pairsim.cases.quantities import as_given
from pairsim.results.curve_table import Motion
from pairsim.results.folder import kind_of, read_record
from pairsim.results.table_files import read_table
from pairsim.results.units import scales_in
from pairsim.runtime.arrays import Array, Indices
from pairsim.runtime.errors import InputError

if TYPE_CHECKING:
    from pairsim.plots.style import Page

GIVES = {"modulus": ("Ca_e", -1), "relaxation": ("De", 1)}
"""What may be unknown, the number that follows from it, and the power of it."""
LEAST = 1e-3  # such a number over its first guess, at least; chosen
WIDE = 2.0  # ratio to its value at which an interval ends of which it is said that the data do not determine it; chosen
SETTLED = 6.0  # decay times after which dU from rest is that of the curve: to 0.2 % in Giesekus liquids, 7 % after 3
PLACES = 40  # values of what is unknown at which the sum of squares is looked at, for all its minima; chosen
EXACT = 1e-4  # least noise of distances that is assumed [D_c]; chosen
STEP = 1e-4  # of differences, relative; chosen
CHANCE = 3.0  # standard errors that the correlation of neighbouring residuals may have by chance; chosen


@dataclass(frozen=True)
class FilmFit:
    """A fit to a film.

    Attributes:
        values: By quantity, its value, the least and the largest one of its interval of 95 %, and their unit.
        times: Times of the frames that were used [s], shape (frames,).
        distances: Distances of these frames [um], of the same shape.
        fitted: Those of the model [um], of the same shape.
        alike: Correlation of the residuals of neighbouring frames, less what the atlas may be off by.
        cut: The quantities whose interval ends because the atlas does.
    """

    values: Mapping[str, tuple[float, float, float, str]]
    times: Array
    distances: Array
    fitted: Array
    alike: float
    cut: frozenset[str] = frozenset()

    @property
    def residuals(self) -> Array:
        """Distances of the model less those of the frames [um], shape (frames,)."""
        return self.fitted - self.distances

    def plot(self, out: Path | str) -> list[Path]:
        """Draw film and fitted motion over time, and the residuals: film.png in a folder."""
        from pairsim.plots.measured import draw_film
        from pairsim.plots.style import Page

        film, fitted = (self.times, self.distances), (self.times, self.fitted)
        return draw_film(film, {"fit": fitted}, Path(out), Page())

    def __str__(self) -> str:
        lines = []
        for name, (value, least, most, unit) in self.values.items():
            wide = most > WIDE * value or value > WIDE * least
            unknown = ": these data do not determine it" if wide else ""
            cut = (
                "; the interval ends where the atlas does, values beyond were not looked at" if name in self.cut else ""
            )
            lines.append(f"{name} = {value:.4g} {unit}, 95 %: {least:.4g} to {most:.4g}{unknown}{cut}")
        lines.append(f"{len(self.times)} frames, off by {self.residuals.std():.2g} um")
        if self.alike > CHANCE / np.sqrt(len(self.times)):
            lines.append("A bad fit: neighbouring frames are off in the same direction, so this model is not theirs.")
        return "\n".join(lines)


def fit(
    film: Path | str,
    case: AnyCase,
    *,
    unknown: str | Sequence[str] = "modulus",
    atlas: Path | str | None = None,
    fps: float | None = None,
    pixel: str | None = None,
    particles: Sequence[int | str] | None = None,
) -> FilmFit:
    """Fit quantities of an experiment to a film of two equal beads, from when they have forgotten their start.

    Intervals reach to the last values at which the film is as probable as its scatter, and the half-widths of the
    atlas, allow (the profile of its likelihood, as in Bates and Watts 1988, chapter 6). Errors of the atlas change with
    the distance as those of curves that are left out of it. Where values on both sides of a turning point give nearly
    the same film, its deviation from the best one is that of two numbers.

    Args:
        film: Table with times and distances between the surfaces, columns such as "t [s]" and "d [um]", or of a
            tracker: frames, particles and their positions.
        case: The experiment, with a first guess of what is unknown in its `physical` block.
        unknown: "modulus", "relaxation" or both.
        atlas: File of an atlas; None: those that ship.
        fps: Frames per second, for a film with frame numbers in place of times.
        pixel: Size of a pixel, such as ".65 +- .01 um", for lengths in pixels.
        particles: Names of the two beads in a table with more than two.

    Raises:
        InputError: A file or key is wrong, or the atlas has no answer for the first guess.
    """
    unknown = list(dict.fromkeys([unknown] if isinstance(unknown, str) else unknown))
    if not unknown or not {*unknown} <= GIVES.keys():
        raise InputError("pairsim fit", "unknown", ", ".join(unknown), f"allowed: {', '.join(GIVES)}, or both")
    book, asked, reasons = asked_of(case, {}, atlas)
    scales, block = asked.scales, dict(asked.physical or {})
    missing = [name for name in unknown if not block.get(name)]
    if scales is None or missing:
        raise InputError("pairsim fit", f"physical.{(missing or unknown)[0]}", None, "must be given, as a first guess")
    if reasons:
        raise InputError("pairsim fit", "", None, f"the atlas has no answer: {' and '.join(reasons)}")
    read = film_of(film, fps=fps, pixel=pixel, particles=particles)
    seconds, metres = read.seconds, read.gaps(asked.betas[0] * scales.length)
    t, d = seconds / scales.time, metres / scales.length
    numbers = {"beta": asked.betas[0], "De": asked.De, "Ca_e": asked.Ca_es[0]}
    start = SETTLED * float(np.interp(d[0], book.d, book.table(**numbers)["t_relax"]))
    used = t >= t[0] + start
    seconds, d, follow = seconds[used], d[used], [GIVES[name] for name in unknown]
    if len(d) < len(unknown) + 3:
        after = (
            f"frames later than {scales.time * start:.3g} s after the first one, when the pair has forgotten its start"
        )
        raise InputError(str(film), "", None, f"must have at least {len(unknown) + 3} {after}; has {len(d)}")
    t = t[used] - t[used][0]

    @cache
    def curve_at(*ratios: float) -> tuple[Mapping[str, Array], Motion]:
        there = {name: numbers[name] * ratio for (name, _), ratio in zip(follow, ratios, strict=True)}
        table = book.table(**numbers | there)
        motion = Motion.of(table)
        assert motion is not None
        return table, motion

    def residuals(x: Array) -> Array:
        """Those of the unknown numbers over their first guess, and the first distance."""
        return curve_at(*x[:-1])[1].path(x[-1], t) - d

    ends = [(LEAST, book.box[name][1] / numbers[name]) for name, _ in follow]
    bounds = np.array([*ends, book.d[[0, -1]]]).T
    freedom = len(t) - len(bounds.T)
    noise, shapes, sizes = EXACT, np.zeros((len(t), 1)), np.zeros(1)

    def whitened(off: Array) -> Array:
        """Combinations of residuals that are independent, with variance 1: less what the atlas may be off by."""
        return np.asarray((off - shapes @ ((1 - noise / np.hypot(noise, sizes)) * (shapes.T @ off))) / noise)

    def best(x: Array, held: Mapping[int, float]) -> tuple[float, Array]:
        """The least sum of squares, from values on, some of which are held at others; and where it is."""
        free = np.setdiff1d(np.arange(len(x)), list(held))
        x = x.copy()
        x[list(held)] = list(held.values())

        def filled(y: Array) -> Array:
            x[free] = y
            return x

        found = scipy.optimize.least_squares(
            lambda y: whitened(residuals(filled(y))), x[free], bounds=bounds[:, free], diff_step=STEP
        )
        return 2 * found.cost, filled(found.x)

    def profile(k: int, x: Array) -> tuple[Array, Array]:
        """The least sums of squares over the range of an unknown number and at their minima, and where they are."""
        found = []
        for value in np.geomspace(*ends[k], PLACES):
            found.append(best(x, {k: value}))
            x = found[-1][1]
        found += [best(found[i][1], {}) for i in minima_of(np.array([cost for cost, _ in found]))]
        costs, points = (np.array(each) for each in zip(*sorted(found, key=lambda each: each[1][k]), strict=True))
        return costs, points

    first = np.array([*np.ones(len(unknown)), np.clip(d[0], 1.01 * book.d[0], 0.99 * book.d[-1])])
    costs, points = profile(0, first)
    x = points[costs.argmin()]
    noise = max(noise, float(np.linalg.norm(residuals(x))) / np.sqrt(freedom))
    table, path = curve_at(*x[:-1])[0], residuals(x) + d
    where = np.log(path), np.log(book.d)
    errors = np.array([np.interp(*where, each * table["dU_error"]) for each in book.patterns])
    relative = errors / np.interp(*where, table["dU"]) / scipy.stats.norm.ppf(0.975)
    ahead = scipy.integrate.cumulative_trapezoid(relative, t, initial=0)  # in time
    shapes, sizes, _ = np.linalg.svd((ahead * np.gradient(path, t)).T, full_matrices=False)
    profiles = [profile(k, x) for k in range(len(unknown))]
    costs, points = (np.concatenate(each) for each in zip(*profiles, strict=True))
    least, x = float(costs.min()), points[costs.argmin()]
    fitted, white = residuals(x) + d, whitened(residuals(x))
    if not (book.d[0] < fitted.min() and fitted.max() < book.d[-1]):
        raise InputError(str(film), "", None, "the motion that fits best leaves the distances of the atlas")

    def above(value: float, k: int, x: Array, limit: float) -> float:
        return best(x, {k: value})[0] - limit

    values, cut = {}, set[str]()
    one, two = (n * scipy.stats.f.ppf(0.95, n, freedom) for n in (1, 2))
    for k, (name, (_, power), (costs, points)) in enumerate(zip(unknown, follow, profiles, strict=True)):
        order = np.argsort([*points[:, k], x[k]])  # another profile may have found the least sum
        costs, points = np.append(costs, least)[order], np.vstack([points, x])[order]
        several = (costs[minima_of(costs)] <= least + two).sum() > 1
        limit = least + (two if several else one)
        inside, reach = np.flatnonzero(costs <= limit), []
        for i, out in ((inside[0], inside[0] - 1), (inside[-1], inside[-1] + 1)):
            end, beyond = points[i, k], points[np.clip(out, 0, len(costs) - 1), k]
            args = k, points[i], limit
            crossed = above(beyond, *args) > 0
            reach.append(scipy.optimize.brentq(above, end, beyond, args, rtol=1e-3) if crossed else beyond)
        if reach[0] <= LEAST:  # as good as 0: the interval holds rigid beads, or a Newtonian liquid
            reach[0] = 0.0
        if reach[1] >= ends[k][1]:
            cut.add(name)
        guess, unit = as_given(block[name][0] if isinstance(block[name], list) else block[name])
        with np.errstate(divide="ignore"):  # no softness at all is an infinite modulus
            interval = np.sort(guess * np.array(reach, dtype=float) ** power).tolist()
        values[name] = guess * x[k] ** power, *interval, unit
    um = 1e6 * scales.length
    alike = float(white[1:] @ white[:-1]) / max(float(white @ white), len(t))
    return FilmFit(values, seconds, um * d, um * fitted, alike, frozenset(cut))


def minima_of(costs: Array) -> Indices:
    """Places of the minima of costs, ends included, shape (minima,)."""
    padded = np.pad(costs, 1, constant_values=np.inf)
    return np.flatnonzero((costs < padded[:-2]) & (costs <= padded[2:]))


def overlay_film(film: Path, folders: Sequence[Path], out: Path, page: Page) -> list[Path]:
    """Draw a film, runs from their start on, and motions by curves from its first distance on: `film`.

    Raises:
        InputError: The film is wrong, or a folder has no units, or is neither a run nor a curve that has its distance.
    """
    from pairsim.plots.measured import draw_film

    seen, lines = film_of(film), {}
    t, d = seen.seconds - seen.seconds[0], seen.metres
    for folder in folders:
        kind, scales = kind_of(folder), scales_in(read_record(folder))
        if kind not in ("run", "curve") or scales is None:
            raise InputError(str(folder), "", None, "must be a run or a curve with a physical block, to go with a film")
        table = read_table(folder / f"{'series' if kind == 'run' else kind}.csv")
        if kind == "curve":
            if not table["d"][0] <= d[0] / scales.length <= table["d"][-1]:
                raise InputError(str(folder), "", None, "must be a curve that has the first distance of the film")
            if (motion := Motion.of(table)) is None:
                raise InputError(str(folder), "", None, "must be the curve of a pair in steady states")
            table = {"t": t / scales.time, "d": motion.path(d[0] / scales.length, t / scales.time)}
        lines[f"{kind} {folder.name}"] = scales.time * table["t"], 1e6 * scales.length * table["d"]
    return draw_film((t, 1e6 * d), lines, out, page)
