"""A film of two beads: times and distances from tables that cameras' trackers and spreadsheets write."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from io import StringIO
from pathlib import Path

import numpy as np
import pandas as pd

from pairsim.api.rheometer_files import text_of
from pairsim.cases.quantities import unit_in
from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import InputError


@dataclass(frozen=True)
class Film:
    """The distance of two beads over time.

    Attributes:
        seconds: Times of the frames [s], strictly ascending, shape (frames,).
        metres: Distances in these frames [m], of the same shape: of the centres, or of the facing surfaces.
        from_centres: Whether they are those of the centres.
        pixel: Size of a pixel [m] and the half-width of its interval of 95 %, if lengths were in pixels: all
            `metres` are proportional to it.
        notes: What was read, left out and put right, in sentences.
    """

    seconds: Array
    metres: Array
    from_centres: bool = False
    pixel: tuple[float, float] | None = None
    notes: tuple[str, ...] = ()

    def gaps(self, diameter: float) -> Array:
        """Distances between the surfaces of beads of one diameter [m] in metres, shape (frames,)."""
        return self.metres - diameter if self.from_centres else self.metres


def film_of(
    path: Path | str,
    *,
    fps: float | None = None,
    pixel: str | None = None,
    particles: Sequence[int | str] | None = None,
) -> Film:
    """Read a film; spreadsheets write semicolons and decimal commas.

    Args:
        path: A table with columns of times and distances, or of a tracker: frames, particles and their positions.
        fps: Frames per second, for tables with frame numbers in place of times.
        pixel: Size of a pixel, which may have a half-width, such as ".65 +- .01 um", for lengths in pixels.
        particles: Names of the two beads in a table with more than two.

    Raises:
        InputError: It is no such table, or an option is missing.
    """
    film = Path(path)
    if not film.exists():
        raise InputError(str(film), "", None, "no such file")
    try:
        text = text_of(film)
        separator = next((each for each in "\t;" if each in text.partition("\n")[0]), ",")
        table = pd.read_csv(StringIO(text), sep=separator, decimal="." if separator == "," else ",")
    except ValueError as error:
        raise InputError(str(film), "", None, f"must be a table such as one of t [s], d [um] ({error})") from None
    found = []
    for name, unit in (("t", "s"), ("d", "m")):
        heading = next((each for each in map(str, table) if re.fullmatch(rf"\s*{name}\s*\[.+\]\s*", each)), "")
        if not heading:
            raise InputError(str(film), name, None, f"must be a column with its unit, such as {name} [{unit}]")
        values = pd.to_numeric(table[heading], errors="coerce")
        if values.empty:
            raise InputError(str(film), heading.strip(), None, "must have numbers below it")
        if not np.isfinite(values).all():
            wrong = int(np.flatnonzero(~np.isfinite(values))[0])
            raise InputError(f"{film}:{wrong + 2}", heading.strip(), table[heading].iloc[wrong], "must be a number")
        try:
            size = unit_in(unit, heading.partition("[")[2].strip(" ]"))
        except ValueError as error:
            raise InputError(str(film), heading.strip(), None, str(error)) from None
        found.append(values.to_numpy(dtype=float) * size)
    seconds, metres = (each[np.argsort(found[0])] for each in found)
    return Film(seconds, metres)
