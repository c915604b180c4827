"""A child process that computes for a thread of its parent: `python -P -m pairsim.computing.child DESCRIPTOR`.

It loads libraries once, for many pieces of work, whose results are written to files.
"""

from __future__ import annotations

import os
import signal
import sys
from contextlib import suppress
from multiprocessing.connection import Connection

import pairsim.runtime.fenicsx  # noqa: F401  # before everything else that loads MPI or makes threads

# isort: split
from pairsim.computing.provenance import memory
from pairsim.runtime.child import Reply
from pairsim.runtime.child_process import end_with_parent

IDLE = 60.0
"""Seconds without work after which the process ends: workers of other executors live on after a command."""


def serve(connection: Connection) -> None:
    """Do the work that arrives, until the other end is closed, or none has arrived for `IDLE` seconds."""
    connection.send(True)  # ready
    with suppress(EOFError):
        while connection.poll(IDLE):
            connection.send(Reply(connection.recv().in_child(), memory()))


if __name__ == "__main__":
    end_with_parent()
    signal.signal(signal.SIGTERM, signal.SIG_DFL)  # inherited as ignored from a process of mpirun that waits for it
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGTERM})  # inherited as blocked from threads of the parent
    serve(Connection(int(sys.argv[1])))
    os._exit(0)  # all is written, and MPI and PETSc need not be finalised
