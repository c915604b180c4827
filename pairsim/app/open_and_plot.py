"""Any folder of results: `open` and `plot`.

Code that draws is imported where it is used: most commands end with one small picture.
"""

from __future__ import annotations

from collections.abc import Sequence
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pairsim.app.sweep_results import SweepResult
from pairsim.computing.pictures import draw, no_fields, page_of
from pairsim.questions.registry import QUESTIONS
from pairsim.record.folder import kind_of
from pairsim.runtime.errors import Argument, InputError

if TYPE_CHECKING:
    from pairsim.plots.style import Page


def open(folder: str | PathLike[str]) -> Any:
    """Open the results of a question such as `curve`, or of `sweep`.

    Args:
        folder: The folder of results. The computation may still be running; files are read when first accessed.

    Returns:
        A result of the same type as that of the function which computed it.

    Raises:
        InputError: The folder has no results, or is that of a study, whose results are its study.csv.
    """
    path = Path(folder)
    kind = kind_of(path)
    if kind == "sweep":
        return SweepResult(path)
    if kind not in QUESTIONS:
        allowed = f"must be a folder of {', '.join(QUESTIONS)} or sweep, not of `pairsim {kind}`"
        raise InputError(str(path), "", None, allowed)
    return QUESTIONS[kind].result(QUESTIONS[kind], path)


def plot(
    *folders: str | PathLike[str],
    out: str | PathLike[str] | None = None,
    formats: str | Sequence[str] | None = None,
    width: str | float = 170.0,
    group: str | None = None,
    field: str | None = None,
    animate: bool = False,
    physical: bool | None = None,
    legend: bool = True,
    fps: float | str | None = None,
    pixel: str | None = None,
    particles: str | Sequence[object] | None = None,
) -> list[Path]:
    """Draw what a folder holds, or several runs or several curves in the same panels.

    Args:
        folders: One folder of any command; several folders of runs, or of curves; or a film, a file as for `fit`, with
            runs and curves.
        out: Where the pictures go, by default the folder itself; must be given for several folders.
        formats: "png" (the default), "pdf", "svg", or several of them; an animation is a GIF.
        width: Width of the pictures, such as "85mm"; a number is in mm.
        group: Parameter that chooses the colours, of a sweep or of several folders.
        field: Fields of a run or a curve to draw, separated by commas, or "all"; nothing else is drawn then.
        animate: Make a run's fields, or a curve's, an animation; nothing else is drawn then.
        physical: Whether to draw in um, s, um/s and Pa; by default where all cases have a `physical` block.
        legend: Whether there are a legend and the small print with the parameters.
        fps: Frames per second of a film, see `fit`.
        pixel: Size of the pixels of a film, see `fit`.
        particles: Names of the two beads of a film, see `fit`.

    Returns:
        The files written.

    Raises:
        InputError: A folder holds no results, there is nothing to draw yet, or an option is wrong or does not fit.
    """
    if not folders:
        raise InputError("pairsim plot", "", None, "must name a folder of results")
    places = [Path(folder) for folder in folders]
    films = [each for each in places if each.is_file() or each.suffix == ".csv"]
    for name, value in {"fps": fps, "pixel": pixel, "particles": particles}.items():
        if value is not None and not films:
            raise InputError("pairsim plot", Argument(name), value, "must be left out without a film")
    page = page_of(formats, width, physical, legend, animate)
    if len(places) == 1:
        return _plot_one(places[0], Path(out) if out is not None else places[0], page, group, field, animate)
    if out is None:
        raise InputError("pairsim plot", Argument("out"), None, "must be given with several folders")
    if field is not None or animate:
        name = Argument("field" if field is not None else "animate")
        raise InputError("pairsim plot", name, field, "must be left out with several folders")
    if films:
        from pairsim.lab.films.film import film_of
        from pairsim.lab.films.film_overlay import overlay_film

        if len(films) > 1 or len(films) == len(places):
            raise InputError("pairsim plot", "", str(films[-1]), "must be a single film, with runs or curves")
        film = film_of(films[0], fps=fps, pixel=pixel, particles=particles)
        return overlay_film(film, [each for each in places if each not in films], Path(out), page)
    from pairsim.plots.runs_and_curves import overlay

    return overlay(places, Path(out), page, group)


def _plot_one(
    directory: Path, target: Path, page: Page, group: str | None, field: str | None, animate: bool
) -> list[Path]:
    """Draw what one folder holds; arguments and errors are those of `plot`."""
    kind = kind_of(directory)
    if group is not None and kind != "sweep":
        allowed = f"must be left out: it is for a sweep or several folders, but {directory} holds a {kind}"
        raise InputError(Argument("group"), "", group, allowed)
    if kind in QUESTIONS:
        return draw(QUESTIONS[kind], directory, target, page, field, animate)
    if animate or field is not None:
        raise no_fields(kind, field, animate)
    if kind == "sweep":
        from pairsim.sweeps.sweep_plots import plot_sweep

        return plot_sweep(directory, target, group, page)
    from pairsim.sweeps.study_plots import plot_study

    return plot_study(directory, target, page)
