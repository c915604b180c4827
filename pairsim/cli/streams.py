"""Standard streams that are closed, full or broken: progress and notes are not worth a computation."""

from __future__ import annotations

import os
import sys
from contextlib import suppress
from typing import Any, TextIO, cast


class LenientStream:
    """A stream for messages whose write errors are ignored.

    Args:
        stream: The stream; other attributes are its own.
    """

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream

    def write(self, text: str) -> int:
        """Write a text, or as much of it as can be written."""
        with suppress(OSError):
            self._stream.write(text)
        return len(text)

    def flush(self) -> None:
        """Flush the stream, if that is possible."""
        with suppress(OSError):
            self._stream.flush()

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


def repair_streams() -> None:
    """Open closed standard streams on the null device, and ignore write errors of stderr.

    The next file opened would get the number of a closed stream, and libraries would write their messages into it.
    """
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # takes the lowest free number, which is this one
        if getattr(sys, name) is None:
            setattr(sys, name, open(number, "w" if number else "r", closefd=False))  # noqa: SIM115
    if not isinstance(sys.stderr, LenientStream):
        sys.stderr = cast(TextIO, LenientStream(sys.stderr))


def discard_stdout() -> None:
    """Write what is left for stdout nowhere, after an error: the interpreter would report another one at its end."""
    sys.stdout = open(os.devnull, "w")  # noqa: SIM115
