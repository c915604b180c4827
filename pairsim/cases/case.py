"""The keys of a case, and the quantities that follow from them.

The models here, and those of each question's own keys, are the only definition of keys, defaults, limits and their
documentation. `pairsim.computing.case_files` validates YAML files against them.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cache
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import AfterValidator, Field, model_validator

from pairsim.cases import kinds_of_cases as kinds
from pairsim.cases import values
from pairsim.cases.accuracy import DEFAULT, Accuracy, percent, settings_of
from pairsim.cases.experiment import USUAL_COUNT, Experiment
from pairsim.cases.keys import Key, Keys, Part, PerParticle, keys_of
from pairsim.cases.law_checks import check_De, check_liquid, check_xi
from pairsim.cases.laws import OF_ALL, Declared, Laws
from pairsim.cases.material_keys import LIQUIDS, LiquidKey, SolidKey, written
from pairsim.cases.mesh_keys import MeshOptions
from pairsim.cases.mistakes import Mistake
from pairsim.cases.physical_keys import Physical
from pairsim.cases.yaml_file import Content
from pairsim.physics import liquids, solids
from pairsim.physics.drive import DEVELOPED, Drive
from pairsim.physics.liquids import Liquid, Newtonian
from pairsim.physics.softest import beyond_steady_shapes, beyond_tension
from pairsim.physics.solids import Solid
from pairsim.quantities.scales import Scales
from pairsim.runtime.plain import Plain

Ends = Literal["developed", "periodic"]
ENDS = "ends of the tube: developed (with the developed flow profile) or periodic (with an imposed flow rate)"


def _number(name: str, caption: int, **more: Any) -> Key:
    """The key of a parameter in `OF_ALL`; `more` are further arguments of `Key`."""
    return Key(OF_ALL[name].symbol, part=Part.MATERIAL, caption=caption, **more)


def _limits(name: str) -> tuple[Any, ...]:
    """The limits of a parameter in `OF_ALL`, which is 0 or in a range."""
    return values.zero_or(OF_ALL[name].least, OF_ALL[name].most)


def _named(text: str) -> str:
    if not values.is_name(text):
        raise ValueError(f"must be {values.NAME_WORDS}")
    return text


def _no_polymer(case: SceneCase) -> str:
    """Why `xi` has no effect in a case, namely because its liquid has no polymer; "" where it has one."""
    if case.liquid_model.modes:
        return ""
    return f"the liquid is {case.liquid_model.label}" + ("" if case.is_viscous else " at De = 0")


def _check_length(case: SceneCase) -> Iterator[Mistake]:
    """Yield the mistake of a tube that is too short for its particles, or of `auto` with ends that need a number."""
    if case.length == "auto" and case.ends != "developed":
        yield Mistake("length", "auto", "must be a number with ends: periodic; auto requires ends: developed")
    elif case.n and not case.closed and case.tube_length < (least := case.cluster + 2 * FREE_ENDS):
        allowed = f"must be at least {least:g}: {case.cluster:g} for the particles and {FREE_ENDS:g} at each end"
        yield Mistake("length", case.tube_length, allowed)


DIAMETER = Key(r"\beta", caption=1, required=True)
COUNT = Key(caption=5)
CAPILLARY = _number("Ca_e", caption=3, required=True)
LENGTHS = Field(ge=0.1, le=1e4)
NAME = Field(json_schema_extra={"pattern": values.NAME})
XI = _number("xi", caption=7, identity=lambda case: bool(case.liquid_model.modes), idle=_no_polymer, check=check_xi)
LIQUID = Key(
    part=Part.MATERIAL,
    caption=6,
    identity=lambda case: not case.liquid_model.newtonian,
    idle=lambda case: "" if case.is_viscous else _no_polymer(case),
    check=check_liquid,
)
SOLID = Key(
    part=Part.MATERIAL,
    caption=8,
    identity=lambda case: any(case.Ca_es),
    idle=lambda case: "" if any(case.Ca_es) else "the particles are rigid",
)


class SceneCase(Keys):
    """Keys that all questions share. beta, Ca_e: one value for all particles, or a list from upstream."""

    kind: ClassVar[str]
    """The command that the case is for."""
    in_time: ClassVar[bool] = False
    """Whether it is solved in time, for which `accuracy` sets other cells than for steady states."""
    named_by_kind: ClassVar[bool] = True
    """Whether folders of cases without a name begin with the command."""

    # Cell sizes follow from the diameter, unless they are given.
    beta: Annotated[PerParticle[Annotated[values.Number, Field(ge=1e-3, le=0.999)]] | None, DIAMETER] = Field(
        None, description="diameter of the particle over that of the tube, D_p/D_c"
    )
    De: Annotated[values.Number, *_limits("De"), _number("De", caption=2, check=check_De)] = Field(
        0.0, description="Deborah number lambda U_av/D_c; 0 is a liquid without elasticity"
    )
    Ca_e: Annotated[PerParticle[Annotated[values.Number, *_limits("Ca_e")]] | None, CAPILLARY] = Field(
        None, description="elastic capillary number eta_0 U_av/(D_c G_p); 0 is a rigid particle"
    )
    name: Annotated[Annotated[str, NAME, AfterValidator(_named)] | None, Key(part=Part.REPORT, identity=False)] = Field(
        None, description="name of the folder for the results"
    )
    particles: Annotated[values.Whole, COUNT] = Field(
        USUAL_COUNT, ge=0, le=50, description="number of particles on the axis"
    )
    xi: Annotated[values.Number, *_limits("xi"), XI] = Field(0.09, description="solvent viscosity over eta_0 (De > 0)")
    liquid: Annotated[LiquidKey, LIQUID] = Field(
        None,
        description="constitutive law of the liquid, or a group with the law and its parameters; default: "
        f"{liquids.DEFAULT.name}, or {Newtonian.name} at De = 0",
    )
    solid: Annotated[SolidKey, SOLID] = Field(
        None,
        description="constitutive law of the soft particles, or a group with the law and its parameters, or a list "
        f"with one of these for each particle, from upstream; default: {solids.DEFAULT.name}",
    )
    length: Annotated[Annotated[values.Number, LENGTHS] | Literal["auto"] | None, Key(check=_check_length)] = Field(
        None,
        description="tube length [D_c]; default: auto, just long enough for developed ends to have hardly any effect "
        "on dU (and on dp_plus, if the particles are moved); with periodic ends, 50 times the largest beta; without "
        "particles, 10",
    )
    ends: Ends = Field("developed", description=ENDS)
    accuracy: Annotated[Accuracy, Key(part=Part.NUMERICS)] = Field(
        DEFAULT,
        description="target error of dU, relative to the largest |dU| of the curve; sets mesh and time steps. Where "
        "the error is estimated (curves, critical distances, runs with dU_error), the mesh is adapted until this "
        "target is met",
    )
    mesh: Annotated[MeshOptions, Key(part=Part.NUMERICS)] = MeshOptions()
    physical: Annotated[Physical | None, Key(part=Part.REPORT)] = Field(
        None,
        description="the experiment in physical units, in place of beta, De, Ca_e, xi, distances, time.end and "
        "parameters of the laws",
    )

    @classmethod
    def with_files(cls, data: Content) -> tuple[Content, Mistake | None]:
        """A case, as read, with names of files replaced by their content; and the mistake if one cannot be used."""
        return data, None

    @model_validator(mode="after")
    def _with_defaults(self) -> Self:
        """Fill in the keys that follow from others where they are not given."""
        groups = {
            key: group.filled(inner)
            for key, inner in self._defaults().items()
            if isinstance(group := getattr(self, key), Keys) and isinstance(inner, Mapping)
        }
        return self.filled({**self._defaults(), **groups}, groups)

    def _defaults(self) -> dict[str, Plain]:
        """Defaults that follow from other keys: those that `accuracy` sets."""
        return {"mesh": self._cells | {"adapt": "Np" not in self.mesh.model_fields_set}}

    @property
    def _cells(self) -> dict[str, float]:
        """The cells that `accuracy` sets."""
        return settings_of(self.accuracy).mesh(self.liquid_model.cells, self.betas, self.in_time)

    @property
    def closed(self) -> bool:
        """Whether the tube is a period of an infinite row of particles."""
        return False

    @property
    def error_wanted(self) -> float:
        """The target error of dU as a fraction of the largest |dU|."""
        return percent(self.accuracy) / 100

    @property
    def fixed_cells(self) -> frozenset[str]:
        """Which of `mesh.Np` and `mesh.max_size` adaptation must keep; if `Np` is one, no cells are adapted."""
        if not self.mesh.adapt:
            return frozenset({"Np"})
        return frozenset({"max_size"} if self.mesh.max_size != self._cells["max_size"] else ())

    @property
    def n(self) -> int:
        """Number of particles."""
        return self.particles

    def each(self, key: str) -> tuple[Any, ...]:
        """The values of a key that has one for each particle or gap, from upstream; empty if it is not given."""
        value, count = getattr(self, key), keys_of(type(self))[key].count
        assert count is not None, f"{key} has one value for the case"
        return value if isinstance(value, tuple) else () if value is None else (value,) * count(self.n)

    @property
    def betas(self) -> tuple[float, ...]:
        """Particle diameters [D_c], one for each particle from upstream."""
        return self.each("beta")

    @property
    def Ca_es(self) -> tuple[float, ...]:
        """Elastic capillary numbers, one for each particle from upstream."""
        return self.each("Ca_e")

    @property
    def gaps(self) -> tuple[float, ...]:
        """Distances for which the geometry is made, from upstream, N-1 values [D_c]; none in this base class."""
        return ()

    @property
    def first_gaps(self) -> tuple[float, ...]:
        """Distances [D_c] that are computed first, N-1 values from upstream."""
        return self.gaps[: max(self.n - 1, 0)]

    @property
    def first_case(self) -> SceneCase:
        """The case that is computed first: this one, or the first of several of which it consists."""
        return self

    @property
    def range_of_d(self) -> tuple[float, float]:
        """The least and the largest distance of the case [D_c]."""
        return min(self.gaps), max(self.gaps)

    @property
    def values_of_De(self) -> tuple[float, ...]:
        """Every De at which the case is solved."""
        return (self.De,)

    @property
    def drive(self) -> Drive:
        """What drives the liquid and the particles."""
        return DEVELOPED

    @property
    def has_history(self) -> bool:
        """Whether the answer is a state after some time rather than a steady one; only then may a polymer yield."""
        return self.in_time

    @property
    def laws(self) -> Laws:
        """The laws of the liquid and of the particles, with the parameters that the case gives."""
        return Laws.of(self.liquid, self.solid)

    @property
    def is_viscous(self) -> bool:
        """Whether the law of the liquid is purely viscous, so that De does not belong to it."""
        return self.laws.liquid.is_viscous

    @property
    def declared_parameters(self) -> tuple[Declared, ...]:
        """The parameters of all laws that the case names."""
        return tuple(self.laws.declared())

    @property
    def liquid_model(self) -> Liquid:
        return self.laws.liquid.model(self.De, self.xi)

    @property
    def slowest_time(self) -> float:
        """The longest relaxation time of the liquid over the one in De; 1 if there is none."""
        return self.laws.liquid.model(1.0, self.xi).longest or 1.0

    @property
    def solid_models(self) -> tuple[Solid | None, ...]:
        """The solid of each particle from upstream, None for rigid ones."""
        return self.laws.solid_models(self.Ca_es)

    @property
    def experiment(self) -> Experiment | None:
        """The quantities of the `physical` block and the numbers that follow from them; None without a block."""
        return Experiment(self.physical.given, self.laws, self.particles) if self.physical is not None else None

    @property
    def scales(self) -> Scales | None:
        """The units of length, velocity and viscosity in SI units, None if the case has no `physical` block."""
        return self.experiment.scales if self.experiment is not None else None

    @property
    def reynolds_number(self) -> float | None:
        """The Reynolds number rho U_av D_c/eta_0 of the experiment; None where its density is not known."""
        return None if self.experiment is None else self.experiment.reynolds_number(self.experiment.scales)

    @property
    def remarks(self) -> list[str]:
        """Remarks on quantities of the `physical` block that are far from usual."""
        return self.experiment.remarks if self.experiment is not None else []

    @property
    def notes(self) -> list[str]:
        """Notes for the user beside `remarks`: on given keys without effect, and particles without steady shapes."""
        idle = {key: why for key, why in self._idle().items() if self._is_given(key)}
        if "liquid" in idle:
            idle = {f"liquid: {self.laws.liquid.name}": idle.pop("liquid"), **idle}
        keys = {why: [key for key in idle if idle[key] == why] for why in idle.values()}
        no_effect = [f"{', '.join(k)} {'has' if len(k) == 1 else 'have'} no effect: {why}" for why, k in keys.items()]
        tense = beyond_tension(self.liquid_model, self.betas, self.Ca_es)
        return [*no_effect, *beyond_steady_shapes(self.betas, self.Ca_es), *tense]

    def _is_given(self, key: str) -> bool:
        """Whether a dotted key has another value than its default."""
        group, _, last = key.rpartition(".")
        value = getattr(getattr(self, group) if group else self, last)
        return not keys_of(type(self))[key].is_default(value)

    def _idle(self) -> dict[str, str]:
        """The keys without effect in this case, whether given or not, each with the reason."""
        reasons = {name: key.why_idle(self, self.n) for name, key in keys_of(type(self)).items()}
        return {name: why for name, why in reasons.items() if why}

    @property
    def tube_length(self) -> float:
        """Length of the tube [D_c]."""
        if isinstance(self.length, float):
            return self.length
        if self.ends == "developed":  # `length: auto`, which is the default
            return self.cluster + 2 * self.margin
        return PERIODIC_LENGTH * max(self.betas) if self.n else 10.0

    @property
    def margin(self) -> float:
        """Length of tube on each side of the particles with `length: auto` [D_c]."""
        if not self.liquid_model.modes:
            return NEWTONIAN_MARGIN
        least, most = ELASTIC_MARGINS
        usual = min(max(7.0 - 10.0 * min(self.betas, default=1.0), least), most)
        velocity = self.drive.velocity
        return usual if velocity is None else max(usual, self._wake(velocity - self.drive.flow))

    def _wake(self, relative_velocity: float) -> float:
        """Length of tube behind moved particles over which the stress in the liquid decays [D_c].

        `relative_velocity` is that of the particles minus the mean velocity of the liquid [U_av].
        """
        return min(MEMORIES * self.liquid_model.longest * abs(relative_velocity), LONGEST_WAKE)

    @property
    def cluster(self) -> float:
        """Length of the row of particles, gaps included [D_c]."""
        return sum(self.betas) + sum(self.gaps)

    @property
    def slug(self) -> str:
        """Beginning of the folder name: the name of the case, or its question (unless a run) and main parameters."""
        question = [self.kind] if self.named_by_kind else []
        return self.name or "-".join([*question, *self._slug_parts()])

    def _slug_parts(self) -> list[str]:
        """The main parameters, for the name of the folder."""
        liquid = self.liquid_model
        law = [] if self.is_viscous and not liquid.newtonian else [f"De{self.De:g}"]
        if not liquid.newtonian and liquid.structure != liquids.DEFAULT.name:
            law += [liquid.structure.replace("/", "-in-")]
        if len(liquid.modes) == 1:
            mode = liquid.modes[0]
            law += [f"{key}{value:g}" for key, value in mode.numbers.items() if value != mode.parameters()[key].default]
        own = [part.numbers for part in (liquid.solvent, liquid.yielding) if part is not None]
        law += [f"{key}{value:g}" for numbers in own for key, value in numbers.items()]
        kinds = [solid.name for solid in self.solid_models if solid is not None]
        law += [name for name in dict.fromkeys(kinds) if name != solids.DEFAULT.name]
        if self.n == 0:
            return ["pipe", *law]
        parts = [f"beta{shown(self.beta)}", *law, f"Cae{shown(self.Ca_e)}", *self._slugs()]
        return parts if self.n == 2 else [f"n{self.n}", *parts]

    def _slugs(self) -> list[str]:
        """The parts of the folder's name for keys that declare one (`Key.slug`) and differ from their default."""
        declared = [(key, getattr(self, name)) for name, key in keys_of(type(self)).items() if key.slug]
        here = [each for each in declared if each[0].count is None or each[0].count(self.n)]
        return [f"{key.slug}{shown(value)}" for key, value in here if not key.is_default(value)]

    def resolved(self) -> dict[str, Plain]:
        """The case with every default filled in, as dicts, lists, numbers and strings."""
        data = self.model_dump(mode="json")
        if self.length is None:
            data["length"] = "auto" if self.ends == "developed" else self.tube_length
        name = liquids.DEFAULT.name
        by_default = LIQUIDS[name](law=name) if self.liquid_model.modes else None
        data |= {"liquid": written(self.liquid or by_default), "solid": self._resolved_solid()}
        if self.physical is not None:
            data["physical"] = self.physical.model_dump(mode="json", exclude_none=True)
        return {k: v for k, v in data.items() if v is not None}

    def _resolved_solid(self) -> Any:
        """The solid with its defaults, a list only if particles differ; None for the default one."""
        solids_of_each = [written(each) for each in (self.solid if isinstance(self.solid, tuple) else (self.solid,))]
        alike = all(each == solids_of_each[0] for each in solids_of_each)
        return (solids_of_each[0] if solids_of_each[0] != solids.DEFAULT.name else None) if alike else solids_of_each


# Length of tube on each side of the particles with `length: auto` [D_c]. The slowest disturbance of a Newtonian pipe
# flow decays as exp(-8.93 z/D_c): after 2 diameters 2e-8 of it is left. In a viscoelastic liquid the decay is slower,
# most of all for small particles, and depends little on De (measured in docs/explanation/decisions.md).
NEWTONIAN_MARGIN = 2.0
ELASTIC_MARGINS = 3.0, 6.0
# Particles that are moved against the liquid strain it near the wall, and this stress is carried along with the wall at
# its velocity relative to them. The tube beyond a distance z would add 0.3 exp(-z/(De |velocity - flow|)) of dp_plus to
# it: 0.03 % at seven times the length in the exponent (measured in docs/explanation/decisions.md).
MEMORIES = 7.0
LONGEST_WAKE = 60.0  # [D_c]; chosen
PERIODIC_LENGTH = 50.0  # default of the length of the tube with periodic ends, over the largest diameter; chosen
FREE_ENDS = 0.5  # least length of tube between the particles and each end [D_c]


def shown(value: Any) -> str:
    """A number, a word, or a tuple of these as text, for a folder name."""
    if isinstance(value, tuple):
        return "_".join(map(shown, value))
    return f"{value:g}" if isinstance(value, int | float) else str(value)


def known_keys() -> dict[str, Key]:
    """The keys of all kinds of cases by name, including kinds whose files have not been imported yet.

    If several kinds of cases have a key of the same name, such as d, a declaration as `Part.REPORT` takes precedence.
    """
    for models in kinds.LISTS:
        models()  # imports them, after which they are found as subclasses
    return _keys_of_all(_kinds_of(SceneCase))


def _kinds_of(model: type[SceneCase]) -> tuple[type[SceneCase], ...]:
    return (model, *(kind for each in model.__subclasses__() for kind in _kinds_of(each)))


@cache
def _keys_of_all(models: tuple[type[SceneCase], ...]) -> dict[str, Key]:
    found: dict[str, Key] = {}
    for name, key in (entry for model in models for entry in keys_of(model).items()):
        if name not in found or key.part is Part.REPORT:
            found[name] = key
    return found
