"""The columns of all tables: their names and order, what each means, its symbol and unit."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Column:
    """One column: its name, the paper's symbol (TeX), what it means, its unit (TeX, "" without one).

    `whole`: whether its numbers are whole.
    """

    name: str
    symbol: str
    meaning: str
    unit: str
    whole: bool = False


RATE = r"U_{av}/D_c"
TIME, VELOCITY, LENGTH, STRESS = r"D_c/U_{av}", r"U_{av}", r"D_c", r"\eta_0 U_{av}/D_c"
COLUMNS: tuple[Column, ...] = (
    Column("t", r"t", "time", TIME),
    Column("d", r"d", "distance between the facing surfaces of the pair on the axis", LENGTH),
    Column("d_i", r"d_i", "distance between the facing surfaces of particles i and i+1 on the axis", LENGTH),
    Column("U_L", r"U_L", "velocity of the leading (downstream) particle, the volume average of u_z", VELOCITY),
    Column("U_T", r"U_T", "velocity of the trailing (upstream) particle, the volume average of u_z", VELOCITY),
    Column("U_i", r"U_i", "velocity of particle i, counted from upstream, the volume average of u_z", VELOCITY),
    Column("dU", r"\Delta U", "relative velocity of the pair, U_L - U_T, positive if they separate", VELOCITY),
    Column(
        "dU_i", r"\Delta U_i", "relative velocity of neighbours, U_(i+1) - U_i, positive if they separate", VELOCITY
    ),
    Column("D_L", r"D_L", "Taylor parameter (L_z - L_r)/(L_z + L_r) of the leading particle", ""),
    Column("D_T", r"D_T", "Taylor parameter (L_z - L_r)/(L_z + L_r) of the trailing particle", ""),
    Column("D_i", r"D_i", "Taylor parameter (L_z - L_r)/(L_z + L_r) of particle i, counted from upstream", ""),
    Column("dp", r"\Delta p", "pressure drop over the length of the tube", STRESS),
    Column("dp_plus", r"\Delta p^+", "pressure drop in excess of that of the same tube without particles", STRESS),
    Column("dt", r"\Delta t", "size of the step that ends here", TIME),
    Column("newton", r"n", "Newton iterations of the step, or on the way from the point before", "", whole=True),
    Column("mesh", r"k", "remeshings before the step", "", whole=True),
    Column("meshes", r"k", "meshes made so far", "", whole=True),
    Column("slope", r"\mathrm{d}\Delta U/\mathrm{d}d", "slope of dU over d; at a zero, negative is stable", RATE),
    Column("slope_i", r"\mathrm{d}\Delta U_i/\mathrm{d}d", "slope of dU_i when all distances change together", RATE),
    Column("drift", r"\delta", "change of dU by the terms that a quasi-steady solution leaves out", VELOCITY),
    Column("drift_i", r"\delta_i", "change of dU_i by the terms that a quasi-steady solution leaves out", VELOCITY),
    *(
        Column(
            f"by_{name}{i}",
            rf"\partial\Delta U{s}/\partial {symbol}",
            f"derivative of dU{i} by {name} at fixed d",
            VELOCITY,
        )
        for name, symbol in (("Ca_e", "Ca_e"), ("De", r"\mathrm{De}"), ("beta", r"\beta"))
        for i, s in (("", ""), ("_i", "_i"))
    ),
    Column("Ca_e", "Ca_e", "elastic capillary number of the soft particles", ""),
    Column("De", r"\mathrm{De}", "Deborah number", ""),
    Column("d_cr", r"d_{cr}", "critical distance: the pair moves as one", LENGTH),
    Column("stable", "", "true: a pair that is displaced a little comes back", ""),
    Column("kind", "", "wanted, added; vanishes: a stable and an unstable zero meet; edge: d leaves the range", ""),
    Column("branch", "", "number of the line of critical distances", "", whole=True),
    Column("U", "U", "velocity of the pair", VELOCITY),
    Column("peak", "", "largest |dU| between a zero and the next, over that of the whole curve", ""),
    Column("certain", "", "true: |dU| exceeds its error on both sides of the zero", ""),
    Column("d_error", r"\epsilon_d", "error of the distance, dU_error/|slope|; empty where two zeros meet", LENGTH),
    Column("parameter_error", r"\epsilon", "error of the followed parameter where two zeros meet; empty elsewhere", ""),
    Column("dU_correction", r"\delta^h", "estimate of exact minus discrete dU", VELOCITY),
    Column("dU_correction_i", r"\delta^h_i", "estimate of exact minus discrete dU_i", VELOCITY),
    Column("dU_error", r"\epsilon", "error of dU by mesh and Newton's method, half-width of an interval", VELOCITY),
    Column("dU_error_i", r"\epsilon_i", "error of dU_i by mesh and Newton's method, half-width", VELOCITY),
    Column("U_correction_L", r"\delta^h_L", "estimate of exact minus discrete U_L", VELOCITY),
    Column("U_correction_T", r"\delta^h_T", "estimate of exact minus discrete U_T", VELOCITY),
    Column("U_correction_i", r"\delta^h_i", "estimate of exact minus discrete U_i", VELOCITY),
    Column("dp_plus_correction", r"\delta^h", "estimate of exact minus discrete dp_plus", STRESS),
    Column("mesh_error", r"\epsilon", "|dU - dU on a mesh with cells 2^0.5 times larger|", VELOCITY),
    Column("mesh_error_i", r"\epsilon_i", "|dU_i - dU_i on a mesh with cells 2^0.5 times larger|", VELOCITY),
    Column("wanted", "", "1 at a point that was asked for, 0 at one that was added", "", whole=True),
    Column(
        "m", r"m", "uniform source in the liquid's continuity that the time scheme needs; a measure of its error", RATE
    ),
    Column("volume_error", r"\epsilon_V", "largest relative change of a particle's volume", ""),
    Column(
        "distortion", r"q", "smallest ratio of a liquid cell's current to its reference Jacobian; 0 is turned over", ""
    ),
    Column("c_max", r"\max\,\mathrm{tr}\,c", "largest trace of the conformation", ""),
    Column("c_max_z", "z", "where along the tube that is", LENGTH),
    Column("c_max_r", "r", "how far from the axis that is", LENGTH),
    Column("c_min", r"\min\,c", "smallest eigenvalue of the conformation", ""),
    Column("s_jump", r"[s]", "largest change of s = log c within a cell", ""),
)
"""What columns mean; `_i` stands for the number of a particle or gap. Labels of plots have symbol and unit."""
WHOLE = frozenset({"points", "steps", "unknowns", *(entry.name for entry in COLUMNS if entry.whole)})
"""The columns of all tables, results.csv included, whose numbers are whole."""
HEALTH = ("dt", "newton", "mesh", "m", "volume_error", "distortion")
"""The columns that every series.csv has after those."""
POLYMER_HEALTH = ("c_max", "c_max_z", "c_max_r", "c_min", "s_jump")
"""The columns that follow in a viscoelastic liquid."""
CURVE_HEALTH = ("meshes", "m", "volume_error", "distortion")
"""The columns that every curve.csv ends with, before those of a viscoelastic liquid."""


SWEEP_COLUMNS = (
    Column("folder", "", "folder of the case in that of the sweep", ""),
    Column("status", "", "pending, finished, failed or timeout", ""),
    Column("reason", "", "why the case ended", ""),
    Column("warnings", "", "what run.json of the case warns of, separated by semicolons", ""),
    Column("points", "", "points of the curve or of the lines of critical distances", ""),
    Column("zeros", "", "zeros of dU from the smallest d on, or the critical distances asked for (a list in JSON)", ""),
    Column("stable", "", "whether each of them is stable (a list in JSON)", ""),
    Column("d_peak", "", "distance of the largest |dU| of the curve", LENGTH),
    Column("dU_peak", "", "dU there", VELOCITY),
    Column("dU_error", "", "dU_error there", VELOCITY),
    Column("mesh_error", "", "mesh_error there", VELOCITY),
    Column("steps", "", "accepted time steps", ""),
    Column("unknowns", "", "unknowns of the largest linear system", ""),
    Column("wall_time", "", "seconds, without the start of Python", "s"),
)
"""What columns of results.csv mean that are those of no other table; the rest is in `COLUMNS`."""
STUDY_COLUMNS = (
    Column("status", "", "pending, finished, failed or timeout: of all repetitions, the worst", ""),
    Column("reason", "", "why the case ended", ""),
    Column("unknowns", "", "unknowns of the largest linear system", ""),
    Column("steps", "", "accepted time steps of a run", ""),
    Column("points", "", "points of a curve", ""),
    Column("newton_iterations", "", "Newton iterations in all", ""),
    Column("factorisations", "", "factorisations of Newton's matrix in all", ""),
    Column("remeshings", "", "remeshings of a run", ""),
    Column("meshes", "", "meshes that were made for a curve", ""),
    Column("wall_time", "", "median of all repetitions, without the start of Python", "s"),
    Column("wall_time_spread", "", "largest less smallest of them", "s"),
    Column("wall_*", "", "median time of a phase, such as wall_assembly", "s"),
    Column("peak_memory", "", "largest memory of the first process, Python and its libraries included", "bytes"),
    Column("*@*", "", "the compared column at each entry of `at`, such as dU@0.5", ""),
    Column("d_cr", "", "zero of dU of a curve, the one with the largest peak", LENGTH),
    Column("error", "", "largest difference from the reference or the exact values over `at`", ""),
    Column("relative_error", "", "error over the largest of these values", ""),
    Column("reference", "", "whether this row is the reference", ""),
    Column("order_space", "", "slope of log error over log 1/sqrt(unknowns), from the next coarser mesh", ""),
    Column("order_time", "", "slope of log error over log 1/steps, from the next longer steps", ""),
    Column("richardson_*", "", "limit that three neighbours in space or time extrapolate to, at the last of `at`", ""),
    Column("richardson_order_*", "", "order that these three neighbours show", ""),
    Column("pareto", "", "whether no other row takes less time without a larger error", ""),
)
"""What columns of study.csv mean that are those of no other table; `*` stands for a part that varies."""


def gap_endings(n: int) -> list[str]:
    """What the names of the columns of every gap end with."""
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


def curve_columns(n: int, common: bool, newtonian: bool, mesh_error: bool, sensitivities: Sequence[str]) -> list[str]:
    """The columns that curve.csv begins with.

    Args:
        n: Number of particles.
        common: Whether there is a curve over one distance, which has slopes.
        newtonian: Kind of the liquid; in a viscoelastic one the error of dp_plus is not estimated.
        mesh_error: Whether points were solved on a coarser mesh too.
        sensitivities: Parameters by which dU was differentiated.
    """
    names = ["drift", "dU_correction", "dU_error", *(["mesh_error"] if mesh_error else [])]
    names += [*(["slope"] if common else []), *(f"by_{name}" for name in sensitivities)]
    by_gap = (name + gap for name in names for gap in gap_endings(n))
    corrections = [f"U_correction{each}" for each in particle_endings(n)] + ["dp_plus_correction"] * newtonian
    return [*series_columns(n)[1:], "newton", *by_gap, *corrections, "wanted"]


CRITICAL_COLUMNS = (
    *("Ca_e", "De", "d_cr", "stable", "kind", "branch", "slope", "U", "D_L", "D_T", "dp", "dp_plus"),
    *("newton", "drift", "dU_correction", "dU_error", "d_error", "parameter_error"),
)
"""The columns that critical.csv begins with."""
EQUILIBRIA_COLUMNS = ("d", "stable", "slope", "peak", "d_error", "certain")
"""The columns of equilibria.csv."""


def column(name: str) -> Column:
    """The entry of `COLUMNS` for a column, with the number filled in: `column("D_3").symbol == "D_{3}"`.

    Raises:
        KeyError: No entry of the table has that name.
    """
    table = {entry.name: entry for entry in COLUMNS}
    if name in table and not name.endswith("_i"):
        return table[name]
    match = re.fullmatch(r"(\w+)_(\d+)", name)
    entry = table.get(f"{match[1]}_i") if match else None
    if match is None or entry is None:
        raise KeyError(name)
    return Column(name, entry.symbol.replace("_i", f"_{{{match[2]}}}"), entry.meaning, entry.unit)


def series_columns(n: int) -> list[str]:
    """The columns that series.csv of a scene with `n` particles begins with, in their order."""
    if n < 0:
        raise ValueError(f"number of particles is {n}")
    if n == 2:
        return ["t", "d", "U_L", "U_T", "dU", "D_L", "D_T", "dp", "dp_plus"]
    gaps, particles = range(1, n), range(1, n + 1)
    names = ["t", *(f"d_{i}" for i in gaps), *(f"U_{i}" for i in particles)]
    return [*names, *(f"dU_{i}" for i in gaps), *(f"D_{i}" for i in particles), "dp", "dp_plus"]


def named_row(
    t: float,
    d: Iterable[float],
    U: Iterable[float],
    dU: Iterable[float],
    D: Iterable[float],
    dp: float,
    dp_plus: float,
) -> dict[str, float]:
    """One row of the series under the names of `series_columns`.

    Args:
        t: Time.
        d: The N-1 gaps, from upstream (empty below two particles).
        U: The N velocities, from upstream.
        dU: The N-1 relative velocities over the gaps, from upstream.
        D: The N Taylor parameters, from upstream.
        dp: Pressure drop over the length of the tube.
        dp_plus: The part of it that the particles cause.

    Raises:
        ValueError: The lengths of `d`, `U`, `dU` and `D` do not fit each other.
    """
    gaps, velocities, differences, shapes = ([float(value) for value in values] for values in (d, U, dU, D))
    n = len(velocities)
    if len(shapes) != n or len(gaps) != max(n - 1, 0) or len(differences) != len(gaps):
        raise ValueError(f"{n} velocities, {len(shapes)} Taylor parameters and {len(gaps)} gaps do not fit each other")
    if n == 2:  # trailing = 1 = upstream; the header names the leading one first
        middle = [*gaps, *velocities[::-1], *differences, *shapes[::-1]]
    else:
        middle = [*gaps, *velocities, *differences, *shapes]
    values = (float(value) for value in (t, *middle, dp, dp_plus))
    return dict(zip(series_columns(n), values, strict=True))
