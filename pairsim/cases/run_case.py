"""The keys of a run."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import replace
from math import inf
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from pairsim.cases import values
from pairsim.cases.accuracy import USUAL, settings_of
from pairsim.cases.case import ENDS, SceneCase
from pairsim.cases.experiment import Experiment
from pairsim.cases.keys import NO_PARTICLES, Key, Keys, Part, PerGap
from pairsim.cases.mistakes import Mistake
from pairsim.cases.off_axis import OffAxisCase
from pairsim.cases.waveform_keys import GROUP as WAVEFORM
from pairsim.cases.waveform_keys import TABLE, WaveformOptions
from pairsim.cases.yaml_file import Content
from pairsim.physics.drive import Drive
from pairsim.physics.waveform import Waveform
from pairsim.runtime.plain import Plain

MOST_OUTPUTS = 10_000
LEAST_GAP = 1e-4  # least distance of the last particle of a period from the first of the next [D_c], as of other gaps
# The flow in the tube starts up like exp(-t/De), and soft pairs near each other (beta .5, d .04) forget their shape
# like exp(-t/(6 Ca_e)); the factors were chosen.
SHORTEST_RUN = 2.0  # least end [D_c/U_av]
RUN_PER_DE = 6.0
RUN_PER_CAPILLARY = 20.0  # of the largest Ca_e
CYCLES = 10  # cycles of a flow that varies in a run, after the time of a start-up; chosen
RUN_PER_VISCOSITY = 0.45  # relative increase of RUN_PER_CAPILLARY per viscosity of the particles over eta_0
DEFAULT_END = (
    f"the largest of {SHORTEST_RUN:g}, {RUN_PER_DE:g} De and {RUN_PER_CAPILLARY:g} Ca_e, later with "
    "slower modes and viscous particles"
)


def _without_gaps(case: SceneCase) -> str:
    """Why a case has no distances."""
    return "" if case.n > 1 else "there is only one particle" if case.n else NO_PARTICLES


def _without_cycles(case: Case) -> str:
    """Why a case has no cycles whose drift could be known."""
    return _without_gaps(case) or ("" if case.waveform is not None else "there is no waveform")


def _check_waveform(case: Case) -> Iterator[Mistake]:
    """Yield the mistakes of a flow that varies."""
    if case.waveform is not None:
        yield from case.waveform.mistakes(case.physical is not None)
        if case.focus:
            yield Mistake(
                "focus", case.focus, "must be left out with a waveform: rates off the axis are those of a steady flow"
            )


def _by_the_end(key: str) -> Callable[[Case], str]:
    """The check of a time in the group `time`, which must not be later than the end."""
    return lambda case: f"must be at most time.end = {case.time.end:g}" if _late(case, getattr(case.time, key)) else ""


def _late(case: Case, time: float | None) -> bool:
    return (time or 0.0) > case.time.end


def _check_max_step(case: Case) -> str:
    first = case.time.first_step
    return f"must be at least time.first_step = {first:g}" if case.time.max_step < first else ""


def _check_min_gap(case: Case) -> str:
    narrowest = min(case.gaps, default=inf)
    return f"must be below the initial distance {narrowest:g}" if case.limits.min_gap >= narrowest else ""


def _check_max_gap(case: Case) -> str:
    widest = max(case.gaps, default=-inf)
    return f"must be above the initial distance {widest:g}" if (case.limits.max_gap or inf) <= widest else ""


def _check_times(case: Case) -> Iterator[Mistake]:
    """Yield the mistake of the first time of output after the end."""
    late = [t for t in case.output.times if _late(case, t)]
    yield from (Mistake("output.times", t, f"must be at most time.end = {case.time.end:g}") for t in late[:1])


def _check_every(case: Case) -> str:
    least = case.time.end / MOST_OUTPUTS
    many = (case.output.every or inf) < least
    return f"must be at least {least:g}, which gives {MOST_OUTPUTS} outputs" if many else ""


def _check_ends(case: Case) -> Iterator[Mistake]:
    """Yield the mistake if a period of an infinite row has no particles, or is too short for them."""
    if not case.closed:
        return
    if not case.n:
        yield Mistake("ends", case.ends, "must be periodic or developed: there are no particles to repeat")
    elif case.length != "auto" and case.tube_length <= (least := case.cluster + max(case.limits.min_gap, LEAST_GAP)):
        allowed = f"must be above {least:g}: {case.cluster:g} for the particles, and the distance to the next period"
        yield Mistake("length", case.tube_length, allowed)


class TimeOptions(Keys):
    """Time steps."""

    end: Annotated[values.Time, Key(part=Part.REPORT)] = Field(
        SHORTEST_RUN,
        description=f"end time [D_c/U_av] (default: {DEFAULT_END}, when a start from rest has been forgotten; with a "
        f"waveform, {CYCLES} periods later, or the end of its table)",
    )
    tol: values.Number = Field(
        USUAL.time_tol,
        ge=1e-9,
        le=0.1,
        description="allowed local error of the particles' velocities [U_av] (default: by accuracy)",
    )
    first_step: Annotated[values.Time, Key(check=_by_the_end("first_step"))] = Field(
        5e-4, description="size of the first step [D_c/U_av]"
    )
    max_step: Annotated[values.Time, Key(check=_check_max_step)] = Field(2.0, description="largest step [D_c/U_av]")
    fixed_step: Annotated[values.Time | None, Key(check=_by_the_end("fixed_step"))] = Field(
        None, description="constant step size [D_c/U_av], without error control; shortened to land on output times"
    )


class Limits(Keys):
    """Conditions that end a run before its end time."""

    min_gap: Annotated[values.Number, Key(idle=_without_gaps, check=_check_min_gap)] = Field(
        0.002, ge=0, le=1e4, description="contact: the run ends when a gap falls below this [D_c]"
    )
    max_gap: Annotated[values.Distance | None, Key(idle=_without_gaps, check=_check_max_gap)] = Field(
        None, description="the run ends when a gap exceeds this [D_c]"
    )
    drift: Annotated[bool, Key(since="0.4", idle=_without_cycles)] = Field(
        True,
        strict=True,
        description="with a waveform: the run ends once its cycles are periodic and the drift of the distances over "
        "one cycle is known to accuracy, relative to the largest |dU|",
    )
    wall_time: Annotated[values.Number, Field(ge=0.001, le=1e9)] | None = Field(
        None, description="largest wall time of the whole run [s]; the run fails beyond it"
    )
    max_steps: values.Whole = Field(
        100_000, ge=1, le=10**9, description="largest number of steps; the run fails beyond it"
    )


class OutputOptions(Keys):
    """When files are written. Steps land on `times` and `every`; the first and the last step are always written."""

    times: Annotated[tuple[values.Time, ...], Key(check=_check_times)] = Field(
        (), max_length=MOST_OUTPUTS, description="times at which fields are written to fields.xdmf [D_c/U_av]"
    )
    every: Annotated[values.Time | None, Key(check=_check_every)] = Field(
        None, description="interval between fields in fields.xdmf [D_c/U_av]"
    )
    frames: values.Whole = Field(
        20,
        ge=0,
        le=MOST_OUTPUTS,
        description="approximate number of times in fields.xdmf if neither times nor every is set: time steps that are "
        "spread over the run, up to the end time, contact or max_gap",
    )
    fields: bool = Field(True, strict=True, description="whether fields.xdmf is written")
    checkpoint: values.Number = Field(
        60.0,
        ge=0,
        le=1e9,
        description="interval between checkpoints (checkpoint.npz, for run --resume) [s of wall time]",
    )


D0 = Key("d_0", "D_c", part=Part.START, caption=4, slug="d", required=True, usual=0.1, idle=_without_gaps)


class Case(OffAxisCase):
    """A run in time; d0 is one distance for all gaps, or a list from upstream."""

    kind: ClassVar[str] = "run"
    in_time: ClassVar[bool] = True
    named_by_kind: ClassVar[bool] = False

    d0: Annotated[PerGap[values.Distance] | None, D0] = Field(
        None, description="initial distance between the facing surfaces [D_c]"
    )
    ends: Annotated[Literal["periodic", "developed", "repeated"], Key(check=_check_ends)] = Field(  # type: ignore[assignment]  # one more than others have
        "developed",
        description=f"{ENDS}; or repeated: the tube is one period of an infinite row, in which the first particle "
        "comes again after the last one (default of length: such that these two are the mean of d0 apart)",
    )
    start: Annotated[Literal["rest", "steady"], Key(part=Part.START)] = Field(
        "rest",
        description="state at t = 0: rest, with unstressed liquid and particles; or steady, the quasi-steady state at "
        "the initial distances in the developed flow (default: rest; with a physical block steady, because beads that "
        "meet in a tube have been flowing through it for a long time)",
    )
    hold: Annotated[bool, Key(idle=_without_gaps)] = Field(
        False,
        strict=True,
        description="hold the distances at d0, as in quasi-steady solutions, while shapes and stresses evolve; gives "
        "dU after any time at these distances, where it depends on the history",
    )
    waveform: Annotated[WaveformOptions | None, Key(check=_check_waveform, first=True)] = Field(
        None,
        description="a flow that varies in time, in place of a constant one; without units, flows are in U_av, on "
        "which De and Ca_e are based; with units, U_av is the mean of |Q| over a cycle, unless physical.flow_rate or "
        "physical.velocity is given",
    )
    dU_error: Annotated[bool, Key(part=Part.NUMERICS, idle=_without_gaps)] = Field(
        False,
        strict=True,
        description="estimate the error of dU at every step and correct dU by it; unless mesh.Np is given, a coarse "
        "run comes first, which shows the mesh that accuracy requires (takes a third to two thirds longer)",
    )
    time: Annotated[TimeOptions, Key(part=Part.NUMERICS)] = TimeOptions()
    limits: Annotated[Limits, Key(part=Part.REPORT)] = Limits()
    output: Annotated[OutputOptions, Key(part=Part.REPORT)] = OutputOptions()

    def _defaults(self) -> dict[str, Plain]:
        particles = zip(self.Ca_es, self.solid_models, strict=True)
        soft = [Ca_e * (1 + RUN_PER_VISCOSITY * float(solid.viscosity or 0.0)) for Ca_e, solid in particles if solid]
        elastic = RUN_PER_DE * self.De * self.slowest_time
        latest = max(SHORTEST_RUN, elastic, *(RUN_PER_CAPILLARY * each for each in soft))
        end = float(f"{min(latest, values.MOST_TIME):.3g}")
        with suppress(ValueError):  # which the check of its key reports
            end = self._end_with_cycles(end)
        start = {} if self.physical is None else {"start": "steady"}
        return super()._defaults() | start | {"time": {"tol": settings_of(self.accuracy).time_tol, "end": end}}

    def _end_with_cycles(self, start_up: float) -> float:
        """End time of a run [D_c/U_av], which with a flow that varies is some cycles later, or the end of a table."""
        if (flow := self.flow_over_time) is None:
            return start_up
        of_table = self.waveform is not None and self.waveform.shape == TABLE
        if of_table:
            return min(flow.cycle, values.MOST_TIME)
        end = start_up + (CYCLES if flow.period is not None else 1) * flow.cycle
        return float(f"{min(end, values.MOST_TIME):.3g}")

    @classmethod
    def with_files(cls, data: Content) -> tuple[Content, Mistake | None]:
        try:
            return WaveformOptions.with_table(data), None
        except ValueError as error:
            group = data[WAVEFORM]
            named = group.get(TABLE) if isinstance(group, Mapping) else None
            return data, Mistake(f"{WAVEFORM}.{TABLE}", named, str(error))

    @property
    def flow_over_time(self) -> Waveform | None:
        """The mean velocity of the liquid [U_av] over time [D_c/U_av]; None where it is constant.

        Raises:
            ValueError: The case has mistakes.
        """
        if self.waveform is None:
            return None
        if self.experiment is not None and self.experiment.mistakes:
            raise ValueError("the physical block does not give the scales")
        return self.waveform.waveform(self.scales)

    @property
    def drive(self) -> Drive:
        return super().drive if (flow := self.flow_over_time) is None else Drive.varying(flow)

    @property
    def unit_of_flow(self) -> str:
        """What gives U_av: a key of `physical`, or "mean" for the mean |Q| of a flow that varies; "" without block."""
        if self.experiment is None:
            return ""
        return next((key for key in ("flow_rate", "velocity") if key in self.experiment.given), "mean")

    @property
    def experiment(self) -> Experiment | None:
        found = super().experiment
        if found is None or self.waveform is None:
            return found
        return replace(found, waveform=self.waveform)

    def resolved(self) -> dict[str, Plain]:
        found = super().resolved()
        return found if self.waveform is None else found | {WAVEFORM: self.waveform.written}

    @property
    def gaps(self) -> tuple[float, ...]:
        """Initial distances [D_c], one for each gap from upstream."""
        return self.each("d0")

    @property
    def closed(self) -> bool:
        return self.ends == "repeated"

    @property
    def tube_length(self) -> float:
        if self.closed and self.length is None and self.n > 1:
            return self.cluster + sum(self.gaps) / len(self.gaps)
        return super().tube_length

    @property
    def estimates_error(self) -> bool:
        """Whether the error of dU is estimated."""
        return self.n > 1 and self.dU_error

    @property
    def adapts(self) -> bool:
        """Whether a coarse run comes first, from whose error the cells follow."""
        return self.estimates_error and self.mesh.adapt
