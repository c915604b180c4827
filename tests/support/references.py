"""Reference values of the verification tests: those that the validation book compares with, each with its source."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import yaml

FILE = Path(__file__).resolve().parents[2] / "docs" / "validation" / "references.yaml"


@cache
def _groups() -> dict[str, Any]:
    return dict(yaml.safe_load(FILE.read_text())["groups"])


def reference(group: str, key: str) -> float:
    """A value of docs/validation/references.yaml.

    Raises:
        KeyError: There is none.
    """
    return float(_groups()[group]["values"][key])
