"""The tasks that a sweep gives to an executor: each computes one case in a child process.

The child belongs to the thread of the executor that computes the task, and is used for its next task. With any
executor, a case that crashes, hangs or is killed is thus the only one that is lost.
"""

from __future__ import annotations

import signal
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from pairsim.record.record import Record
from pairsim.record.run_entries import COMMAND, KEY, KIND, MESSAGE, REASON, SECONDS, STATUS, Entries
from pairsim.runtime.child import MOST_MEMORY, ask, stops
from pairsim.sweeps.folder import STOP, CaseState, read_state

STOPPING = (signal.SIGTERM, signal.SIGINT, signal.SIGHUP)


@dataclass(frozen=True)
class Task:
    """A case of a sweep."""

    folder: Path  # its folder, in that of the sweep
    command: str  # name of its question
    key: str  # its hash
    case: bytes  # pickled; only the child unpickles it, as it has loaded the laws of the user
    line: str  # command line of the sweep, for run.json
    timeout: float | None  # largest wall time [s]; None for no limit
    environment: Mapping[str, str]  # environment variables of the child, beside those of its parent
    flags: Mapping[str, bool]  # options of the command

    @property
    def stop(self) -> Path:
        """File whose presence stops the sweep."""
        return self.folder.parent / STOP

    @property
    def finished(self) -> bool:
        """Whether its folder holds the results of the case."""
        return read_state(self.folder, self.key, values=False).status == "finished"

    def in_child(self) -> tuple[str, str]:
        """Compute the case; returns reason and message of a failure that run.json may not have, else empty texts."""
        from pairsim.sweeps.in_child import compute as in_this_process  # loads FEniCSx

        return in_this_process(self)


def compute(task: Task) -> CaseState:
    """Compute a task in a worker of any executor; returns the state of its case, "pending" if it was stopped."""
    if not task.finished and stops(task.stop):
        return CaseState(task.folder.name)
    return (None if task.finished else _compute(task)) or read_state(task.folder, task.key)


def _compute(task: Task) -> CaseState | None:
    """Compute a case, and complete its run.json where the child could not.

    Returns:
        The state of the case if it cannot be read from its folder, else None.
    """
    folder, key, begin = task.folder, task.key, time.monotonic()
    child, said, why = ask(task, task.environment, task.stop, task.timeout)
    if said is not None:
        interrupted = Record.read(folder).status == "interrupted"
    else:
        # A child that was stopped while it was loading may still be alive, if its parent ignores SIGTERM.
        interrupted = bool(why) or -child.process.returncode in STOPPING
    if said is None or why or interrupted or said.memory > MOST_MEMORY:
        child.close()
    if task.finished:
        return None
    if why == "interrupted" or (interrupted and not why):  # the next command goes on
        return CaseState(folder.name)  # the folder may have the failure of an earlier command
    if why:
        reason, message = why, f"stopped after {task.timeout:g} s"
    else:
        reason, message = said.result if said is not None else child.death
    if reason == "refused":  # the folder belongs to something else, and must not be written to
        return CaseState(folder.name, "failed", reason, message)
    if reason:
        record = Record.read(folder)
        if record.key != key:
            record = Record.of({KIND: task.command, COMMAND: task.line, KEY: key})
        failed: Entries = {STATUS: "failed", REASON: reason, MESSAGE: message}
        record = record.with_entries({SECONDS: time.monotonic() - begin, **failed})
        try:
            folder.mkdir(exist_ok=True)
            record.write(folder)
        except OSError as error:
            return CaseState(folder.name, "failed", "write_failed", str(error))
    return None
