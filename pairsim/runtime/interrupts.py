"""SIGINT (Ctrl-C) outside of computations, for instance while libraries are loaded.

During computations `runtime/signals.py` handles it. A KeyboardInterrupt raised inside compiled code may be turned into
another exception, such as an ImportError, or be lost; the handler therefore also records that the signal came.
"""

from __future__ import annotations

import os
import signal
import sys

TYPE_CHECKING = False  # importing typing would delay the installation of the handler
if TYPE_CHECKING:
    from types import FrameType

EXIT_CODE = 130
_came = False


def remember_interrupts() -> None:
    """Install a handler that raises KeyboardInterrupt, as Python's own does, and records that it did."""
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
    """End the process if an exception that cannot be caught, such as one in a callback, is an interrupt."""
    if _came and issubclass(unraisable.exc_type, KeyboardInterrupt):
        os._exit(EXIT_CODE)
    sys.__unraisablehook__(unraisable)
