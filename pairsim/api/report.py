"""One HTML file that holds all of a folder's results: `report`."""

from __future__ import annotations

import base64
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from importlib import resources
from os import PathLike
from pathlib import Path

import jinja2

from pairsim.api.pictures import plot
from pairsim.api.report_content import Content, content_of
from pairsim.commands import COMMANDS
from pairsim.plots.fields import draw_fields, frame_count
from pairsim.plots.style import Page
from pairsim.results.output import REPORT, write_text
from pairsim.runtime.errors import InputError
from pairsim.runtime.version import __version__

CAPTIONS = {
    **{name: words for command in COMMANDS.values() for name, words in command.captions.items()},
    "fields": "What the particles change in the liquid, and the axial elastic stress in soft ones",
    "field-streamlines": "Streamlines in the frame of the particles",
    "sweep_series": "All cases over time",
    "sweep_curves": "All curves",
    "sweep_parameters": "Relative velocity at the end over a parameter",
    "sweep_zeros": "Zeros of the relative velocity over a parameter",
    "sweep_map": "How the cases ended",
    "study": "Error against wall time",
}
"""What is said below pictures, by the names of their files."""
WIDE, NARROW = 170.0, 85.0  # mm
FIELDS = 100.0  # mm; the same file serves wide and narrow screens
TYPES = {".svg": "image/svg+xml", ".png": "image/png"}


def report(folder: str | PathLike[str]) -> Path:
    """Write report.html into a folder: answer, pictures, table, failures, warnings and provenance in one file.

    The file needs no network and no other file. One that is there is replaced: it holds nothing that cannot be made
    again.

    Args:
        folder: A folder of run, curve, critical, sweep or study; it may be unfinished or that of a failure.

    Returns:
        The file.

    Raises:
        InputError: The folder holds no results of pairsim, or cannot be written to.
    """
    directory = Path(folder)
    content = content_of(directory)
    pictures, notes = _pictures(directory, content)
    source = resources.files("pairsim.api").joinpath("templates", "report.html.j2").read_text(encoding="utf-8")
    template = jinja2.Environment(autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True).from_string(
        source
    )
    written = time.strftime("%Y-%m-%d %H:%M:%S %z")
    page = template.render(content=content, pictures=pictures, notes=notes, version=__version__, written=written)
    path = directory / REPORT
    try:
        write_text(path, page)
    except OSError as error:
        raise InputError(str(path), "", None, f"cannot be written ({error.strerror or error})") from error
    return path


@dataclass(frozen=True)
class Picture:
    """A picture of the report.

    Attributes:
        caption: What it shows.
        data: As a data URI.
        narrow: The same for a narrow screen, "" where `data` does for it.
    """

    caption: str
    data: str
    narrow: str


def _pictures(directory: Path, content: Content) -> tuple[list[Picture], list[str]]:
    """Every picture, and why some are missing."""
    wide, notes = _drawn(directory, content.kind, WIDE)
    narrow, _ = _drawn(directory, content.kind, NARROW)
    return [Picture(CAPTIONS.get(name, name), data, narrow.get(name, "")) for name, data in wide.items()], notes


def _drawn(directory: Path, kind: str, width: float) -> tuple[dict[str, str], list[str]]:
    """Data URIs by the names of the pictures, and why some are missing."""
    found: dict[str, str] = {}
    notes = []
    with tempfile.TemporaryDirectory() as name:
        for draw in _drawings(directory, Path(name), kind, width):
            try:
                files = draw()
            except InputError as error:
                notes.append(f"No picture: {error.key or Path(error.file).name}: {error.allowed}.")
                continue
            for file in files:
                data = base64.b64encode(file.read_bytes()).decode("ascii")
                found[file.stem] = f"data:{TYPES[file.suffix]};base64,{data}"
    return found, notes


def _drawings(directory: Path, out: Path, kind: str, width: float) -> list[Callable[[], list[Path]]]:
    """What draws a folder: lines as SVG, fields, which are pixels anyway, as PNG."""
    lines, pixels = Page(("svg",), width), Page(("png",), FIELDS, dpi=225.0)
    if kind not in COMMANDS:
        return [lambda: plot(directory, out=out, formats="svg", width=width)]
    command = COMMANDS[kind]
    drawings = [lambda: command.draw(directory, out, lines)]
    if command.frames and width == WIDE and frame_count(directory):
        curve = command.frames == "d"
        drawings += [
            lambda: draw_fields(directory, out, pixels, curve=curve),
            lambda: draw_fields(directory, out, pixels, curve=curve, field="streamlines"),
        ]
    return drawings
