"""The columns of all tables: name, order, symbol, meaning and unit."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pairsim.runtime.arrays import Array


@dataclass(frozen=True)
class Column:
    """A column of a table.

    Attributes:
        name: Its name in the header.
        symbol: Symbol of the paper (TeX).
        meaning: Its description.
        unit: Its unit (TeX), empty if it has none.
        whole: Whether its values are whole numbers.
        value: Its value, where it is read off the `Observation` of a solution: such a column is in every table of
            solutions.
        polymer: Whether it is there in viscoelastic liquids alone.
    """

    name: str
    symbol: str
    meaning: str
    unit: str = ""
    whole: bool = False
    value: Callable[[Any], float] | None = None
    polymer: bool = False


RATE = r"U_{av}/D_c"
TIME, VELOCITY, LENGTH, STRESS = r"D_c/U_{av}", r"U_{av}", r"D_c", r"\eta_0 U_{av}/D_c"
FORCE = r"\eta_0 U_{av} D_c"
AREA = r"D_c^2"
# What the names of columns of every gap and every particle end with, and what they are of. Where a pair has a column of
# its own, `_i` stands for the number in larger rows; `{_}` (in a subscript `{,}`) and `{of}` for either.
GAPS = (("", "the pair"), ("_i", "particles i and i+1"))
PARTICLES = (
    ("_L", "the leading (downstream) particle"),
    ("_T", "the trailing (upstream) particle"),
    ("_i", "particle i (counted from upstream)"),
)
ONE = (("", ""),)


def _plain(name: str, meaning: str, unit: str = "", *, whole: bool = False) -> Column:
    """A column without a symbol."""
    return Column(name, "", meaning, unit, whole)


def _each(endings: Iterable[tuple[str, str]], name: str, symbol: str, meaning: str, unit: str) -> Iterator[Column]:
    """The columns of a quantity of every gap or particle."""
    for ending, of in endings:
        symbol_of = symbol.replace("{_}", ending).replace("{,}", ending.replace("_", ","))
        yield Column(name + ending, symbol_of, meaning.replace("{_}", ending).replace("{of}", of), unit)


def _correction(endings: Iterable[tuple[str, str]], name: str, unit: str) -> Iterator[Column]:
    """The columns of the estimated discretisation error of a quantity."""
    meaning = f"estimate of exact minus discrete {name}{{_}}, contained in it where corrected is 1"
    return _each(endings, f"{name}_correction", r"\delta^h{_}", meaning, unit)


def _error(endings: Iterable[tuple[str, str]], name: str, unit: str, by: str) -> Iterator[Column]:
    """The columns of the half-width of the interval of a quantity."""
    return _each(endings, f"{name}_error", r"\epsilon{_}", f"error of {name}{{_}} by {by}, half-width", unit)


def _by(name: str, symbol: str) -> Iterator[Column]:
    """The columns of the derivatives by a parameter."""
    symbol = rf"\partial\Delta U{{_}}/\partial {symbol}"
    return _each(GAPS, f"by_{name}", symbol, f"derivative of dU_held{{_}} by {name}", VELOCITY)


def _of_polymer(name: str, symbol: str, meaning: str, unit: str) -> Column:
    """A column of the same name as in `Observation.conformation`."""
    return Column(name, symbol, meaning, unit, value=lambda o: getattr(o.conformation, name), polymer=True)


_TAYLOR = "Taylor parameter (L_z - L_r)/(L_z + L_r) of {of}"
_HELD = "dU{_} with all distances held, as if shapes and stresses had endless time"
_DISCRETE = "dU{_} of the discrete solution, at held distances or in a run, without the estimate of its error"
_CORRECTED = (
    "1: velocities, forces and pressure drop contain the estimates of their errors; 0: they do not, as the estimates "
    "are what remains of much larger contributions"
)
_STRETCH = "rate of the centres of volume, dU{_}, over that of the surfaces, when all distances change together"
_SLOPE = (
    "derivative of dU_held{_} by d when all distances change together; at a zero of dU that of dU, and a zero with "
    "negative slope is stable"
)
_EARLIER = "in folders of earlier versions: dU{_} is that at held distance, and this is added"
_ENDS = "the part of dU_error{_} that is due to the ends of the tube"
_MOVED = "force along the tube that moves {of} at the prescribed velocity"

COLUMNS: tuple[Column, ...] = (
    Column("t", r"t", "time", TIME),
    *_each(GAPS, "d", r"d{_}", "distance between the facing surfaces of {of} on the axis", LENGTH),
    *_each(PARTICLES, "U", r"U{_}", "velocity of {of}, the volume average of u_z", VELOCITY),
    *_each(
        GAPS,
        "dU",
        r"\Delta U{_}",
        "velocity of the downstream particle of {of} minus that of the upstream one; positive: they separate",
        VELOCITY,
    ),
    *_each(GAPS, "dU_held", r"\Delta U_{h{,}}", _HELD, VELOCITY),
    *_each(GAPS, "dU_discrete", r"\Delta U^h{_}", _DISCRETE, VELOCITY),
    _plain("corrected", _CORRECTED, whole=True),
    *_each(GAPS, "stretch", r"\mathrm{d}c{_}/\mathrm{d}d", _STRETCH, ""),
    Column("t_relax", r"t_r", "slowest decay time of a disturbance at held distance", TIME),
    *_each(GAPS, "drift", r"\delta{_}", _EARLIER, VELOCITY),
    *_each(PARTICLES, "D", r"D{_}", _TAYLOR, ""),
    Column("dp", r"\Delta p", "pressure drop over the length of the tube", STRESS),
    Column("dp_plus", r"\Delta p^+", "pressure drop in excess of that of the same tube without particles", STRESS),
    *_each(PARTICLES, "F", r"F{_}", _MOVED, FORCE),
    Column("dt", r"\Delta t", "size of the time step that ends at t", TIME),
    Column(
        "newton", r"n", "Newton iterations of the step, or of the continuation from the previous point", "", whole=True
    ),
    Column("mesh", r"k", "number of remeshings before the step", "", whole=True),
    Column("meshes", r"k", "number of meshes made so far", "", whole=True),
    *_each(GAPS, "slope", r"\mathrm{d}\Delta U{_}/\mathrm{d}d", _SLOPE, RATE),
    *_by("Ca_e", r"\mathrm{Ca}_e"),
    *_by("De", r"\mathrm{De}"),
    *_by("beta", r"\beta"),
    Column("Ca_e", r"\mathrm{Ca}_e", "elastic capillary number of the soft particles", ""),
    Column("De", r"\mathrm{De}", "Deborah number", ""),
    Column("d_cr", r"d_{cr}", "critical distance, at which dU = 0", LENGTH),
    _plain("stable", "true: the pair returns to this distance after a small displacement"),
    _plain(
        "kind",
        "wanted: at a requested value; added: between two; vanishes: fold of two zeros; edge: d leaves its range",
    ),
    _plain("branch", "number of the branch of critical distances", whole=True),
    Column("U", "U", "velocity of the pair", VELOCITY),
    _plain("peak", "largest |dU| between a zero and the next, over that of the whole curve"),
    _plain("certain", "true: |dU| exceeds its error on both sides of the zero"),
    Column("d_error", r"\epsilon_d", "error of the distance, dU_error/|slope|; empty where two zeros meet", LENGTH),
    Column("parameter_error", r"\epsilon", "error of the followed parameter where two zeros meet; empty elsewhere", ""),
    *_correction(GAPS, "dU", VELOCITY),
    *_error(GAPS, "dU", VELOCITY, "mesh, ends, Newton's method and motion"),
    *_each(GAPS, "ends_error", r"\epsilon_{L{,}}", _ENDS, VELOCITY),
    *_correction(PARTICLES, "U", VELOCITY),
    *_correction(ONE, "dp_plus", STRESS),
    *_correction(PARTICLES, "F", FORCE),
    *_error(PARTICLES, "F", FORCE, "mesh, ends and Newton's method"),
    *_each(GAPS, "mesh_error", r"\epsilon{_}", "|dU{_} - dU{_} on a mesh with cells 2^0.5 times larger|", VELOCITY),
    _plain("wanted", "1 for a requested point, 0 for a point added by refinement", whole=True),
    Column(
        "m",
        r"m",
        "uniform source in the continuity equation of the liquid; measures the error of the time scheme",
        RATE,
        value=lambda o: o.m,
    ),
    Column(
        "volume_error",
        r"\epsilon_V",
        "largest relative change of a particle's volume",
        "",
        value=lambda o: o.volume_error,
    ),
    Column(
        "distortion", r"q", "smallest ratio of the current to the reference Jacobian of a liquid cell; 0: inverted", ""
    ),
    _of_polymer("c_max", r"\max\,\mathrm{tr}\,c", "largest trace of the conformation tensor", ""),
    _of_polymer("c_max_z", "z", "axial position of c_max", LENGTH),
    _of_polymer("c_max_r", "r", "radial position of c_max", LENGTH),
    _of_polymer("c_min", r"\min\,c", "smallest eigenvalue of the conformation tensor", ""),
    _of_polymer("s_jump", r"[s]", "largest change of s = log c within a cell", ""),
)
"""All columns; `_i` stands for the number of a particle or gap. Plots take their labels from symbol and unit."""
_BY_NAME = {entry.name: entry for entry in COLUMNS}
OBSERVED = tuple(entry.name for entry in COLUMNS if entry.value is not None and not entry.polymer)
"""Columns that are read off the observation of a solution."""
HEALTH = ("dt", "newton", "mesh", *OBSERVED, "distortion")
"""Diagnostic columns of series.csv, after `series_columns`."""
POLYMER_HEALTH = tuple(entry.name for entry in COLUMNS if entry.polymer)
"""Diagnostic columns that follow in a viscoelastic liquid."""
FORCES = ("F", "F_correction", "F_error")
"""Columns of every particle in curve.csv, if the velocity of the particles is prescribed."""
CURVE_HEALTH = ("t_relax", "meshes", *OBSERVED, "distortion")
"""Diagnostic columns of curve.csv and critical.csv, before those of a viscoelastic liquid."""


_OF_CASES = (
    _plain("status", "pending, finished, failed or timeout; the worst of all repetitions"),
    _plain("reason", "why the case ended"),
    _plain("points", "points of the curve or of the lines of critical distances", whole=True),
    _plain("steps", "accepted time steps of a run", whole=True),
    _plain("unknowns", "unknowns of the largest linear system", whole=True),
    _plain("wall_time", "wall time, without the start of Python; the median of all repetitions", "s"),
)
SWEEP_COLUMNS = (
    _plain("folder", "folder of the case within that of the sweep"),
    *_OF_CASES,
    _plain("warnings", "what run.json of the case warns of, separated by semicolons"),
    _plain("zeros", "zeros of dU from the smallest d on, or the critical distances asked for, with spaces between"),
    _plain("stable", "whether each of them is stable: true or false"),
    _plain("zeros_error", "error of each of them, half-width, with spaces between"),
    _plain("d_peak", "distance of the largest |dU| of the curve, which may lie between two points", LENGTH),
    _plain("d_peak_error", "error of d_peak, half-width", LENGTH),
    _plain("dU_peak", "dU there", VELOCITY),
    _plain("dU_error", "error of dU_peak, half-width", VELOCITY),
    _plain("mesh_error", "mesh_error of the nearest point", VELOCITY),
)
"""Columns that only results.csv has; the others are in `COLUMNS`."""
STUDY_COLUMNS = (
    *_OF_CASES,
    _plain("newton_iterations", "total number of Newton iterations", whole=True),
    _plain("factorisations", "total number of factorisations of Newton's matrix", whole=True),
    _plain("remeshings", "number of remeshings of a run", whole=True),
    _plain("meshes", "number of meshes made for a curve", whole=True),
    _plain("wall_time_spread", "largest minus smallest wall time of the repetitions", "s"),
    _plain("wall_*", "median wall time of a phase, such as wall_assembly", "s"),
    _plain("peak_memory", "peak memory of the process, libraries included", "bytes"),
    _plain("*@*", "the compared column at each entry of `at`, such as dU@0.5"),
    _plain("d_cr", "zero of dU of a curve; if there are several, the one with the largest peak", LENGTH),
    _plain("error", "largest difference from the reference or the exact values, over all entries of `at`"),
    _plain("relative_error", "error relative to the largest of the reference or exact values"),
    _plain("reference", "whether this row is the reference"),
    _plain("order_space", "observed order in space, from the next coarser mesh: of error over unknowns^-1/2"),
    _plain("order_time", "observed order in time, from the next larger steps: of error over 1/steps"),
    _plain("richardson_*", "Richardson extrapolation from three neighbours, at the last entry of `at`"),
    _plain("richardson_order_*", "observed order of the same three neighbours"),
    _plain("pareto", "whether no other row has a smaller wall time at the same or a smaller error"),
)
"""Columns that only study.csv has; `*` stands for a variable part of the name."""
WHOLE = frozenset(entry.name for entry in (*COLUMNS, *_OF_CASES) if entry.whole)
"""Names of the columns with whole numbers, in all tables including results.csv."""


def observed(observation: Any) -> dict[str, float]:
    """The columns that are read off the `Observation` of a solution, by name."""
    polymer = observation.conformation is not None
    return {e.name: float(e.value(observation)) for e in COLUMNS if e.value is not None and polymer >= e.polymer}


def gap_endings(n: int) -> list[str]:
    """Suffix of the column names for each gap of `n` particles: "" for a pair, else "_1", "_2", ..."""
    return [""] if n == 2 else [f"_{i}" for i in range(1, n)]


def relative_velocities(names: Iterable[str]) -> list[str]:
    """Those among the names of columns that are a relative velocity: dU, or dU_1, dU_2, ..."""
    return [name for name in names if re.fullmatch(r"dU(_\d+)?", name)]


def particle_endings(n: int) -> list[str]:
    """What the names of the columns of every particle end with, from upstream."""
    return ["_T", "_L"] if n == 2 else [f"_{i}" for i in range(1, n + 1)]


def error_column(names: Iterable[str], gap: str = "") -> str | None:
    """The column that holds the error of dU, the half-width of an interval; None if there is none.

    Args:
        names: Columns of a table.
        gap: What the names of the columns of the gap end with.
    """
    there = set(names)
    return next((name for name in (f"dU_error{gap}", f"mesh_error{gap}") if name in there), None)


def curve_columns(n: int, common: bool, sensitivities: Sequence[str], forces: bool) -> list[str]:
    """The columns that curve.csv begins with.

    Args:
        n: Number of particles.
        common: Whether there is a curve over one distance, which has slopes.
        sensitivities: Parameters by which dU was differentiated.
        forces: Whether the velocity of the particles is prescribed.
    """
    names = ["dU_held", "dU_discrete", "stretch", "dU_correction", "dU_error", "ends_error"]
    names += [*(["slope"] if common else []), *(f"by_{name}" for name in sensitivities)]
    by_gap = (name + gap for name in names for gap in gap_endings(n))
    corrections = [f"U_correction{each}" for each in particle_endings(n)] + ["dp_plus_correction"]
    if forces:
        corrections += [name + each for name in FORCES for each in particle_endings(n)]
    return [*series_columns(n)[1:], "newton", *by_gap, *corrections, "corrected", "wanted"]


CRITICAL_COLUMNS = (
    *("Ca_e", "De", "d_cr", "stable", "kind", "branch", "slope", "U", "D_L", "D_T", "dp", "dp_plus"),
    *("newton", "dU_correction", "corrected", "dU_error", "ends_error", "d_error", "parameter_error"),
)
"""The columns that critical.csv begins with."""
EQUILIBRIA_COLUMNS = ("d", "stable", "slope", "peak", "d_error", "certain")
"""The columns of equilibria.csv."""


def declare(columns: Iterable[Column]) -> None:
    """Add columns that one command alone has."""
    _BY_NAME.update({entry.name: entry for entry in columns})


def column(name: str) -> Column:
    """The description of a column, with its number filled in: `column("D_3").symbol == "D_{3}"`.

    Raises:
        KeyError: There is no such column.
    """
    if name in _BY_NAME and not name.endswith("_i"):
        return _BY_NAME[name]
    base, _, number = name.rpartition("_")
    if not number.isdecimal():
        raise KeyError(name)
    entry = _BY_NAME[f"{base}_i"]
    return replace(entry, name=name, symbol=entry.symbol.replace("_i", f"_{{{number}}}"))


def names_of(n: int, *quantities: str) -> list[str]:
    """The columns of quantities of every gap or particle, for `n` particles: of a pair, the leading one comes first."""
    gaps, particles = gap_endings(n), particle_endings(n)[:: -1 if n == 2 else 1]
    return [name + ending for name in quantities for ending in (particles if f"{name}_L" in _BY_NAME else gaps)]


def series_columns(n: int) -> list[str]:
    """The first columns of series.csv for `n` particles."""
    return ["t", *names_of(n, "d", "U", "dU", "D"), "dp", "dp_plus"]


def error_columns(n: int) -> list[str]:
    """The columns of the error of dU in series.csv, after `series_columns`, for `n` particles."""
    return names_of(n, "dU_discrete", "dU_correction", "dU_error")


def spread(endings: Sequence[str], **values: Iterable[float]) -> dict[str, float]:
    """Values by the names of their columns: of every quantity one for each gap or particle, from upstream.

    Raises:
        ValueError: A quantity has fewer or more values.
    """
    names = {name: zip(endings, each, strict=True) for name, each in values.items()}
    return {name + ending: float(value) for name, pairs in names.items() for ending, value in pairs}


def named_row(
    t: float,
    d: Iterable[float],
    U: Sequence[float] | Array,
    dU: Iterable[float],
    D: Iterable[float],
    dp: float,
    dp_plus: float,
) -> dict[str, float]:
    """One row of series.csv by the names of `series_columns`.

    Args:
        t: Time [D_c/U_av].
        d: Distances [D_c], one for each of the N-1 gaps from upstream.
        U: Velocities [U_av], one for each of the N particles from upstream.
        dU: Relative velocities [U_av], one for each gap from upstream.
        D: Taylor parameters, one for each particle from upstream.
        dp: Pressure drop over the length of the tube [eta_0 U_av/D_c].
        dp_plus: The part of `dp` that the particles cause [eta_0 U_av/D_c].

    Raises:
        ValueError: The lengths of `d`, `U`, `dU` and `D` are inconsistent.
    """
    n = len(U)
    values = {"t": float(t), "dp": float(dp), "dp_plus": float(dp_plus)}
    values |= spread(gap_endings(n), d=d, dU=dU) | spread(particle_endings(n), U=U, D=D)
    return {name: values[name] for name in series_columns(n)}
