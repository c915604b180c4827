"""A cache of solutions of short rows, from which the model of long rows is made, for other cases with the same rows.

Streams that differ in their arrivals, spread or length, such as the cases of a sweep over seeds, need the same rows. So
do rows of any number of beads that `pairsim train` follows. The name of the file is a hash of all that the rows depend
on, including the sources of the numerics; an incomplete file is never visible.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import numpy as np

from pairsim.cases.case import SceneCase
from pairsim.cases.identity import sources_of
from pairsim.record.folder import write_file
from pairsim.runtime.arrays import Array
from pairsim.runtime.cache import cache_folder
from pairsim.runtime.errors import InputError
from pairsim.runtime.monitor import Monitor
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.problems import SteadyProblem
from pairsim.solvers.rows.model import Row, Waves

NUMERICS = "solvers", "fem", "physics"  # packages whose sources the solutions depend on
ROWS = "rows"  # a package of `solvers` that only uses the solutions, except for the modules in `SOLVING`
SOLVING = "short_rows", "row_branch"
ALWAYS = "gaps", "values", "slopes", "dU_error", "rear"  # the arrays that each row has
KNOWN = "short rows are known from an earlier case"  # the note if they are in the cache
POLL = 1.0  # interval at which it is checked whether another process has solved the same rows [s]


@dataclass(frozen=True)
class KeptRows:
    """The file of the short rows of a problem."""

    file: Path

    @classmethod
    def of(
        cls, case: SceneCase, problem: SteadyProblem, alone: Parameters, *, most: int, by_particle: bool, least: float
    ) -> Self:
        """The file of the rows of a case, by the hash of all that they depend on.

        Args:
            case: The case, for the sources of users' laws.
            problem: The problem of a single particle.
            alone: The materials of a single particle.
            most, by_particle, least: As for `short_rows`.
        """
        of = {
            **{"problem": repr(problem), "alone": repr(alone), "laws": sources_of(case), "numerics": _numerics()},
            **{"most": most, "by_particle": by_particle, "least": least},
        }
        key = hashlib.sha256(json.dumps(of, sort_keys=True).encode()).hexdigest()
        return cls(cache_folder() / "rows" / f"{key[:32]}.npz")

    def read(self) -> tuple[list[Row], list[Waves]] | None:
        """The rows, the single particle first, and the waves of infinite trains; None if they are not in the cache."""
        try:
            with np.load(self.file, allow_pickle=False) as stored:
                known = dict(stored)
            rows = [_row(known, f"row{i}") for i in range(int(known["rows"]))]
            waves = [known[f"train{i}"] for i in range(int(known["trains"]))]
            return rows, [(float(d[0].real), k.real, growth) for d, k, growth in waves]
        except (OSError, ValueError, KeyError):
            return None

    def write(self, rows: Sequence[Row], waves: Sequence[Waves]) -> None:
        """Store rows and waves, unless the folder of the cache cannot be written to."""
        from io import BytesIO

        arrays: dict[str, Any] = {"rows": len(rows), "trains": len(waves)}
        for i, row in enumerate(rows):
            arrays |= {f"row{i}_{name}": value for name, value in vars(row).items() if value is not None}
        for i, (d, k, growth) in enumerate(waves):
            arrays[f"train{i}"] = np.array([np.full(len(k), d), k, growth])
        content = BytesIO()
        np.savez_compressed(content, **arrays)
        with suppress(OSError, InputError):
            self.file.parent.mkdir(parents=True, exist_ok=True)
            write_file(self.file, content.getvalue())

    @contextmanager
    def sole_solver(self, monitor: Monitor) -> Iterator[None]:
        """Context in which no other process solves the same rows; waits for one that does."""
        from filelock import FileLock, Timeout

        lock = FileLock(self.file.with_suffix(".lock"), timeout=POLL)
        try:
            self.file.parent.mkdir(parents=True, exist_ok=True)
            while True:
                monitor.check()
                with suppress(Timeout):
                    lock.acquire()
                    break
        except OSError:  # no folder to keep them in
            yield
            return
        try:
            yield
        finally:
            lock.release()


def _row(known: Mapping[str, Array], name: str) -> Row:
    gaps, values, slopes, error, rear = (known[f"{name}_{each}"] for each in ALWAYS)
    more = {each: known.get(f"{name}_{each}") for each in ("by_particle", "parts", "lag")}
    return Row(gaps, values, slopes, float(error), rear=float(rear), **more)


def _numerics() -> str:
    """Hash of the sources of the numerics."""
    found, root = hashlib.sha256(), Path(__file__).parents[1]
    for package in NUMERICS:
        for file in sorted((root / package).rglob("*.py")):
            if file.parent.name != ROWS or file.stem in SOLVING:
                found.update(file.read_bytes())
    return found.hexdigest()
