"""YAML files of figures, statements, pages and studies, read by the library with which pairsim reads its cases."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ruamel.yaml import YAML


def read(path: Path) -> Any:
    """The content of a file; an anchor may be defined anew for later entries."""
    reader = YAML(typ="safe", pure=True)
    reader.composer.warn_double_anchors = False
    return reader.load(path.read_text(encoding="utf-8"))
