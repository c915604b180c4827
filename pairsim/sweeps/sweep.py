"""`pairsim sweep`: compute the cases of a grid that are not finished, on any `concurrent.futures.Executor`."""

from __future__ import annotations

import os
import pickle
import signal
import time
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import CancelledError, Executor, Future, ThreadPoolExecutor
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import NamedTuple, cast

from pairsim.computing.progress import Reporter
from pairsim.physics.own_laws import OWN
from pairsim.record.folder import write_text
from pairsim.record.table_files import table_text
from pairsim.runtime.errors import OF_MACHINE, Argument, EnvironmentFailure, InputError, RunFailure
from pairsim.runtime.interrupts import EXIT_CODE
from pairsim.runtime.launcher import communicator
from pairsim.runtime.locks import command_line, sole_writer
from pairsim.runtime.signals import ENDING, Signals, name_of
from pairsim.runtime.text import counted, pasteable
from pairsim.sweeps.folder import ENDED, RECORD, STOP, CaseState, SweptCase, begin, read_state
from pairsim.sweeps.grid import Grid, SweepCase
from pairsim.sweeps.progress import headline, summarised
from pairsim.sweeps.task import Task, compute

POLL = 0.1  # interval at which signals are checked [s]
EVERY = 10.0  # least time between two writings of results.csv [s]; with 10,000 cases one takes half a second


class Ending(NamedTuple):
    """How a sweep has ended.

    Attributes:
        exit_code: Of the command: 0 if no case has failed, 3 if some have, 4 if the environment is at fault, 130 if it
            was interrupted.
        message: What users read.
    """

    exit_code: int
    message: str

    @property
    def to_the_end(self) -> bool:
        """Whether the sweep has not been stopped: all its cases are finished or have failed."""
        return self.exit_code in (0, RunFailure.exit_code)

    def saying(self, more: str) -> Ending:
        """The same ending with a longer message."""
        return self._replace(message=f"{self.message}; {more}")


@dataclass(frozen=True)
class Options:
    """How the cases of a sweep are computed: arguments of `pairsim.sweep`, and the signals that the caller catches."""

    case_timeout: float | None = None
    progress: bool = False
    signals: Signals | None = None
    flags: Mapping[str, bool] = field(default_factory=dict)  # options of the command of the cases


Workers = Sequence[tuple[Executor, int | None]]
"""The executors that compute cases, each with the number of tasks that it is given at a time; None for all."""


def with_workers[T](work: Callable[[Workers], T], executor: Executor | None = None, count: int = 1) -> T:
    """Call a function with the workers that compute the cases of its sweeps.

    Under mpirun all processes must call this. Only the first one calls the function, and the others are its workers
    until it returns; all of them then return its result, or raise its exception.

    Args:
        work: The function.
        executor: Computes the cases; by default `count` threads of this process do, or the processes of mpirun.
        count: Number of threads; 1 under mpirun.

    Raises:
        InputError: `count` is above 1 under mpirun.
    """
    if executor is not None:
        return work([(executor, None)])
    comm = communicator()
    if comm is None:
        with ThreadPoolExecutor(count) as threads:
            return work([(threads, count)])
    from mpi4py.futures import MPICommExecutor

    result: T | None = None
    error: BaseException | None = None
    with _signals_left_to_the_first(comm.rank), MPICommExecutor(comm) as others:
        if others is not None:
            try:
                if count > 1:
                    allowed = "must be 1 under mpirun, whose processes are the workers"
                    raise InputError(Argument("workers"), "", count, allowed)
                with ThreadPoolExecutor(1) as here:
                    result = work([(cast(Executor, others), comm.size - 1), (here, 1)])
            except BaseException as caught:
                error = caught
    result, error = comm.bcast((result, error))
    if error is not None:
        raise error
    return cast(T, result)


@contextmanager
def _signals_left_to_the_first(rank: int) -> Iterator[None]:
    """Context in which only the first process listens to the signals that end a sweep; the others ignore them."""
    before = {number: signal.signal(number, signal.SIG_IGN) for number in (ENDING if rank else ())}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def run_sweep(grid: Grid, directory: Path, options: Options, workers: Workers) -> Ending:
    """Compute the cases of a grid that are not finished, in a new folder or in that of an earlier sweep of this grid.

    Raises:
        InputError: The folder belongs to another grid, or another sweep is writing to it.
        EnvironmentFailure: The folder is removed or moved meanwhile.
    """
    with sole_writer(directory, command_line()):
        (directory / STOP).unlink(missing_ok=True)
        return _Sweep(grid, directory.resolve(), options, workers).run()


class _Sweep:
    """A sweep while it is computed: its tasks and the states of its cases; see `run_sweep`, which locks the folder."""

    def __init__(self, grid: Grid, directory: Path, options: Options, workers: Workers) -> None:
        self.directory, self.options = directory, options
        self.record = begin(directory, grid)
        self.cases: dict[str, SweptCase] = {case.folder: case for case in self.record.cases}
        left = []
        for case in grid.cases:
            state = read_state(directory / case.folder, case.key)
            if state.status not in ENDED or state.reason in OF_MACHINE:  # the next command computes it again
                left.append(case)
                state = CaseState(case.folder)
            self.cases[case.folder].state = state
        self.todo = deque(left)
        self.free = [each for each, count in workers for _ in range(len(left) if count is None else count)]
        self.running: dict[Future[CaseState], tuple[Executor, str]] = {}
        self.ended: SimpleQueue[Future[CaseState]] = SimpleQueue()
        self.reporter, self.count = Reporter(options.progress), len(self.cases) - len(left)
        self.duplicates = grid.duplicates
        self.code, self.why = 0, ""
        self._written = 0.0

    def run(self) -> Ending:
        """Compute all tasks."""
        cases = len(self.cases)
        self.reporter.start(self.record.name, f"{cases} cases, {cases - self.count} to do", cases)
        try:
            self._write_results()
            while self.running or (self.todo and not self.why):
                if self._gone:
                    self._stop(EnvironmentFailure.exit_code, f"{self.directory} is gone")
                if self.options.signals is not None and (number := self.options.signals.number):
                    self._stop(EXIT_CODE, name_of(number))
                self._step()
        except KeyboardInterrupt as interrupt:  # a second Ctrl-C
            self._stop(EXIT_CODE, str(interrupt) or name_of(signal.SIGINT))
        except BaseException:
            self._stop(1, "stopped")  # executors wait for their tasks
            raise
        if self._gone:
            raise EnvironmentFailure(f"{self.directory} was removed or moved while its cases were computed")
        self._write_results()
        return self._verdict()

    @property
    def _gone(self) -> bool:
        """Whether the folder of the sweep has been removed or moved."""
        return not (self.directory / RECORD).is_file()

    def _step(self) -> None:
        """Submit tasks to all free workers, and take one that has ended, for which this waits up to `POLL`."""
        while self.todo and self.free and not self.why:
            self._submit(self.free.pop(), self.todo.popleft())
        try:
            future = self.ended.get(timeout=POLL)
        except Empty:
            return
        executor, folder = self.running.pop(future)
        self.free.append(executor)
        self._take(_result(future, folder))
        if time.monotonic() - self._written > EVERY and not self._gone:
            self._write_results()

    def _submit(self, executor: Executor, case: SweepCase) -> None:
        task = Task(
            folder=self.directory / case.folder,
            command=self.record.question.name,
            key=case.key,
            case=pickle.dumps(case.case),
            line=command_line(),
            timeout=self.options.case_timeout,
            environment={OWN: os.environ[OWN]} if OWN in os.environ else {},
            flags=self.options.flags,
        )
        future = executor.submit(compute, task)
        self.running[future] = executor, case.folder
        future.add_done_callback(self.ended.put)

    def _take(self, state: CaseState) -> None:
        self.cases[state.folder].state = state
        if state.status in ENDED:
            self.count += 1
            self.reporter.case(self.count, headline(state))
        if state.reason == EnvironmentFailure.reason:
            self._stop(EnvironmentFailure.exit_code, state.message)

    def _stop(self, code: int, why: str) -> None:
        """Begin no further cases, and ask the running ones to stop after writing what they have."""
        if self.why:
            return
        self.code, self.why = code, why
        with suppress(OSError):
            (self.directory / STOP).touch()
        if self.running:
            self.reporter.say(f"{why}: stopping the running cases")
        for future in list(self.running):
            future.cancel()

    def _write_results(self) -> None:
        write_text(self.directory / "results.csv", table_text(*self.record.results()))
        self._written = time.monotonic()

    def _verdict(self) -> Ending:
        count = self.record.counts
        failed, pending = count["failed"], len(self.cases) - count["finished"] - count["failed"]
        parts = [f"{count['finished']} of {len(self.cases)} cases finished"]
        parts += [f"{failed} failed"] if failed else []
        parts += [f"{pending} to do"] if pending else []
        parts += [f"{counted(self.duplicates, 'duplicate')} left out"] if self.duplicates else []
        text = ", ".join(parts)
        for warning in summarised(list(self.cases.values())):
            self.reporter.say(f"warning: {warning}")
        if self.code == EXIT_CODE:
            return Ending(self.code, f"stopped by {self.why}; {text}; the same command continues it")
        if self.why:
            return Ending(self.code, f"{self.why}; {text}")
        if failed:
            return Ending(RunFailure.exit_code, f"{text}; pairsim status {pasteable(self.directory)} lists the reasons")
        return Ending(EXIT_CODE, f"{text}; the same command continues it") if pending else Ending(0, text)


def _result(future: Future[CaseState], folder: str) -> CaseState:
    """The state of a case whose task has ended."""
    try:
        return future.result()
    except CancelledError:
        return CaseState(folder)
    except Exception as error:  # from the executor: tasks themselves raise nothing
        why = f"the executor did not compute it ({type(error).__name__}: {error})"
        return CaseState(folder, "failed", "not_computed", why)
