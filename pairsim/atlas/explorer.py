"""One HTML page that answers as `ask` does, in a browser and without a server."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from pairsim.atlas.atlas import BEND, POWER
from pairsim.runtime.version import __version__
from pairsim.solvers.curves.distances import WIDEST

TEMPLATE = Path(__file__).with_suffix(".html")


def page_of(files: Sequence[Path]) -> str:
    """The page of atlases, whose files are valid."""
    content = {"atlases": [_content(each) for each in files], "bend": BEND, "power": POWER, "widest": WIDEST}
    page = TEMPLATE.read_text(encoding="utf-8").replace("VERSION", __version__)
    return page.replace("CONTENT", json.dumps(content))


def _content(file: Path) -> dict[str, Any]:
    """The arrays of an atlas: those of "dU" and "others", each by the names of `Kriging`, and its own."""
    found: dict[str, Any] = {"dU": {}, "others": {}}
    with np.load(file, allow_pickle=False) as stored:
        for name in stored.files:
            group, _, key = name.rpartition(".")
            if name != "others.inverse":
                (found[group] if group else found)[key] = stored[name].tolist()
    return found | {"head": json.loads(found["head"])}
