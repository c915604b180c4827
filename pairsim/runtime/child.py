"""A child process that belongs to a thread and does the work that this thread gives to it.

The same child does all the work of its thread in turn. If the work crashes, hangs or is killed, only the child is lost.
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
from pathlib import Path
from typing import Any, NamedTuple, Protocol

from pairsim.runtime.child_process import clean_environment, module_command
from pairsim.runtime.errors import EnvironmentFailure

MODULE = "pairsim.computing.child"
"""The module that the child runs. It is not imported here, as it loads libraries that the parent does not need."""
POLL = 1.0  # interval at which a thread that waits for its child checks for the stop file and the time limit [s]
GRACE = 20.0  # seconds from SIGTERM to SIGKILL; chosen, long enough for a step and its checkpoint
MOST_MEMORY = 1e9
"""Memory of a child above which it is given no further work [bytes]; a run of the default mesh at De 1 takes half."""
_own = threading.local()


def stops(file: Path) -> bool:
    """Whether a stop file tells children to stop: it is there, or its folder has been removed or moved."""
    return file.exists() or not file.parent.exists()


class Work(Protocol):
    """A piece of work for a child, to which it is sent by pickle."""

    def in_child(self) -> Any:
        """Do the work in the child; the return value must be picklable, too."""


class Reply(NamedTuple):
    """The answer of a child that has done its work.

    Attributes:
        result: The return value of the work.
        memory: Memory that the child now uses [bytes].
    """

    result: Any
    memory: float


class Child:
    """The child process of a thread.

    Raises:
        OSError: It cannot be started.
    """

    def __init__(self, environment: Mapping[str, str]) -> None:
        self.connection, end = multiprocessing.Pipe()
        self._output = tempfile.TemporaryFile()  # noqa: SIM115  # closed with the child
        self.process = subprocess.Popen(
            module_command(MODULE, str(end.fileno())),
            env={**clean_environment(), **environment},
            stdin=subprocess.DEVNULL,
            stdout=self._output,
            stderr=self._output,
            pass_fds=[end.fileno()],
            process_group=0,  # Ctrl-C is for its parent
        )
        end.close()
        self.ready = False

    def wait(self, stop: Path | None = None, timeout: float | None = None) -> tuple[Any, str]:
        """Wait for the next object from the child, and end the child if a stop file appears or its time is over.

        Args:
            stop: File whose presence stops the child, as the absence of its folder does; None if there is no such file.
            timeout: Largest wall time [s]; None for no limit.

        Returns:
            The object, None if the child has ended without sending one; and why the child was stopped: "interrupted" or
            "case_timeout", empty if it was not.
        """
        why, deadline = "", time.monotonic() + (timeout or math.inf)
        while not self.connection.poll(POLL):
            late = time.monotonic() > deadline
            if why and late:
                self.process.kill()
            elif not why and (late or (stop is not None and stops(stop))):
                why, deadline = "case_timeout" if late else "interrupted", time.monotonic() + GRACE
                self.process.terminate()
        try:
            return self.connection.recv(), why
        except (EOFError, ConnectionError):
            self.process.wait()
            return None, why

    @property
    def last_line(self) -> str:
        """The last line that the child has written to stdout or stderr."""
        self._output.seek(0)
        return self._output.read().decode(errors="replace").strip().rpartition("\n")[2].strip()

    @property
    def death(self) -> tuple[str, str]:
        """Reason and message of the failure of work whose child has ended without a reply."""
        code, last = self.process.returncode, self.last_line
        if code == -signal.SIGKILL:
            return "out_of_memory", "killed by SIGKILL, probably because the system ran out of memory"
        if not self.ready:
            return EnvironmentFailure.reason, f"the process of a case cannot start: {last or f'exit code {code}'}"
        name = f"exit code {code}" if code >= 0 else signal.Signals(-code).name
        return "crashed", f"ended by {name}" + (f": {last}" if last else "")

    def close(self) -> None:
        """Let the child end, and wait until it has; its thread then has no child."""
        self.connection.close()
        self.process.wait()
        if getattr(_own, "child", None) is self:
            _own.child = None


def child_of_thread(environment: Mapping[str, str], stop: Path | None = None) -> tuple[Child, bool, str]:
    """The child of this thread, which is started if there is none.

    Returns:
        The child; whether it had not yet reported ready, as when this call has started it; and why it was stopped, see
        `Child.wait`.
    """
    child: Child = getattr(_own, "child", None) or Child(environment)
    _own.child, fresh, why = child, not child.ready, ""
    if fresh:
        child.ready, why = child.wait(stop)
    return child, fresh, why


def close_child() -> None:
    """Close the child of this thread, if there is one."""
    child: Child | None = getattr(_own, "child", None)
    if child is not None:
        child.close()


def ask(work: Work, environment: Mapping[str, str], stop: Path, timeout: float | None) -> tuple[Child, Any, str]:
    """Give work to the child of this thread, and wait for its reply.

    Args:
        work: The work.
        environment: Environment variables for a child that must be started first, beside those of this process.
        stop: File whose presence stops the child, see `stops`.
        timeout: Largest wall time [s]; None for no limit.

    Returns:
        The child; its `Reply`, None if it has ended without one; and why it was stopped, see `Child.wait`.
    """
    while True:
        child, fresh, why = child_of_thread(environment, stop)
        if not child.ready or why:
            return child, None, why
        with suppress(OSError):
            child.connection.send(work)
        said, why = child.wait(stop, timeout)
        if said is not None or fresh or child.process.returncode:
            return child, said, why
        _own.child = None  # it had ended by itself for lack of work: start another one
