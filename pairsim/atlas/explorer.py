"""One HTML page that answers as `ask` does, in a browser and without a server."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TypedDict

from pairsim.atlas.atlas import BEND, POWER, Atlas
from pairsim.runtime.arrays import Array
from pairsim.runtime.version import __version__
from pairsim.solvers.curves.distances import WIDEST


def page_of(atlases: Iterable[tuple[str, Atlas]]) -> str:
    """The HTML page of some atlases, each given with its liquid in words."""
    contents = [_content(liquid, atlas) for liquid, atlas in atlases]
    content = {"atlases": contents, "bend": BEND, "power": POWER, "widest": WIDEST}
    page = Path(__file__).with_suffix(".html").read_text(encoding="utf-8").replace("VERSION", __version__)
    return page.replace("CONTENT", json.dumps(content, default=lambda array: array.tolist()))


class Content(TypedDict):
    """The content of the page for one atlas: its liquid in words, and its attributes and those of its krigings."""

    liquid: str
    box: Mapping[str, Sequence[float]]
    d: Array
    widths: Array
    own: Array
    dU: Mapping[str, Array | Sequence[Array] | bool]
    others: Mapping[str, Array | Sequence[Array] | bool]
    means: Array


def _content(liquid: str, atlas: Atlas) -> Content:
    root = [row[: i + 1] for i, row in enumerate(atlas.dU.root)]  # lower triangular
    return {
        "liquid": liquid,
        "box": atlas.box,
        "d": atlas.d,
        "widths": atlas.widths,
        "own": atlas.own,
        "dU": {**vars(atlas.dU), "root": root, "vanishing": True},
        "others": {**vars(atlas.others.kriging), "root": [], "vanishing": False},
        "means": atlas.others.means,
    }
