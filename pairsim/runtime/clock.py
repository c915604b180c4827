"""Wall time spent in each phase of a computation."""

from __future__ import annotations

import time
from collections import defaultdict
from dataclasses import dataclass, field


@dataclass
class Clock:
    """Stopwatch with one total for each phase: `with clock("assembly"): ...`.

    Attributes:
        seconds: Wall time [s] by name of the phase.
    """

    seconds: defaultdict[str, float] = field(default_factory=lambda: defaultdict(float))

    def __call__(self, name: str) -> _Timer:
        return _Timer(self, name)


class _Timer:
    def __init__(self, clock: Clock, name: str) -> None:
        self.clock, self.name = clock, name

    def __enter__(self) -> None:
        self.begin = time.perf_counter()

    def __exit__(self, *_: object) -> None:
        self.clock.seconds[self.name] += time.perf_counter() - self.begin
