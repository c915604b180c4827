"""The folder in which pairsim keeps what is made once for each user, such as compiled forms."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path


def cache_folder() -> Path:
    """`pairsim` in $XDG_CACHE_HOME or ~/.cache, or in the folder of temporary files where there is no home."""
    try:
        base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    except RuntimeError:  # no home folder
        base = Path(tempfile.gettempdir())
    return base / "pairsim"
