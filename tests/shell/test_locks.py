"""One writer for each folder: a second command is refused and names the first one, and a killed owner is none."""

from __future__ import annotations

import errno
import json
import os
import platform
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from support.commands import Done, Pairsim, at_work
from support.inputs import SMALL

from pairsim.record.folder import prepare_folder
from pairsim.record.table_files import read_table
from pairsim.record.xdmf import read_frame
from pairsim.runtime.errors import InputError
from pairsim.runtime.locks import LOCK_FILES, is_locked, sole_writer

ENDLESS = f"{{d0: 0.1, {SMALL}, time: {{end: 100, fixed_step: 0.002}}, output: {{every: 0.01, checkpoint: 1}}}}\n"


def refused(done: Done, owner: subprocess.Popen[str]) -> None:
    assert done.returncode == 2, done.stdout + done.stderr
    assert "Traceback" not in done.stderr
    assert f"process {owner.pid} on {platform.node()}: pairsim run" in done.stderr


@pytest.mark.slow
def test_second_run_is_refused_and_the_first_one_is_whole(tmp_path: Path, pairsim: Pairsim) -> None:
    (tmp_path / "case.yaml").write_text(ENDLESS)
    out = tmp_path / "out"
    with at_work(out / "series.csv", "run", "case.yaml", "-o", "out") as first:
        refused(pairsim("run", "case.yaml", "--resume", "out", "-q"), first)
        refused(pairsim("run", "case.yaml", "-o", "out", "--overwrite", "-q"), first)
        assert is_locked(out)
        first.send_signal(signal.SIGTERM)
        assert first.wait(timeout=100) == 130
    record, series = json.loads((out / "run.json").read_text()), read_table(out / "series.csv")
    assert len(series["t"]) == record["steps"]
    assert read_frame(out, -1).t == pytest.approx(series["t"][-1])
    assert not {file.name for file in out.iterdir()} & {*LOCK_FILES}


@pytest.fixture(params=[0, errno.ENOSYS], ids=lambda number: f"errno {number}")
def killed_owner(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> str:
    """A program that is killed while it has a lock; here and there a file system is without `flock`, if not 0.

    As Lustre without `-o flock`.
    """
    program = "import os, pathlib, sys; from pairsim.runtime.locks import sole_writer\n"
    if request.param:

        def refuse(file: int, kind: int) -> None:
            raise OSError(request.param, os.strerror(request.param))

        monkeypatch.setattr("fcntl.flock", refuse)
        program += f"import fcntl\ndef refuse(*_): raise OSError({request.param}, '')\nfcntl.flock = refuse\n"
    return f"{program}with sole_writer(pathlib.Path(sys.argv[1]), ''): os.kill(os.getpid(), 9)"


@pytest.mark.filterwarnings("ignore:flock not supported")
def test_one_writer_on_every_file_system(killed_owner: str, tmp_path: Path) -> None:
    folder = tmp_path / "out"
    with sole_writer(folder, "pairsim run"):
        assert is_locked(folder)
        owner = f"process {os.getpid()} on {platform.node()}: pairsim run"
        with pytest.raises(InputError, match=owner), sole_writer(folder, "another"):
            pass
        prepare_folder(folder)  # locked, and empty all the same
    assert not is_locked(folder)
    assert not folder.exists()
    subprocess.run([sys.executable, "-c", killed_owner, folder], check=False)
    assert list(folder.iterdir())
    assert not is_locked(folder)
    with sole_writer(folder, "pairsim run"):
        pass
    assert not list(folder.iterdir())


def test_a_folder_that_cannot_be_written_can_be_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(path: str, flags: int, mode: int = 0o777, **_: int) -> int:
        if flags & (os.O_WRONLY | os.O_RDWR | os.O_CREAT):
            raise OSError(errno.EROFS, os.strerror(errno.EROFS), path)
        return real(path, flags, mode)

    for name in LOCK_FILES:  # left by a killed run
        (tmp_path / name).touch()
    real = os.open
    monkeypatch.setattr("os.open", refuse)
    assert not is_locked(tmp_path)
    with pytest.raises(InputError, match="cannot be used as a folder"), sole_writer(tmp_path, "pairsim run"):
        pass


@pytest.mark.parametrize(
    ("name", "command"), [("PMI_SIZE", "run"), ("OMPI_COMM_WORLD_SIZE", "curve"), ("SLURM_STEP_NUM_TASKS", "sweep")]
)
def test_processes_that_do_not_see_each_other_are_refused(
    name: str, command: str, tmp_path: Path, pairsim: Pairsim, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With a launcher of another MPI, each process would run the same case in the same folder."""
    monkeypatch.setenv(name, "2")
    case = {"run": "{d0: 0.1, ", "curve": "{d: [0.1], ", "sweep": "{grid: {d0: [0.1]}, base: {"}[command] + SMALL
    (tmp_path / "case.yaml").write_text(case + ("}}" if command == "sweep" else "}"))
    done = pairsim(command, "case.yaml", "-o", "out", timeout=60)
    assert done.returncode == 2
    assert "2 processes that do not see each other" in done.stderr
    assert "Traceback" not in done.stderr
    assert not (tmp_path / "out").exists()
