"""The modulus of two beads, or the relaxation time of their liquid, from films of their distance: `fit`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from pairsim.atlas.atlas import Atlas
from pairsim.cases.case import SceneCase
from pairsim.cases.inputs import inputs_of
from pairsim.cases.physical import DIFFERENCE, QUANTITIES, with_deviations
from pairsim.cases.quantity_text import as_given, measured, percentage, si, unit_in
from pairsim.computing.loading import AnyCase, content_of
from pairsim.lab.ask_atlas import asked_of
from pairsim.lab.films.film import Film, film_of
from pairsim.lab.films.film_model import NORMAL, FilmModel, Seen, Uncertain
from pairsim.lab.films.fit_search import LEAST, Search, near_films
from pairsim.quantities.measurable import Measurable
from pairsim.quantities.scales import Scales
from pairsim.runtime.arrays import Array, Flags
from pairsim.runtime.errors import InputError
from pairsim.runtime.plain import Plain

GIVES = {"modulus": ("Ca_e", -1), "relaxation": ("De", 1)}
"""Quantities that may be unknown; for each the number that follows from it, and the power of the quantity in this."""
MIDDLE = 0.5  # unknown number over its largest value in the atlas, in the case that is checked; any would do
WIDE = 2.0  # ratio of an end of an interval to the value above which data are said not to determine it; chosen
CHANCE = 3.0  # standard errors that the correlation of neighbouring residuals may have by chance; chosen
UNKNOWN_DIFFERENCE = 0.1  # half-width of the difference of two diameters over their mean, if nothing is known of it


class Value(NamedTuple):
    """A quantity, the lower and the upper end of its interval of 95 %, and their unit."""

    value: float
    least: float
    most: float
    unit: str


@dataclass(frozen=True)
class FilmFit:
    """A fit to films.

    Attributes:
        values: By quantity, its value, the lower and the upper end of its interval of 95 %, and their unit.
        times: Times of the frames that were used [s], shape (frames,); of several films, one after the other.
        distances: Distances between the surfaces in these frames [um], of the same shape.
        fitted: Those of the model [um], of the same shape.
        alike: Correlation of the residuals of neighbouring frames, which do not contain what errors of the atlas and
            other uncertain inputs explain.
        cut: The quantities whose interval ends because the atlas does.
        parts: Contribution of each uncertain input, by name, to the half-width of each quantity, over its value and to
            first order: the root of the difference of the squares of the half-widths with the input uncertain and with
            it exactly known; "noise" is what would remain if all were known.
        equal: As `values`, for beads whose diameters are equal; empty where their difference is given.
        difference: Difference of the diameters, leading less trailing over their mean, and its half-width, as fitted.
        left_out: Number of frames that were left out as outliers.
        notes: What was read, and what the intervals do not contain, in sentences.
    """

    values: Mapping[str, Value]
    times: Array
    distances: Array
    fitted: Array
    alike: float
    cut: frozenset[str] = frozenset()
    parts: Mapping[str, Mapping[str, float]] | None = None
    equal: Mapping[str, Value] | None = None
    difference: tuple[float, float] = (0.0, 0.0)
    left_out: int = 0
    notes: tuple[str, ...] = ()

    @property
    def residuals(self) -> Array:
        """Distances of the model less those of the frames [um], shape (frames,)."""
        return self.fitted - self.distances

    def plot(self, out: Path | str) -> list[Path]:
        """Draw film and fitted motion over time, and the residuals: film.png in a folder."""
        from pairsim.lab.pictures import draw_film
        from pairsim.plots.style import Page

        film, fitted = (self.times, self.distances), (self.times, self.fitted)
        return draw_film(film, {"fit": fitted}, Path(out), Page())

    def __str__(self) -> str:
        return "\n".join(self._sentences())

    def _sentences(self) -> Iterator[str]:
        for name, found in self.values.items():
            cut = "; the interval ends where the atlas does, values beyond were not considered" * (name in self.cut)
            yield f"{name} = {_interval(found)}{cut}"
            largest = sorted((self.parts or {}).get(name, {}).items(), key=lambda item: -item[1])
            sizes = [(part, f"+- {100 * half:.2g} %" if half < 1 else "> 100 %") for part, half in largest]
            said = [
                f"{part} {size}"
                for (part, size), (_, half) in zip(sizes, largest, strict=True)
                if 10 * half > largest[0][1]
            ]
            if np.isfinite(found.most) and said:
                yield f"  by {', '.join(said)}"
        size, half_width = (100 * each for each in self.difference)
        if size and not half_width:
            side = "larger" if size > 0 else "smaller"
            yield f"The leading bead is taken to be {abs(size):.4g} % {side} than the trailing one, as the case says."
        if half_width:
            yield (
                f"The leading bead is {abs(size):.2g} +- {half_width:.2g} % {'larger' if size > 0 else 'smaller'} than "
                "the trailing one, as fitted."
            )
        for name, found in (self.equal or {}).items():
            yield (
                f"If the diameters are equal (particle_difference: 0 % in the physical block), {name} = "
                f"{_interval(found)}."
            )
        frames = f"{len(self.times)} frames, off by {self.residuals.std():.2g} um (standard deviation)"
        yield frames + (f"; {self.left_out} more are outliers and were left out" if self.left_out else "")
        if self.alike > CHANCE / np.sqrt(len(self.times)):
            yield "A bad fit: neighbouring frames are off in the same direction, so the model does not describe them."
        yield from self.notes


def _interval(found: Value) -> str:
    """A value and its interval in words."""
    wide = found.most > WIDE * found.value or found.value > WIDE * found.least
    unknown = ": these data do not determine it" if wide else ""
    return f"{found.value:.4g} {found.unit}, 95 %: {found.least:.4g} to {found.most:.4g}{unknown}"


def fit(
    film: Path | str,
    case: AnyCase,
    *,
    unknown: str | Sequence[str] = "modulus",
    exchanged: Path | str | None = None,
    atlas: Path | str | None = None,
    fps: float | str | None = None,
    pixel: str | None = None,
    particles: str | Sequence[object] | None = None,
) -> FilmFit:
    """Fit quantities of an experiment to a film of two beads of one material, whose diameters may differ slightly.

    The model is the motion along the curve of an atlas from an unknown first distance, with a start-up transient: a sum
    of exponentials in time, with the slowest decay time at the values that are tried, and shorter ones. The intervals
    contain all that is not known exactly: noise, which follows from the scatter of the film; quantities of the case
    with half-widths; the size of a pixel; the atlas; and the difference of the two diameters, which is unknown unless
    the case has `particle_difference`. Intervals are those of the profile likelihood (Bates and Watts 1988, chapter 6).
    Where values on both sides of a turning point give nearly the same film, the limit of the sum of squares is that of
    two numbers.

    Args:
        film: Table with times and distances, columns such as "t [s]" and "d [um]", or of a tracker; see `film_of`.
        case: The experiment. What is unknown may be left out of its `physical` block; a value that is there gives
            the unit of the answer, and nothing else.
        unknown: "modulus", "relaxation" or both.
        exchanged: A second film of the same beads, in which the other one leads, or the flow is reversed.
        atlas: File of an atlas; None: those that ship.
        fps: Frames per second, for a film with frame numbers in place of times.
        pixel: Size of a pixel, such as ".65 +- .01 um", for lengths in pixels.
        particles: Names of the two beads in a film with more, such as "3,5".

    Raises:
        InputError: A file or key is wrong, or the atlas has no answer for the case.
    """
    unknown = _unknown(unknown)
    chosen, asked, units, difference = _case_of(case, unknown, atlas)
    given = [film, *([exchanged] if exchanged is not None else [])]
    films = [film_of(path, fps=fps, pixel=pixel, particles=particles) for path in given]
    paths = [each.path for each in films]
    model, notes = _model_of(films, paths, chosen, asked, unknown, difference)
    numbers = [GIVES[name][0] for name in unknown]
    with near_films(film):
        search = Search.of(model, numbers)
        seen = np.concatenate([each.distances for each in model.films])
        fitted = search.found.residuals + seen
        if not (chosen.d[0] < fitted.min() and fitted.max() < chosen.d[-1]):
            raise InputError(
                str(film), "", None, "the motion that fits best leaves the range of distances of the atlas"
            )
        equal = {}
        if model.difference == (0.0, UNKNOWN_DIFFERENCE):
            of_equals = Search.of(replace(model, difference=(0.0, 0.0)), numbers, search.likelihood.noise)
            equal = _values(of_equals, unknown, units, asked)
        used: Flags = search.likelihood.used
        um = 1e6 * _scales(asked).length
        return FilmFit(
            values=_values(search, unknown, units, asked),
            times=np.concatenate([each.seconds for each in films])[used],
            distances=um * seen[used],
            fitted=um * fitted[used],
            alike=search.alike,
            cut=_cut(search, unknown),
            parts=dict(zip(unknown, search.parts, strict=True)),
            equal=equal,
            difference=search.difference,
            left_out=int(np.count_nonzero(~used)),
            notes=(*dict.fromkeys(note for each in films for note in each.notes), *notes),
        )


def _unknown(names: str | Sequence[str]) -> list[str]:
    """The unknown quantities, each once.

    Raises:
        InputError: There is none, or one that cannot be fitted to films.
    """
    found = list(dict.fromkeys([names] if isinstance(names, str) else names))
    found = [*GIVES] if found == ["both"] else found
    if not found or not {*found} <= GIVES.keys():
        raise InputError("pairsim fit", "unknown", ", ".join(found), f"allowed: {', '.join(GIVES)}, both")
    return found


def _cut(search: Search, unknown: Sequence[str]) -> frozenset[str]:
    """The unknown quantities whose interval ends where the atlas does."""
    ends = zip(unknown, search.reach, search.likelihood.bounds, strict=True)
    return frozenset(name for name, (_, log), (_, end) in ends if log >= end)


def _values(search: Search, unknown: Sequence[str], units: Sequence[str], case: SceneCase) -> dict[str, Value]:
    """The unknown quantities with their intervals, in the given units."""
    found = {}
    for name, unit, log, reach in zip(unknown, units, search.found.logs, search.reach, strict=True):
        number, power = GIVES[name]
        of = QUANTITIES[name]
        size = unit_in(of.unit, unit)

        def quantity(value: float, of: Measurable = of, size: float = size, power: int = power) -> float:
            return (value / of.number(size, _scales(case))) ** power

        ends = [quantity(float(np.exp(each))) for each in reach]
        if reach[0] <= np.log(LEAST * search.model.atlas.box[number][1]):  # it holds rigid beads, or a Newtonian liquid
            ends[0] = np.inf if power < 0 else 0.0
        least, most = sorted(ends)
        found[name] = Value(quantity(float(np.exp(log))), least, most, unit)
    return found


def _model_of(
    films: Sequence[Film],
    paths: Sequence[Path],
    atlas: Atlas,
    case: SceneCase,
    unknown: Sequence[str],
    difference: tuple[float, float],
) -> tuple[FilmModel, list[str]]:
    """The model of the films in the units of the case, and sentences on what the intervals do not contain.

    Raises:
        InputError: A film has too few frames, or distances that such beads cannot have.
    """
    scales, beta, notes = _scales(case), case.betas[0], []
    numbers = {"beta": beta, "De": case.De, "Ca_e": case.Ca_es[0]}
    seen: list[Seen] = []
    for film, path in zip(films, paths, strict=True):
        least = len(unknown) + 3
        if len(film.seconds) < least:
            raise InputError(str(path), "", None, f"must have at least {least} frames; has {len(film.seconds)}")
        whole = film.metres / scales.length
        gaps = film.gaps(beta * scales.length) / scales.length
        times = (film.seconds - film.seconds[0]) / scales.time
        pixel = film.pixel[1] / film.pixel[0] if film.pixel else 0.0
        seen.append(Seen(times, gaps, whole if film.from_centres else None, pixel, len(seen) > 0))
    uncertain = []
    for each in inputs_of(case):
        if not each.half_width or each.key in unknown:
            continue
        if more := [
            name for name, change in each.changes.items() if change and name not in (*numbers, "length", "velocity")
        ]:
            notes.append(
                f"The intervals do not include how the half-width of {each.key} changes the film by {', '.join(more)}."
            )
        powers = {
            name: change / numbers.get(name, 1.0) for name, change in each.changes.items() if numbers.get(name, 1.0)
        }
        uncertain.append(Uncertain(each.key, each.half_width / each.value, powers))
    if atlas.at(**numbers).by_difference is None:
        difference = (0.0, 0.0)
        notes.append("This atlas lacks the effect of a difference of the diameters: they are taken to be equal.")
    return FilmModel(atlas, numbers, seen, uncertain, difference), notes


def _case_of(
    case: AnyCase, unknown: Sequence[str], file: Path | str | None
) -> tuple[Atlas, SceneCase, list[str], tuple[float, float]]:
    """The atlas and the case for a fit.

    Returns:
        The atlas; the case, made one of two equal beads whose unknown numbers are in the middle of the atlas; the units
        of the answers; and the difference of the diameters over their mean with its half-width.

    Raises:
        InputError: The case has no units, or the atlas has no answer.
    """
    content = content_of(case)
    block = content.get("physical")
    if not isinstance(block, Mapping):
        raise InputError("pairsim fit", "physical", None, "must be given: the quantities of the experiment")
    others, difference = _difference_of(block)
    if not {"distance", "d", "d0"} & {*block, *content}:  # films have it
        others["distance"] = QUANTITIES["distance"].example
    numbers = {GIVES[name][0] for name in unknown if name not in block and "young" not in block}
    if numbers & content.keys():  # as in a case that was made without the unknown quantities
        case = {key: value for key, value in content.items() if key not in numbers}
    values, units = {}, []
    for name in unknown:
        of = QUANTITIES[name]
        given = block.get(name) or of.example
        units.append(as_given(str(given[0] if isinstance(given, list) else given))[1])
        values[name] = si(of.example, of)
    for _ in range(2):  # the second time with numbers in the middle of the atlas
        replaced = others | {name: f"{value:.15g} {QUANTITIES[name].unit}" for name, value in values.items()}
        if "modulus" in replaced and "young" in block:
            replaced["young"] = None
        atlas, asked, reasons = asked_of(case, atlas=file, physical=replaced)
        for name in unknown:
            number, power = GIVES[name]
            now = QUANTITIES[name].number(values[name], _scales(asked))
            values[name] *= (MIDDLE * atlas.box[number][1] / now) ** power if atlas.box[number][1] else 1.0
    if reasons:
        why = f"the atlas has no answer: {' and '.join(reasons)}; for other beads and liquids pairsim atlas makes one"
        raise InputError("pairsim fit", "", None, f"{why}, which --atlas takes")
    return atlas, asked, units, difference


def _difference_of(block: Mapping[str, Plain]) -> tuple[dict[str, str | None], tuple[float, float]]:
    """Keys of a `physical` block that make the diameters equal, and their difference with its half-width.

    Raises:
        InputError: It is no percentage.
    """
    particle, given = block.get("particle"), block.get(DIFFERENCE.key)
    if given is not None:
        try:
            return {DIFFERENCE.key: None}, percentage(given)
        except ValueError as error:
            raise InputError("case", f"physical.{DIFFERENCE.key}", given, str(error)) from None
    if isinstance(particle, list | tuple) and len(particle) == 2:
        with suppress(ValueError):  # wrong ones are named where the case is checked
            trailing, leading = (si(each, QUANTITIES["particle"]) for each in particle)
            mean = (trailing + leading) / 2
            if leading != trailing:
                return {"particle": f"{mean:.15g} m"}, ((leading - trailing) / mean, 0.0)
    of, apart = QUANTITIES["particle"], with_deviations(block)
    if (each := apart.get(of.deviation.key)) is not None:  # two beads drawn from many
        with suppress(ValueError):
            deviation = si(each, of) / measured(apart["particle"], of)[0]
            return {"particle": str(apart["particle"])}, (0.0, NORMAL * 2**0.5 * deviation)
    return {}, (0.0, UNKNOWN_DIFFERENCE)


def _scales(case: SceneCase) -> Scales:
    """The units of a case with a `physical` block."""
    assert case.scales is not None
    return case.scales
