"""A Slurm of one node in a folder of its own: munged, slurmctld and slurmd without systemd; for slurm_test.py."""

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
import time
from collections.abc import Callable
from pathlib import Path

from pairsim.runtime.child_process import descendants

PACKAGES = {"munged": "munge", "slurmctld": "slurmctld", "slurmd": "slurmd", "sbatch": "slurm-client"}
"""Programs and the packages of Debian that have them."""
PATH = f"{os.environ['PATH']}:/usr/sbin:/sbin"  # the daemons are not on the PATH of everybody
POLL = 0.2  # [s]
DOWN_AFTER = 6  # seconds without an answer after which Slurm gives a node up
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
SlurmdTimeout={down_after}
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
    """Wait until a condition holds.

    Raises:
        TimeoutError: It does not hold after so many seconds.
    """
    end = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > end:
            raise TimeoutError(f"waited {seconds:g} s in vain: {what}")
        time.sleep(POLL)


def free_port() -> int:
    """A port of 127.0.0.1 that nobody listens at."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def program_of(pid: int) -> str:
    """The first word of the command line of a process; empty if there is none."""
    with contextlib.suppress(OSError):
        return Path(f"/proc/{pid}/cmdline").read_text(errors="replace").partition("\0")[0]
    return ""


class SlurmNode:
    """Context manager: a running Slurm of this machine; at its end all processes that came of it are killed.

    Args:
        folder: An existing folder for configuration, state and logs.

    Attributes:
        environment: The environment in which sbatch, srun and squeue speak to this Slurm.
    """

    def __init__(self, folder: Path) -> None:
        self.folder, self.host = folder, platform.node().partition(".")[0]
        self.environment = {**os.environ, "SLURM_CONF": str(folder / "slurm.conf")}
        self._daemons: dict[str, subprocess.Popen[bytes]] = {}

    def __enter__(self) -> SlurmNode:
        # slurmd and srun leave processes without a parent; they become children of this one, which can find them.
        ctypes.CDLL(None).prctl(_PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)
        for name in ("state", "spool"):
            (self.folder / name).mkdir()
        key = self.folder / "munge.key"
        key.touch(mode=0o600)
        key.write_bytes(secrets.token_bytes(128))
        ports = {"controller_port": free_port(), "node_port": free_port()}
        places = {"folder": self.folder, "host": self.host, "user": getpass.getuser()}
        text = CONFIGURATION.format(**places, **ports, down_after=DOWN_AFTER)
        (self.folder / "slurm.conf").write_text(text)
        (self.folder / "cgroup.conf").write_text(CGROUP)
        try:
            # --force: it is content with a folder that others cannot enter.
            names = {
                "key-file": "munge.key",
                "socket": "munge.sock",
                "pid-file": "munge.pid",
                "seed-file": "munge.seed",
            }
            options = [f"--{option}={self.folder / name}" for option, name in names.items()]
            self._start("munged", "--foreground", "--force", *options)
            wait_for("munged", (self.folder / "munge.sock").exists, 10)
            self._start("slurmctld", "-D")
            self.start_node()
        except BaseException:
            self.__exit__()
            raise
        return self

    def _start(self, program: str, *options: str) -> None:
        found = shutil.which(program, path=PATH)
        assert found is not None
        # A daemon ends with this process, however that ends.
        command = ["setpriv", "--pdeathsig", "KILL", found, *options]
        with (self.folder / f"{program}.out").open("ab") as out:
            self._daemons[program] = subprocess.Popen(
                command, env=self.environment, stdin=subprocess.DEVNULL, stdout=out, stderr=out, process_group=0
            )

    def start_node(self) -> None:
        """Start slurmd, and wait until the controller takes the node for usable."""
        self._start("slurmd", "-D")
        wait_for("the node is up", lambda: self.state() in ("idle", "mixed", "allocated"), 60)

    def kill_node(self, jobs: bool) -> None:
        """Kill slurmd and, as the crash of a node would, its jobs, too."""
        self._daemons["slurmd"].kill()
        self._daemons.pop("slurmd").wait()
        if jobs:
            for step in [pid for pid in descendants(os.getpid()) if "slurmstepd" in program_of(pid)]:
                for pid in descendants(step):
                    with contextlib.suppress(ProcessLookupError):
                        os.kill(pid, signal.SIGKILL)

    def ask(self, *command: str) -> str:
        """Output of a command of Slurm, without line ends; empty if it fails."""
        done = subprocess.run(command, env=self.environment, capture_output=True, text=True, timeout=60, check=False)
        return done.stdout.strip() if done.returncode == 0 else ""

    def state(self) -> str:
        """State of the node, such as idle, or `down*`."""
        return self.ask("sinfo", "--noheader", "--format", "%T")

    def job(self, number: str) -> dict[str, str]:
        """What Slurm knows of a job, such as JobState and Restarts; empty if nothing."""
        words = self.ask("scontrol", "--oneliner", "show", "job", number).split()
        return dict(word.split("=", 1) for word in words if "=" in word)

    def __exit__(self, *_: object) -> None:
        # A killed process may leave children that have just become those of this process.
        for _round in range(50):
            if not (left := descendants(os.getpid())[1:]):
                break
            for pid in left:
                with contextlib.suppress(ProcessLookupError):
                    os.kill(pid, signal.SIGKILL)
            with contextlib.suppress(ChildProcessError):
                while os.waitpid(-1, os.WNOHANG)[0]:
                    pass
            time.sleep(POLL / 4)
