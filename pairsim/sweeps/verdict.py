"""What became of a case in a process of its own: status, reason and message from all that it leaves."""

from __future__ import annotations

import errno
import os
import re
import signal
from typing import Any

from pairsim.runtime.child_process import FULL, TOO_LARGE

MEMORY = re.compile(r"MemoryError|std::bad_alloc|Cannot allocate memory|Out of memory")


def _disk_full(text: str) -> tuple[str, str, str] | None:
    """Status, reason and message, where a text tells of a full disk or of a limit on the size of files."""
    for pattern, number in ((TOO_LARGE, errno.EFBIG), (FULL, errno.ENOSPC)):
        if pattern.search(text):
            return "failed", "disk_full", f"could not write: {os.strerror(number)}"
    return None


def judge(code: int, told: dict[str, Any], stderr: str, stopped: str, seconds: float) -> tuple[str, str, str]:
    """Status, reason and message of a child that has ended.

    Args:
        code: Exit code; negative: the signal that ended it.
        told: Its run.json.
        stderr: The last of what it said.
        stopped: Why the sweep had asked it to stop: "", "timeout" or "interrupted".
        seconds: How long it ran.
    """
    lines = [line for line in stderr.splitlines() if line.strip()]
    last = lines[-1].strip() if lines else ""
    number = -code if code < 0 else None
    if match := re.search(r"EXIT STRING:.*\(signal (\d+)\)", stderr):  # mpirun tells of a rank
        number = int(match[1])
    status = told.get("status")
    if code == 0 and status == "finished":
        return "finished", told.get("reason", ""), told.get("message", "")
    if stopped == "timeout":
        return "timeout", "case_timeout", f"stopped after {seconds:.0f} s"
    if stopped:
        return "pending", "interrupted", "stopped with the sweep"
    if code == 3 and status == "failed":
        reason, message = told.get("reason", "failed"), told.get("message", "")
        if reason == "write_failed" and (full := _disk_full(message)):
            return full  # nothing is wrong with the case: it goes on when there is room
        return ("timeout" if reason == "wall_time" else "failed"), reason, message
    if code in (130, -signal.SIGTERM, -signal.SIGINT):
        return "pending", "interrupted", "a signal from outside stopped it"
    if full := _disk_full(stderr):
        return full
    if MEMORY.search(stderr):
        return "failed", "out_of_memory", last
    if number == signal.SIGKILL:
        return "failed", "out_of_memory", "killed from outside by SIGKILL, as the system does when memory runs out"
    if number is not None:
        name = signal.Signals(number).name if number in set(signal.Signals) else f"signal {number}"
        return "failed", "crashed", f"ended by {name}" + (f": {last}" if last else "")
    if code == 2:
        return "failed", "refused", last.removeprefix("pairsim: ")
    if not told:
        return "failed", "not_started", last or f"exit code {code} before anything was written"
    return "failed", "error", last or f"exit code {code} without a word"
