"""`pairsim sweep`: compute the cases of a grid, distributed over the ranks of an MPI job, in child processes.

Rank 0 keeps the ledger, distributes the cases and computes some itself. No rank blocks inside MPI, so that idle ranks
use no processor time. Without mpirun, MPI is not imported.
"""

from __future__ import annotations

import math
import os
import platform
import signal
import time
from collections import deque
from collections.abc import Iterator
from contextlib import ExitStack, nullcontext
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pairsim.config.yaml_file import yaml_text
from pairsim.drivers.progress import Reporter
from pairsim.fem import form_cache
from pairsim.results.output import plain, write_text
from pairsim.runtime.child_process import DISK, TOO_LARGE
from pairsim.runtime.collective import collectively
from pairsim.runtime.errors import ENVIRONMENT, EnvironmentFailure, InputError
from pairsim.runtime.locks import command_line, sole_writer
from pairsim.runtime.signals import Signals
from pairsim.runtime.slurm import job_end
from pairsim.runtime.version import __version__
from pairsim.sweeps.case import SweepCase
from pairsim.sweeps.grid import Grid
from pairsim.sweeps.ledger import FAILED, Ledger
from pairsim.sweeps.options import Options
from pairsim.sweeps.progress import SweepProgress
from pairsim.sweeps.queue import part_of, units
from pairsim.sweeps.worker import CaseWorker, Result

if TYPE_CHECKING:
    from mpi4py import MPI

POLL = 0.02  # interval at which child processes and messages are polled [s]
AGAIN = "free disk space and repeat the command"
# Failures of the machine, not of the case: always repeated.
NOT_THE_CASE = ("disk_full", "write_failed", "not_started", EnvironmentFailure.reason)


def run_sweep(
    grid: Grid, directory: Path, options: Options, comm: MPI.Comm | None, reporter: Reporter
) -> tuple[int, str]:
    """Compute the cases of a grid that are not finished yet.

    Args:
        grid: The grid.
        directory: Folder of the sweep; created, or continued if it exists.
        options: The options.
        comm: MPI communicator; every process of it calls this function. None: without MPI.
        reporter: Shows progress (on the first process).

    Returns:
        Exit code (0: no case has failed; 3: some have, or the disk is full; 4: the environment is at fault; 130:
        interrupted) and a message.

    Raises:
        InputError: The folder belongs to another grid, or another sweep is writing to it.
        EnvironmentFailure: The forms cannot be compiled.
    """
    rank, size = (comm.rank, comm.size) if comm else (0, 1)
    if size > 1 and options.workers > 1:
        raise InputError("--workers", "", options.workers, "must be 1 under mpirun, whose processes are the workers")
    with Signals() if options.signals else nullcontext(Signals()) as signals, ExitStack() as held:

        def begin() -> _Root:
            _usable(directory)
            if options.shard is None:
                held.enter_context(sole_writer(directory, command_line()))
            return _Root(grid, directory, options, comm, reporter, signals)

        try:
            root = collectively(comm, begin)
        except OSError as error:
            if error.errno in DISK:
                return 3, f"{directory} cannot be written ({error.strerror}); {AGAIN}" if rank == 0 else ""
            allowed = f"must be a folder that can be used ({error})"
            raise InputError(str(directory), "-o", None, allowed) from error
        _compile_forms(root.forms if root else (), comm, reporter)
        count = options.workers if root is not None else 1
        workers = [CaseWorker(grid.command, directory, options.case_timeout) for _ in range(count)]
        for worker in workers:
            held.callback(worker.close)
        if root is not None:
            return root.run(workers)
        assert comm is not None
        return _serve(comm, workers[0], signals), ""


def _compile_forms(forms: tuple[str, ...], comm: MPI.Comm | None, reporter: Reporter) -> None:
    """Compile the forms that are missing, on one process of each machine; the others wait without computing.

    Raises:
        EnvironmentFailure: They cannot be compiled; raised on every process.
    """
    node = None
    if comm:
        forms = comm.bcast(forms)
        from mpi4py import MPI

        node = comm.Split_type(MPI.COMM_TYPE_SHARED)
    error: EnvironmentFailure | None = None
    if (node is None or node.rank == 0) and (wanted := form_cache.missing(forms)):
        reporter.note(f"compiling {', '.join(wanted)}")
        try:
            form_cache.compile_apart(wanted, reporter.note)
        except EnvironmentFailure as caught:
            error = caught
    if comm and node:
        request = comm.Ibarrier()
        while not request.Test():
            time.sleep(POLL)
        form_cache.share_cache(node)
        node.Free()
        error = next((each for each in comm.allgather(error) if each is not None), None)
    if error is not None:
        raise error


def _serve(comm: MPI.Comm, worker: CaseWorker, signals: Signals) -> int:
    """Loop of every process but the first: compute cases until the first process ends it with an exit code."""
    reported = False
    while True:
        while comm.iprobe(source=0):
            word, value = comm.recv(source=0)
            if word == "leave":
                return int(value)
            _obey(worker, word, value)
        if signals.number and not reported:
            reported = True
            comm.send(signals.number, dest=0)
        if (result := worker.poll()) is not None:
            comm.send(result, dest=0)
        _pause(signals)


def _obey(worker: CaseWorker, word: str, value: Any) -> None:
    """Do what the first process says."""
    if word == "unit":
        worker.take(value)
    else:
        worker.stop()


def _pause(signals: Signals) -> None:
    """Sleep until the next poll. A KeyboardInterrupt, which almost always occurs here, counts as SIGINT."""
    try:
        time.sleep(POLL)
    except KeyboardInterrupt:
        signals.number = signal.SIGINT


class _Root:
    """The first process: keeps queue and ledger, and decides when the sweep ends.

    Raises:
        InputError, OSError: The folder cannot be used.
    """

    def __init__(
        self,
        grid: Grid,
        directory: Path,
        options: Options,
        comm: MPI.Comm | None,
        reporter: Reporter,
        signals: Signals,
    ) -> None:
        self.options, self.directory, self.comm = options, directory, comm
        self.reporter, self.signals = reporter, signals
        cases = part_of(grid.cases, options.shard)
        self.ledger = Ledger(directory, grid, cases, options.shard)
        self.ledger.recover()
        self.ledger.about = {
            "shard": [options.shard.i, options.shard.n] if options.shard else None,
            "command_line": command_line(),
            "folder": os.getcwd(),
            "process": os.getpid(),
            "machine": {"node": platform.node(), "system": platform.platform()},
            "versions": {"pairsim": __version__, "python": platform.python_version()},
        }
        self.idle = deque(range(comm.size if comm and comm.size > 1 else options.workers))
        self.workers = {rank: {"cases": 0, "busy": 0.0} for rank in self.idle}
        self.running: dict[int, list[str]] = {}
        wanted, neighbours = self._wanted(cases), grid.command.in_sweeps.neighbours
        self.queue = deque([case] for case in wanted) if options.cold else units(wanted, neighbours, len(self.workers))
        self.forms = tuple(dict.fromkeys(form for case in wanted for form in case.forms))
        self.progress = SweepProgress(self.ledger, len(self.workers), reporter)
        self.stopping, self.code, self.why = False, 0, ""
        self.begin = time.monotonic()
        self.deadline = self._deadline()
        if not (directory / "grid.yaml").exists():
            settings = "".join(f"# --set {setting}\n" for setting in options.settings)
            text = yaml_text(plain(grid.content))
            part = directory / f".grid.{platform.node()}.{os.getpid()}"  # shards may write it at the same time
            write_text(part, settings + text)
            part.replace(directory / "grid.yaml")
        self.ledger.write(now=True)

    def _wanted(self, cases: list[SweepCase]) -> list[SweepCase]:
        """The cases to compute, the most expensive first."""
        wanted = []
        for case in cases:
            entry = self.ledger.entries[case.folder]
            failed, excused = entry.status in FAILED, entry.reason in NOT_THE_CASE
            only_failed = self.options.only_failed
            if (failed and (only_failed or excused)) or (
                entry.status == "pending" and (entry.again or not only_failed)
            ):
                wanted.append(replace(case, resume=entry.status != "failed" or excused))
        wanted.sort(key=lambda case: -case.estimate.seconds)
        return wanted[: self.options.limit]

    def _deadline(self) -> float:
        """Time at which to stop, early enough for the running cases to end in order; infinite without a limit."""
        end = job_end()
        allowed = min(self.options.walltime or math.inf, math.inf if end is None else end - time.time())
        return self.begin + allowed - min(30.0, 0.1 * allowed)

    def run(self, workers: list[CaseWorker]) -> tuple[int, str]:
        """Distribute all cases to the workers of this process and to the other processes, and wait for the results."""
        self.progress.start(sum(map(len, self.queue)))
        stopped = False
        while True:
            for number, result in self._results(workers):
                self._result(number, result)
            if self.signals.number:
                self._stop(130, signal.Signals(self.signals.number).name)
            if time.monotonic() > self.deadline:
                self._stop(130, "the wall time of the sweep is over")
            if self.stopping and not stopped:
                stopped = True
                for number in self.workers:
                    self._tell(workers, number, "stop")
            while self.queue and self.idle and not self.stopping:
                number, unit = self.idle.popleft(), self.queue.popleft()
                self.running[number] = [case.folder for case in unit]
                self._started(number)
                self._tell(workers, number, "unit", unit)
            self._write()
            self.progress.tick(self.running)
            if not self.running and (self.stopping or not self.queue):
                break
            _pause(self.signals)
        self._write(now=True)
        code, message = self._verdict()
        for rank in range(1, self.comm.size if self.comm else 1):
            self._tell(workers, rank, "leave", code)
        self.progress.finish(message)
        return code, message

    def _results(self, workers: list[CaseWorker]) -> Iterator[tuple[int, Result]]:
        """Yield the results that have come, each with the number of its worker; a signal of a process counts here."""
        while self.comm and self.comm.iprobe():
            from mpi4py import MPI

            status = MPI.Status()
            news = self.comm.recv(status=status)
            if isinstance(news, Result):
                yield status.Get_source(), news
            else:
                self.signals.number = news
        for number, worker in enumerate(workers):
            if (result := worker.poll()) is not None:
                yield number, result

    def _tell(self, workers: list[CaseWorker], number: int, word: str, value: Any = None) -> None:
        """Tell a worker, of this or another process, what to do."""
        if number < len(workers):
            _obey(workers[number], word, value)
        elif self.comm:
            self.comm.send((word, value), dest=number)

    def _stop(self, code: int, why: str) -> None:
        if not self.stopping:
            self.stopping, self.code, self.why = True, code, why
            running = sum(map(len, self.running.values()))
            self.reporter.note(why + (f": stopping {running} running cases" if running else ""))

    def _started(self, rank: int) -> None:
        folder = self.running[rank][0]
        entry = self.ledger.entries[folder]
        again, attempts = entry.again or entry.status in FAILED, entry.attempts + 1
        news = {"rank": rank, "attempts": attempts, "again": again, "values": {}, "warnings": []}
        self.ledger.change(folder, status="running", reason="", message="", **news)

    def _result(self, rank: int, result: Result) -> None:
        entry = self.ledger.change(**vars(result))
        entry.again &= result.status == "pending"
        self.workers[rank]["cases"] += 1
        self.workers[rank]["busy"] += result.seconds
        self.running[rank].remove(result.folder)
        if not self.running[rank]:
            del self.running[rank]
            self.idle.append(rank)
        elif not self.stopping:
            self._started(rank)
        self.progress.case(entry)
        if result.reason == "disk_full" and not TOO_LARGE.search(result.message):
            self._stop(3, f"the disk is full ({result.message}); {AGAIN}")
        elif result.reason == EnvironmentFailure.reason:
            self._stop(ENVIRONMENT, result.message)
        elif self.options.fail_fast and result.status in FAILED:
            self._stop(3, f"{result.folder} {result.status} ({result.reason})")

    def _write(self, now: bool = False) -> None:
        counts = {str(rank): counts for rank, counts in self.workers.items()}
        self.ledger.about["session"] = {"seconds": time.monotonic() - self.begin, "workers": counts}
        try:
            self.ledger.write(now)
        except OSError as error:
            self._stop(3, f"{self.ledger.path} cannot be written ({error.strerror or error}); {AGAIN}")

    def _verdict(self) -> tuple[int, str]:
        ledger = self.ledger
        failed, pending = ledger.count(*FAILED), ledger.count("pending", "running")
        parts = [f"{ledger.count('finished')} of {len(ledger.entries)} cases finished"]
        parts += [f"{failed} failed"] if failed else []
        parts += [f"{pending} to do"] if pending else []
        text = ", ".join(parts)
        if self.stopping:
            return self.code, f"{self.why}; {text}"
        if failed:
            return 3, f"{text}; pairsim status {self.directory} lists the reasons"
        interrupted = any(entry.reason == "interrupted" for entry in ledger.entries.values())
        return (130 if interrupted else 0), text


def _usable(directory: Path) -> None:
    """Create the folder, or check that it is that of a sweep."""
    if directory.exists() and not directory.is_dir():
        raise InputError(str(directory), "-o", None, "must be a folder, but is a file")
    directory.mkdir(parents=True, exist_ok=True)
    names = [path.name for path in directory.iterdir() if not path.name.startswith(".")]
    if names and not any(name.startswith("sweep") or name == "grid.yaml" for name in names):
        allowed = "must be a new or empty folder, or one of a sweep"
        raise InputError(str(directory), "-o", None, allowed)
