"""What all pictures share: size, fonts, colours, line styles, the legend, the small print and the files."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from contextlib import ContextDecorator, contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import matplotlib as mpl
from cycler import cycler
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg, RendererAgg
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.legend import Legend

from pairsim.results.output import make_folder, part_of
from pairsim.runtime.errors import InputError

FORMATS = ("png", "pdf", "svg")
MOVIES = ("mp4", "gif")
"""Kinds of animations."""
MM = 1 / 25.4  # inches
NARROW = 120.0  # mm; panels of narrower pictures lie below each other
LEAST_WIDTH, MOST_WIDTH = 50.0, 400.0  # mm
SMALL = 6.0  # points

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
"""Okabe and Ito's colours without the yellow one, which is faint on white."""
LINES: tuple[Any, ...] = ("-", (0, (4, 1.5)), (0, (1, 1.2)), (0, (5, 1.2, 1, 1.2)))
MARKERS = "os^Dv<>P"
SEQUENTIAL, DIVERGING = "cividis", "RdBu_r"
ORDERED = ListedColormap(mpl.colormaps["viridis"](range(0, 236)))  # without its yellow end
GREY = "0.72"

PRINT: Any = {
    # STIX comes with matplotlib and fits the Times of most journals: pictures are the same on every machine.
    "font.family": "STIXGeneral",
    "mathtext.fontset": "stix",
    "font.size": 8,
    "axes.labelsize": 8,
    "axes.titlesize": 8,
    "xtick.labelsize": 7,
    "ytick.labelsize": 7,
    "legend.fontsize": 7,
    "legend.title_fontsize": 7,
    "legend.frameon": False,
    "legend.handlelength": 2.4,
    "legend.columnspacing": 1.2,
    "legend.borderaxespad": 0.2,
    "lines.linewidth": 1.1,
    "lines.markersize": 3.5,
    "lines.markeredgewidth": 0.8,
    "axes.linewidth": 0.6,
    "axes.prop_cycle": cycler(color=COLOURS),
    "axes.formatter.use_mathtext": True,
    "axes.formatter.limits": (-2, 4),
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "0.92",
    "grid.linewidth": 0.5,
    "xtick.direction": "in",
    "ytick.direction": "in",
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "image.cmap": SEQUENTIAL,
    "figure.dpi": 300,
    "pdf.fonttype": 42,  # TrueType: journals refuse the default, Type 3
    "svg.fonttype": "path",  # looks the same where the fonts are missing
    "svg.hashsalt": "pairsim",  # the same picture is the same file
}
"""The style; everything that draws does so under `printing`."""


def printing() -> ContextDecorator:
    """The style, as a decorator of whatever draws."""
    return mpl.rc_context(PRINT)


@contextmanager
def picture_file(path: Path) -> Iterator[Path]:
    """Temporary name of a picture with the same ending, which becomes its name when the block has written it.

    Raises:
        InputError: The file cannot be written.
    """
    part = part_of(path).with_suffix(path.suffix)  # writers of animations go by the ending
    try:
        yield part
        part.replace(path)
    except OSError as error:
        raise InputError(str(path), "-o", None, f"cannot be written ({error.strerror or error})") from error
    finally:
        with suppress(OSError):  # on a file system that is read-only
            part.unlink(missing_ok=True)


@dataclass(frozen=True)
class Page:
    """What pictures are drawn for.

    Attributes:
        formats: Kinds of files.
        width: Width in mm.
        dpi: Pixels by inch, of PNG and of what is made of pixels in PDF and SVG.
    """

    formats: tuple[str, ...] = ("png",)
    width: float = 170.0
    dpi: float = 300.0

    @staticmethod
    def parse(formats: str | Sequence[str] = "png", width: str | float = 170.0, known: Sequence[str] = FORMATS) -> Page:
        """A page from words.

        Args:
            formats: Kinds of files, separated by commas if they are one text.
            width: mm as a number, or text such as "85mm".
            known: What `formats` may be.

        Raises:
            InputError: A format is unknown, or the width is not between `LEAST_WIDTH` and `MOST_WIDTH`.
        """
        names = formats.split(",") if isinstance(formats, str) else list(formats)
        chosen = tuple(dict.fromkeys(name.strip().lower() for name in names))
        for name in chosen:
            if name not in known:
                raise InputError("--format", "", name, f"must be one or more of {', '.join(known)}")
        match = re.fullmatch(r"\s*(\d+(?:\.\d*)?)\s*(mm|cm|in)?\s*", str(width))
        size = float(match[1]) * {"mm": 1.0, "cm": 10.0, "in": 25.4}[match[2] or "mm"] if match else 0.0
        if not LEAST_WIDTH <= size <= MOST_WIDTH:
            allowed = f"must be {LEAST_WIDTH:g}mm to {MOST_WIDTH:g}mm, such as 85mm (a column) or 170mm (a page)"
            raise InputError("--width", "", width, allowed)
        return Page(tuple(name for name in known if name in chosen), size)

    @property
    def narrow(self) -> bool:
        """Whether panels lie below each other."""
        return self.width < NARROW

    def figure(self, height: float) -> Figure:
        """An empty figure of this width and so many mm of height."""
        figure = Figure(figsize=(self.width * MM, height * MM), layout="constrained")
        FigureCanvasAgg(figure)
        return figure

    def panels(self, count: int, height: float = 62.0, extra: float = 10.0) -> tuple[Figure, list[Any]]:
        """A figure with panels, two in a row where there is room.

        Args:
            count: How many.
            height: Of a panel, in mm.
            extra: For what lies outside of the panels, in mm.
        """
        columns = 1 if self.narrow else min(count, 2)
        rows = -(-count // columns)
        figure = self.figure(rows * height + extra)
        axes = list(figure.subplots(rows, columns, squeeze=False).flat)
        for unused in axes[count:]:
            unused.remove()
        return figure, axes[:count]

    def alone(self) -> Page:
        """The same for a picture of a single panel, which need not be wider than a column and a half."""
        return replace(self, width=min(self.width, NARROW))

    def save(self, figure: Figure, folder: Path, stem: str) -> list[Path]:
        """Write a figure in every format; each file appears whole.

        Raises:
            InputError: The folder cannot be used.
        """
        make_folder(folder)
        written = []
        for name in self.formats:
            path = folder / f"{stem}.{name}"
            with picture_file(path) as part:
                figure.savefig(
                    part, format=name, dpi=self.dpi, metadata=None if name == "png" else {date_key(name): None}
                )
            written.append(path)
        return written


def date_key(name: str) -> str:
    """The entry of a file's metadata that would make equal pictures differ."""
    return {"pdf": "CreationDate", "svg": "Date"}[name]


def renderer(figure: Figure) -> RendererAgg:
    """What measures texts."""
    canvas = figure.canvas
    assert isinstance(canvas, FigureCanvasAgg)
    return canvas.get_renderer()


def small_print(figure: Figure, parts: Sequence[str]) -> None:
    """What holds for the whole picture, in small letters below it, in as many lines as it takes."""
    if not parts:
        return
    measure, font = renderer(figure), FontProperties(family=PRINT["font.family"], size=SMALL)
    room = figure.bbox.width * 0.97

    def wide(text: str) -> float:
        return float(measure.get_text_width_height_descent(text, font, True)[0])

    lines = [parts[0]]
    for part in parts[1:]:
        longer = f"{lines[-1]},  {part}"
        if wide(longer) <= room:
            lines[-1] = longer
        else:
            lines[-1] += ","
            lines.append(part)
    figure.supxlabel("\n".join(lines), x=0.015, ha="left", fontsize=SMALL, color="0.25", linespacing=1.3)


def key(figure: Figure, handles: Sequence[Any]) -> Legend | None:
    """A legend above the panels, in as many columns as there is room for."""
    if not handles:
        return None
    for columns in range(min(len(handles), 6), 0, -1):
        legend = figure.legend(handles=list(handles), loc="outside upper center", ncols=columns)
        if columns == 1 or legend.get_window_extent(renderer(figure)).width <= 0.98 * figure.bbox.width:
            return legend
        legend.remove()
    return None


def key_above(figure: Figure, axis: Axes, handles: Sequence[Any], page: Page) -> None:
    """A legend above one panel, in as many columns as there is room for."""
    room = figure.bbox.width * (0.8 if page.narrow else 0.42)
    for columns in range(min(len(handles), 6), 0, -1):
        legend = axis.legend(handles=list(handles), ncols=columns, loc="lower center", bbox_to_anchor=(0.5, 1.06))
        if columns == 1 or legend.get_window_extent(renderer(figure)).width <= room:
            return
