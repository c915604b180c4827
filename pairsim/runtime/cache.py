"""The cache folder, in which pairsim keeps what needs to be made only once per user, such as compiled forms."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path


def cache_folder() -> Path:
    """The folder `pairsim` in $XDG_CACHE_HOME or ~/.cache, or in that of temporary files if there is no home folder."""
    try:
        base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    except RuntimeError:  # no home folder
        base = Path(tempfile.gettempdir())
    return base / "pairsim"
