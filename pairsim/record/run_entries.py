"""The entries of run.json. Nothing here loads numpy, since each question imports this file to declare its entries."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypedDict

from pairsim.record.columns import MESHES, STEPS, UNKNOWNS, WALL_TIME
from pairsim.runtime.message import Text
from pairsim.runtime.plain import Plain

if TYPE_CHECKING:
    from pairsim.cases.inputs import UnitSizes, WrittenInput
    from pairsim.record.record import Record
    from pairsim.runtime.arrays import Array


@dataclass(frozen=True)
class Entry[V]:
    """An entry of run.json. Those of a single question are declared in its file, and listed in `Question.entries`."""

    name: str
    meaning: str

    def of(self, record: Record) -> V | None:
        """Its value; None where a record does not have it."""
        value: V | None = record.get(self.name)
        return value


type Entries = Mapping[Entry[Any], Any]
"""Values of entries."""


class Settled(TypedDict, total=False):
    """The quasi-steady solution at the last distances of a run; only a message if there is none.

    `d` [D_c], `dU` and `dU_error` [U_av] have a value for each gap from upstream; `t_relax` is the decay time of a
    disturbance [D_c/U_av], `start` how the run began, and `accuracy` the fraction of dU that its error may be. `creeps`
    and `held_together` are present only where unyielded liquid makes them true.
    """

    d: Sequence[float]
    dU: Sequence[float]
    dU_error: Sequence[float]
    creeps: bool
    held_together: bool
    t_relax: float
    start: str
    accuracy: float
    message: Text


class WholeCycles(TypedDict, total=False):
    """The whole cycles of a flow that varies, and what the distances did over the last one.

    `shape` is that of the flow, `cycle` the duration of a cycle [D_c/U_av], `repeats` whether the flow is periodic,
    `U_av` what gave the unit of velocity (see `Case.unit_of_flow`), and `whole` the number of whole cycles. After the
    first cycle, `drift` is the change of each distance from upstream [D_c], `drift_error` its half-width, None where it
    is not known, and `dU_peak` the largest |dU| [U_av]. After the second one, `change` is the mean |dU| by which cycles
    to come may differ [U_av]; `periodic` and `known` say whether this change, and the half-widths, are within the
    fraction `accuracy` of `dU_peak`.
    """

    shape: str
    cycle: float
    repeats: bool
    U_av: str
    whole: int
    accuracy: float
    drift: Sequence[float]
    drift_error: Sequence[float | None]
    dU_peak: float
    change: float
    periodic: bool
    known: bool


class DrawnEnds(TypedDict):
    """The range of dU in most draws of the inputs, from `least` to `largest` [um/s], over the distance d [D_c].

    `outside` is the fraction of the draws that lie outside the atlas, `beyond` the numbers in which they do, and
    `missing` the numbers that differ between draws but have one value in the atlas.
    """

    d: Array | Sequence[float]
    least: Array | Sequence[float]
    largest: Array | Sequence[float]
    outside: Array | Sequence[float]
    beyond: str
    missing: str


KIND = Entry[str]("kind", "the question")
STATUS = Entry[str]("status", "running, finished, failed or interrupted")
REASON = Entry[str]("reason", "why it ended")
MESSAGE = Entry[str]("message", "how it ended, in words")
STARTED = Entry[str]("started", "when it began")
COMMAND = Entry[str]("command", "the command line, or the call in Python")
MACHINE = Entry[Mapping[str, str]]("machine", "node, system and processor")
VERSIONS = Entry[Mapping[str, str]]("versions", "versions of the program and its libraries")
SECONDS = Entry[float](WALL_TIME.name, "wall time in s, including that before a run was resumed")
PEAK_MEMORY = Entry[int]("peak_memory", "peak memory of the process in bytes")
KEY = Entry[str]("key", "hash of the case")
LAWS = Entry[Mapping[str, str]]("laws", "hash of the source of each user-defined law")
WARNINGS = Entry[Sequence[str]]("warnings", "warnings about the results")
NOTES = Entry[Sequence[str]]("notes", "remarks in words that an atlas adds to its answer")
SCALES: Entry[UnitSizes] = Entry("scales", "units of length, time, velocity and stress, with a physical block")
INPUTS: Entry[list[WrittenInput]] = Entry("inputs", "the quantities of the physical block, with half-widths")
PHASES = Entry[Mapping[str, float]]("wall_time_by_phase", "wall time of each phase in s")
COMMON = (KIND, STATUS, REASON, MESSAGE, STARTED, COMMAND, MACHINE, VERSIONS, SECONDS, PEAK_MEMORY, KEY, LAWS)
"""The entries that records of all questions have, before their own."""
AT_THE_END = (WARNINGS, SCALES, INPUTS, PHASES)
"""Entries that are written when a computation has ended, after those of its question."""
SIZE = Entry[int](UNKNOWNS.name, "unknowns of the largest linear system")
POINTS = Entry[int]("points", "points of a curve, or steady states")
NEWTON_ITERATIONS = Entry[int]("newton_iterations", "total number of Newton iterations")
FACTORISATIONS = Entry[int]("factorisations", "total number of factorisations of Newton's matrix")
ADAPTATION = Entry[Mapping[str, Plain]](
    "adaptation", "how meshes were adapted to the accuracy, and whether this was reached"
)
MESH_COUNT = Entry[int](MESHES.name, "meshes made")
END_OF_BRANCH = Entry[Mapping[str, Plain]](
    "end_of_branch", "where steady states end, if they do so before the requested parameters"
)
OF_STEADY = (POINTS, ADAPTATION, NEWTON_ITERATIONS, FACTORISATIONS, MESH_COUNT, SIZE, END_OF_BRANCH)
"""The entries of questions about quasi-steady states."""
TIME_STEPS = Entry[int](STEPS.name, "accepted time steps")
SETTLED = Entry[Settled](
    "settled", "the quasi-steady solution at the last distances of a run with two particles or more"
)
START = Entry[str]("start", "how a run began: from rest, or in a steady state")
HOLD = Entry[bool]("hold", "whether distances were held in a run")
CYCLES = Entry[WholeCycles](
    "cycles", "duration of a cycle of a varying flow, and how the distances change over the last complete one"
)
REACHED = Entry[float]("t", "time reached by a run")
REJECTED = Entry[int]("rejected_steps", "time steps that were repeated with a smaller size")
REMESHINGS = Entry[int]("remeshings", "number of remeshings in a run")
OF_RUNS = (
    *(REACHED, SIZE, TIME_STEPS, REJECTED, NEWTON_ITERATIONS, FACTORISATIONS, REMESHINGS),
    *(START, HOLD, SETTLED, CYCLES, ADAPTATION),
)
"""The entries of runs."""
SPREAD_OF_PARTICLES = Entry[Mapping[str, float]](
    "spread",
    "where particles differ: relative standard deviations of diameter and modulus, and mean beta and Ca_e",
)
DRAWN = Entry[DrawnEnds]("dU_inputs", "range of dU in most random draws of the inputs, in an answer of an atlas")
