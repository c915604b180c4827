"""The process in which a worker of a sweep computes its cases: `python -P -m pairsim.sweeps.child DESCRIPTOR`.

Libraries are loaded once. What becomes of a case is in its folder.
"""

from __future__ import annotations

import os
import pickle
import signal
import sys
import traceback
from contextlib import suppress
from multiprocessing.connection import Connection

import pairsim.runtime.fenicsx  # noqa: F401  # before everything else that loads MPI or makes threads

# isort: split
from pairsim.computing.progress import Reporter
from pairsim.computing.provenance import memory
from pairsim.computing.question import own_files
from pairsim.computing.session import Options, carry_out
from pairsim.questions.registry import QUESTIONS
from pairsim.record.folder import CHECKPOINT
from pairsim.runtime.child_process import end_with_parent
from pairsim.runtime.errors import InputError, RunFailure
from pairsim.runtime.signals import Signals
from pairsim.sweeps.task import ChildReply, Task

IDLE = 60.0
"""Seconds without a case after which the process ends: workers of other executors live on after a sweep."""


def serve(connection: Connection) -> None:
    """Compute the cases that come, until the other end is closed, or none has come for a while."""
    connection.send(True)  # ready
    with suppress(EOFError):
        while connection.poll(IDLE):
            connection.send(ChildReply(*compute(connection.recv()), memory()))


def compute(task: Task) -> tuple[str, str]:
    """Compute a case of a task and write it to its folder, from its checkpoint if it has one.

    Returns reason and message of its failure, where run.json does not have them; else empty.
    """
    folder, question = task.folder, QUESTIONS[task.command]
    try:
        case, outcome = pickle.loads(task.case), None
        with Signals() as signals:
            options = Options(True, Reporter(), task.line, own_files(QUESTIONS.values()), signals)
            if question.resumable and (folder / CHECKPOINT).is_file():
                with suppress(InputError):  # it cannot be used
                    outcome = carry_out(question, case, folder, options, resume=True, **task.flags)
            if outcome is None:
                outcome = carry_out(question, case, folder, options, **task.flags)
        if outcome.status == "finished" and question.draws_from is not None:
            from pairsim.plots.style import Page  # matplotlib takes a quarter of the time to start

            with suppress(OSError, InputError):  # a picture can be drawn again
                question.draw(folder, folder, Page())
    except InputError as error:
        return "refused", str(error)
    except RunFailure as failure:
        return failure.reason, str(failure)
    except MemoryError as error:
        return "out_of_memory", str(error) or "MemoryError"
    except Exception as error:
        traceback.print_exc()
        return "error", f"{type(error).__name__}: {error}"
    return "", ""


if __name__ == "__main__":
    end_with_parent()
    signal.signal(signal.SIGTERM, signal.SIG_DFL)  # which a process of mpirun ignores that waits for its child
    serve(Connection(int(sys.argv[1])))
    os._exit(0)  # all is written, and MPI and PETSc need not take their leave
