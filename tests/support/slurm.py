"""A Slurm of one node in a folder of its own: munged, slurmctld and slurmd without systemd."""

from __future__ import annotations

import contextlib
import ctypes
import getpass
import os
import platform
import secrets
import shutil
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterable
from pathlib import Path

from support.commands import descendants

PACKAGES = {"munged": "munge", "slurmctld": "slurmctld", "slurmd": "slurmd", "sbatch": "slurm-client"}
"""Programs and the packages of Debian that have them."""
# `pairsim` is that of this Python; the daemons are not on the PATH of everybody.
PATH = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"], "/usr/sbin", "/sbin"])
POLL = 0.2  # [s]
CONFIGURATION = """\
ClusterName=trial
SlurmctldHost={host}(127.0.0.1)
SlurmUser={user}
SlurmdUser={user}
SlurmctldPort={controller_port}
SlurmdPort={node_port}
AuthType=auth/munge
AuthInfo=socket={folder}/munge.sock,cred_expire=5
CredType=cred/munge
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core_Memory
SchedulerParameters=sched_interval=2,bf_interval=2
SlurmdParameters=config_overrides
ReturnToService=2
MpiDefault=none
DefMemPerCPU=1000
NodeName={host} NodeAddr=127.0.0.1 CPUs=2 RealMemory=4000 State=UNKNOWN
PartitionName=all Nodes={host} Default=YES MaxTime=INFINITE State=UP
"""
CGROUP = "CgroupPlugin=cgroup/v1\nCgroupAutomount=no\n"  # not used, but slurmd 22.05 reads it and knows no `disabled`
_PR_SET_CHILD_SUBREAPER = 36


def missing() -> list[str]:
    """Packages of Debian whose programs are not installed."""
    return [package for program, package in PACKAGES.items() if shutil.which(program, path=PATH) is None]


def wait_for(what: str, condition: Callable[[], object], seconds: float) -> None:
    """Wait until a condition holds."""
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, f"waited {seconds:g} s in vain: {what}"
        time.sleep(POLL)


def free_port() -> int:
    """A port of 127.0.0.1 that nobody listens at."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


class Slurm:
    """A Slurm of this machine.

    Args:
        folder: An existing folder for configuration, state and logs, with a short name: there are sockets in it.
        work: The folder that commands run in.
    """

    def __init__(self, folder: Path, work: Path) -> None:
        self.folder, self.work, self.host = folder, work, platform.node().partition(".")[0]
        self.environment = os.environ | {"SLURM_CONF": str(folder / "slurm.conf"), "PATH": PATH}
        self._before = set(descendants(os.getpid()))

    def start(self) -> None:
        """Start all of it."""
        # slurmd and srun leave processes without a parent; they become children of this one, which can find them.
        ctypes.CDLL(None).prctl(_PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)
        for name in ("state", "spool"):
            (self.folder / name).mkdir()
        (self.folder / "munge.key").touch(mode=0o600)
        (self.folder / "munge.key").write_bytes(secrets.token_bytes(128))
        ports = {"controller_port": free_port(), "node_port": free_port()}
        places = {"folder": self.folder, "host": self.host, "user": getpass.getuser()}
        text = CONFIGURATION.format(**places, **ports)
        (self.folder / "slurm.conf").write_text(text)
        (self.folder / "cgroup.conf").write_text(CGROUP)
        files = {"key-file": "munge.key", "socket": "munge.sock", "pid-file": "munge.pid", "seed-file": "munge.seed"}
        options = [f"--{option}={self.folder / name}" for option, name in files.items()]
        self._start("munged", "--foreground", "--force", *options)  # --force: a folder that others cannot enter
        wait_for("munged", (self.folder / "munge.sock").exists, 10)
        self._start("slurmctld", "-D")
        self._start("slurmd", "-D")
        wait_for("the node is up", lambda: self.ask("sinfo", "--noheader", "--format", "%T") == "idle", 60)

    def _start(self, program: str, *options: str) -> None:
        found = shutil.which(program, path=PATH)
        assert found is not None
        command = ["setpriv", "--pdeathsig", "KILL", found, *options]  # it ends with this process, however that ends
        with (self.folder / f"{program}.out").open("ab") as out:
            subprocess.Popen(
                command, env=self.environment, stdin=subprocess.DEVNULL, stdout=out, stderr=out, process_group=0
            )

    def _processes(self) -> set[int]:
        """All processes that came of it."""
        return set(descendants(os.getpid())) - self._before

    def run(self, command: str) -> str:
        """Run a line of shell that must succeed; returns its output, which is printed, too."""
        print(f"$ {command}", flush=True)
        done = subprocess.run(
            command, shell=True, cwd=self.work, env=self.environment, capture_output=True, text=True, check=False
        )
        print(done.stdout + done.stderr, flush=True)
        assert done.returncode == 0
        return done.stdout + done.stderr

    def ask(self, *command: str) -> str:
        """Output of a command of Slurm, without line ends; empty if it fails."""
        done = subprocess.run(command, env=self.environment, capture_output=True, text=True, timeout=60, check=False)
        return done.stdout.strip() if done.returncode == 0 else ""

    def job(self, number: str) -> dict[str, str]:
        """What Slurm knows of a job, such as JobState and Restarts; empty if nothing."""
        words = self.ask("scontrol", "--oneliner", "show", "job", number).split()
        return dict(word.split("=", 1) for word in words if "=" in word)

    def submit(self, words: str) -> str:
        """Submit a script, which options of sbatch may precede, and return the number of the job."""
        return self.run(f"sbatch --parsable {words}").strip()

    def wait_for_end(self, job: str) -> None:
        """Wait until no task of a job is in the queue."""
        queue = ("squeue", "--noheader", "--jobs", job, "--format", "%T")
        wait_for(f"job {job} ends", lambda: not self.ask(*queue), 300)

    def stop(self) -> None:
        """Kill all processes that came of it, and print the last lines of its logs."""
        while left := self._processes():  # a killed process may leave children that have just become those of this one
            kill(left)
            time.sleep(POLL / 4)
            for pid in left:
                with contextlib.suppress(ChildProcessError):
                    os.waitpid(pid, os.WNOHANG)
        ctypes.CDLL(None).prctl(_PR_SET_CHILD_SUBREAPER, 0, 0, 0, 0)
        for log in sorted([*self.folder.glob("slurm*.log"), *self.work.glob("*.log")]):
            print(f"\n{log.name}:", *log.read_text().splitlines()[-10:], sep="\n  ")


def kill(pids: Iterable[int]) -> None:
    """Send SIGKILL to processes, some of which may have ended."""
    for pid in pids:
        with contextlib.suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)
