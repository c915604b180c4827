"""Determine the outcome of a case from its exit code, run.json and stderr."""

from __future__ import annotations

import errno
import os
import re
import signal
from typing import Any

from pairsim.runtime.child_process import FULL, TOO_LARGE
from pairsim.runtime.errors import ENVIRONMENT, EnvironmentFailure

MEMORY = re.compile(r"MemoryError|std::bad_alloc|Cannot allocate memory|Out of memory")


def _disk_full(text: str) -> tuple[str, str, str] | None:
    """Status, reason and message, if a text reports a full disk or a limit on file sizes; else None."""
    for pattern, number in ((TOO_LARGE, errno.EFBIG), (FULL, errno.ENOSPC)):
        if pattern.search(text):
            return "failed", "disk_full", f"could not write: {os.strerror(number)}"
    return None


def judge(code: int, record: dict[str, Any], stderr: str, stopped: str, seconds: float) -> tuple[str, str, str]:
    """Determine status, reason and message of a child process that has ended.

    Args:
        code: Exit code; if negative, minus the signal that ended the process.
        record: Content of its run.json, empty if there is none.
        stderr: The end of its stderr.
        stopped: Why the sweep stopped it: "timeout" or "interrupted"; "" if it did not.
        seconds: Its wall time [s].
    """
    lines = [line for line in stderr.splitlines() if line.strip()]
    last = lines[-1].strip() if lines else ""
    number = -code if code < 0 else None
    status = record.get("status")
    if code == 0 and status == "finished":
        return "finished", record.get("reason", ""), record.get("message", "")
    if stopped == "timeout":
        return "timeout", "case_timeout", f"stopped after {seconds:.0f} s"
    if stopped:
        return "pending", "interrupted", "stopped with the sweep"
    if code == ENVIRONMENT:
        return "failed", EnvironmentFailure.reason, record.get("message") or last.removeprefix("pairsim: ")
    if code == 3 and status == "failed":
        reason, message = record.get("reason", "failed"), record.get("message", "")
        if reason == "write_failed" and (full := _disk_full(message)):
            return full  # not a failure of the case: it is continued later
        return ("timeout" if reason == "wall_time" else "failed"), reason, message
    if code in (130, -signal.SIGTERM, -signal.SIGINT):
        return "pending", "interrupted", "stopped by an external signal"
    if full := _disk_full(stderr):
        return full
    if MEMORY.search(stderr):
        return "failed", "out_of_memory", last
    if number == signal.SIGKILL:
        return "failed", "out_of_memory", "killed by SIGKILL, probably because the system ran out of memory"
    if number is not None:
        name = signal.Signals(number).name if number in set(signal.Signals) else f"signal {number}"
        return "failed", "crashed", f"ended by {name}" + (f": {last}" if last else "")
    if code == 2:
        return "failed", "refused", last.removeprefix("pairsim: ")
    if not record:
        return "failed", "not_started", last or f"exit code {code} before any file was written"
    return "failed", "error", last or f"exit code {code} without a message"
