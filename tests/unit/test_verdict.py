"""Outcomes of cases in child processes, and the environment of these processes."""

from __future__ import annotations

import os

import pytest

from pairsim.runtime.child_process import clean_environment
from pairsim.sweeps.verdict import judge

FAILED = {"status": "failed"}


@pytest.mark.parametrize(
    ("code", "run", "stderr", "stopped", "expected"),
    [
        (0, {"status": "finished", "reason": "contact"}, "", "", ("finished", "contact")),
        (0, {"status": "finished", "reason": "end"}, "", "timeout", ("finished", "end")),
        (3, {"status": "failed", "reason": "newton_diverged"}, "", "", ("failed", "newton_diverged")),
        (3, {"status": "failed", "reason": "wall_time"}, "", "", ("timeout", "wall_time")),
        (
            3,
            {"reason": "write_failed", "message": "[Errno 28] No space left"} | FAILED,
            "",
            "",
            ("failed", "disk_full"),
        ),
        (3, {"reason": "write_failed", "message": "Permission denied"} | FAILED, "", "", ("failed", "write_failed")),
        (130, {"status": "interrupted"}, "", "timeout", ("timeout", "case_timeout")),
        (-9, {"status": "running"}, "", "timeout", ("timeout", "case_timeout")),
        (130, {"status": "interrupted"}, "", "interrupted", ("pending", "interrupted")),
        (130, {"status": "interrupted"}, "", "", ("pending", "interrupted")),
        (-11, {"status": "running"}, "", "", ("failed", "crashed")),
        (-9, {"status": "running"}, "", "", ("failed", "out_of_memory")),
        (1, {"status": "running"}, "MemoryError", "", ("failed", "out_of_memory")),
        (1, {"status": "running"}, "OSError: [Errno 28] No space left on device", "", ("failed", "disk_full")),
        (1, {"status": "running"}, "write failed (errno = 27, error message)", "", ("failed", "disk_full")),
        (1, {"status": "running"}, "ValueError: odd", "", ("failed", "error")),
        (1, {}, "ImportError: libmpi", "", ("failed", "not_started")),
        (2, {}, "pairsim: mpirun: De: got 1", "", ("failed", "refused")),
    ],
)
def test_ends_have_typed_reasons(
    code: int, run: dict[str, str], stderr: str, stopped: str, expected: tuple[str, str]
) -> None:
    status, reason, message = judge(code, run, stderr, stopped, 5.0)
    assert (status, reason) == expected
    assert "SIGSEGV" in message or reason != "crashed"


def test_child_does_not_take_itself_for_a_rank(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("PMI_RANK", "PMI_FD", "MPI_LOCALNRANKS", "SLURM_PROCID", "OMPI_COMM_WORLD_RANK", "HYDI_CONTROL_FD"):
        monkeypatch.setenv(name, "1")
    monkeypatch.setenv("OMP_NUM_THREADS", "8")
    environment = clean_environment()
    assert not [name for name in environment if name.startswith(("PMI", "MPI_", "SLURM_", "OMPI_C", "HYDI"))]
    assert environment["OMP_NUM_THREADS"] == "1"
    assert environment["PATH"] == os.environ["PATH"]
