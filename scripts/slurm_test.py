"""pairsim on a real Slurm of one node, which is started in a temporary folder and stopped in any case; takes minutes.

usage: scripts/slurm-test

Array of --emit slurm, srun of a sweep and of a run on two processes, time limit by Slurm's signal and by the end that
squeue tells, scancel, requeue, slurmd killed, crash of the node, and submission until all is done. Tables are compared
with those of the same commands without Slurm. Installs nothing; says which packages of Debian are missing.

Exit codes: 0 all of it was done and is right, 1 it was not, 2 Slurm is not installed. At most ten minutes.
"""

from __future__ import annotations

import csv
import shlex
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from types import FrameType

from slurm_node import SlurmNode, missing, wait_for

from pairsim.results.checkpoint import load
from pairsim.runtime.child_process import clean_environment, module_command

LIMIT = 600  # seconds for everything
CASE = "{beta: 0.4, De: 0, Ca_e: 0.1, d0: 0.1, ends: developed, length: 3, mesh: {Np: 8}, output: {fields: false}}\n"
SHORT = "base: case.yaml\ngrid: {d0: [0.1, 0.15, 0.2, 0.25], time.end: [0.01]}\n"
# Steps of some milliseconds: 5,600, so that there is time to stop them, and more than anyone waits for.
LONG = "base: case.yaml\ngrid: {d0: [0.1, 0.2], time.end: [0.14], time.fixed_step: [5.0e-5]}\n"
ENDLESS = "base: case.yaml\ngrid: {d0: [0.1], time.end: [100], time.fixed_step: [5.0e-5]}\n"
TINY = ("mesh.Np = 8 is coarser", "of tube on each side")  # warnings of the cases that are not printed
PROGRESS = 200  # rows of a series after which a job has got on
ROUNDING = 1e-10  # by how much a run on two processes may differ


class Mismatch(Exception):
    """What was seen is not what must be."""


def require(condition: bool, what: str) -> None:
    """Print what is required.

    Raises:
        Mismatch: It is not so.
    """
    if not condition:
        raise Mismatch(f"not so: {what}")
    print(f"  ok: {what}", flush=True)


class Trial:
    """What is done with a Slurm.

    Args:
        node: The Slurm.
        folder: Where cases and results are.
    """

    def __init__(self, node: SlurmNode, folder: Path) -> None:
        self.node, self.folder, self.begin = node, folder, time.monotonic()

    def part(self, title: str) -> None:
        print(f"\n# {title} [{time.monotonic() - self.begin:.0f} s]", flush=True)

    def run(self, words: str, code: int = 0, slurm: bool = True) -> str:
        """Run a command, in which `pairsim` is that of this Python, and print it with its output.

        Args:
            words: The command line.
            code: The exit code it must have.
            slurm: Whether it can speak to Slurm; if not it cannot know of it either.

        Returns:
            Its output.

        Raises:
            Mismatch: It has another exit code.
        """
        print(f"$ {words}", flush=True)
        argv = [part for word in shlex.split(words) for part in (module_command(word) if word == "pairsim" else [word])]
        environment = self.node.environment if slurm else clean_environment()
        done = subprocess.run(argv, cwd=self.folder, env=environment, capture_output=True, text=True, check=False)
        output = done.stdout + done.stderr
        for line in output.splitlines():
            if not any(warning in line for warning in TINY):
                print(f"  {line}", flush=True)
        if done.returncode != code:
            raise Mismatch(f"exit code {done.returncode}, not {code}")
        return output

    def emit(self, script: str, words: str) -> None:
        """Write a job script with `pairsim sweep --emit slurm`; only its directives are printed."""
        command = f"pairsim sweep {words} --emit slurm"
        print(f"$ {command} > {script}", flush=True)
        argv = module_command(*shlex.split(command))
        done = subprocess.run(argv, cwd=self.folder, capture_output=True, text=True, check=True)
        (self.folder / script).write_text(done.stdout)
        for line in done.stdout.splitlines():
            if line.startswith(("#SBATCH --array", "#SBATCH --time", "#SBATCH --mem")):
                print(f"  {line}")
        for line in done.stderr.splitlines():
            print(f"  {line}", flush=True)

    def submit(self, words: str) -> str:
        """Submit a script, which options of sbatch may precede, and return the number of the job."""
        return self.run(f"sbatch --parsable {words}").strip()

    def ended(self, job: str, seconds: float = 300) -> None:
        """Wait until no task of a job is in the queue."""
        wait_for(
            f"job {job} ends",
            lambda: not self.node.ask("squeue", "--noheader", "--jobs", job, "--format", "%T"),
            seconds,
        )

    def rows(self, name: str) -> int:
        """Rows of all series of a sweep."""
        return sum(path.read_text().count("\n") - 1 for path in (self.folder / name).glob("*/series.csv"))

    def gets_on(self, name: str) -> None:
        """Wait until a sweep has computed something since now."""
        written = [path.stat().st_mtime for path in (self.folder / name).glob("*/series.csv")]

        def begun() -> bool:
            now = [path.stat().st_mtime for path in (self.folder / name).glob("*/series.csv")]
            return now != written

        wait_for(f"{name} begins", begun, 90)
        rows = self.rows(name)
        wait_for(f"{name} gets on", lambda: self.rows(name) > rows + PROGRESS, 90)

    def stopped_in_order(self, name: str) -> None:
        """Check that the checkpoint of a stopped case has all of its rows."""
        for path in (self.folder / name).glob("*/checkpoint.npz"):
            checkpoint, rows = load(path.parent), (path.parent / "series.csv").read_text().count("\n") - 1
            assert checkpoint is not None
            require(checkpoint.rows == rows, f"the checkpoint of {path.parent.name} has all {rows} rows")

    def same_tables(self, name: str, reference: str) -> None:
        """Compare results.csv, without wall times, and all series of two sweeps, to the last digit."""
        for one, other in zip(table(self.folder / name), table(self.folder / reference), strict=True):
            del one["wall_time"], other["wall_time"]
            if one != other:
                raise Mismatch(f"{name} differs from {reference}: {one} and {other}")
        for path in sorted((self.folder / reference).glob("*/series.csv")):
            twin = self.folder / name / path.parent.name / path.name
            if twin.read_bytes() != path.read_bytes():
                raise Mismatch(f"{twin} differs from {path}")
        require(True, f"{name}/results.csv and all series are those of {reference}, to the last digit")

    # What is tried, in this order.

    def references(self) -> None:
        self.part("The same without Slurm")
        for command in ("sweep short.yaml -o local", "sweep long.yaml -o local-long --workers 2"):
            self.run(f"pairsim {command} -q", slurm=False)
        self.run("pairsim run case.yaml -o local-run --set time.end=0.01 -q", slurm=False)

    def array(self) -> None:
        self.part("A job array")
        self.emit("short.sh", "short.yaml -o array --shard 1/2")
        self.ended(self.submit("short.sh"))
        self.run("pairsim sweep short.yaml -o array")
        self.same_tables("array", "local")

    def two_processes(self) -> None:
        self.part("Two processes by srun")
        self.run("srun --mpi=pmi2 -n 2 pairsim sweep short.yaml -o srun")
        self.same_tables("srun", "local")
        self.run("srun --mpi=pmi2 -n 2 pairsim run case.yaml -o srun-run --set time.end=0.01 -q")
        one, two = ((self.folder / name / "series.csv").read_text().splitlines() for name in ("srun-run", "local-run"))
        last, other = ([float(cell) for cell in lines[-1].split(",")[:9]] for lines in (one, two))
        difference = max(abs(a - b) for a, b in zip(last, other, strict=True))
        require(
            len(one) == len(two) and difference < ROUNDING, f"as on one process: largest difference {difference:.0e}"
        )

    def time_limit(self) -> None:
        self.part("The time limit: by Slurm's signal, and by the end that squeue tells")
        self.emit("hurried.sh", "endless.yaml -o endless --walltime 0:02:00")
        job = self.submit("hurried.sh")
        said = self.run("srun --time=1 pairsim sweep endless.yaml -o endless-srun --progress lines", code=130)
        require("the wall time of the sweep is over" in said, "the sweep ended in order before the limit of 60 s")
        self.ended(job)
        log = next(self.folder.glob(f"endless-{job}-1.log")).read_text()
        require("SIGTERM" in log, "the log of the job: " + log.strip().splitlines()[-1])
        self.stopped_in_order("endless")
        self.stopped_in_order("endless-srun")
        rows, job = self.rows("endless"), self.submit("--time=10 hurried.sh")
        self.gets_on("endless")
        require(self.rows("endless") > rows, f"submitted again it goes on after row {rows}")
        self.run(f"scancel {job}")
        self.ended(job)

    def cancelled(self) -> None:
        self.part("scancel")
        self.emit("long.sh", "long.yaml -o long")
        job = self.submit("long.sh")
        self.gets_on("long")
        self.run(f"scancel {job}")
        self.ended(job)
        self.stopped_in_order("long")

    def requeued(self) -> str:
        self.part("Requeue")
        job = self.submit("long.sh")
        self.gets_on("long")
        self.run(f"scontrol requeue {job}")
        self.runs_again(job, "1")
        return job

    def runs_again(self, job: str, restarts: str) -> None:
        """Wait until a job has been started again, and works."""

        def again() -> bool:
            known = self.node.job(job)
            return known.get("Restarts") == restarts and known.get("JobState") == "RUNNING"

        wait_for(f"job {job} starts again", again, 120)
        self.gets_on("long")
        require(self.node.job(job)["JobState"] == "RUNNING", f"job {job} runs again, Restarts={restarts}")

    def slurmd_killed(self, job: str) -> None:
        self.part("slurmd killed and started again")
        self.node.kill_node(jobs=False)
        self.gets_on("long")
        self.node.start_node()
        require(self.node.job(job)["JobState"] == "RUNNING", f"job {job} has gone on without slurmd")
        self.part("The node crashes: slurmd and its jobs killed")
        self.node.kill_node(jobs=True)
        wait_for("Slurm gives the node up", lambda: self.node.state().startswith("down"), 120)
        print(f"$ sinfo\n  {self.node.host} is {self.node.state()}", flush=True)
        self.node.start_node()
        self.runs_again(job, "2")
        self.run(f"scancel {job}")
        self.ended(job)

    def all_done(self) -> None:
        self.part("Submission until all is done")
        self.ended(self.submit("long.sh"))
        self.run("pairsim sweep long.yaml -o long")
        self.same_tables("long", "local-long")


def table(folder: Path) -> list[dict[str, str]]:
    """Rows of the results.csv of a sweep."""
    with (folder / "results.csv").open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def trial(folder: Path) -> None:
    """Do all of it."""
    home, work = folder / "slurm", folder / "work"
    home.mkdir()
    work.mkdir()
    for name, text in {"case": CASE, "short": SHORT, "long": LONG, "endless": ENDLESS}.items():
        (work / f"{name}.yaml").write_text(text)
    with SlurmNode(home) as node:
        doing = Trial(node, work)
        print(f"{node.ask('sinfo', '--version')}, one node with two cores: {node.state()}")
        doing.references()
        doing.array()
        doing.two_processes()
        doing.time_limit()
        doing.cancelled()
        doing.slurmd_killed(doing.requeued())
        doing.all_done()
        doing.part("All of it was done")


def main() -> int:
    """Returns the exit code."""
    if len(sys.argv) > 1:
        print(__doc__)
        return 0 if sys.argv[1] in ("-h", "--help") else 2
    if packages := missing():
        print(f"slurm-test: Slurm is not complete; on Debian: apt install {' '.join(packages)}", file=sys.stderr)
        return 2

    def stop(number: int, _: FrameType | None) -> None:
        if number == signal.SIGALRM:
            raise TimeoutError(f"not done after {LIMIT} s")
        sys.exit(128 + number)

    for number in (signal.SIGALRM, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, stop)
    signal.alarm(LIMIT)
    with tempfile.TemporaryDirectory(prefix="pairsim-slurm-", ignore_cleanup_errors=True) as folder:
        try:
            trial(Path(folder))
        except (Mismatch, TimeoutError) as error:
            print(f"slurm-test: {error}", file=sys.stderr)
            for log in ("slurmctld.log", "slurmd.log"):
                if (path := Path(folder) / "slurm" / log).exists():
                    print(f"\n{log}:", *path.read_text().splitlines()[-10:], sep="\n  ", file=sys.stderr)
            for path in sorted(Path(folder).glob("work/*.log")):
                print(f"\n{path.name}:", *path.read_text().splitlines()[-10:], sep="\n  ", file=sys.stderr)
            return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
