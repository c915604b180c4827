"""The columns of all tables: name, order, symbol, meaning and unit."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any


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
    unit: str
    whole: bool = False
    value: Callable[[Any], float] | None = None
    polymer: bool = False


RATE = r"U_{av}/D_c"
TIME, VELOCITY, LENGTH, STRESS = r"D_c/U_{av}", r"U_{av}", r"D_c", r"\eta_0 U_{av}/D_c"
FORCE = r"\eta_0 U_{av} D_c"
# What names, symbols and descriptions of the particles' columns end with.
ENDINGS = (
    ("_L", "_L", "the leading (downstream) particle"),
    ("_T", "_T", "the trailing (upstream) particle"),
    ("_i", "_i", "particle i, counted from upstream,"),
)


def _of_polymer(name: str, symbol: str, meaning: str, unit: str) -> Column:
    """A column of the same name as in `Observation.conformation`."""
    return Column(name, symbol, meaning, unit, value=lambda o: getattr(o.conformation, name), polymer=True)


COLUMNS: tuple[Column, ...] = (
    Column("t", r"t", "time", TIME),
    Column("d", r"d", "distance between the facing surfaces of the pair on the axis", LENGTH),
    Column("d_i", r"d_i", "distance between the facing surfaces of particles i and i+1 on the axis", LENGTH),
    Column("U_L", r"U_L", "velocity of the leading (downstream) particle, the volume average of u_z", VELOCITY),
    Column("U_T", r"U_T", "velocity of the trailing (upstream) particle, the volume average of u_z", VELOCITY),
    Column("U_i", r"U_i", "velocity of particle i, counted from upstream, the volume average of u_z", VELOCITY),
    Column("dU", r"\Delta U", "relative velocity of the pair, U_L - U_T; positive: it separates", VELOCITY),
    Column("dU_i", r"\Delta U_i", "relative velocity of neighbours, U_(i+1) - U_i; positive: they separate", VELOCITY),
    Column("dU_held", r"\Delta U_h", "dU with the distance held, as if shapes and stresses had endless time", VELOCITY),
    Column("dU_held_i", r"\Delta U_{h,i}", "dU_i with all distances held", VELOCITY),
    Column("stretch", r"\mathrm{d}c/\mathrm{d}d", "rate of the centres of volume, dU, over that of the surfaces", ""),
    Column("stretch_i", r"\mathrm{d}c_i/\mathrm{d}d", "the same when all distances change together", ""),
    Column("t_relax", r"t_r", "slowest decay time of a disturbance at held distance", TIME),
    Column(
        "drift", r"\delta", "in folders of earlier versions: dU is that at held distance, and this is added", VELOCITY
    ),
    Column("drift_i", r"\delta_i", "in folders of earlier versions: the same for dU_i", VELOCITY),
    Column("D_L", r"D_L", "Taylor parameter (L_z - L_r)/(L_z + L_r) of the leading particle", ""),
    Column("D_T", r"D_T", "Taylor parameter (L_z - L_r)/(L_z + L_r) of the trailing particle", ""),
    Column("D_i", r"D_i", "Taylor parameter (L_z - L_r)/(L_z + L_r) of particle i, counted from upstream", ""),
    Column("dp", r"\Delta p", "pressure drop over the length of the tube", STRESS),
    Column("dp_plus", r"\Delta p^+", "pressure drop in excess of that of the same tube without particles", STRESS),
    *(
        Column(f"F{i}", f"F{s}", f"force along the tube that moves {who} at the prescribed velocity", FORCE)
        for i, s, who in ENDINGS
    ),
    Column("dt", r"\Delta t", "size of the time step that ends at t", TIME),
    Column(
        "newton", r"n", "Newton iterations of the step, or of the continuation from the previous point", "", whole=True
    ),
    Column("mesh", r"k", "number of remeshings before the step", "", whole=True),
    Column("meshes", r"k", "number of meshes made so far", "", whole=True),
    Column(
        "slope",
        r"\mathrm{d}\Delta U/\mathrm{d}d",
        "derivative by d of dU_held, at a zero of dU; a zero with negative slope is stable",
        RATE,
    ),
    Column(
        "slope_i",
        r"\mathrm{d}\Delta U_i/\mathrm{d}d",
        "derivative of dU_held_i by d when all distances change together",
        RATE,
    ),
    *(
        Column(
            f"by_{name}{i}",
            rf"\partial\Delta U{s}/\partial {symbol}",
            f"derivative of dU_held{i} by {name}",
            VELOCITY,
        )
        for name, symbol in (("Ca_e", r"\mathrm{Ca}_e"), ("De", r"\mathrm{De}"), ("beta", r"\beta"))
        for i, s in (("", ""), ("_i", "_i"))
    ),
    Column("Ca_e", r"\mathrm{Ca}_e", "elastic capillary number of the soft particles", ""),
    Column("De", r"\mathrm{De}", "Deborah number", ""),
    Column("d_cr", r"d_{cr}", "critical distance, at which dU = 0", LENGTH),
    Column("stable", "", "true: the pair returns to this distance after a small displacement", ""),
    Column(
        "kind",
        "",
        "wanted: at a requested value; added: between two; vanishes: fold of two zeros; edge: d leaves its range",
        "",
    ),
    Column("branch", "", "number of the branch of critical distances", "", whole=True),
    Column("U", "U", "velocity of the pair", VELOCITY),
    Column("peak", "", "largest |dU| between a zero and the next, over that of the whole curve", ""),
    Column("certain", "", "true: |dU| exceeds its error on both sides of the zero", ""),
    Column("d_error", r"\epsilon_d", "error of the distance, dU_error/|slope|; empty where two zeros meet", LENGTH),
    Column("parameter_error", r"\epsilon", "error of the followed parameter where two zeros meet; empty elsewhere", ""),
    Column("dU_correction", r"\delta^h", "estimate of exact minus discrete dU", VELOCITY),
    Column("dU_correction_i", r"\delta^h_i", "estimate of exact minus discrete dU_i", VELOCITY),
    Column("dU_error", r"\epsilon", "error of dU by mesh, ends, Newton's method and motion, half-width", VELOCITY),
    Column("dU_error_i", r"\epsilon_i", "error of dU_i by the same, half-width", VELOCITY),
    Column("ends_error", r"\epsilon_L", "the part of dU_error that is due to the ends of the tube", VELOCITY),
    Column("ends_error_i", r"\epsilon_{L,i}", "the part of dU_error_i that is due to the ends of the tube", VELOCITY),
    Column("U_correction_L", r"\delta^h_L", "estimate of exact minus discrete U_L", VELOCITY),
    Column("U_correction_T", r"\delta^h_T", "estimate of exact minus discrete U_T", VELOCITY),
    Column("U_correction_i", r"\delta^h_i", "estimate of exact minus discrete U_i", VELOCITY),
    Column("dp_plus_correction", r"\delta^h", "estimate of exact minus discrete dp_plus", STRESS),
    *(
        Column(f"F_correction{i}", rf"\delta^h{s}", f"estimate of exact minus discrete F{i}", FORCE)
        for i, s, _ in ENDINGS
    ),
    *(
        Column(f"F_error{i}", rf"\epsilon{s}", f"error of F{i} by mesh, ends and Newton's method, half-width", FORCE)
        for i, s, _ in ENDINGS
    ),
    Column("mesh_error", r"\epsilon", "|dU - dU on a mesh with cells 2^0.5 times larger|", VELOCITY),
    Column("mesh_error_i", r"\epsilon_i", "|dU_i - dU_i on a mesh with cells 2^0.5 times larger|", VELOCITY),
    Column("wanted", "", "1 for a requested point, 0 for a point added by refinement", "", whole=True),
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
WHOLE = frozenset({"points", "steps", "unknowns", *(entry.name for entry in COLUMNS if entry.whole)})
"""Names of the columns with whole numbers, in all tables including results.csv."""
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


SWEEP_COLUMNS = (
    Column("folder", "", "folder of the case within that of the sweep", ""),
    Column("status", "", "pending, finished, failed or timeout", ""),
    Column("reason", "", "why the case ended", ""),
    Column("warnings", "", "what run.json of the case warns of, separated by semicolons", ""),
    Column("points", "", "points of the curve or of the lines of critical distances", ""),
    Column(
        "zeros", "", "zeros of dU from the smallest d on, or the critical distances asked for, with spaces between", ""
    ),
    Column("stable", "", "whether each of them is stable: true or false", ""),
    Column("zeros_error", "", "error of each of them, half-width, with spaces between", ""),
    Column("d_peak", "", "distance of the largest |dU| of the curve, which may lie between two points", LENGTH),
    Column("d_peak_error", "", "error of d_peak, half-width", LENGTH),
    Column("dU_peak", "", "dU there", VELOCITY),
    Column("dU_error", "", "error of dU_peak, half-width", VELOCITY),
    Column("mesh_error", "", "mesh_error of the nearest point", VELOCITY),
    Column("steps", "", "accepted time steps", ""),
    Column("unknowns", "", "unknowns of the largest linear system", ""),
    Column("wall_time", "", "wall time, without the start of Python", "s"),
)
"""Columns that only results.csv has; the others are in `COLUMNS`."""
STUDY_COLUMNS = (
    Column("status", "", "pending, finished, failed or timeout: the worst of all repetitions", ""),
    Column("reason", "", "why the case ended", ""),
    Column("unknowns", "", "unknowns of the largest linear system", ""),
    Column("steps", "", "number of accepted time steps of a run", ""),
    Column("points", "", "number of points of a curve", ""),
    Column("newton_iterations", "", "total number of Newton iterations", ""),
    Column("factorisations", "", "total number of factorisations of Newton's matrix", ""),
    Column("remeshings", "", "number of remeshings of a run", ""),
    Column("meshes", "", "number of meshes made for a curve", ""),
    Column("wall_time", "", "median wall time of all repetitions, without the start of Python", "s"),
    Column("wall_time_spread", "", "largest minus smallest wall time of the repetitions", "s"),
    Column("wall_*", "", "median wall time of a phase, such as wall_assembly", "s"),
    Column("peak_memory", "", "peak memory of the process, libraries included", "bytes"),
    Column("*@*", "", "the compared column at each entry of `at`, such as dU@0.5", ""),
    Column("d_cr", "", "zero of dU of a curve; if there are several, the one with the largest peak", LENGTH),
    Column("error", "", "largest difference from the reference or the exact values, over all entries of `at`", ""),
    Column("relative_error", "", "error relative to the largest of the reference or exact values", ""),
    Column("reference", "", "whether this row is the reference", ""),
    Column(
        "order_space",
        "",
        "observed order in space: slope of log error over log 1/sqrt(unknowns), from the next coarser mesh",
        "",
    ),
    Column(
        "order_time", "", "observed order in time: slope of log error over log 1/steps, from the next larger steps", ""
    ),
    Column(
        "richardson_*",
        "",
        "Richardson extrapolation from three neighbours in space or time, at the last entry of `at`",
        "",
    ),
    Column("richardson_order_*", "", "observed order of the same three neighbours", ""),
    Column("pareto", "", "whether no other row has a smaller wall time at the same or a smaller error", ""),
)
"""Columns that only study.csv has; `*` stands for a variable part of the name."""


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


def curve_columns(n: int, common: bool, mesh_error: bool, sensitivities: Sequence[str], forces: bool) -> list[str]:
    """The columns that curve.csv begins with.

    Args:
        n: Number of particles.
        common: Whether there is a curve over one distance, which has slopes.
        mesh_error: Whether points were solved on a coarser mesh too.
        sensitivities: Parameters by which dU was differentiated.
        forces: Whether the velocity of the particles is prescribed.
    """
    names = ["dU_held", "stretch", "dU_correction", "dU_error", "ends_error", *(["mesh_error"] if mesh_error else [])]
    names += [*(["slope"] if common else []), *(f"by_{name}" for name in sensitivities)]
    by_gap = (name + gap for name in names for gap in gap_endings(n))
    corrections = [f"U_correction{each}" for each in particle_endings(n)] + ["dp_plus_correction"]
    if forces:
        corrections += [name + each for name in FORCES for each in particle_endings(n)]
    return [*series_columns(n)[1:], "newton", *by_gap, *corrections, "wanted"]


CRITICAL_COLUMNS = (
    *("Ca_e", "De", "d_cr", "stable", "kind", "branch", "slope", "U", "D_L", "D_T", "dp", "dp_plus"),
    *("newton", "dU_correction", "dU_error", "ends_error", "d_error", "parameter_error"),
)
"""The columns that critical.csv begins with."""
EQUILIBRIA_COLUMNS = ("d", "stable", "slope", "peak", "d_error", "certain")
"""The columns of equilibria.csv."""


_DECLARED: dict[str, Column] = {}


def declare(columns: Iterable[Column]) -> None:
    """Add columns that one command alone has."""
    _DECLARED.update({entry.name: entry for entry in columns})


def column(name: str) -> Column:
    """The description of a column, with its number filled in: `column("D_3").symbol == "D_{3}"`.

    Raises:
        KeyError: There is no such column.
    """
    table = {entry.name: entry for entry in COLUMNS} | _DECLARED
    if name in table and not name.endswith("_i"):
        return table[name]
    match = re.fullmatch(r"(\w+)_(\d+)", name)
    entry = table.get(f"{match[1]}_i") if match else None
    if match is None or entry is None:
        raise KeyError(name)
    return Column(name, entry.symbol.replace("_i", f"_{{{match[2]}}}"), entry.meaning, entry.unit)


def series_columns(n: int) -> list[str]:
    """The first columns of series.csv for `n` particles.

    Raises:
        ValueError: `n` is negative.
    """
    if n < 0:
        raise ValueError(f"number of particles is {n}")
    if n == 2:
        return ["t", "d", "U_L", "U_T", "dU", "D_L", "D_T", "dp", "dp_plus"]
    gaps, particles = range(1, n), range(1, n + 1)
    names = ["t", *(f"d_{i}" for i in gaps), *(f"U_{i}" for i in particles)]
    return [*names, *(f"dU_{i}" for i in gaps), *(f"D_{i}" for i in particles), "dp", "dp_plus"]


def error_columns(n: int) -> list[str]:
    """The columns of the error of dU in series.csv, after `series_columns`, for `n` particles."""
    return [f"{name}{gap}" for name in ("dU_correction", "dU_error") for gap in gap_endings(n)]


def named_row(
    t: float,
    d: Iterable[float],
    U: Iterable[float],
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
    gaps, velocities, differences, shapes = ([float(value) for value in values] for values in (d, U, dU, D))
    n = len(velocities)
    if len(shapes) != n or len(gaps) != max(n - 1, 0) or len(differences) != len(gaps):
        raise ValueError(f"{n} velocities, {len(shapes)} Taylor parameters and {len(gaps)} gaps are inconsistent")
    if n == 2:  # particle 1 is the trailing one; the columns of the leading one come first
        middle = [*gaps, *velocities[::-1], *differences, *shapes[::-1]]
    else:
        middle = [*gaps, *velocities, *differences, *shapes]
    values = (float(value) for value in (t, *middle, dp, dp_plus))
    return dict(zip(series_columns(n), values, strict=True))
