"""SIGINT (Ctrl-C) outside of computations, which have `runtime/signals.py`: while libraries are loaded, and in between.

The exception that it raises may come in compiled code, which turns it into another one, such as an ImportError, or
loses it. It is therefore remembered that it came.
"""

from __future__ import annotations

import os
import signal
import sys

TYPE_CHECKING = False  # typing would be imported before an interrupt can be answered
if TYPE_CHECKING:
    from types import FrameType

EXIT_CODE = 130
_came = False


def remember_interrupts() -> None:
    """Install a handler that raises KeyboardInterrupt, as Python's own does, and remembers that it has."""
    signal.signal(signal.SIGINT, _interrupt)
    sys.unraisablehook = _lost


def interrupted() -> bool:
    """Whether an interrupt has come since `remember_interrupts`."""
    return _came


def _interrupt(_: int, __: FrameType | None) -> None:
    global _came
    _came = True
    raise KeyboardInterrupt


def _lost(unraisable: sys.UnraisableHookArgs) -> None:
    """End the process if the exception that nobody can catch, such as one in a callback, is an interrupt."""
    if _came and issubclass(unraisable.exc_type, KeyboardInterrupt):
        os._exit(EXIT_CODE)
    sys.__unraisablehook__(unraisable)
