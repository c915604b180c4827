"""What scipy takes of numpy when it is first imported.

It copies all that numpy names, which imports f2py and the tools of tests, and what these import: a quarter
of the time in which scipy.linalg is imported.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

TOOLS = {"f2py", "testing"}
"""What numpy imports when somebody first asks for it, and scipy never uses."""


@contextmanager
def without_tools() -> Iterator[None]:
    """Let numpy not name its tools, so that what takes all that it names does not import them."""
    names, before = vars(np), {"__all__": np.__all__, "__dir__": np.__dir__}
    listed = [name for name in dir(np) if name not in TOOLS]
    names.update(__all__=[name for name in np.__all__ if name not in TOOLS], __dir__=lambda: listed)
    try:
        yield
    finally:
        names.update(before)
