"""A child process of a thread, to which the thread gives work.

It is used again for the next work of its thread. What crashes, hangs or is killed is the child alone.
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
"""The program of the child, by its name: it loads libraries that a parent need not have."""
POLL = 1.0  # interval at which a thread that waits for its child looks whether all is to stop [s]
GRACE = 20.0  # seconds from SIGTERM to SIGKILL; chosen, long enough for a step and its checkpoint
MOST_MEMORY = 1e9
"""Memory of a child above which it is given no further work [bytes]; a run of the default mesh at De 1 takes half."""
_own = threading.local()


class Work(Protocol):
    """What a child is given, pickled."""

    def in_child(self) -> Any:
        """Do it; what is returned is pickled, too."""


class Reply(NamedTuple):
    """What a child says once it has done its work.

    Attributes:
        result: What the work has returned.
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
        """Wait for what the child sends, and end the child if all is to stop or its time is over.

        Args:
            stop: File whose presence stops it; None for none.
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
            elif not why and (late or (stop is not None and stop.exists())):
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

    @property
    def death(self) -> tuple[str, str]:
        """Reason and message of the failure of work whose child has ended without saying anything."""
        code, last = self.process.returncode, self.last_line
        if not self.ready:
            return EnvironmentFailure.reason, f"the process of a case cannot start: {last or f'exit code {code}'}"
        if code == -signal.SIGKILL:
            return "out_of_memory", "killed by SIGKILL, probably because the system ran out of memory"
        name = f"exit code {code}" if code >= 0 else signal.Signals(-code).name
        return "crashed", f"ended by {name}" + (f": {last}" if last else "")

    def close(self) -> None:
        """Let it end, if it has not; its thread then has none."""
        self.connection.close()
        self.process.wait()
        if getattr(_own, "child", None) is self:
            _own.child = None


def child_of_thread(environment: Mapping[str, str], stop: Path | None = None) -> tuple[Child, bool, str]:
    """The child of this thread, which is started if there is none.

    Returns:
        The child; whether it was started now; and why it was stopped, see `Child.wait`.
    """
    child: Child = getattr(_own, "child", None) or Child(environment)
    _own.child, fresh, why = child, not child.ready, ""
    if fresh:
        child.ready, why = child.wait(stop)
    return child, fresh, why


def close_child() -> None:
    """Let the child of this thread end, if there is one."""
    child: Child | None = getattr(_own, "child", None)
    if child is not None:
        child.close()


def ask(work: Work, environment: Mapping[str, str], stop: Path, timeout: float | None) -> tuple[Child, Any, str]:
    """Give work to the child of this thread.

    Args:
        work: The work.
        environment: Variables of a child that is started.
        stop: File whose presence stops it.
        timeout: Largest wall time [s]; None for no limit.

    Returns:
        The child; its `Reply`, None if it has ended without that; and why it was stopped, see `Child.wait`.
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
        _own.child = None  # it had ended because there was nothing to do
