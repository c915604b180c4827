"""What a sweep gives to an executor: a case, computed in a child process.

The child belongs to the thread of the executor that computes the task, and is used for the next one. A case that
crashes, hangs or is killed therefore costs itself alone, whichever executor it is.
"""

from __future__ import annotations

import math
import multiprocessing
import signal
import subprocess
import tempfile
import threading
import time
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from pairsim.record.record import Record
from pairsim.record.run_entries import COMMAND, KEY, KIND, MESSAGE, REASON, SECONDS, STATUS, Entries
from pairsim.runtime.child_process import clean_environment, module_command
from pairsim.runtime.errors import EnvironmentFailure
from pairsim.sweeps.folder import STOP, CaseState, read_state

POLL = 1.0  # interval at which a task that waits for its child looks whether the sweep is to stop [s]
GRACE = 20.0  # seconds from SIGTERM to SIGKILL; chosen, long enough for a step and its checkpoint
MOST_MEMORY = 1e9
"""Memory of a child above which it computes no further case [bytes]; a run of the default mesh at De 1 takes half."""
STOPPING = (signal.SIGTERM, signal.SIGINT, signal.SIGHUP)
_own = threading.local()


@dataclass(frozen=True)
class Task:
    """A case of a sweep."""

    folder: Path  # its folder, in that of the sweep
    command: str  # that computes it
    key: str  # its hash
    case: bytes  # pickled; only the child, which knows the same laws of one's own as the sweep, unpickles it
    line: str  # command line of the sweep, for run.json
    timeout: float | None  # largest wall time [s]; None for no limit
    environment: Mapping[str, str]  # variables of the child
    flags: Mapping[str, bool]  # options of the command

    @property
    def stop(self) -> Path:
        """File whose presence stops the sweep."""
        return self.folder.parent / STOP

    @property
    def finished(self) -> bool:
        """Whether its folder holds the results of the case."""
        return read_state(self.folder, self.key, values=False).status == "finished"


class ChildReply(NamedTuple):
    """What a child process says of a case once it has ended.

    Attributes:
        reason: Why it failed; "" if it did not, or if its run.json says so.
        message: The same in words.
        memory: Memory that the child now uses [bytes].
    """

    reason: str
    message: str
    memory: float


def compute(task: Task) -> CaseState:
    """Compute a task, for a worker of any executor; returns how its case stands, "pending" if it was stopped."""
    refusal = None if task.finished or task.stop.exists() else _compute(task)
    return refusal or read_state(task.folder, task.key)


class Child:
    """The child process of a thread.

    Raises:
        OSError: It cannot be started.
    """

    def __init__(self, environment: Mapping[str, str]) -> None:
        self.connection, end = multiprocessing.Pipe()
        self._output = tempfile.TemporaryFile()  # noqa: SIM115  # closed with the child
        self.process = subprocess.Popen(
            module_command("pairsim.sweeps.child", str(end.fileno())),
            env={**clean_environment(), **environment},
            stdin=subprocess.DEVNULL,
            stdout=self._output,
            stderr=self._output,
            pass_fds=[end.fileno()],
            process_group=0,  # Ctrl-C is for the sweep
        )
        end.close()
        self.ready = False

    def wait(self, stop: Path, timeout: float | None = None) -> tuple[Any, str]:
        """Wait for what the child sends, and end the child if the sweep is to stop or its time is over.

        Args:
            stop: File whose presence stops the sweep.
            timeout: Largest wall time [s]; None for no limit.

        Returns:
            What it has sent, None if it has ended without that; and why it was stopped, "interrupted" or
            "case_timeout", empty if it was not.
        """
        why, deadline = "", time.monotonic() + (timeout or math.inf)
        while not self.connection.poll(POLL):
            late = time.monotonic() > deadline
            if why and late:
                self.process.kill()
            elif not why and (late or stop.exists()):
                why, deadline = "case_timeout" if late else "interrupted", time.monotonic() + GRACE
                self.process.terminate()
        try:
            return self.connection.recv(), why
        except (EOFError, ConnectionError):
            self.process.wait()
            return None, why

    @property
    def last_line(self) -> str:
        """The last line that it has written to stdout or stderr."""
        self._output.seek(0)
        return self._output.read().decode(errors="replace").strip().rpartition("\n")[2].strip()

    def close(self) -> None:
        """Let it end, if it has not."""
        self.connection.close()
        self.process.wait()


def _compute(task: Task) -> CaseState | None:
    """Compute a case, and complete its run.json where the child could not.

    Returns:
        How the case stands where its folder cannot tell that; else None.
    """
    folder, key, begin = task.folder, task.key, time.monotonic()
    child, said, why = _ask(task)
    if said is not None:
        interrupted = Record.read(folder).status == "interrupted"
    else:
        interrupted = -child.process.returncode in STOPPING
    if said is None or why or interrupted or said.memory > MOST_MEMORY:
        child.close()
        _own.child = None
    if why == "interrupted" or (interrupted and not why) or task.finished:  # the next command goes on
        return None
    if why:
        reason, message = why, f"stopped after {task.timeout:g} s"
    else:
        reason, message = said[:2] if said is not None else _death(child)
    if reason == "refused":  # the folder is someone else's
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


def _ask(task: Task) -> tuple[Child, ChildReply | None, str]:
    """Give a case to the child of this thread, which is started if there is none.

    Returns:
        The child; what it has said, None if it has ended without that; and why it was stopped, see `Child.wait`.
    """
    while True:
        child: Child = getattr(_own, "child", None) or Child(task.environment)
        _own.child, fresh = child, not child.ready
        if fresh:
            child.ready, why = child.wait(task.stop)
            if not child.ready or why:
                return child, None, why
        with suppress(OSError):
            child.connection.send(task)
        said, why = child.wait(task.stop, task.timeout)
        if said is not None or fresh or child.process.returncode:
            return child, said, why
        _own.child = None  # it had ended because there was nothing to do


def _death(child: Child) -> tuple[str, str]:
    """Reason and message of the failure of a case whose child has ended without saying anything."""
    code, last = child.process.returncode, child.last_line
    if not child.ready:
        return EnvironmentFailure.reason, f"the process of a case cannot start: {last or f'exit code {code}'}"
    if code == -signal.SIGKILL:
        return "out_of_memory", "killed by SIGKILL, probably because the system ran out of memory"
    name = f"exit code {code}" if code >= 0 else signal.Signals(-code).name
    return "crashed", f"ended by {name}" + (f": {last}" if last else "")
