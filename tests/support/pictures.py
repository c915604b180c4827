"""Check pictures."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib import image


def colours(file: Path) -> int:
    """Number of different colours of a picture: a blank one has a single one."""
    red, green, blue = (image.imread(file)[..., :3] * 255).astype(np.uint32).reshape(-1, 3).T
    return len(np.unique((red * 256 + green) * 256 + blue))
