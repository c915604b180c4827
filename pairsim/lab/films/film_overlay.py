"""A film of two beads beside runs and curves, for a picture."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from scipy.integrate import cumulative_trapezoid

from pairsim.analysis.master_curve import Curve
from pairsim.analysis.time_series import Series
from pairsim.lab.films.film import Film
from pairsim.lab.load import load
from pairsim.record.columns import DISTANCE, Z
from pairsim.record.folder import kind_of
from pairsim.record.record import Record
from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import InputError

if TYPE_CHECKING:
    from pairsim.plots.style import Page


def overlay_film(film: Film, folders: Sequence[Path], out: Path, page: Page) -> list[Path]:
    """Draw `film`: a film, runs from their start on, and motions along curves from the film's first distance on.

    If the film has the distances between the centres, those of film and models are shown less the mean diameter of the
    beads of the first folder. Along a curve these count from the first frame on.

    Raises:
        InputError: A folder has no units, or is neither the run of a pair nor a curve that has the first distance of
            the film.
    """
    from pairsim.lab.pictures import draw_film

    t, d = film.seconds - film.seconds[0], film.metres
    diameter = None  # of the beads of a film of centres [m]
    lines: dict[str, tuple[Array, Array]] = {}
    for folder in folders:
        kind, scales = kind_of(folder), Record.read(folder).scales
        if kind not in ("run", "curve") or scales is None:
            raise InputError(str(folder), "", None, "must be a run or a curve with a physical block, to go with a film")
        if film.from_centres and diameter is None:
            diameter = float(np.mean(load(folder / "case.yaml", kind=kind).betas)) * scales.length
            d = film.gaps(diameter)
        if kind == "curve":
            times = t / scales.time
            distances = _along_curve(folder, d[0] / scales.length, times, film.from_centres)
        else:
            times, distances = _of_run(folder, None if diameter is None else diameter / scales.length)
        lines[f"{kind} {folder.name}"] = scales.time * times, 1e6 * scales.length * distances
    return draw_film((t, 1e6 * d), lines, out, page)


def _of_run(folder: Path, diameter: float | None) -> tuple[Array, Array]:
    """Times [D_c/U_av] and distances [D_c] of a run, of its surfaces, or of its centres less a diameter [D_c].

    Raises:
        InputError: It is not the run of a pair.
    """
    series = Series.read(folder)
    if series.gaps != [""]:
        raise InputError(str(folder), "", None, "must be the run of a pair, to go with a film")
    if diameter is None:
        return series.t, series.d()
    leading, trailing = (series.table.of(Z, side) for side in ("_L", "_T"))
    return series.t, leading - trailing - diameter


def _along_curve(folder: Path, start: float, times: Array, centres: bool) -> Array:
    """Distances [D_c] by the curve of a folder, from a first one on, at times [D_c/U_av], shape (times,).

    They are those of the surfaces, or, with `centres`, what those of the centres become if they change from the first
    one on.

    Raises:
        InputError: It is no curve that has the first distance.
    """
    curve = Curve.read(folder)
    if (d := curve.table.known(DISTANCE)) is not None and not d[0] <= start <= d[-1]:
        raise InputError(str(folder), "", None, "must be a curve that has the first distance of the film")
    if curve.motion is None:
        raise InputError(str(folder), "", None, "must be the curve of a pair in steady states")
    distances = curve.motion.path(start, times)
    if not centres:
        return distances
    return start + np.asarray(cumulative_trapezoid(curve.motion.stretch(distances), distances, initial=0))
