"""A film of two beads: their distance over time, from tables that trackers and spreadsheets write."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from fractions import Fraction
from os import PathLike
from pathlib import Path

import numpy as np
import pandas as pd

from pairsim.cases.quantity_text import measured, si
from pairsim.lab.films.film_table import Column, FilmTable, read_film_table
from pairsim.lab.films.headings import CENTRES, FRAME, LENGTHS, PARTICLE, SURFACES, TIME
from pairsim.lab.films.tracker_tables import Distances, deviations, distances_of, named, usual_limits
from pairsim.quantities.measurable import a_length
from pairsim.runtime.arrays import Array, Flags, Indices
from pairsim.runtime.errors import Argument, InputError
from pairsim.runtime.text import counted

PIXEL = a_length("pixel", "size of a pixel", ".65 um")
AGREE = 0.01  # relative difference of two frame rates that are the same; chosen
FAR = 100.0  # distance in diameters which no atlas reaches, and hardly any picture shows; chosen


@dataclass(frozen=True)
class Film:
    """The distance of two beads over time.

    Attributes:
        seconds: Times of the frames [s], strictly ascending, shape (frames,).
        metres: Distances in these frames [m], of the same shape: of the centres, or of the facing surfaces.
        from_centres: Whether they are those of the centres.
        pixel: Size of a pixel [m] and the half-width of its interval of 95 %, if lengths were in pixels, so that all
            `metres` are proportional to it; else None.
        notes: What was read, left out and put right, in sentences.
        path: The file.
        lines: The lines of the frames in the file, of the same shape.
    """

    seconds: Array
    metres: Array
    from_centres: bool
    pixel: tuple[float, float] | None
    notes: tuple[str, ...]
    path: Path
    lines: Indices

    def gaps(self, diameter: float) -> Array:
        """Distances [m] between the surfaces of two beads of the same diameter [m], shape (frames,).

        Raises:
            InputError: Centres are nearer than a diameter, or jump; distances are so large that their unit must be
                wrong, or a single one is.
        """
        if self.metres.min() > FAR * diameter:
            far = f"has distances of {1e6 * self.metres.min():.4g} um or more, for beads of {1e6 * diameter:.4g} um"
            wrong = "the unit, or the scale in the tracker, is wrong, such as inches or cm of a print"
            raise InputError(str(self.path), "", None, f"{far}: {wrong}")
        if self.metres.max() > FAR * diameter:
            i = int(self.metres.argmax())
            wrong = f"must be at most {FAR:g} diameters of the case, {1e6 * FAR * diameter:.4g} um, as in other frames"
            raise InputError(
                str(self.path), "distance", f"{1e6 * self.metres[i]:.4g} um", wrong, line=int(self.lines[i])
            )
        if not self.from_centres:
            return self.metres
        gaps = self.metres - diameter
        if (gaps <= 0).any():
            i = int(gaps.argmin())
            near = f"has centres {1e6 * self.metres[i]:.4g} um apart"
            wrong = f"{near}, less than the diameter of the case, {1e6 * diameter:.4g} um"
            hint = "; `pixel` or particle is wrong, or these are the centres of something else"
            raise InputError(str(self.path), "", None, wrong + hint, line=int(self.lines[i]))
        if len(gaps) > 2:
            off, between = deviations(gaps[:, None], np.diff(self.seconds)), np.diff(self.seconds)
            if (jumps := np.flatnonzero(off > usual_limits(diameter / 2, off, between))).size:
                wrong = "must not jump by more than half a diameter: one of the centres is that of another bead here"
                raise InputError(str(self.path), "", None, wrong, line=int(self.lines[jumps[0] + 1]))
        return gaps


def film_of(
    path: PathLike[str] | str,
    *,
    fps: float | str | None = None,
    pixel: str | None = None,
    particles: str | Sequence[object] | None = None,
) -> Film:
    """Read a film.

    Args:
        path: A table with times and distances, columns such as "t [s]" and "d [um]" (between surfaces) or "c [um]"
            (between centres), or of a tracker: frames, particles and their positions.
        fps: Frames per second, for frame numbers in place of times.
        pixel: Size of a pixel, which may have a half-width, such as ".65 +- .01 um" or "1.54 px/um", for lengths in
            pixels or without a unit.
        particles: Names of the two particles in a table with more, such as "3,5"; "3+7,5" joins two parts of a track.

    Raises:
        InputError: It is no such table, or an argument is missing.
    """
    if not isinstance(path, str | PathLike):
        raise InputError("pairsim fit", "film", type(path).__name__, "must be the path of a table, such as film.csv")
    rate, size = _rate(fps), _pixel(pixel)
    if particles is not None and not isinstance(particles, Iterable):
        raise InputError(Argument("particles"), "", particles, "must be two names, such as 3,5")
    table = read_film_table(Path(path))
    lengths = [each[what] for each in table.placed for what in LENGTHS if what in each]
    missing: list[InputError] = []  # arguments, all of which are asked for at once
    with _collected(missing):
        seconds, said = _seconds(table, rate)
    with _collected(missing):
        metre = _metre(table, lengths, size)
    with _collected(missing, only=Argument("particles") if missing else None):
        found, (what, *notes) = (distances_of if table.tracked else _distances)(table, particles)
    if missing:
        raise InputError.of_all(missing)
    frames = Frames(
        np.asarray(seconds.loc[found.index], dtype=float), np.asarray(found, dtype=float), found.index.to_numpy()
    )
    frames = _in_order(table, frames, lengths[0].heading, notes)
    metres = frames.d * metre
    ends = f"{1e6 * metres.min():.4g} to {1e6 * metres.max():.4g} um"
    times = f"t {frames.t[0]:.4g} to {frames.t[-1]:.4g} s"
    in_px = ""
    if size is not None:
        um, half_width = (1e6 * each for each in size)
        in_px = f" (1 px = {um:.4g}{f' +- {half_width:.2g}' if half_width else ''} um)"
    read = f"read: {table.path.name}: {counted(len(frames.t), 'frame')}, {times}{said}, {what} {ends}{in_px}"
    if table.below:
        notes.append(f"not read: numbers below the end of the table, from line {table.below} on")
    return Film(
        seconds=frames.t,
        metres=metres,
        from_centres=SURFACES not in table.columns,
        pixel=size,
        notes=(read, *notes),
        path=table.path,
        lines=frames.lines,
    )


@dataclass(frozen=True)
class Frames:
    """Distances of the frames of a film, shape (frames,) each.

    Attributes:
        t: Times [s], nan where they are not known.
        d: Distances, in the unit of the file.
        lines: The lines of the file.
    """

    t: Array
    d: Array
    lines: Indices

    def where(self, wanted: Flags | slice) -> Frames:
        """The frames that are wanted: a mask or a slice."""
        return Frames(self.t[wanted], self.d[wanted], self.lines[wanted])


@contextmanager
def _collected(errors: list[InputError], only: str | None = None) -> Iterator[None]:
    """Add an error of input to a list; with `only` given, drop it unless it is that of this argument."""
    try:
        yield
    except InputError as error:
        if only in (None, error.key):
            errors.append(error)


def _distances(table: FilmTable, particles: str | Sequence[object] | None) -> Distances:
    """The distances in a column, in its unit."""
    if particles is not None:
        raise table.error(Argument("particles"), str(particles), "must be left out: the film has distances")
    column = table.columns.get(SURFACES) or table.columns[CENTRES]
    known = table.clock.numbers.notna() & column.numbers.notna()
    if PARTICLE in table.columns:
        names = table.columns[PARTICLE].cells[known]
        if (several := names.groupby(table.clock.numbers[known]).transform("nunique") > 1).any():
            allowed = (
                f"must be that of pairs, but particles {named(names[several].unique())} have one each at one time, as "
                "diameters do"
            )
            raise table.error(column.heading, None, allowed, int(names[several].index[0]))
    gaps = column.numbers[~known].index
    left_out = [f"left out: {counted(len(gaps), 'row')} without a number, of {len(known)}: line {named(gaps)}"]
    return Distances(column.numbers[known], [column.heading, *(left_out if len(gaps) else [])])


def _rate(fps: float | str | None) -> float | None:
    """Frames per second, which may be a fraction such as 30000/1001."""
    if fps is None:
        return None
    try:
        rate = float(Fraction(re.sub(r"\s*(fps|Hz|/s|1/s)$", "", fps.strip()))) if isinstance(fps, str) else float(fps)
    except (TypeError, ValueError, ZeroDivisionError):
        rate = np.nan
    if not 0 < rate < np.inf:
        raise InputError(Argument("fps"), "", fps, "must be frames per second above 0, such as 500")
    return rate


def _pixel(pixel: str | None) -> tuple[float, float] | None:
    """Size of a pixel and its half-width [m]."""
    if pixel is None:
        return None
    pixel = str(pixel)
    try:
        if inverse := re.fullmatch(r"(.*?)\s*(?:px|pix|pixels?)\s*(?:/|per)\s*([^\W\d]+)(.*)", pixel):
            text, unit, rest = inverse.groups()  # as ImageJ gives its scale
            number, half_width = measured(f"{text} {unit}{rest}", PIXEL)
            length = si(f"1 {unit}", PIXEL) ** 2 / number
            return length, length * half_width / number
        return measured(re.sub(r"\s*(?:/|per)\s*(?:px|pix|pixels?)\b", "", pixel), PIXEL)
    except ValueError as error:
        raise InputError(Argument("pixel"), "", pixel, str(error)) from None


def _seconds(table: FilmTable, rate: float | None) -> tuple[pd.Series[float], str]:
    """Times of the rows [s], by line, and a phrase on where they come from."""
    t, frame = table.columns.get(TIME), table.columns.get(FRAME)
    if t is not None and np.isnan(t.size) and (t.unit or rate is not None):
        frame, t = frame or t, None
    if t is not None and np.isnan(t.size):
        raise table.error(
            t.heading, None, "must be a column with its unit, such as t [s], or have frame numbers, with `fps`"
        )
    if t is not None and rate is None:
        if frame is not None and frame.numbers.nunique() > 1:
            same = t.numbers.nunique() == 1
            if same or (t.size == 1 and t.numbers.equals(frame.numbers)):
                unset = "is the same in all rows" if same else "counts frames, at one per second"
                raise table.error(
                    Argument("fps"), None, f"must be given: {t.heading} {unset}, as where no interval is set"
                )
        said = "" if frame is None else f' (column "{t.heading}": {_rate_of(t, frame):.4g} frames per second)'
        return t.numbers * t.size, said
    if frame is None:
        of = "" if t is None else f', column "{t.heading}"'
        raise table.error(Argument("fps"), f"{rate:g}", f"must be left out: the film has times{of}")
    if rate is None:
        raise table.error(Argument("fps"), None, f'must be given: the film has frame numbers, column "{frame.heading}"')
    wrong = frame.numbers[frame.numbers % 1 > 0]
    if len(wrong):
        line = int(wrong.index[0])
        raise table.error(frame.heading, wrong.iloc[0], "must be whole, as frame numbers are, with `fps`", line)
    said = f" ({rate:g} frames per second)"
    if t is not None:
        own = _rate_of(t, frame)
        if abs(own / rate - 1) > AGREE:
            said = f' ({rate:g} frames per second; column "{t.heading}", which says {own:.4g}, is not read)'
    return frame.numbers / rate, said


def _rate_of(t: Column, frame: Column) -> float:
    """Frames per second by a column of times and one of frames."""
    steps = pd.DataFrame({"frame": frame.numbers, "t": t.numbers * t.size}).drop_duplicates("frame").diff()
    rates = (steps["frame"] / steps["t"])[steps["t"] != 0]
    return float(rates.median())


def _metre(table: FilmTable, lengths: Sequence[Column], size: tuple[float, float] | None) -> float:
    """The unit of lengths [m], which all columns share."""
    units = {each.unit: each for each in reversed(lengths)}
    first = lengths[0]
    if len(units) > 1 and "" in units:  # y without a unit has that of x
        units.pop("")
    unit, column = next(iter(units.items()))
    if len(units) > 1:
        raise table.error(
            first.heading, None, f"must have the same unit as other lengths, but these have {', '.join(units)}"
        )
    if unit not in ("", "px"):
        if size is not None:
            raise table.error(Argument("pixel"), None, f'must be left out: "{column.heading}" is in {unit}')
        return column.size
    if size is None and not unit and not table.tracked:
        allowed = "must be a column with its unit, such as d [um], or be in pixels, with `pixel`"
        raise table.error(column.heading, None, allowed)
    if size is None:
        given = "is in px" if unit else "has no unit"
        hint = "such as '.65 +- .01 um'" if unit else "such as '.65 +- .01 um' if it is in px, or 1um if it is in um"
        raise table.error(Argument("pixel"), None, f'must be given, {hint}: "{column.heading}" {given}')
    return size[0]


def _in_order(table: FilmTable, frames: Frames, heading: str, notes: list[str]) -> Frames:
    """The frames in ascending time, those of one time as their mean.

    Args:
        table: The table of the film.
        frames: Its frames.
        heading: The heading of the distances.
        notes: Sentences, to which those on what was done are added.
    """
    clock = table.clock.heading
    if untimed := int(np.isnan(frames.t).sum()):
        notes.append(f"left out: {counted(untimed, 'frame')} without a time")
        frames = frames.where(~np.isnan(frames.t))
    if not len(frames.t):
        raise table.error(heading, None, "must have numbers below it, beside times")
    if (wrong := np.flatnonzero(frames.d <= 0)).size:
        why = "must be above 0: particles are swapped, or surfaces overlap"
        raise table.error(heading, f"{frames.d[wrong[0]]:g}", why, int(frames.lines[wrong[0]]))
    steps = np.diff(frames.t)
    if len(frames.t) > 1 and (steps < 0).all() and not table.tracked:
        notes.append("reversed: rows are in descending order of time")
        frames, steps = frames.where(slice(None, None, -1)), -steps[::-1]
    if (back := np.flatnonzero(steps < 0)).size:
        before, t = frames.t[back[0] : back[0] + 2]
        allowed = f"must not step back: the row before has {before:.6g} s"
        raise table.error(clock, f"{t:.6g} s", allowed, int(frames.lines[back[0] + 1]))
    if (steps > 0).all():
        return frames
    if not steps.any():
        raise table.error(clock, f"{frames.t[0]:g} s", "must not be the same in all rows")
    return _merged(table, frames, notes)


def _merged(table: FilmTable, frames: Frames, notes: list[str]) -> Frames:
    """Frames in the order of their times, in which several of one time are replaced by their mean."""
    several = pd.DataFrame(vars(frames)).groupby("t")
    means = several.agg(d=("d", "mean"), line=("lines", "first"), spread=("d", np.ptp), size=("d", "size"))
    alone = means["d"][means["size"] == 1]
    usual = float(np.abs(np.diff(alone if len(alone) > 1 else means["d"])).max(initial=0.0))
    if len(far := means[means["spread"] > usual]):
        t, line = far.index[0], int(far["line"].iloc[0])
        both = named(f"{each:g}" for each in frames.d[frames.t == t])
        allowed = f"must have one distance at a time, but has {both}, which differ by more than those of neighbours"
        raise table.error(table.clock.heading, f"{t:.6g} s", allowed, line)
    merged = counted(len(frames.t) - len(means), "row")
    notes.append(f"merged: {merged} with the time of another one, into their mean")
    return Frames(means.index.to_numpy(float), means["d"].to_numpy(float), means["line"].to_numpy())
