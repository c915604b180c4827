"""Several cores for one case: workers of an executor that compute parts of it beside this process.

A worker has its part computed in a child process of its own, as a worker of a sweep has its cases. The child appends
what it finds to a file in the folder of the case, where it is read at once, and not only when the part ends. Workers
only help: what a part has not found, because its process was killed or because its solutions end early, is computed by
this process, as it would be without workers. So a computation fails, ends and warns as it does on one core.
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
"""The folder of what parts find, in that of a case while it is computed."""
STOP = "stop"
POLL = 0.02  # seconds between two looks for what parts have found
LENGTH = 8  # bytes of the length of an entry in a file


class Desk:
    """What a process has in which parts of a computation are computed, one after another.

    Args:
        computation: The computation.
        monitor: Ends the parts.

    Attributes:
        name: A name that no other one has.
    """

    def __init__(self, computation: str, monitor: Monitor) -> None:
        self.computation, self.monitor, self.name = computation, monitor, uuid4().hex
        self._open, self._kept = ExitStack(), list[Any]()

    @classmethod
    def in_child(cls, part: Part) -> Self:
        """That of a child process, whose signals end the computation as well as its budget does."""
        signals = Signals()
        desk = cls(part.computation, Monitor(signals, budget=part.budget))
        desk._open.enter_context(signals)
        return desk

    def kept[S](self, make: Callable[[], AbstractContextManager[S]]) -> S:
        """What an earlier part has made, or else what is made now; closed after the last part."""
        if not self._kept:
            self._kept.append(self._open.enter_context(make()))
        kept: S = self._kept[0]
        return kept

    def close(self) -> None:
        """End the computation."""
        self._open.close()


type PartOf[T] = Callable[[Desk], Iterator[T]]
"""The computation of a part, which yields what it finds; a function of a module with arguments that can be pickled."""


@dataclass(frozen=True)
class Part:
    """What is given to a worker."""

    file: Path  # takes what is found
    stop: Path  # file whose presence stops it
    computation: str  # what it is a part of
    work: bytes  # pickled `PartOf`; only the child unpickles it, which knows the same laws of one's own
    budget: float | None  # wall time that is left [s]; None for no limit
    environment: Mapping[str, str]  # variables of the child

    def in_child(self) -> str:
        """Compute it; returns what is to be said if it was not completed, if anything is."""
        try:
            found = pickle.loads(self.work)(_desk_of(self))
            with self.file.open("ab") as file:
                for each in found:
                    content = pickle.dumps(each)
                    file.write(len(content).to_bytes(LENGTH) + content)
                    file.flush()
                file.write(bytes(LENGTH))  # all is there
        except (RunFailure, KeyboardInterrupt):  # which this process finds, too, if it is one of the case
            return ""
        except Exception as error:
            traceback.print_exc()
            return f"{type(error).__name__}: {error}"
        return ""


_desks: list[Desk] = []
"""That of this process, if it has one."""


def _desk_of(part: Part) -> Desk:
    """The desk of the computation that a part belongs to, in the child."""
    if not (_desks and _desks[0].computation == part.computation):
        while _desks:
            _desks.pop().close()
        _desks.append(Desk.in_child(part))
    return _desks[0]


def compute(part: Part) -> str:
    """Compute a part, for a worker of any executor; returns what is to be said if it was not completed."""
    if part.stop.exists():
        return ""
    with _sigterm_left_to_the_main_thread():
        child, said, why = ask(part, part.environment, part.stop, None)
        death = child.death[1] if said is None and not why else ""
        if said is None or why or said.memory > MOST_MEMORY:
            child.close()
    return str(said.result) if said is not None else death


def _begun(environment: Mapping[str, str]) -> None:
    """Start the child of a thread, which loads libraries meanwhile."""
    with _sigterm_left_to_the_main_thread():
        child_of_thread(environment)


def _sigterm_left_to_the_main_thread() -> AbstractContextManager[None]:
    """A context in which other threads take no SIGTERM: METIS may be at work in the main thread (`sigterm_waits`)."""
    return nullcontext() if threading.current_thread() is threading.main_thread() else sigterm_waits()


class Helper[T]:
    """A part that a worker computes, and what it has found so far.

    Attributes:
        complete: Whether all that it finds has been read.
    """

    def __init__(self, future: Future[str], file: Path) -> None:
        self._future, self._file, self._read, self.complete = future, file, 0, False

    @property
    def at_work(self) -> bool:
        """Whether it may find more."""
        return not self._future.done()

    def found(self) -> Iterator[T]:
        """Yield what it has found since this was asked last."""
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
        """Give it up if it has not begun; returns whether that was so."""
        return self._future.cancel()

    @property
    def said(self) -> str:
        """What is to be said of it, once it has ended, if it was not completed: empty if nothing is."""
        try:
            return self._future.result()
        except CancelledError:
            return ""
        except Exception as error:  # the executor's
            return f"the executor has not computed it ({type(error).__name__}: {error})"


class Workers:
    """This process and those that help it; entered while a case is computed.

    Args:
        processes: Number of processes that compute, this one included.
        executor: Has the others started; by default threads of this process do. Its workers must see the folder of the
            case.

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
            # A thread each: the part that goes on where another one has ended finds the solutions of that one.
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
        """Context in which parts of a case with this folder can be started; ends those that are still at work."""
        if self.count == 1:
            yield
            return
        self._folder, self._computation = folder / FOLDER, uuid4().hex
        shutil.rmtree(self._folder, ignore_errors=True)  # of a computation that was killed
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
        """Give a part to the worker of a number, from 0; of an executor to any one.

        Args:
            work: The computation of the part.
            monitor: That of the case.
            number: Which of the others computes it, if they are threads of this process.

        Raises:
            OSError: The folder of the case cannot be used.
        """
        assert self._folder is not None, "a case is at work"
        file = self._folder / f"part{next(self._numbers)}"
        environment = {OWN: os.environ[OWN]} if OWN in os.environ else {}
        content = pickle.dumps(work)
        part = Part(file, self._folder / STOP, self._computation, content, monitor.left, environment)
        executor = self._executor or self._threads[number % len(self._threads)]
        helper = Helper[T](executor.submit(compute, part), file)
        self._helpers.append(helper)
        return helper


ALONE = Workers()
"""No other process."""


@dataclass(frozen=True)
class FoundAt[P, T]:
    """What a part yields at a place: the result there."""

    place: P
    result: T


class Shared[P, T]:
    """Work on places, such as distances, that this process shares with its workers: `pairsim.runtime.others.Others`.

    Args:
        workers: The workers.
        monitor: The monitor of the case.
        part: The computation of a part but for its places, which are its last argument but the desk. It yields a
            `FoundAt` for each place, and may yield other things.
        aside: Takes these other things.

    Attributes:
        notes: What is to be said of workers that have ended early.
    """

    def __init__(
        self,
        workers: Workers,
        monitor: Monitor,
        part: Callable[[Sequence[P], Desk], Iterator[Any]],
        aside: Callable[[Any], None],
    ) -> None:
        self._workers, self._monitor, self._part, self._aside = workers, monitor, part, aside
        self._helpers: list[Helper[Any]] = []
        self.notes: list[str] = []

    @property
    def shares(self) -> bool:
        """Whether there are workers."""
        return self._workers.count > 1

    def share(self, places: Sequence[P], more: float = 0.0) -> Sequence[P]:
        """Give places to the workers; returns those that are left to this process, the first ones.

        Args:
            places: The places, neighbours beside each other.
            more: What this process has to do beside its places, in places.
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
        """Yield what workers have found since this was asked last, with its place."""
        for helper in self._helpers:
            for each in helper.found():
                if isinstance(each, FoundAt):
                    yield each.place, each.result
                else:
                    self._aside(each)

    def rest(self, meanwhile: Callable[[], bool]) -> Iterator[tuple[P, T]]:
        """Yield what they find until all have ended.

        Args:
            meanwhile: Does something while they are at work; returns whether there was anything to do.
        """
        while self._helpers:
            self._monitor.check()
            ended = [helper for helper in self._helpers if not helper.at_work]  # before what they have found is read
            yield from self.come()
            for helper in ended:
                self._helpers.remove(helper)
                if said := helper.said:
                    self.notes.append(f"a worker has ended early, what is left of its part is computed here: {said}")
            if self._helpers and not meanwhile():
                time.sleep(POLL)


def found_in_parts[T](workers: Workers, monitor: Monitor, parts: Sequence[PartOf[T]]) -> Iterator[tuple[int, T]]:
    """Compute parts that do not depend on each other, each by whichever process is free first.

    Args:
        workers: The workers.
        monitor: The monitor of the case.
        parts: The computations.

    Yields:
        What they find, with the number of the part, from 0: of this process at once, of others once a part is complete.
    """
    helpers = dict[int, Helper[T]]()
    if workers.count > 1:
        helpers = {i: workers.start(part, monitor, i) for i, part in enumerate(parts)}
    here, left, found = Desk("", monitor), {*range(len(parts))}, {i: list[T]() for i in helpers}

    def complete() -> Iterator[tuple[int, T]]:
        for i, helper in [*helpers.items()]:
            ended = not helper.at_work  # before what it has found is read
            found[i] += helper.found()
            if helper.complete:
                left.discard(i)
                yield from ((i, each) for each in found[i])
            if helper.complete or ended:  # what is not complete is computed here
                del helpers[i]

    while left:
        monitor.check()
        yield from complete()
        # Workers begin with the first parts, this process with the last ones.
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
