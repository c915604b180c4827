"""Check pictures."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from matplotlib import image
from matplotlib.figure import Figure
from matplotlib.transforms import Bbox

from pairsim.plots.style import Page, printing


def colours(file: Path) -> int:
    """Number of different colours of a picture: a blank one has a single one."""
    red, green, blue = (image.imread(file)[..., :3] * 255).astype(np.uint32).reshape(-1, 3).T
    return len(np.unique((red * 256 + green) * 256 + blue))


@contextmanager
def drawn_figures(monkeypatch: pytest.MonkeyPatch, *, written: bool = False) -> Iterator[list[Figure]]:
    """The figures that are made meanwhile; they are written on demand alone, which takes nearly all of the time."""
    figures: list[Figure] = []
    save = Page.save

    def keep(page: Page, figure: Figure, folder: Path, stem: str) -> list[Path]:
        figures.append(figure)
        return save(page, figure, folder, stem) if written else [folder / f"{stem}.png"]

    with monkeypatch.context() as patch:
        patch.setattr(Page, "save", keep)
        yield figures


def overlapping(figure: Figure) -> list[tuple[str, str]]:
    """Texts of a figure which cover each other, or reach beyond its edges (with "edge")."""
    with printing():
        figure.draw_without_rendering()
        return _overlapping(figure)


def _overlapping(figure: Figure) -> list[tuple[str, str]]:
    renderer = figure.canvas.get_renderer()  # type: ignore[attr-defined]
    boxes: list[tuple[str, Bbox]] = []
    texts = [figure._supxlabel] if figure._supxlabel is not None else []
    for axis in figure.axes:
        texts += [axis.title, axis.xaxis.label, axis.yaxis.label, axis.xaxis.offsetText, axis.yaxis.offsetText]
        for direction, limits in ((axis.xaxis, axis.get_xlim()), (axis.yaxis, axis.get_ylim())):
            low, high = sorted(limits)
            margin = 1e-9 * (high - low)
            ticks = zip(direction.get_majorticklocs(), direction.get_majorticklabels(), strict=False)
            texts += [text for at, text in ticks if low - margin <= at <= high + margin]
    for legend in figure.legends:
        texts += legend.get_texts()
    for text in texts:
        if text.get_visible() and text.get_text().strip():
            boxes.append((text.get_text(), text.get_window_extent(renderer)))
    page = figure.bbox.padded(2)
    found = [(name, "edge") for name, box in boxes if not (page.x0 <= box.x0 and box.x1 <= page.x1)]
    found += [(name, "edge") for name, box in boxes if not (page.y0 <= box.y0 and box.y1 <= page.y1)]
    for (first, a), (second, b) in combinations(boxes, 2):
        shared = Bbox.intersection(a, b)
        if shared is not None and shared.width > 1 and shared.height > 1:
            found.append((first, second))
    return found
