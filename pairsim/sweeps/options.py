"""Options of a sweep, for Python and the command line."""

from __future__ import annotations

import re
from dataclasses import dataclass, field

from pairsim.runtime.errors import InputError


@dataclass(frozen=True)
class Shard:
    """Part `i` of `n` of a sweep, counted from 1."""

    i: int
    n: int

    @property
    def tag(self) -> str:
        """Suffix of the names of its files."""
        return f"-{self.i}-of-{self.n}"


def parse_time(text: str) -> float:
    """Parse a time in seconds, H:MM or H:MM:SS.

    Returns:
        The time in seconds.

    Raises:
        InputError: The text has another form.
    """
    if re.fullmatch(r"\d{1,9}(\.\d*)?", text) and float(text) > 0:
        return float(text)
    if match := re.fullmatch(r"(\d{1,6}):([0-5]?\d)(?::([0-5]?\d))?", text):
        hours, minutes, seconds = (int(part or 0) for part in match.groups())
        return 3600.0 * hours + 60 * minutes + seconds
    raise InputError("--walltime", "", text, "must be seconds, H:MM or H:MM:SS")


def parse_shard(text: str) -> Shard:
    """Parse a shard `i/n` with 1 <= i <= n.

    Raises:
        InputError: The text has another form.
    """
    match = re.fullmatch(r"(\d{1,9})/(\d{1,9})", text)
    if match is None or not 1 <= int(match[1]) <= int(match[2]):
        raise InputError("--shard", "", text, "must be part/parts counted from 1, such as 2/8")
    return Shard(int(match[1]), int(match[2]))


@dataclass(frozen=True)
class Options:
    """Options of a sweep.

    Those with metadata are options of the command line, too: `help` says what they do, `parse` reads the text of a
    value, and the rest is for typer.

    Attributes:
        settings: The settings of --set, for grid.yaml.
        signals: Whether SIGINT and SIGTERM end the sweep in order; if not, a KeyboardInterrupt does.
    """

    limit: int | None = field(default=None, metadata={"help": "Largest number of cases to start.", "min": 1})
    only_failed: bool = field(default=False, metadata={"help": "Repeat only the cases that failed or timed out."})
    fail_fast: bool = field(default=False, metadata={"help": "Stop when a case fails."})
    shard: Shard | None = field(
        default=None,
        metadata={"help": "Compute part I of N, counted from 1.", "metavar": "I/N", "parse": parse_shard},
    )
    workers: int = field(
        default=1, metadata={"help": "Number of cases computed at the same time, without mpirun.", "min": 1}
    )
    cold: bool = field(
        default=False, metadata={"help": "A process of its own for every case, with nothing of another's."}
    )
    case_timeout: float | None = field(
        default=None, metadata={"help": "Largest wall time of a case, in seconds.", "min": 0.0}
    )
    walltime: float | None = field(
        default=None,
        metadata={
            "help": "Largest wall time of the sweep, in seconds or H:MM:SS; running cases are stopped in order before.",
            "metavar": "TIME",
            "parse": parse_time,
        },
    )
    settings: tuple[str, ...] = ()
    signals: bool = True
