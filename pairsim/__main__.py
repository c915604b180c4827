"""The entry point of the command line: `pairsim`, and `python -m pairsim`."""

import gc
import io
import os
import sys

from pairsim.runtime.interrupts import EXIT_CODE, interrupted, remember_interrupts

ALLOCATIONS = 200_000
"""Allocations between two searches for cyclic garbage: more than in a short command, whose objects live to its end."""
PLUGINS = "PYDANTIC_DISABLE_PLUGINS"
"""Plugins of pydantic, which change no case, are looked for in the metadata of every installed package."""
LAST_STREAM = 2
"""Descriptor of stderr, the last one of the standard streams."""


def _open_standard_streams() -> None:
    """Open those of stdin, stdout and stderr that are closed, on the null device.

    Otherwise the next files and pipes, such as one to a child process, would get their descriptors.
    """
    while (descriptor := os.open(os.devnull, os.O_RDWR)) <= LAST_STREAM:
        os.set_inheritable(descriptor, True)
    os.close(descriptor)
    sys.stdin = sys.stdin or os.fdopen(0)
    sys.stdout = sys.stdout or os.fdopen(1, "w")
    sys.stderr = sys.stderr or os.fdopen(LAST_STREAM, "w")


def main() -> None:
    """Run the command line; Ctrl-C ends it with the exit code 130, also while libraries are loaded for it."""
    remember_interrupts()
    _open_standard_streams()
    gc.set_threshold(ALLOCATIONS)
    os.environ.setdefault(PLUGINS, "__all__")
    try:
        from pairsim.app.command_line import main as run

        if isinstance(sys.stdout, io.TextIOWrapper):  # names of files that are not in UTF-8 are printed as they are
            sys.stdout.reconfigure(errors="surrogateescape")
        run()
    except (Exception, KeyboardInterrupt):
        if not interrupted():
            raise
        sys.exit(EXIT_CODE)


if __name__ == "__main__":
    main()
