"""A case: what a user may say, and what follows from it.

The models below are the only definition of keys, defaults, limits and their documentation;
`pairsim.config.case_file` reads them from YAML and words their errors.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, ClassVar, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, model_validator

from pairsim.config.accuracy import DEFAULT, LEAST_THINNING, PIPE_CELL, SETTINGS, Accuracy
from pairsim.config.physical import Physical
from pairsim.physics.materials.polymer import PARAMETERS, Law, Name, Polymer
from pairsim.physics.scales import Scales


def number(value: Any) -> Any:
    """A finite number; true, false and words that YAML made of numbers are none."""
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise ValueError("a number")
    try:
        as_float = float(value)
    except OverflowError:
        as_float = math.inf
    if not math.isfinite(as_float):
        raise ValueError("a finite number")
    return as_float


def whole(value: Any) -> Any:
    """A whole number."""
    if isinstance(value, bool) or not isinstance(value, int):
        raise ValueError("a whole number")
    return value


Number = Annotated[float, BeforeValidator(number)]
Whole = Annotated[int, BeforeValidator(whole)]
# Bounds come before the validator, so that they show in the JSON schema of a union too.
Diameter = Annotated[float, Field(gt=0, lt=1), BeforeValidator(number)]
Capillary = Annotated[float, Field(ge=0), BeforeValidator(number)]
Unit = Annotated[float, Field(ge=0, le=1), BeforeValidator(number)]
Extensibility = Annotated[float, Field(gt=3), BeforeValidator(number)]
CellSize = Annotated[float, Field(gt=0, le=0.5), BeforeValidator(number)]
Positive = Annotated[float, Field(gt=0), BeforeValidator(number)]
# Far narrower gaps ask for more cells than any machine holds, and gmsh does not say so.
Distance = Annotated[float, Field(ge=1e-4), BeforeValidator(number)]


MOST_OUTPUTS = 10_000


class _Options(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class MeshOptions(_Options):
    """Cell sizes."""

    Np: Whole = Field(
        SETTINGS[DEFAULT].thinning.Np,
        ge=6,
        le=1000,
        description="cells on each half-circle, at least (default: by accuracy; at "
        f"{DEFAULT}, {SETTINGS[DEFAULT].newtonian.Np} in a Newtonian liquid, {SETTINGS[DEFAULT].hardening.Np} in "
        "Oldroyd-B, FENE-P and where alpha or epsilon is below "
        f"{LEAST_THINNING:g}, elsewhere {SETTINGS[DEFAULT].thinning.Np})",
    )
    growth: Number = Field(0.15, gt=0, le=2, description="growth of the cell size by unit distance from a particle")
    gap_cells: Whole = Field(0, ge=0, description="cells across a gap between particles (0: Np/4)")
    gap_exponent: Number = Field(
        0.0, ge=0, le=1, description="below d = 0.1 the cells across a gap grow as (0.1/d)^gap_exponent"
    )
    wall_cells: Whole = Field(0, ge=0, description="cells between particle and wall (0: Np/4)")
    max_size: CellSize = Field(
        SETTINGS[DEFAULT].thinning.max_size,
        description="largest cell [D_c] (default: by accuracy; at "
        f"{DEFAULT}, {SETTINGS[DEFAULT].newtonian.max_size:g} in a Newtonian liquid, elsewhere the smaller of "
        f"{SETTINGS[DEFAULT].thinning.max_size:g} and {SETTINGS[DEFAULT].thinning.per_beta:g} beta, without particles "
        f"{PIPE_CELL:g})",
    )
    core_growth: Number = Field(0.3, gt=0, le=2, description="growth of the cell size by unit depth in a particle")
    rows: Number = Field(
        SETTINGS[DEFAULT].thinning.rows,
        ge=0,
        description="distance from the particles beyond which cells lie in rows along the tube [D_c] (default: by "
        "accuracy; in a Newtonian liquid and without particles 0: none)",
    )


class TimeOptions(_Options):
    """Time steps."""

    end: Number = Field(2.0, gt=0, description="end time [D_c/U_av]")
    tol: Number = Field(
        SETTINGS[DEFAULT].time_tol,
        gt=0,
        le=0.1,
        description="allowed local error of the particles' velocities [U_av] (default: by accuracy)",
    )
    first_step: Number = Field(5e-4, gt=0, description="first step [D_c/U_av]")
    max_step: Number = Field(2.0, gt=0, description="largest step [D_c/U_av]")
    fixed_step: Positive | None = Field(
        None, description="keep to this step, without error control; shorter steps land on outputs"
    )


class Limits(_Options):
    """What ends a run before its end time."""

    min_gap: Number = Field(0.002, ge=0, description="contact: the run ends when a gap falls below this [D_c]")
    max_gap: Positive | None = Field(None, description="the run ends when a gap passes this [D_c]")
    wall_time: Positive | None = Field(None, description="allowed time of the whole run [s]; more is a failure")
    max_steps: Whole = Field(100_000, ge=1, description="allowed steps; more is a failure")


class OutputOptions(_Options):
    """When files are written. Steps land on `times` and `every`; the first and last step's fields are always there."""

    times: tuple[Positive, ...] = Field((), description="times of fields.xdmf [D_c/U_av]")
    every: Positive | None = Field(None, description="interval of fields.xdmf [D_c/U_av]")
    frames: Whole = Field(
        20,
        ge=0,
        le=MOST_OUTPUTS,
        description="fields.xdmf has about so many times, at steps as they come, where times and every say nothing",
    )
    fields: bool = Field(True, strict=True, description="write fields.xdmf at all")
    checkpoint: Number = Field(60.0, ge=0, description="interval of checkpoint.npz, for run --resume [s of wall time]")


class SceneCase(_Options):
    """What every command needs to know. beta, Ca_e: the same for all particles, or a list counted from upstream."""

    kind: ClassVar[str]
    """The command that the case is for."""

    beta: Diameter | tuple[Diameter, ...] | None = Field(None, description="blockage D_p/D_c, between 0 and 1")
    De: Number = Field(ge=0, description="Deborah number lambda U_av/D_c; 0 is a Newtonian liquid")
    Ca_e: Capillary | tuple[Capillary, ...] | None = Field(
        None, description="elastic capillary number eta_0 U_av/(D_c G_p); 0 is a rigid particle"
    )
    name: str | None = Field(None, pattern=r"^\w[\w.+-]{0,99}$", description="name of the run's folder")
    particles: Whole = Field(2, ge=0, le=50, description="number of particles on the axis")
    xi: Number = Field(0.09, ge=0, le=1, description="solvent viscosity over eta_0 (De > 0)")
    liquid: Literal["newtonian", Name] | None = Field(
        None, description="constitutive law; giesekus by default, newtonian at De = 0"
    )
    alpha: Unit | None = Field(
        None, description=f"Giesekus mobility; 0.2 by default (liquid: {', '.join(PARAMETERS['alpha'])})"
    )
    epsilon: Capillary | None = Field(
        None, description=f"PTT's extensional parameter (liquid: {', '.join(PARAMETERS['epsilon'])})"
    )
    L2: Extensibility | None = Field(
        None, description=f"largest trace of the conformation (liquid: {', '.join(PARAMETERS['L2'])})"
    )
    length: Positive | Literal["auto"] | None = Field(
        None, description="tube length [D_c]; 50 times the largest beta (10 without particles); auto: developed ends"
    )
    ends: Literal["periodic", "developed"] = Field("periodic", description="periodic with the flow rate, or developed")
    accuracy: Accuracy = Field(
        DEFAULT,
        description="error of dU that mesh and steps are chosen for, as a part of the largest |dU| of the curve",
    )
    mesh: MeshOptions = MeshOptions()
    physical: Physical | None = Field(
        None, description="the case in units, in place of beta, De, Ca_e, xi, the distances and time.end"
    )

    @model_validator(mode="before")
    @classmethod
    def _with_settings(cls, data: Any) -> Any:
        """Settings of the accuracy wherever the case says nothing; a wrong accuracy is for its field to refuse."""
        accuracy = data.get("accuracy", DEFAULT) if isinstance(data, dict) else None
        if not isinstance(accuracy, str) or accuracy not in SETTINGS:
            return data
        return SETTINGS[accuracy].under(data, set(cls.model_fields))

    @property
    def n(self) -> int:
        """Number of particles."""
        return self.particles

    @property
    def betas(self) -> tuple[float, ...]:
        """Diameters, one a particle."""
        return _each(self.beta, self.n)

    @property
    def Ca_es(self) -> tuple[float, ...]:
        """Elastic capillary numbers, one a particle."""
        return _each(self.Ca_e, self.n)

    @property
    def gaps(self) -> tuple[float, ...]:
        """Distances that the scene is made for, one a gap."""
        raise NotImplementedError

    @property
    def law(self) -> Law | None:
        """The constitutive law of the liquid, None for a Newtonian one: nothing else decides which of both it is."""
        name = self.liquid or "giesekus"
        if self.De == 0 or name == "newtonian":
            return None
        alpha = 0.2 if self.alpha is None else self.alpha
        alpha = alpha if name in PARAMETERS["alpha"] else 0.0
        return Law(name, self.xi, alpha, self.epsilon or 0.0, self.L2 or 0.0)

    @property
    def scales(self) -> Scales | None:
        """The units of the case in SI units, None where it was given without units."""
        return self.physical.scales if self.physical is not None else None

    @property
    def polymer(self) -> Polymer | None:
        """The viscoelastic part of the liquid, None for a Newtonian one."""
        return self.law.at(self.De) if self.law else None

    @property
    def notes(self) -> list[str]:
        """What a user should know of the case as it was understood: the keys that have no effect in it."""
        idle = self._idle()
        keys = {why: [key for key in idle if idle[key] == why] for why in idle.values()}
        return [f"{', '.join(k)} {'has' if len(k) == 1 else 'have'} no effect: {why}" for why, k in keys.items()]

    def _idle(self) -> dict[str, str]:
        """Keys that were given although nothing depends on them, and why. A default that is spelled out is none."""
        idle: dict[str, str] = {}
        if self.polymer is None:
            law = {} if self.liquid in (None, "newtonian") else {f"liquid: {self.liquid}": self.liquid}
            unused = law | {key: getattr(self, key) for key in PARAMETERS}
            unused |= {"xi": self.xi} if self.xi != SceneCase.model_fields["xi"].default else {}
            why = "the liquid is Newtonian at De = 0" if self.De == 0 else "the liquid is Newtonian"
            idle |= {key: why for key, value in unused.items() if value is not None}
        if self.n == 0:
            idle |= {key: "there are no particles" for key in ("beta", "Ca_e") if getattr(self, key) is not None}
        return idle

    @property
    def tube_length(self) -> float:
        """Length of the tube."""
        if self.length == "auto":
            return self.cluster + 2 * self.margin
        if self.length is None:
            return 50 * max(self.betas) if self.n else 10.0
        return self.length

    @property
    def margin(self) -> float:
        """Tube on each side of the particles with `length: auto`."""
        if self.polymer is None:
            return NEWTONIAN_MARGIN
        least, most = ELASTIC_MARGINS
        return min(max(7.0 - 10.0 * min(self.betas, default=1.0), least), most)

    @property
    def cluster(self) -> float:
        """Length of the row of particles."""
        return sum(self.betas) + sum(self.gaps)

    @property
    def slug(self) -> str:
        """Name of the run's folder."""
        return self.name or "-".join(self._words())

    def _words(self) -> list[str]:
        """The case in short, for the name of its folder."""
        law = [f"De{self.De:g}"]
        if self.polymer is not None:
            law += [] if self.polymer.name == "giesekus" else [self.polymer.name]
            law += [f"{key}{value:g}" for key in PARAMETERS if (value := getattr(self, key)) is not None]
        if self.n == 0:
            return ["pipe", *law]
        parts = [f"beta{shown(self.beta)}", *law, f"Cae{shown(self.Ca_e)}"]
        return parts if self.n == 2 else [f"n{self.n}", *parts]

    def resolved(self) -> dict[str, Any]:
        """The case with every default filled in, as plain data."""
        data = self.model_dump(mode="json")
        if self.length is None:
            data["length"] = self.tube_length
        if self.polymer is not None:
            data["liquid"] = self.polymer.name
            data["alpha"] = self.polymer.alpha if self.polymer.name in PARAMETERS["alpha"] else None
        if self.physical is not None:
            data["physical"] = self.physical.model_dump(mode="json", exclude_none=True)
        return {k: v for k, v in data.items() if v is not None}


class Case(SceneCase):
    """One case in time; d0 is one distance for all gaps or a list."""

    kind: ClassVar[str] = "run"

    d0: Distance | tuple[Distance, ...] | None = Field(None, description="initial distance between surfaces [D_c]")
    time: TimeOptions = TimeOptions()
    limits: Limits = Limits()
    output: OutputOptions = OutputOptions()

    @property
    def gaps(self) -> tuple[float, ...]:
        """Initial distances, one a gap."""
        return _each(self.d0, max(self.n - 1, 0))

    def _words(self) -> list[str]:
        words = super()._words()
        return [*words, f"d{shown(self.d0)}"] if self.n > 1 else words

    def _idle(self) -> dict[str, str]:
        idle = super()._idle()
        if self.n < 2:
            limits = {
                f"limits.{name}": value
                for name in ("min_gap", "max_gap")
                if (value := getattr(self.limits, name)) != Limits.model_fields[name].default
            }
            given = {"d0": self.d0, **limits}
            why = "one particle has no distance" if self.n else "there are no particles"
            idle |= {key: why for key, value in given.items() if value is not None}
        return idle


# Tube on each side of the particles with developed ends. The slowest disturbance of a Newtonian pipe flow decays as
# exp(-8.93 z/D_c): 2 leaves 2e-8 of it. A viscoelastic one decays more slowly, for small particles most of all, as
# measured in docs/notebook/viscoelastic.md; De hardly matters.
NEWTONIAN_MARGIN = 2.0
ELASTIC_MARGINS = 3.0, 6.0
FREE_ENDS = 0.5


def shown(value: Any) -> str:
    """A number or a list of them, for a name."""
    return "_".join(f"{v:g}" for v in value) if isinstance(value, tuple) else f"{value:g}"


def _each(value: float | tuple[float, ...] | None, count: int) -> tuple[float, ...]:
    if count == 0 or value is None:
        return ()
    return value if isinstance(value, tuple) else (value,) * count
