"""The keys of a run, and the checks that involve several of them."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from math import inf
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field

from pairsim.cases import values
from pairsim.cases.accuracy import USUAL, settings_of
from pairsim.cases.case import ENDS, SceneCase
from pairsim.cases.checks import check_scene
from pairsim.cases.experiment import Experiment
from pairsim.cases.keys import NO_PARTICLES, Key, Keys, Part, PerGap
from pairsim.cases.mistakes import Mistake, broken
from pairsim.cases.waveform_keys import GROUP as WAVEFORM
from pairsim.cases.waveform_keys import TABLE, WaveformOptions
from pairsim.cases.yaml_file import Content
from pairsim.physics.drive import Drive
from pairsim.physics.waveform import Waveform

MOST_OUTPUTS = 10_000
LEAST_GAP = 1e-4  # between the last particle of a period and the first one of the next [D_c], as of others
# The flow in the tube starts up like exp(-t/De), and soft pairs near each other (beta .5, d .04) forget their shape
# like exp(-t/(6 Ca_e)); the factors were chosen.
SHORTEST_RUN = 2.0  # least end [D_c/U_av]
RUN_PER_DE = 6.0
RUN_PER_CAPILLARY = 20.0  # of the largest Ca_e
CYCLES = 10  # of a flow that varies, beside the time of a start-up; chosen
RUN_PER_VISCOSITY = 0.45  # how a viscosity of the particles over eta_0 increases the last factor
DEFAULT_END = (
    f"the largest of {SHORTEST_RUN:g}, {RUN_PER_DE:g} De and {RUN_PER_CAPILLARY:g} Ca_e; later with "
    "slower modes and viscous particles"
)


def _without_gaps(case: SceneCase) -> str:
    """Why a case has no distances."""
    return "" if case.n > 1 else "there is only one particle" if case.n else NO_PARTICLES


def _without_cycles(case: Any) -> str:
    """Why a case has no cycles whose drift could be known."""
    return _without_gaps(case) or ("" if case.waveform is not None else "there is no waveform")


OF_GAPS = Key(idle=_without_gaps)


class TimeOptions(Keys):
    """Time steps."""

    end: Annotated[values.Time, Key(part=Part.REPORT)] = Field(
        SHORTEST_RUN,
        description=f"end time [D_c/U_av] (default: {DEFAULT_END}, by when a start from rest is forgotten; with a "
        f"waveform {CYCLES} periods later, or the end of its table)",
    )
    tol: values.Tolerance = Field(
        USUAL.time_tol, description="allowed local error of the particles' velocities [U_av] (default: by accuracy)"
    )
    first_step: values.Time = Field(5e-4, description="size of the first step [D_c/U_av]")
    max_step: values.Time = Field(2.0, description="largest step [D_c/U_av]")
    fixed_step: values.Time | None = Field(
        None, description="constant step size [D_c/U_av], without error control; shortened to land on output times"
    )


class Limits(Keys):
    """Conditions that end a run before its end time."""

    min_gap: Annotated[values.Gap, OF_GAPS] = Field(
        0.002, description="contact: the run ends when a gap falls below this [D_c]"
    )
    max_gap: Annotated[values.Distance | None, OF_GAPS] = Field(
        None, description="the run ends when a gap exceeds this [D_c]"
    )
    drift: Annotated[bool, Key(since="0.4", idle=_without_cycles)] = Field(
        True,
        strict=True,
        description="with a waveform: the run ends once its cycles are periodic and the drift of the distances over "
        "one is known to accuracy, as a part of the largest |dU|",
    )
    wall_time: values.Seconds | None = Field(
        None, description="largest wall time of the whole run [s]; the run fails beyond it"
    )
    max_steps: values.Whole = Field(
        100_000, ge=1, le=10**9, description="largest number of steps; the run fails beyond it"
    )


class OutputOptions(Keys):
    """When files are written. Steps land on `times` and `every`; the first and the last step are always written."""

    times: tuple[values.Time, ...] = Field(
        (), max_length=MOST_OUTPUTS, description="times at which fields are written to fields.xdmf [D_c/U_av]"
    )
    every: values.Time | None = Field(None, description="interval between fields in fields.xdmf [D_c/U_av]")
    frames: values.Whole = Field(
        20,
        ge=0,
        le=MOST_OUTPUTS,
        description="approximate number of times in fields.xdmf, at steps as they come, spread over the way to the end "
        "time, contact or max_gap; if times and every are unset",
    )
    fields: bool = Field(True, strict=True, description="whether fields.xdmf is written")
    checkpoint: values.Interval = Field(
        60.0, description="interval between checkpoints (checkpoint.npz, for run --resume) [s of wall time]"
    )


D0 = Key("d_0", "D_c", part=Part.START, caption=4, slug="d", required=True, usual=0.1, idle=_without_gaps)


class Case(SceneCase):
    """A run in time; d0 is one distance for all gaps, or a list from upstream."""

    kind: ClassVar[str] = "run"
    in_time: ClassVar[bool] = True
    named_by_kind: ClassVar[bool] = False

    d0: Annotated[PerGap[values.Distance] | None, D0] = Field(
        None, description="initial distance between the facing surfaces [D_c]"
    )
    ends: Literal["periodic", "developed", "repeated"] = Field(  # type: ignore[assignment]  # one more than others have
        "developed",
        description=f"{ENDS}; or repeated: the tube is a period of an infinite row, in which the last particle is "
        "followed by the first one (default of length: the mean of d0 between these two)",
    )
    start: Annotated[Literal["rest", "steady"], Key(part=Part.START)] = Field(
        "rest",
        description="state at t = 0: unstressed liquid and particles at rest, or the quasi-steady state of the initial "
        "distances in the developed flow (default: rest; steady with a physical block, as beads that meet in a tube "
        "have flowed through it for long)",
    )
    hold: Annotated[bool, OF_GAPS] = Field(
        False,
        strict=True,
        description="keep the distances d0 while shapes and stresses go on, as quasi-steady solutions do: dU after any "
        "time at this distance, of what has a history",
    )
    waveform: Annotated[WaveformOptions | None, Key()] = Field(
        None,
        description="a flow that varies in time, in place of a constant one; without units flows are in U_av, with "
        "which De and Ca_e are made; with units U_av is the mean of |Q| over a cycle, unless physical.flow_rate or "
        "physical.velocity is given",
    )
    dU_error: Annotated[bool, Key(part=Part.NUMERICS, idle=_without_gaps)] = Field(
        False,
        strict=True,
        description="estimate the error of dU at every step and add it to dU; a coarse run then tells which cells "
        "accuracy needs, unless mesh.Np is given (a third to two thirds more time)",
    )
    time: Annotated[TimeOptions, Key(part=Part.NUMERICS)] = TimeOptions()
    limits: Annotated[Limits, Key(part=Part.REPORT)] = Limits()
    output: Annotated[OutputOptions, Key(part=Part.REPORT)] = OutputOptions()

    def _defaults(self) -> dict[str, Any]:
        particles = zip(self.Ca_es, self.solid_models, strict=True)
        soft = [Ca_e * (1 + RUN_PER_VISCOSITY * float(solid.viscosity or 0.0)) for Ca_e, solid in particles if solid]
        elastic = RUN_PER_DE * self.De * self.slowest_time
        latest = max(SHORTEST_RUN, elastic, *(RUN_PER_CAPILLARY * each for each in soft))
        end = float(f"{min(latest, values.MOST_TIME):.3g}")
        with suppress(ValueError):  # which `check_run` reports
            end = self._end_with_cycles(end)
        start = {} if self.physical is None else {"start": "steady"}
        return super()._defaults() | start | {"time": {"tol": settings_of(self.accuracy).time_tol, "end": end}}

    def _end_with_cycles(self, start_up: float) -> float:
        """End time of a flow that varies: that of a start-up and some cycles, or of a table."""
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
            return data, Mistake(f"{WAVEFORM}.{TABLE}", data[WAVEFORM][TABLE], str(error))

    @property
    def flow_over_time(self) -> Waveform | None:
        """The mean velocity of the liquid [U_av] over time [D_c/U_av]; None where it is constant.

        Raises:
            ValueError: The case is not valid.
        """
        if self.waveform is None:
            return None
        if self.experiment is not None and self.experiment.mistakes:
            raise ValueError("no scales follow from the physical block")
        return self.waveform.waveform(self.scales)

    @property
    def drive(self) -> Drive:
        return super().drive if (flow := self.flow_over_time) is None else Drive.varying(flow)

    @property
    def unit_of_flow(self) -> str:
        """What gives U_av: "mean", of the size of a flow that varies, a key of `physical`, or "" without that block."""
        if self.experiment is None:
            return ""
        return next((key for key in ("flow_rate", "velocity") if key in self.experiment.given), "mean")

    @property
    def experiment(self) -> Experiment | None:
        found = super().experiment
        if found is None or self.waveform is None:
            return found
        return replace(found, waveform=self.waveform)

    def resolved(self) -> dict[str, Any]:
        found = super().resolved()
        if self.waveform is not None:
            return found | {WAVEFORM: self.waveform.written}
        del found["limits"]["drift"]  # which has no effect: such cases are as they were before there were waveforms
        return found

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
        """Whether a coarse run tells which cells are needed."""
        return self.estimates_error and self.mesh.adapt


def check_run(case: Case) -> Iterator[Mistake]:
    """Check the keys of a run against each other; yields mistakes as `check_scene` does."""
    yield from check_scene(case)
    if case.waveform is not None and (wrong := list(case.waveform.mistakes(case.physical is not None))):
        yield from wrong
        return
    if case.closed:
        yield from _check_period(case)
    time, output, limits, end = case.time, case.output, case.limits, case.time.end
    widest, narrowest = max(case.gaps, default=-inf), min(case.gaps, default=inf)
    in_time = f"must be at most time.end = {end:g}"
    outputs = f"must be at least {end / MOST_OUTPUTS:g}, which gives {MOST_OUTPUTS} outputs"
    yield from (Mistake("output.times", t, in_time) for t in [t for t in output.times if t > end][:1])
    yield from broken(
        case,
        ("time.first_step", time.first_step > end, in_time),
        ("time.max_step", time.max_step < time.first_step, f"must be at least time.first_step = {time.first_step:g}"),
        ("time.fixed_step", (time.fixed_step or 0.0) > end, in_time),
        ("output.every", (output.every or inf) < end / MOST_OUTPUTS, outputs),
        ("limits.max_gap", (limits.max_gap or inf) <= widest, f"must be above the initial distance {widest:g}"),
        ("limits.min_gap", limits.min_gap >= narrowest, f"must be below the initial distance {narrowest:g}"),
    )


def _check_period(case: Case) -> Iterator[Mistake]:
    """Check the length of a period of an infinite row; yields mistakes."""
    if not case.n:
        yield Mistake("ends", case.ends, "must be periodic or developed: there are no particles to be repeated")
    elif case.length != "auto" and case.tube_length <= (least := case.cluster + max(case.limits.min_gap, LEAST_GAP)):
        allowed = f"must be above {least:g}: {case.cluster:g} for the particles, and the distance to the next period"
        yield Mistake("length", case.tube_length, allowed)
