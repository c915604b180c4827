"""Frames of fields survive SIGKILL at every moment of writing, of resuming and of gathering them in one file."""

from __future__ import annotations

import os
import shutil
import signal
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from support.field_samples import scene

from pairsim.results import xdmf
from pairsim.results.fields_writer import FieldsWriter, gather_frames
from pairsim.results.output import frame_files
from pairsim.results.xdmf import FieldFrame, read_frame, read_times

FRAMES = [scene(0.1 * (k + 1), [(0.02 * k, 0.2, 0.2)], mesh_id=k // 3, rays=8 + k // 3) for k in range(10)]
"""With a new mesh at every third frame."""
EVENTS = {"open", "os.rename", "os.remove", "os.mkdir", "os.rmdir", "os.truncate", "os.link"}
"""Audit events of Python before the operations that change files."""


def in_child(work: Callable[[], None], kill_at: int = -1, kill_after: float = np.inf) -> tuple[bool, int]:
    """Do something in a forked process that is killed.

    Args:
        work: The work; it writes to standard output.
        kill_at: Number of the operation on files before which it is killed.
        kill_after: Seconds after its first output when it is killed.

    Returns:
        Whether it was killed, and how much it wrote to standard output [bytes].
    """
    told, tell = os.pipe()
    if not (child := os.fork()):
        try:
            os.dup2(tell, 1)
            count = 0

            def watch(event: str, _: object) -> None:
                nonlocal count
                if event in EVENTS:
                    if count == kill_at:
                        os.kill(os.getpid(), signal.SIGKILL)
                    count += 1

            sys.addaudithook(watch)
            work()
        finally:
            os._exit(sys.exc_info()[0] is not None)
    os.close(tell)
    with open(told, "rb", buffering=0) as file:
        said = 0
        if np.isfinite(kill_after):
            said = len(file.read(1))
            time.sleep(kill_after)
            os.kill(child, signal.SIGKILL)
        _, status = os.waitpid(child, 0)
        killed = os.WIFSIGNALED(status)
        assert killed or os.waitstatus_to_exitcode(status) == 0
        return killed, said + len(file.readall())


def append(folder: Path, keep: int, count: int) -> None:
    """Go on after some frames, and say so, and after each frame that it is written."""
    writer = FieldsWriter(folder, keep)
    os.write(1, b"." * keep)
    for frame in FRAMES[writer.frames : count]:
        writer.write(frame)
        os.write(1, b".")


def assert_frames(folder: Path, least: int) -> int:
    """At least so many frames are there and are what was written; returns how many there are."""
    times = read_times(folder)
    assert len(times) >= least
    assert times.tolist() == [frame.t for frame in FRAMES[: len(times)]]
    for k, frame in enumerate(FRAMES[: len(times)]):
        back = read_frame(folder, k)
        assert back.mesh_id == frame.mesh_id
        for name in ("points", "cells", "region"):
            assert np.array_equal(getattr(back, name), getattr(frame, name))
        for name, values in frame.point_data.items():
            assert np.array_equal(back.point_data[name], values)
    return len(times)


def frames_in(folder: Path, count: int, gathered: bool = False) -> Path:
    """A folder with some frames."""
    folder.mkdir()
    writer = FieldsWriter(folder)
    for frame in FRAMES[:count]:
        writer.write(frame)
    if gathered:
        gather_frames(folder)
    return folder


@pytest.mark.slow
@pytest.mark.parametrize("gathered", [False, True])
def test_no_frame_is_lost_at_any_operation_of_a_resumed_writer(gathered: bool, tmp_path: Path) -> None:
    """It removes two frames that came after the checkpoint, and writes one of them again."""
    old, folder, operation, killed = frames_in(tmp_path / "old", 4, gathered), tmp_path / "run", 0, True
    while killed:
        shutil.copytree(old, folder)
        killed, said = in_child(lambda: append(folder, 2, 3), operation)
        assert_frames(folder, max(2, said))
        append(folder, 2, 3)
        assert assert_frames(folder, 3) == 3
        assert [number for number, _ in frame_files(folder)] == ([2] if gathered else [0, 1, 2])
        shutil.rmtree(folder)
        operation += 1
    assert operation > 10


@pytest.mark.slow
@pytest.mark.parametrize("gathered", [0, 2])
def test_no_frame_is_lost_at_any_operation_of_gathering(gathered: int, tmp_path: Path) -> None:
    """Of all frames, or of two that came after the others had been gathered."""
    old, folder, operation, killed = frames_in(tmp_path / "old", gathered, gathered=True), tmp_path / "run", 0, True
    append(old, gathered, 4)
    while killed:
        shutil.copytree(old, folder)
        killed, _ = in_child(lambda: gather_frames(folder), operation)
        assert assert_frames(folder, 4) == 4
        gather_frames(folder)
        assert sorted(path.name for path in folder.iterdir()) == ["fields.h5", "fields.xdmf", "fields_last.xdmf"]
        assert assert_frames(folder, 4) == 4
        shutil.rmtree(folder)
        operation += 1
    assert operation > 10


@pytest.mark.slow
def test_no_frame_is_lost_by_a_kill_within_an_operation(tmp_path: Path) -> None:
    """At 30 moments, also while HDF5 is at work.

    The ninth frame is one at which a single HDF5 file with all of them is most at risk: its list of frames no longer
    fits into one node, so that those before are listed anew.
    """
    old, folder, count = frames_in(tmp_path / "old", 8), tmp_path / "run", 0
    for moment in np.linspace(0, 0.02, 30):
        shutil.copytree(old, folder)
        killed, said = in_child(lambda: append(folder, 8, 9), kill_after=float(moment))
        assert assert_frames(folder, said) <= 9
        writer = FieldsWriter(folder, keep=said)
        assert writer.frames == said
        shutil.rmtree(folder)
        count += killed
    assert count > 5


def test_frames_that_cannot_be_read_cost_no_others(tmp_path: Path) -> None:
    """A file that something else than pairsim has damaged."""
    folder = frames_in(tmp_path / "run", 5)
    damaged = folder / "fields" / "000001.h5"
    damaged.write_bytes(damaged.read_bytes()[:5000])
    writer = FieldsWriter(folder, keep=4)
    assert writer.frames == 3
    writer.write(FRAMES[4])
    assert read_times(folder).tolist() == [FRAMES[k].t for k in (0, 2, 3, 4)]
    assert [number for number, _ in frame_files(folder)] == [0, 1, 2, 3, 4]
    gather_frames(folder)
    assert [read_frame(folder, k).t for k in range(4)] == [FRAMES[k].t for k in (0, 2, 3, 4)]


def test_a_full_disk_costs_no_frames(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = frames_in(tmp_path / "run", 4)
    before = {path: path.read_bytes() for path in folder.rglob("*.*")}

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "posix_fallocate", full)
    with pytest.raises(OSError, match="No space left"):
        gather_frames(folder)
    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match="No space left"):
        FieldsWriter(folder, keep=4)
    assert {path: path.read_bytes() for path in folder.rglob("*.*")} == before


def test_frames_of_a_run_that_has_ended_meanwhile_are_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A reader has looked up where a frame is just before the frames are gathered."""
    folder = frames_in(tmp_path / "run", 3)
    found = xdmf._read

    def late(*arguments: object) -> FieldFrame:
        monkeypatch.setattr(xdmf, "_read", found)
        gather_frames(folder)
        return found(*arguments)

    monkeypatch.setattr(xdmf, "_read", late)
    assert read_frame(folder, 1).t == FRAMES[1].t
