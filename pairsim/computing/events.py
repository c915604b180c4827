"""The events that the computation of a command yields: its only communication with the session that carries it out.

A computation is a generator of these events that returns an `Outcome`. It knows no folder, opens no file, shows nothing
and catches no signal (`computing/session.py` does), and may end anywhere by a `RunFailure`. Events that are due however
it ends, such as its `Summary`, are yielded in a `finally`. Texts, also those in entries of run.json, may be messages
that contain quantities: the session puts these into the units of the case.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from pairsim.record.run_entries import Entries
from pairsim.runtime.message import Text

if TYPE_CHECKING:
    from pairsim.record.checkpoint import Checkpoint
    from pairsim.record.table import Cell
    from pairsim.record.xdmf import FieldFrame


@dataclass(frozen=True)
class Outcome:
    """How a command ended."""

    status: str  # "finished", "failed" or "interrupted"
    reason: str  # "end", "contact", "max_gap", "no_steady_state", "interrupted", or the `reason` of a `RunFailure`
    message: Text  # one line of text for the user


@dataclass(frozen=True)
class Begin:
    """The computation begins. This is the first event; a computation that returns without it had nothing to do.

    Attributes:
        goal: The goal in words, such as "to t = 2".
        total: The goal as a number, such as 2; `Progress.done` counts up to it.
    """

    goal: Text
    total: float


@dataclass(frozen=True)
class Note:
    """A message that the user should see."""

    text: Text


@dataclass(frozen=True)
class Table:
    """A CSV table, with its initial rows."""

    name: str  # without .csv
    columns: Sequence[str]
    rows: Sequence[Mapping[str, Cell]] = ()  # values by column
    ascending: bool = False  # whether rows are kept in order of the first column; the file is then replaced at each row
    resumed: bool = False  # whether a resumed computation continues it after the rows that the checkpoint counts


@dataclass(frozen=True)
class Row:
    """A row of the table with this name, as values by column; values for columns that the table lacks are dropped."""

    table: str
    values: Mapping[str, Cell]


@dataclass(frozen=True)
class Frame:
    """A frame of fields.xdmf."""

    fields: FieldFrame


@dataclass(frozen=True)
class Resumable:
    """A state from which a computation can be resumed."""

    checkpoint: Callable[[int, int, float], Checkpoint]  # makes it from the numbers of rows and frames, and wall time
    every: float  # wall time after which a checkpoint is due [s]
    convenient: bool  # whether this is a good moment for one, if it costs little


@dataclass(frozen=True)
class Progress:
    """A step or point was computed, and its rows have been written.

    Attributes:
        done: How much of `Begin.total` is done; of a run the time reached [D_c/U_av].
        text: The solution in words.
        count: Number of steps or points so far.
        state: State from which a run can be resumed; the session keeps the last one.
    """

    done: float
    text: Text
    count: int
    state: Resumable | None = None


@dataclass(frozen=True)
class Summary:
    """Additions to run.json at the end: entries of the computation, warnings, and wall time of each phase [s]."""

    entries: Entries
    warnings: Sequence[Text] = ()
    phases: Mapping[str, float] = field(default_factory=dict)


Event = Begin | Note | Table | Row | Frame | Progress | Summary
Events = Generator[Event, None, Outcome]


@dataclass(frozen=True)
class Earlier:
    """The last checkpoint of an earlier computation, which this one resumes, and whether that one had finished."""

    checkpoint: Checkpoint
    finished: bool
