"""The pictures of a folder with the results of a question."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pairsim.computing.question import Question
from pairsim.record.folder import FIELDS_XDMF
from pairsim.runtime.errors import Argument, InputError

if TYPE_CHECKING:
    from pairsim.plots.style import Page


def page_of(
    formats: str | Sequence[str] | None, width: str | float, physical: bool | None, legend: bool, animate: bool
) -> Page:
    """The page that the options of `pairsim plot` describe: formats, width, units and legend of the pictures.

    Raises:
        InputError: An option is wrong.
    """
    from pairsim.plots.style import Page

    if animate and formats not in (None, "gif"):
        raise InputError(Argument("formats"), "", formats, "must be left out with `animate`, which makes a GIF")
    return Page.parse("png" if animate or formats is None else formats, width, physical, legend)


def draw(
    question: Question[Any], directory: Path, out: Path, page: Page, field: str | None, animate: bool
) -> list[Path]:
    """Draw the results of a question in a folder into another one; returns the files written.

    Raises:
        InputError: There is nothing to draw yet, or an option does not fit.
    """
    alone = animate or field is not None
    if alone and not question.fields_are_drawn:
        raise no_fields(question.name, field, animate)
    drawn = [] if alone else question.draw(directory, out, page)
    if alone or (question.fields_are_drawn and (directory / FIELDS_XDMF).exists()):
        from pairsim.plots.fields import draw_fields

        drawn += draw_fields(directory, out, page, curve=question.frames == "d", field=field, animated=animate)
    return drawn


def no_fields(kind: str, field: str | None, animate: bool) -> InputError:
    """The error if options ask for fields in a folder that cannot have any."""
    allowed = f"must be left out: it is for a run or a curve, not for a {kind}"
    return InputError(Argument("animate" if animate else "field"), "", field, allowed)
