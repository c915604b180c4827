"""The columns of all tables: name, order, symbol, meaning and unit."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

from pairsim.quantities.kinds import FORCE, LENGTH, POSITION, PURE, RATE, SECONDS, STRESS, TIME, VELOCITY, Kind

GAP, PARTICLE = "gap", "particle"
WORDS: dict[str, dict[str, str]] = {
    "": {"": ""},
    GAP: {"": "the pair", "_i": "particles i and i+1"},
    PARTICLE: {
        "_L": "the leading (downstream) particle",
        "_T": "the trailing (upstream) particle",
        "_i": "particle i (counted from upstream)",
    },
}
"""The gaps and particles by the suffixes of their columns: those of a pair, and `_i` in larger rows."""
SUFFIX = "_[0-9]+|_[LT]|"


@dataclass(frozen=True)
class Column:
    """A quantity in tables, with a column of its own or one for each gap or particle."""

    name: str
    symbol: str  # symbol of the paper (TeX); `{_}`, in a subscript `{,}`, stands for the suffix
    meaning: str  # `{_}` stands for the suffix, `{of}` for the gap or particle
    unit: Kind = PURE
    of: str = ""  # what it has a column for each of, `GAP` or `PARTICLE`
    whole: bool = False  # whether its values are whole numbers
    unknown: bool = False  # whether a value may be unknown, nan in the file
    value: Callable[[Any], Any] | None = None  # takes it off an `Observation`: then all tables of solutions have it
    polymer: bool = False  # whether it is there in viscoelastic liquids alone

    def with_suffix(self, suffix: str) -> Column:
        """Its column for a gap or particle.

        Raises:
            KeyError: It has no column with this suffix.
        """
        number = suffix.removeprefix("_")
        subscript, words = (f"_{{{number}}}", "_i") if number.isdecimal() else (suffix, suffix)
        symbol = self.symbol.replace("{_}", subscript).replace("{,}", suffix.replace("_", ","))
        meaning = self.meaning.replace("{_}", suffix).replace("{of}", WORDS[self.of][words])
        return replace(self, name=self.name + suffix, symbol=symbol, meaning=meaning)


def suffixes(of: str, n: int) -> list[str]:
    """What the names of the columns of every gap or particle end with, from upstream.

    Args:
        of: `GAP`, `PARTICLE`, or "" for a quantity with one column.
        n: Number of particles.

    Returns:
        "" for the gap of a pair, "_T" and "_L" for its particles; "_1", "_2", ... for those of other rows.
    """
    if not of:
        return [""]
    if n == 2:
        return [""] if of == GAP else ["_T", "_L"]
    return [f"_{i}" for i in range(1, n + (of == PARTICLE))]


def suffixes_in(names: Iterable[str], quantity: str) -> list[str]:
    """The suffixes with which a quantity is among the names of columns, in their order; see `suffixes`."""
    return [name.removeprefix(quantity) for name in names if re.fullmatch(f"{quantity}({SUFFIX})", name)]


def error_of(name: str) -> str:
    """The column of the error of a column: `dU_error_1` of `dU_1`."""
    return re.sub(f"({SUFFIX})$", r"_error\1", name, count=1)


def _plain(name: str, meaning: str, unit: Kind = PURE, *, whole: bool = False) -> Column:
    """A column without a symbol."""
    return Column(name, "", meaning, unit, whole=whole)


def _correction(of: str, name: str, unit: Kind) -> Column:
    """The estimated discretisation error of a quantity."""
    meaning = f"estimate of exact minus discrete {name}{{_}}, contained in it unless corrected is 0"
    return Column(f"{name}_correction", r"\delta^h{_}", meaning, unit, of, unknown=True)


def _error(of: str, name: str, unit: Kind, by: str) -> Column:
    """The half-width of the interval of a quantity."""
    meaning = f"half-width of the interval of {name}{{_}}: error by {by}"
    return Column(f"{name}_error", r"\epsilon{_}", meaning, unit, of, unknown=True)


def _by(name: str, symbol: str, words: str = "") -> Column:
    """The derivative of dU by a parameter."""
    symbol = rf"\partial\Delta U{{_}}/\partial {symbol}"
    return Column(f"by_{name}", symbol, f"derivative of dU{{_}} by {words or name}", VELOCITY, GAP)


def _observed(name: str, symbol: str, meaning: str, unit: Kind = PURE) -> Column:
    """A column of the same name as in `Observation`."""
    return Column(name, symbol, meaning, unit, value=lambda o: getattr(o, name))


def _of_polymer(name: str, symbol: str, meaning: str, unit: Kind = PURE) -> Column:
    """A column of the same name as in `Observation.conformation`."""
    return Column(name, symbol, meaning, unit, value=lambda o: getattr(o.conformation, name), polymer=True)


_TAYLOR = "Taylor parameter (L_z - L_r)/(L_z + L_r) of {of}"
_RELATIVE = "velocity of the downstream particle of {of} minus that of the upstream one; positive: they separate"
_HELD = "dU{_} with all distances held, as if shapes and stresses had endless time"
_DISCRETE = "dU{_} of the discrete solution, at held distances or in a run, without the estimate of its error"
_CORRECTED = (
    "1: velocities, forces and pressure drop contain the estimates of their errors; 0: they do not, as the estimates "
    "are what remains of much larger contributions"
)
_STRETCH = "rate of the centres of volume, dU{_}, over that of the surfaces, when all distances change together"
_FROM_REST = "bound on what a start from rest adds to, or takes from, the distance of the centres; 0 without softness"
_SLOPE = (
    "derivative of dU_held{_} by d when all distances change together; at a zero of dU that of dU, and a zero with "
    "negative slope is stable"
)
_ENDS = "the part of dU_error{_} that is due to the ends of the tube"
_PLACE = "position of the centre of {of} along the tube, from where that of the first (upstream) one started"
_REGULARISED = "the part of dU_error{_} that is due to the regularisation of a liquid with a yield stress"
_BRIDGE = "radius of the cylinder around the axis in which no liquid yields between the particles; 0: some does"
_CREEP = "power of 1/m by which dU_held{_} has fallen from a tenth of m; nan where no bridge makes it worth asking"
_WHILE = "dU{{_}} at {} of the time of a run at held distances; where it differs from dU{{_}} it has not settled"
_MOVED = "force along the tube that moves {of} at the prescribed velocity"

COLUMNS: tuple[Column, ...] = (
    Column("t", r"t", "time", TIME),
    Column("d", r"d{_}", "distance between the facing surfaces of {of} on the axis", LENGTH, GAP),
    Column("U", r"U{_}", "velocity of {of}, the volume average of u_z", VELOCITY, PARTICLE),
    Column("dU", r"\Delta U{_}", _RELATIVE, VELOCITY, GAP),
    Column("dU_held", r"\Delta U_{h{,}}", _HELD, VELOCITY, GAP),
    Column("dU_half", r"\Delta U_{2T{,}}", _WHILE.format("half"), VELOCITY, GAP),
    Column("dU_quarter", r"\Delta U_{T{,}}", _WHILE.format("a quarter"), VELOCITY, GAP),
    Column("dU_discrete", r"\Delta U^h{_}", _DISCRETE, VELOCITY, GAP),
    _plain("corrected", _CORRECTED, whole=True),
    Column("stretch", r"\mathrm{d}c{_}/\mathrm{d}d", _STRETCH, PURE, GAP),
    Column("from_rest", r"\delta c{_}", _FROM_REST, LENGTH, GAP),
    Column("t_relax", r"t_r", "slowest decay time of a disturbance at held distance", TIME, unknown=True),
    Column("D", r"D{_}", _TAYLOR, PURE, PARTICLE),
    Column("dp", r"\Delta p", "pressure drop over the length of the tube", STRESS),
    Column("dp_plus", r"\Delta p^+", "pressure drop in excess of that of the same tube without particles", STRESS),
    Column("z", r"z{_}", _PLACE, POSITION, PARTICLE),
    Column("F", r"F{_}", _MOVED, FORCE, PARTICLE),
    Column("dt", r"\Delta t", "size of the time step that ends at t", TIME),
    Column("newton", "n", "Newton iterations of the step, or of the continuation from the previous point", whole=True),
    Column("mesh", r"k", "number of remeshings before the step", whole=True),
    Column("meshes", r"k", "number of meshes made so far", whole=True),
    Column("slope", r"\mathrm{d}\Delta U{_}/\mathrm{d}d", _SLOPE, RATE, GAP),
    Column(
        "U_slope",
        r"\partial U{_}/\partial d",
        "derivative of U{_} by a distance, to first order in what moving changes: exact where dU = 0",
        RATE,
        PARTICLE,
    ),
    Column("U_slope_held", r"\partial U_{h{,}}/\partial d", "the same of velocities at held distances", RATE, PARTICLE),
    _plain("gap", "the distance by which is derived, counted from upstream", whole=True),
    _by("Ca_e", r"\mathrm{Ca}_e"),
    _by("De", r"\mathrm{De}"),
    _by("xi", r"\xi"),
    _by("beta", r"\beta"),
    _by("difference", r"\delta", "the difference of the diameters, the leading less the trailing one, over their mean"),
    Column("Ca_e", r"\mathrm{Ca}_e", "elastic capillary number of the soft particles"),
    Column("De", r"\mathrm{De}", "Deborah number"),
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
    Column(
        "d_error",
        r"\epsilon_d",
        "error of the distance where dU (of trains, the largest growth rate) is 0: its error over |slope|; empty "
        "where two zeros meet",
        LENGTH,
    ),
    Column("parameter_error", r"\epsilon", "error of the followed parameter where two zeros meet; empty elsewhere"),
    _correction(GAP, "dU", VELOCITY),
    _error(GAP, "dU", VELOCITY, "mesh, ends, Newton's method and motion; in a run by mesh, time steps and start"),
    Column("ends_error", r"\epsilon_{L{,}}", _ENDS, VELOCITY, GAP),
    Column("regularisation_error", r"\epsilon_{m{,}}", _REGULARISED, VELOCITY, GAP),
    Column("bridge", r"b{_}", _BRIDGE, LENGTH, GAP),
    Column("plug", "r_p", "radius within which the liquid does not yield where there are no particles", LENGTH),
    Column("creep", r"k{_}", _CREEP, PURE, GAP, unknown=True),
    _correction(PARTICLE, "U", VELOCITY),
    _error(PARTICLE, "U", VELOCITY, "mesh, ends and Newton's method"),
    _correction("", "dp_plus", STRESS),
    _error("", "dp_plus", STRESS, "mesh, ends and Newton's method"),
    _correction(PARTICLE, "F", FORCE),
    _error(PARTICLE, "F", FORCE, "mesh, ends and Newton's method"),
    _plain("wanted", "1 for a requested point, 0 for a point added by refinement", whole=True),
    _observed("m", "m", "uniform source in the liquid's continuity equation; measures the error of time steps", RATE),
    _observed("volume_error", r"\epsilon_V", "largest relative change of a particle's volume"),
    Column("distortion", "q", "smallest ratio of the current to the reference Jacobian of a liquid cell; 0: inverted"),
    _of_polymer("c_max", r"\max\,\mathrm{tr}\,c", "largest trace of the conformation tensor"),
    _of_polymer("c_max_z", "z", "axial position of c_max", LENGTH),
    _of_polymer("c_max_r", "r", "radial position of c_max", LENGTH),
    _of_polymer("c_min", r"\min\,c", "smallest eigenvalue of the conformation tensor"),
    _of_polymer("s_jump", r"[s]", "largest change of s = log c within a cell"),
)
"""All columns, but for those of one command alone. Plots take their labels from symbol and unit."""
OBSERVED = tuple(entry.name for entry in COLUMNS if entry.value is not None and not entry.polymer)
"""Quantities that are read off the observation of a solution."""
MOTION = ("d", "U", "dU", "D", "dp", "dp_plus")  # what tables of runs and curves have of every solution
HEALTH = ("dt", "newton", "mesh", *OBSERVED, "distortion")
"""Diagnostics in series.csv, after `series_columns`."""
POLYMER_HEALTH = tuple(entry.name for entry in COLUMNS if entry.polymer)
"""Diagnostics that follow in a viscoelastic liquid."""
YIELD_HEALTH = ("regularisation_error", "bridge", "creep", "plug")
"""Diagnostics in curve.csv and critical.csv that follow in a liquid with a yield stress."""
FORCES = ("F", "F_correction", "F_error")
"""What curve.csv has of every particle, if their velocity is prescribed."""
CURVE_HEALTH = ("t_relax", "meshes", *OBSERVED, "distortion")
"""Diagnostics in curve.csv and critical.csv, before those of a viscoelastic liquid."""


_OF_CASES = (
    _plain("status", "pending, finished or failed; the worst of all repetitions"),
    _plain("reason", "why the case ended"),
    _plain("points", "points of the curve or of the lines of critical distances", whole=True),
    _plain("steps", "accepted time steps of a run", whole=True),
    _plain("unknowns", "unknowns of the largest linear system", whole=True),
    _plain("wall_time", "wall time, without the start of Python; the median of all repetitions", SECONDS),
)
SWEEP_COLUMNS = (
    _plain("folder", "folder of the case within that of the sweep"),
    *_OF_CASES,
    _plain("warnings", "what run.json of the case warns of, separated by semicolons"),
    _plain("zeros", "zeros of dU from the smallest d on, or the critical distances asked for, spaces between", LENGTH),
    _plain("stable", "whether each of them is stable: true or false"),
    _plain("zeros_error", "error of each of them, half-width, with spaces between", LENGTH),
    _plain("d_peak", "distance of the largest |dU| of the curve, which may lie between two points", LENGTH),
    _plain("d_peak_error", "error of d_peak, half-width", LENGTH),
    _plain("dU_peak", "dU there", VELOCITY),
    _plain("dU_error", "error of dU_peak, of a run that of dU, half-width", VELOCITY),
)
"""Columns that only results.csv has; the others are in `COLUMNS`."""
STUDY_COLUMNS = (
    *_OF_CASES,
    _plain("newton_iterations", "total number of Newton iterations", whole=True),
    _plain("factorisations", "total number of factorisations of Newton's matrix", whole=True),
    _plain("*@*", "the compared column at each entry of `at`, such as dU@0.5; its last value without `at`"),
    _plain("error", "largest difference from the reference, over all entries of `at`"),
    _plain("relative_error", "error relative to the largest value of the reference"),
    _plain("reference", "whether this row is the reference"),
    _plain("order_space", "observed order in space, from the next coarser mesh: of error over unknowns^-1/2"),
    _plain("order_time", "observed order in time, from the next larger steps: of error over 1/steps"),
)
"""Columns that only study.csv has; `*` stands for a variable part of the name."""
WHOLE = frozenset(entry.name for entry in (*COLUMNS, *SWEEP_COLUMNS, *STUDY_COLUMNS) if entry.whole)
"""Names of the columns with whole numbers, in all tables including results.csv and study.csv."""


_ALONE: dict[str, Column] = {}
_OF_MANY: dict[str, Column] = {}  # quantities of every gap or particle


def declare(columns: Iterable[Column]) -> None:
    """Add columns to those that are known."""
    for entry in columns:
        if entry.of:
            _OF_MANY[entry.name] = entry
        else:
            _ALONE[entry.name] = entry.with_suffix("")


declare(COLUMNS)


def column(name: str) -> Column:
    """The description of a column, with its number filled in: `column("D_3").symbol == "D_{3}"`.

    Raises:
        KeyError: There is no such column.
    """
    if name in _ALONE:
        return _ALONE[name]
    suffix = name[len(re.sub(f"({SUFFIX})$", "", name, count=1)) :]
    return _OF_MANY[name.removesuffix(suffix)].with_suffix(suffix)


def known(name: str) -> Column | None:
    """The same, None for a column that is not of pairsim."""
    try:
        return column(name)
    except KeyError:
        return None


def _suffixes_of(quantity: str, n: int) -> list[str]:
    return suffixes(_OF_MANY[quantity].of if quantity in _OF_MANY else "", n)


def names_of(n: int, *quantities: str) -> list[str]:
    """The columns of quantities in tables of `n` particles: of a pair, the leading one comes first."""
    return [name + suffix for name in quantities for suffix in _suffixes_of(name, n)[:: -1 if n == 2 else 1]]


def table_row(n: int, **values: Any) -> dict[str, float]:
    """A row of a table of `n` particles by the names of its columns.

    Each quantity has a number, or one for each of the n - 1 gaps or the n particles from upstream.

    Raises:
        ValueError: A quantity has fewer or more values.
    """
    row: dict[str, float] = {}
    for name, value in values.items():
        entries = value if name in _OF_MANY else (value,)
        row |= {name + at: float(entry) for at, entry in zip(_suffixes_of(name, n), entries, strict=True)}
    return row


def observed(observation: Any) -> dict[str, Any]:
    """The values that are read off the `Observation` of a solution, by quantity."""
    polymer = observation.conformation is not None
    return {e.name: e.value(observation) for e in COLUMNS if e.value is not None and polymer >= e.polymer}


def slope_columns(n: int) -> list[str]:
    """The columns of slopes.csv."""
    return names_of(n, "d", "gap", "U_slope", "U_slope_held")


def series_columns(n: int) -> list[str]:
    """The first columns of series.csv for `n` particles."""
    return names_of(n, "t", *MOTION, "z")


def error_columns(n: int) -> list[str]:
    """The columns of the error of dU in series.csv, after `series_columns`, for `n` particles."""
    return names_of(n, "dU_discrete", "dU_correction", "dU_error")


def curve_columns(n: int, common: bool, sensitivities: Sequence[str], forces: bool) -> list[str]:
    """The columns that curve.csv of `n` particles begins with.

    A curve over one distance in common has slopes; where the velocity of the particles is prescribed there are forces.
    Sensitivities are the parameters by which dU was differentiated.
    """
    names = ["newton", "dU_held", "dU_discrete", "stretch", "from_rest", "dU_correction", "dU_error", "ends_error"]
    names += [*(["slope"] if common else []), *(f"by_{name}" for name in sensitivities)]
    names += ["U_correction", "U_error", "dp_plus_correction", "dp_plus_error"]
    names += [*(FORCES if forces else ()), "corrected", "wanted"]
    return names_of(n, *MOTION, *names)


CRITICAL_COLUMNS = (
    *("Ca_e", "De", "d_cr", "stable", "kind", "branch", "slope", "U", "D_L", "D_T", "dp", "dp_plus"),
    *("newton", "dU_correction", "corrected", "dU_error", "ends_error", "d_error", "parameter_error"),
)
"""The columns that critical.csv begins with."""
EQUILIBRIA_COLUMNS = ("d", "stable", "slope", "peak", "d_error", "certain")
"""The columns of equilibria.csv."""
