"""What a process learns about its Slurm job."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from pairsim.runtime.slurm import job_end


@pytest.fixture
def squeue(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A job 7 of a Slurm that does not set SLURM_JOB_END_TIME, and the place of its squeue."""
    monkeypatch.setenv("PATH", f"{tmp_path}:{os.environ['PATH']}")
    monkeypatch.setenv("SLURM_JOB_ID", "7")
    monkeypatch.delenv("SLURM_JOB_END_TIME", raising=False)
    return tmp_path / "squeue"


def put(squeue: Path, text: str) -> None:
    squeue.write_text(f"#!/bin/sh\n{text}\n")
    squeue.chmod(0o755)


def test_squeue_tells_the_end_of_a_job(squeue: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    put(squeue, '[ "$*" = "--noheader --jobs 7 --format %e" ] && [ "$SLURM_TIME_FORMAT" = %s ] && echo 1795404006')
    assert job_end() == 1795404006
    monkeypatch.setenv("SLURM_JOB_END_TIME", "12")
    assert job_end() == 12


@pytest.mark.parametrize("text", ["echo NONE", "exit 1", "echo error >&2"])
def test_a_job_without_an_end(squeue: Path, text: str) -> None:
    put(squeue, text)
    assert job_end() is None


def test_outside_of_slurm_nobody_is_asked(squeue: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    put(squeue, "echo 1795404006")
    monkeypatch.delenv("SLURM_JOB_ID")
    assert job_end() is None
