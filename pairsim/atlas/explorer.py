"""One HTML page that answers as `ask` does, in a browser and without a server."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from pairsim.atlas.atlas import BEND, POWER, Atlas
from pairsim.runtime.version import __version__
from pairsim.solvers.curves.distances import WIDEST


def page_of(atlases: Iterable[tuple[str, Atlas]]) -> str:
    """The page of atlases, each with its liquid in words."""
    contents = [{"liquid": liquid, **_content(atlas)} for liquid, atlas in atlases]
    content = {"atlases": contents, "bend": BEND, "power": POWER, "widest": WIDEST}
    page = Path(__file__).with_suffix(".html").read_text(encoding="utf-8").replace("VERSION", __version__)
    return page.replace("CONTENT", json.dumps(content, default=lambda array: array.tolist()))


def _content(atlas: Atlas) -> dict[str, Any]:
    others, means = atlas.others
    same = {name: getattr(atlas, name) for name in ("box", "d", "widths", "own")}
    root = [row[: i + 1] for i, row in enumerate(atlas.dU.root)]  # which is triangular
    return {**same, "dU": {**vars(atlas.dU), "root": root}, "others": {**vars(others), "root": []}, "means": means}
