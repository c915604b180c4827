"""Several cores for one case: workers of an executor compute parts of it beside the main process, that of the command.

A worker has its part computed in a child process of its own, as a worker of a sweep has its cases. The child appends
its results to a file in the folder of the case, from which the main process reads them at once, and not only when the
part ends. Workers only help: what is missing from a part, because its process was killed or because its solutions end
early, is computed by the main process, as it would be without workers. So a computation fails, ends and warns as it
does on one core.
"""

from __future__ import annotations

import os
import pickle
import shutil
import threading
import time
import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import CancelledError, Executor, Future, ThreadPoolExecutor
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext, suppress
from dataclasses import dataclass
from functools import partial
from itertools import count, pairwise
from pathlib import Path
from typing import Any, Self
from uuid import uuid4

from pairsim.physics.own_laws import OWN
from pairsim.runtime.child import MOST_MEMORY, ask, child_of_thread, close_child
from pairsim.runtime.errors import RunFailure
from pairsim.runtime.monitor import Monitor
from pairsim.runtime.signals import Signals, sigterm_waits

FOLDER = ".parts"
"""The folder for the results of parts, in the folder of a case while it is computed."""
STOP = "stop"
POLL = 0.02  # interval at which files of parts are looked at for new results [s]
LENGTH = 8  # bytes of the number before each result in a file of a part: the length of the pickled result


class Desk:
    """State that a process keeps from one part of a computation to the next: its monitor and, say, a solver.

    Args:
        computation: Name of the computation, that of one case.
        monitor: The monitor that every part asks whether it may go on.

    Attributes:
        computation, monitor: The arguments.
        name: A unique name, by which reports of several processes are distinguished.
    """

    def __init__(self, computation: str, monitor: Monitor) -> None:
        self.computation, self.monitor, self.name = computation, monitor, uuid4().hex
        self._open, self._kept = ExitStack(), list[Any]()

    @classmethod
    def in_child(cls, part: PartTask) -> Self:
        """The state of a child process, in which signals end a computation as well as its budget does."""
        signals = Signals()
        desk = cls(part.computation, Monitor(signals, budget=part.budget))
        desk._open.enter_context(signals)
        return desk

    def kept[S](self, make: Callable[[], AbstractContextManager[S]]) -> S:
        """The object, such as a solver, that `make` made for an earlier part or else makes now; closed at the end."""
        if not self._kept:
            self._kept.append(self._open.enter_context(make()))
        kept: S = self._kept[0]
        return kept

    def close(self) -> None:
        """Close what was kept, after the last part."""
        self._open.close()


type PartOf[T] = Callable[[Desk], Iterator[T]]
"""The computation of a part, which yields its results: a function of a module, with arguments that can be pickled."""


@dataclass(frozen=True)
class PartTask:
    """A part as it is given to a worker."""

    file: Path  # its results are appended to it
    stop: Path  # file whose presence stops it
    computation: str  # name of the computation that it is a part of
    work: bytes  # pickled `PartOf`; only the child unpickles it, which has loaded the user's laws
    budget: float | None  # wall time that is left [s]; None for no limit
    environment: Mapping[str, str]  # variables of the child

    def in_child(self) -> str:
        """Compute it; returns the message of an unexpected error, else an empty text."""
        try:
            found = pickle.loads(self.work)(_desk_of(self))
            with self.file.open("ab") as file:
                for each in found:
                    content = pickle.dumps(each)
                    file.write(len(content).to_bytes(LENGTH) + content)
                    file.flush()
                file.write(bytes(LENGTH))  # a length of 0: all results are there
        except (RunFailure, KeyboardInterrupt):  # a failure of the case ends the main process, too
            return ""
        except Exception as error:
            traceback.print_exc()
            return f"{type(error).__name__}: {error}"
        return ""


_desks: list[Desk] = []
"""The state of this process, if it has one; a list of at most one."""


def _desk_of(part: PartTask) -> Desk:
    """The state of this child for the computation that a part belongs to; that of an earlier computation is closed."""
    if not (_desks and _desks[0].computation == part.computation):
        while _desks:
            _desks.pop().close()
        _desks.append(Desk.in_child(part))
    return _desks[0]


def compute(part: PartTask) -> str:
    """Compute a part, for a worker of any executor; returns why it was not completed, if that is unexpected."""
    if part.stop.exists():
        return ""
    with _sigterm_left_to_the_main_thread():
        child, reply, why = ask(part, part.environment, part.stop, None)
        death = child.death[1] if reply is None and not why else ""
        if reply is None or why or reply.memory > MOST_MEMORY:
            child.close()
    return str(reply.result) if reply is not None else death


def _begun(environment: Mapping[str, str]) -> None:
    """Start the child of this thread, so that it loads its libraries in the meantime."""
    with _sigterm_left_to_the_main_thread():
        child_of_thread(environment)


def _sigterm_left_to_the_main_thread() -> AbstractContextManager[None]:
    """Context in which a thread other than the main one takes no SIGTERM, which the main one may block for METIS."""
    return nullcontext() if threading.current_thread() is threading.main_thread() else sigterm_waits()


class Helper[T]:
    """A part that a worker computes, and the reader of its results.

    Attributes:
        complete: Whether the part was completed and all of its results have been read.
    """

    def __init__(self, future: Future[str], file: Path) -> None:
        self._future, self._file, self._read, self.complete = future, file, 0, False

    @property
    def at_work(self) -> bool:
        """Whether the worker has not ended."""
        return not self._future.done()

    def found(self) -> Iterator[T]:
        """Yield the results that are new since the last call."""
        if not self._file.exists():
            return
        with self._file.open("rb") as file:
            file.seek(self._read)
            while len(head := file.read(LENGTH)) == LENGTH:
                if not (length := int.from_bytes(head)):
                    self.complete = True
                    return
                if len(content := file.read(length)) < length:
                    return  # it is being written
                self._read = file.tell()
                yield pickle.loads(content)

    def cancelled(self) -> bool:
        """Cancel the part if it has not begun; returns whether it had not."""
        return self._future.cancel()

    @property
    def failure(self) -> str:
        """Why the part was not completed, once the worker has ended; empty if it was, or if that is expected."""
        try:
            return self._future.result()
        except CancelledError:
            return ""
        except Exception as error:  # of the executor
            return f"the executor did not compute it ({type(error).__name__}: {error})"


class Workers:
    """The main process and those that help it; entered while a case is computed.

    Args:
        processes: Number of processes that compute, the main process included.
        executor: Starts the others; None: threads of the main process do. Its workers must see the folder of the case.

    Attributes:
        count: The number of processes.
    """

    def __init__(self, processes: int = 1, executor: Executor | None = None) -> None:
        self.count, self._executor = processes, executor
        self._threads: list[Executor] = []
        self._folder: Path | None = None
        self._computation = ""
        self._numbers, self._helpers = count(1), list[Helper[Any]]()

    def __enter__(self) -> Self:
        if self._executor is None:
            # One executor for each thread, so that a part can go to the process with the solutions it starts from.
            self._threads = [ThreadPoolExecutor(1) for _ in range(self.count - 1)]
            for thread in self._threads:
                thread.submit(_begun, {})
        return self

    def __exit__(self, *_: object) -> None:
        for thread in self._threads:
            thread.submit(close_child)
        for thread in self._threads:
            thread.shutdown()

    @contextmanager
    def at_work_in(self, folder: Path) -> Iterator[None]:
        """Context in which parts of a case with this folder can be started; stops those still at work at its end."""
        shutil.rmtree(folder / FOLDER, ignore_errors=True)  # left by a computation that was killed
        if self.count == 1:
            yield
            return
        self._folder, self._computation = folder / FOLDER, uuid4().hex
        self._folder.mkdir()
        try:
            yield
        finally:
            with suppress(OSError):
                (self._folder / STOP).touch()
            for helper in self._helpers:
                helper.cancelled()
            while any(helper.at_work for helper in self._helpers):
                time.sleep(POLL)
            self._helpers.clear()
            shutil.rmtree(self._folder, ignore_errors=True)

    def start[T](self, work: PartOf[T], monitor: Monitor, number: int = 0) -> Helper[T]:
        """Give a part to a worker.

        Args:
            work: The computation of the part.
            monitor: The monitor of the case.
            number: Number of the worker, from 0, if workers are threads of the main process; an executor given by the
                user chooses itself.

        Raises:
            OSError: The folder of the case cannot be used.
        """
        assert self._folder is not None, "a case is at work"
        file = self._folder / f"part{next(self._numbers)}"
        environment = {OWN: os.environ[OWN]} if OWN in os.environ else {}
        content = pickle.dumps(work)
        part = PartTask(file, self._folder / STOP, self._computation, content, monitor.left, environment)
        executor = self._executor or self._threads[number % len(self._threads)]
        helper = Helper[T](executor.submit(compute, part), file)
        self._helpers.append(helper)
        return helper


ALONE = Workers()
"""The main process without others: the default of `Workers`."""


@dataclass(frozen=True)
class FoundAt[P, T]:
    """A result that a part yields, with its place."""

    place: P
    result: T


class Shared[P, T]:
    """Work on places, such as distances, that the main process shares with its workers.

    It implements the protocol `Others` of `pairsim.runtime.others.found_by_all`.

    Args:
        workers: The workers.
        monitor: The monitor of the case.
        part: The computation of a part, as a function of its places and the `Desk` of the process. It yields a
            `FoundAt` for each place, and may yield reports beside them.
        take_report: Called with each of these reports.

    Attributes:
        notes: Messages about workers that have ended early, which the caller shows and removes.
    """

    def __init__(
        self,
        workers: Workers,
        monitor: Monitor,
        part: Callable[[Sequence[P], Desk], Iterator[Any]],
        take_report: Callable[[Any], None],
    ) -> None:
        self._workers, self._monitor, self._part, self._take_report = workers, monitor, part, take_report
        self._helpers: list[Helper[Any]] = []
        self.notes: list[str] = []

    @property
    def shares(self) -> bool:
        """Whether there are workers."""
        return self._workers.count > 1

    def share(self, places: Sequence[P], more: float = 0.0) -> Sequence[P]:
        """Give places to the workers; returns those that are left to the main process, the first ones.

        Args:
            places: The places, in such an order that neighbours follow each other.
            more: Work that the main process has in addition to its places, in units of the work of one place.
        """
        if not self.shares or len(places) < 2:
            return places
        number, others = len(places), min(self._workers.count, len(places)) - 1
        first = max(round((number + more) / (others + 1) - more), 1)
        ends = [first + round(i * (number - first) / others) for i in range(others + 1)]
        self._helpers += [
            self._workers.start(partial(self._part, places[a:b]), self._monitor, i)
            for i, (a, b) in enumerate(pairwise(ends))
        ]
        return places[:first]

    def come(self) -> Iterator[tuple[P, T]]:
        """Yield the results of workers that are new since the last call, with their places."""
        for helper in self._helpers:
            for each in helper.found():
                if isinstance(each, FoundAt):
                    yield each.place, each.result
                else:
                    self._take_report(each)

    def rest(self, meanwhile: Callable[[], bool]) -> Iterator[tuple[P, T]]:
        """Yield the results of workers until all have ended.

        Args:
            meanwhile: Does something while they are at work; returns whether there was anything to do.
        """
        while self._helpers:
            self._monitor.check()
            # Asked before results are read: what a worker appends before it ends is then read in this round.
            ended = [helper for helper in self._helpers if not helper.at_work]
            yield from self.come()
            for helper in ended:
                self._helpers.remove(helper)
                if failure := helper.failure:
                    self.notes.append(f"a worker ended early, so the rest of its part is computed here: {failure}")
            if self._helpers and not meanwhile():
                time.sleep(POLL)


def found_in_parts[T](workers: Workers, monitor: Monitor, parts: Sequence[PartOf[T]]) -> Iterator[tuple[int, T]]:
    """Compute parts that do not depend on each other, each by whichever process is free first.

    Args:
        workers: The workers.
        monitor: The monitor of the case.
        parts: The computations.

    Yields:
        Results with the number of their part, from 0: those of the main process at once, those of workers once their
        part is complete.
    """
    helpers = dict[int, Helper[T]]()
    if workers.count > 1:
        helpers = {i: workers.start(part, monitor, i) for i, part in enumerate(parts)}
    here, left, found = Desk("", monitor), {*range(len(parts))}, {i: list[T]() for i in helpers}

    def complete() -> Iterator[tuple[int, T]]:
        for i, helper in [*helpers.items()]:
            ended = not helper.at_work  # asked before results are read, as in `Shared.rest`
            found[i] += helper.found()
            if helper.complete:
                left.discard(i)
                yield from ((i, each) for each in found[i])
            if helper.complete or ended:  # a part that has ended incomplete is computed by the main process
                del helpers[i]

    while left:
        monitor.check()
        yield from complete()
        # Workers begin with the first parts, the main process with the last ones.
        free = next(
            (i for i in sorted(left, reverse=workers.count > 1) if i not in helpers or helpers[i].cancelled()), None
        )
        if free is not None:
            helpers.pop(free, None)
            left.discard(free)
            for each in parts[free](here):
                yield free, each
                yield from complete()
        elif left:
            time.sleep(POLL)
