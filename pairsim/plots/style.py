"""The page that pictures are drawn on: style, size, formats and files."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from io import BytesIO
from pathlib import Path
from typing import Any, Literal, TypedDict

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.colorbar import Colorbar
from matplotlib.colors import ListedColormap, LogNorm
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, StrMethodFormatter
from matplotlib.typing import ColorType, LineStyleType

from pairsim.record.folder import write_file
from pairsim.runtime.errors import Argument, InputError

FORMATS = ("png", "pdf", "svg")
MM = 1 / 25.4  # inches
NARROW = 120.0  # mm; panels of narrower pictures lie below each other
LEAST_WIDTH, MOST_WIDTH = 50.0, 400.0  # mm
SMALL = 6.0  # points
WIDE = 8.0  # ratio of values from which a scale of them is logarithmic
DATE = {"pdf": "CreationDate", "svg": "Date"}  # the metadata by which equal pictures would differ

PRINT: Any = mpl.rc_params_from_file(Path(__file__).with_name("print.mplstyle"), use_default_template=False)
"""The style; everything that draws does so under `printing`."""
COLOURS: tuple[str, ...] = tuple(PRINT["axes.prop_cycle"].by_key()["color"])
LINES: tuple[LineStyleType, ...] = ("-", "--", ":", "-.")
MARKERS = "os^Dv<>P"
SEQUENTIAL, DIVERGING = "cividis", "RdBu_r"
ORDERED = ListedColormap(mpl.colormaps["viridis"](range(0, 236)))  # without its yellow end
GREY = "0.72"


class Look(TypedDict, total=False):
    """Properties of a line or of points, by their names in matplotlib; others are those of the style."""

    color: ColorType
    linestyle: LineStyleType
    linewidth: float
    drawstyle: Literal["default", "steps", "steps-pre", "steps-mid", "steps-post"]
    marker: str
    markersize: float
    markerfacecolor: ColorType
    elinewidth: float
    zorder: float


def colour_bar(figure: Figure, scale: ScalarMappable, **look: Any) -> Colorbar:
    """A colour bar, with plain numbers where its scale is logarithmic; it looks as in `Figure.colorbar`."""
    if isinstance(scale.norm, LogNorm):
        look |= {"ticks": LogLocator(subs=(1, 2, 5)), "format": StrMethodFormatter("{x:g}")}
    bar = figure.colorbar(scale, **look)
    bar.minorticks_off()
    return bar


@contextmanager
def printing() -> Iterator[None]:
    """Context, or decorator, in which everything is drawn in the style `PRINT`."""
    with mpl.rc_context():
        mpl.rcdefaults()  # a matplotlibrc of the user is ignored
        mpl.rcParams.update(PRINT)
        yield


@dataclass(frozen=True)
class Page:
    """Formats, size and units of pictures."""

    formats: tuple[str, ...] = ("png",)  # kinds of files
    width: float = 170.0  # mm
    dpi: float = 300.0  # of PNG, and of what is made of pixels in PDF and SVG
    physical: bool | None = None  # whether in units of the experiment; None: if the case has a `physical` block
    legend: bool = True  # whether there are a legend and the small print

    @staticmethod
    def parse(
        formats: str | Sequence[str] = "png",
        width: str | float = 170.0,
        physical: bool | None = None,
        legend: bool = True,
    ) -> Page:
        """A page from words: formats separated by commas, and a width such as "85mm", or in mm.

        Raises:
            InputError: A format is unknown, or the width is not between `LEAST_WIDTH` and `MOST_WIDTH`.
        """
        names = formats.split(",") if isinstance(formats, str) else list(formats)
        chosen = {name.strip().lower(): None for name in names}
        for name in chosen:
            if name not in FORMATS:
                raise InputError(Argument("formats"), "", name, f"must be one or more of {', '.join(FORMATS)}")
        match = re.fullmatch(r"\s*(\d+(?:\.\d*)?)\s*(mm|cm|in)?\s*", str(width))
        size = float(match[1]) * {"mm": 1.0, "cm": 10.0, "in": 25.4}[match[2] or "mm"] if match else 0.0
        if not LEAST_WIDTH <= size <= MOST_WIDTH:
            allowed = f"must be {LEAST_WIDTH:g}mm to {MOST_WIDTH:g}mm, such as 85mm (a column) or 170mm (a page)"
            raise InputError(Argument("width"), "", width, allowed)
        return Page(tuple(name for name in FORMATS if name in chosen), size, physical=physical, legend=legend)

    @property
    def narrow(self) -> bool:
        """Whether panels lie below each other."""
        return self.width < NARROW

    def figure(self, height: float) -> Figure:
        """An empty figure of the width of the page, and of a height in mm."""
        figure = Figure(figsize=(self.width * MM, height * MM), layout="constrained")
        FigureCanvasAgg(figure)
        return figure

    def panels(
        self, count: int, height: float = 62.0, extra: float = 10.0, columns: int | None = None
    ) -> tuple[Figure, list[Axes]]:
        """A figure with `count` panels, two or three in a row where there is room, or `columns` of them.

        A single one is at most `NARROW` wide. The height of a panel, and the `extra` one of what lies outside of all,
        are in mm.
        """
        columns = 1 if self.narrow else columns or (3 if count % 3 == 0 else min(count, 2))
        rows = -(-count // columns)
        page = self if count > 1 else replace(self, width=min(self.width, NARROW))
        figure = page.figure(rows * height + extra)
        return figure, [figure.add_subplot(rows, columns, i + 1) for i in range(count)]

    def save(self, figure: Figure, folder: Path, stem: str) -> list[Path]:
        """Write a figure in every format; each file appears whole.

        Raises:
            InputError: A file cannot be written.
        """
        written = [folder / f"{stem}.{name}" for name in self.formats]
        for path, name in zip(written, self.formats, strict=True):
            metadata = {DATE[name]: None} if name in DATE else None
            figure.savefig(content := BytesIO(), format=name, dpi=self.dpi, metadata=metadata)
            write_file(path, content.getvalue())
        return written
