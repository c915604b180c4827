"""A process that does the work of a thread: `python -P -m pairsim.computing.child DESCRIPTOR`.

Libraries are loaded once. What the work finds is in files.
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
    """Do the work that comes, until the other end is closed, or none has come for a while."""
    connection.send(True)  # ready
    with suppress(EOFError):
        while connection.poll(IDLE):
            connection.send(Reply(connection.recv().in_child(), memory()))


if __name__ == "__main__":
    end_with_parent()
    signal.signal(signal.SIGTERM, signal.SIG_DFL)  # which a process of mpirun ignores that waits for its child
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGTERM})  # which threads beside a computation block
    serve(Connection(int(sys.argv[1])))
    os._exit(0)  # all is written, and MPI and PETSc need not take their leave
