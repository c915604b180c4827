"""The columns that tables of several questions share, and those of the tables of many cases.

A column of one question only is declared in the file of that question. A question lists the columns of each of its
tables (`Question.tables`), in which the names in the header of a file are looked up.
"""

from __future__ import annotations

from typing import Any

from pairsim.quantities.kinds import FORCE, LENGTH, POSITION, PURE, RATE, SECONDS, STRESS, TIME, VELOCITY, Kind
from pairsim.record.column import GAP, PARTICLE, Column, Columns, Shown


def _correction(of: str, name: str, unit: Kind) -> Column:
    """The estimated discretisation error of a quantity."""
    meaning = f"estimated discretisation error, exact minus discrete {name}{{_}}; included in {name}{{_}} unless "
    meaning += "corrected is 0"
    return Column(f"{name}_correction", r"\delta^h{_}", meaning, unit, of, Shown.ON_REQUEST, unknown=True)


def _error(of: str, name: str, unit: Kind, by: str, shown: Shown = Shown.USUALLY) -> Column:
    """The half-width of the interval of a quantity; `by` names the sources of the error."""
    meaning = f"half-width of the interval of {name}{{_}}: error due to {by}"
    return Column(f"{name}_error", r"\epsilon{_}", meaning, unit, of, shown, unknown=True)


def _by(name: str, symbol: str, words: str = "") -> Column:
    """The derivative of dU by a parameter."""
    symbol = rf"\partial\Delta U{{_}}/\partial {symbol}"
    return Column(f"by_{name}", symbol, f"derivative of dU{{_}} with respect to {words or name}", VELOCITY, GAP)


def _observed(name: str, symbol: str, meaning: str, unit: Kind = PURE, shown: Shown = Shown.USUALLY) -> Column:
    """A column named after an attribute of `Observation` or of `Observation.conformation`."""
    return Column(name, symbol, meaning, unit, shown=shown)


_MESH_ENDS_NEWTON = "mesh, ends and Newton's method"
_IN_A_RUN = "; in a run, due to mesh, time steps and start"
_WHILE = "dU{{_}} at {} of the time of a run at held distances; where it differs from dU{{_}}, this has not settled"

T = Column("t", r"t", "time", TIME, shown=Shown.ALWAYS)
DISTANCE = Column(
    "d",
    r"d{_}",
    "distance between the facing surfaces of {of} on the axis",
    LENGTH,
    GAP,
    Shown.ALWAYS,
    half_width="d_error",
)
U = Column(
    "U",
    r"U{_}",
    "velocity of {of}, the volume average of u_z",
    VELOCITY,
    PARTICLE,
    Shown.ALWAYS,
    half_width="U_error",
)
DU = Column(
    "dU",
    r"\Delta U{_}",
    "velocity of the downstream particle of {of} minus that of the upstream one; positive: they separate",
    VELOCITY,
    GAP,
    Shown.ALWAYS,
    half_width="dU_error",
)
DU_HELD = Column(
    "dU_held",
    r"\Delta U_{h{,}}",
    "dU{_} with all distances held, once shapes and stresses are steady",
    VELOCITY,
    GAP,
)
DU_HALF = Column("dU_half", r"\Delta U_{2T{,}}", _WHILE.format("half"), VELOCITY, GAP)
DU_QUARTER = Column("dU_quarter", r"\Delta U_{T{,}}", _WHILE.format("a quarter"), VELOCITY, GAP)
DU_DISCRETE = Column(
    "dU_discrete",
    r"\Delta U^h{_}",
    "dU{_} of the discrete solution, at held distances or in a run, without the estimate of its error",
    VELOCITY,
    GAP,
)
CORRECTED = Column(
    "corrected",
    "",
    "1: velocities, forces and pressure drop include the estimates of their errors; 0: they do not, because the "
    "estimates are small differences of much larger contributions",
    whole=True,
)
STRETCH = Column(
    "stretch",
    r"\mathrm{d}c{_}/\mathrm{d}d",
    "rate at which the centres of volume separate, dU{_}, over that of the facing surfaces, when all distances change "
    "together",
    PURE,
    GAP,
    Shown.ON_REQUEST,
)
FROM_REST = Column(
    "from_rest",
    r"\delta c{_}",
    "bound on how much a start from rest finally changes the distance between the centres",
    LENGTH,
    GAP,
    Shown.ON_REQUEST,
)
T_RELAX = Column("t_relax", r"t_r", "decay time of the slowest disturbance at held distance", TIME, unknown=True)
TAYLOR = Column("D", r"D{_}", "Taylor parameter (L_z - L_r)/(L_z + L_r) of {of}", PURE, PARTICLE, half_width="D_error")
DP = Column("dp", r"\Delta p", "pressure drop over the length of the tube", STRESS)
DP_PLUS = Column(
    "dp_plus",
    r"\Delta p^+",
    "pressure drop in excess of that of the same tube without particles",
    STRESS,
    half_width="dp_plus_error",
)
Z = Column(
    "z",
    r"z{_}",
    "position of the centre of {of} along the tube, measured from where the most upstream one started",
    POSITION,
    PARTICLE,
)
F = Column(
    "F",
    r"F{_}",
    "force along the tube that moves {of} at the prescribed velocity",
    FORCE,
    PARTICLE,
    Shown.ALWAYS,
    half_width="F_error",
)
Q = Column("Q", "Q", "flow rate, as the mean velocity of the liquid in the tube, where it varies", VELOCITY)
DRIFT = Column(
    "drift",
    r"\delta{_}",
    "change of d{_} over the last complete cycle of a varying flow; at held distances, the change that dU{_} would "
    "cause",
    LENGTH,
    GAP,
    unknown=True,
    half_width="drift_error",
)
DT = Column("dt", r"\Delta t", "size of the time step that ends at t", TIME)
NEWTON = Column(
    "newton",
    "n",
    "Newton iterations of the step, or of the continuation from the previous point",
    shown=Shown.ON_REQUEST,
    whole=True,
)
MESH = Column("mesh", r"k", "number of remeshings before the step", shown=Shown.ON_REQUEST, whole=True)
MESHES = Column("meshes", r"k", "number of meshes made so far", shown=Shown.ON_REQUEST, whole=True)
SLOPE = Column(
    "slope",
    r"\mathrm{d}\Delta U{_}/\mathrm{d}d",
    "derivative of dU_held{_} with respect to d when all distances change together; at a zero of dU it is also that of "
    "dU, and the zero is stable if it is negative",
    RATE,
    GAP,
)
BY_CA_E = _by("Ca_e", r"\mathrm{Ca}_e")
BY_DE = _by("De", r"\mathrm{De}")
BY_XI = _by("xi", r"\xi")
BY_BETA = _by("beta", r"\beta")
BY_DIFFERENCE = _by("difference", r"\delta", "the relative difference of the diameters, (leading - trailing)/mean")
BY_STIFFNESS = _by(
    "stiffness",
    "g",
    "the relative difference of the moduli, (leading - trailing)/mean",
)
SENSITIVITIES = {
    each.name.removeprefix("by_"): each for each in (BY_CA_E, BY_DE, BY_XI, BY_BETA, BY_DIFFERENCE, BY_STIFFNESS)
}
"""The derivatives of dU by the name of the number."""
CA_E = Column("Ca_e", r"\mathrm{Ca}_e", "elastic capillary number of the soft particles", shown=Shown.ALWAYS)
DE = Column("De", r"\mathrm{De}", "Deborah number", shown=Shown.ALWAYS)
D_CR = Column("d_cr", r"d_{cr}", "critical distance, at which dU = 0", LENGTH, half_width="d_error")
STABLE = Column("stable", "", "true: the pair returns to this distance after a small displacement")
KIND = Column(
    "kind",
    "",
    "wanted: at a requested value; added: between two; vanishes: fold of two zeros; edge: d leaves its range",
)
BRANCH = Column("branch", "", "number of the branch of critical distances", whole=True)
PEAK = Column("peak", "", "largest |dU| between this zero and the next, over that of the whole curve")
CERTAIN = Column("certain", "", "true: |dU| exceeds its error on both sides of the zero")
D_ERROR = Column(
    "d_error",
    r"\epsilon_d",
    "error of the distance at which dU (for trains, the largest growth rate) is 0: the error of dU, or of this rate, "
    "over its |slope|; empty where two zeros meet",
    LENGTH,
)
FOLLOWED = Column("followed", "", "value of the followed parameter, in the unit of the case file")
PARAMETER_ERROR = Column(
    "parameter_error", r"\epsilon", "error of the followed parameter where two zeros meet; empty elsewhere"
)
DU_CORRECTION = _correction(GAP, "dU", VELOCITY)
DU_ERROR = _error(
    GAP,
    "dU",
    VELOCITY,
    "mesh, ends, Newton's method and motion" + _IN_A_RUN,
    Shown.ALWAYS,
)
DRIFT_ERROR = _error(GAP, "drift", LENGTH, "time steps and, where dU_error is estimated, mesh and start")
ENDS_ERROR = Column(
    "ends_error",
    r"\epsilon_{L{,}}",
    "the part of dU_error{_} that is due to the ends of the tube",
    VELOCITY,
    GAP,
    Shown.ON_REQUEST,
)
REGULARISATION_ERROR = Column(
    "regularisation_error",
    r"\epsilon_{m{,}}",
    "the part of dU_error{_} that is due to the regularisation of a liquid with a yield stress",
    VELOCITY,
    GAP,
    Shown.ON_REQUEST,
)
DU_INPUTS = Column(
    "dU_inputs",
    r"\epsilon_i",
    "half-width of dU due to the half-widths of the inputs, to first order, at constant distance in units of length; "
    "not included in dU_error",
    VELOCITY,
    shown=Shown.ALWAYS,
    unknown=True,
)
DU_SPREAD = Column(
    "dU_spread",
    r"\sigma",
    "standard deviation of dU among pairs of particles that differ, to first order; not included in dU_error",
    VELOCITY,
    shown=Shown.ALWAYS,
)
SEPARATE = Column(
    "separate", "s", "fraction of pairs that separate (dU > 0) where particles differ", shown=Shown.ALWAYS
)
BRIDGE = Column(
    "bridge",
    r"b{_}",
    "radius of the cylinder around the axis in which no liquid yields between the particles; 0: liquid on the axis "
    "yields",
    LENGTH,
    GAP,
)
PLUG = Column("plug", r"r_p", "radius of the plug of unyielded liquid in the flow without particles", LENGTH)
CREEP = Column(
    "creep",
    r"k{_}",
    "exponent of 1/m with which dU_held{_} has decreased since a tenth of m; nan where there is no bridge, or the sign "
    "of dU{_} is certain",
    PURE,
    GAP,
    Shown.ON_REQUEST,
    unknown=True,
)
U_CORRECTION = _correction(PARTICLE, "U", VELOCITY)
U_ERROR = _error(PARTICLE, "U", VELOCITY, _MESH_ENDS_NEWTON + _IN_A_RUN)
TAYLOR_ERROR = _error(PARTICLE, "D", PURE, _MESH_ENDS_NEWTON + _IN_A_RUN)
DP_PLUS_CORRECTION = _correction("", "dp_plus", STRESS)
DP_PLUS_ERROR = _error("", "dp_plus", STRESS, _MESH_ENDS_NEWTON + _IN_A_RUN)
F_CORRECTION = _correction(PARTICLE, "F", FORCE)
F_ERROR = _error(PARTICLE, "F", FORCE, _MESH_ENDS_NEWTON, Shown.ALWAYS)
WANTED = Column(
    "wanted", "", "1 for a requested point, 0 for a point added by refinement", shown=Shown.ON_REQUEST, whole=True
)
M = _observed(
    "m",
    "m",
    "uniform source in the liquid's continuity equation; measures the error of time steps",
    RATE,
    Shown.ON_REQUEST,
)
VOLUME_ERROR = _observed(
    "volume_error", r"\epsilon_V", "largest relative change of a particle's volume", shown=Shown.ON_REQUEST
)
DISTORTION = Column(
    "distortion",
    "q",
    "smallest ratio of the current to the reference Jacobian of a liquid cell; 0: inverted",
    shown=Shown.ON_REQUEST,
)
POLYMER_HEALTH = (
    _observed("c_max", r"\max\,\mathrm{tr}\,c", "largest trace of the conformation tensor"),
    _observed("c_max_z", "z", "axial position of c_max", LENGTH),
    _observed("c_max_r", "r", "radial position of c_max", LENGTH),
    _observed("c_min", r"\min\,c", "smallest eigenvalue of the conformation tensor"),
    _observed("s_jump", r"[s]", "largest change of s = log c within a cell", shown=Shown.ON_REQUEST),
)
"""Diagnostics of a viscoelastic liquid, the last columns of a table."""
OBSERVED = (M, VOLUME_ERROR)
"""Quantities that are attributes of the `Observation` of a solution."""
MOTION = (DISTANCE, U, DU, TAYLOR, DP, DP_PLUS)
"""Columns that tables of runs and curves have for every solution."""
YIELD_HEALTH = (REGULARISATION_ERROR, BRIDGE, CREEP, PLUG)
"""Further diagnostics of quasi-steady solutions in liquids with a yield stress."""
FORCES = (F, F_CORRECTION, F_ERROR)
"""Columns that curve.csv has for every particle if the velocity of the particles is prescribed."""
STEADY_HEALTH = (T_RELAX, MESHES, *OBSERVED, DISTORTION)
"""Diagnostics of quasi-steady solutions, before those of a viscoelastic liquid."""
STEADY = (*STEADY_HEALTH, *POLYMER_HEALTH, *YIELD_HEALTH)
"""All diagnostics of quasi-steady solutions."""
WAY_COLUMNS = Columns(DE, CA_E, DISTANCE, U, DU, TAYLOR)
"""The columns of way.csv: steady states on the way to parameters that were not reached."""
CURVE_COLUMNS = Columns(
    *MOTION,
    *(NEWTON, DU_HELD, DU_DISCRETE, DU_HALF, DU_QUARTER, STRETCH, FROM_REST, DU_CORRECTION, DU_ERROR, ENDS_ERROR),
    *(SLOPE, SENSITIVITIES.values(), U_CORRECTION, U_ERROR, TAYLOR_ERROR, DP_PLUS_CORRECTION, DP_PLUS_ERROR, FORCES),
    *(CORRECTED, WANTED, STEADY_HEALTH, POLYMER_HEALTH, YIELD_HEALTH),
)
"""The columns that curve.csv may have, in their order."""
EQUILIBRIA_COLUMNS = Columns(DISTANCE, STABLE, SLOPE, PEAK, D_ERROR, CERTAIN)
"""The columns of equilibria.csv."""
STATE_COLUMNS = (T, *MOTION, Z)
"""The columns that series.csv begins with."""
CYCLE_COLUMNS = (DRIFT, DRIFT_ERROR)
"""Columns about the cycles of a flow that varies; they follow the column of the flow if there are two particles."""
ESTIMATE_COLUMNS = (DU_DISCRETE, DU_CORRECTION)
"""dU without its error estimate, and that estimate; they come next in runs that transport their error."""
ERROR_COLUMNS = (DU_ERROR, U_ERROR, TAYLOR_ERROR, DP_PLUS_ERROR)
"""The half-widths of a run, which come next if they are known."""
RUN_HEALTH = (DT, NEWTON, MESH, *OBSERVED, DISTORTION)
"""Diagnostics of a run, before those of a viscoelastic liquid."""
SERIES_COLUMNS = Columns(
    *(STATE_COLUMNS, Q, CYCLE_COLUMNS, ESTIMATE_COLUMNS, ERROR_COLUMNS, BRIDGE, RUN_HEALTH, POLYMER_HEALTH)
)
"""The columns that series.csv may have, in their order."""

SHARED = Columns([each for each in vars().values() if isinstance(each, Column)], POLYMER_HEALTH)
"""All columns declared above."""


def observed(observation: Any) -> dict[Column, Any]:
    """The values of the columns in `OBSERVED`, and in `POLYMER_HEALTH` if there is a polymer, of an `Observation`."""
    values = {each: getattr(observation, each.name) for each in OBSERVED}
    polymer = POLYMER_HEALTH if observation.conformation is not None else ()
    return values | {each: getattr(observation.conformation, each.name) for each in polymer}


def of_cases(
    name: str, meaning: str, unit: Kind = PURE, of: str = "", *, whole: bool = False, half_width: str = ""
) -> Column:
    """A column of the tables of many cases."""
    return Column(name, "", meaning, unit, of, Shown.ALWAYS, whole=whole, half_width=half_width)


STEPS = of_cases("steps", "accepted time steps of a run", whole=True)
UNKNOWNS = of_cases("unknowns", "unknowns of the largest linear system", whole=True)
WALL_TIME = of_cases("wall_time", "wall time, without the start of Python", SECONDS)
COST = (UNKNOWNS, WALL_TIME)
"""The last columns of results.csv. Like `STEPS` they are entries of run.json."""
HOW_IT_STANDS = of_cases("status", "pending, finished or failed")
WHY = of_cases("reason", "why the case ended, such as end, contact or newton_diverged")
POINT_COUNT = of_cases("points", "points of the curve, or of the lines of critical distances", whole=True)
OF_CASES = (HOW_IT_STANDS, WHY, POINT_COUNT, STEPS, *COST)
"""The columns that all tables of many cases may have."""
ZEROS = of_cases(
    "zeros",
    "zeros of dU in order of increasing d, or the requested critical distances; separated by spaces",
    LENGTH,
    half_width="zeros_error",
)
ZEROS_ERROR = of_cases("zeros_error", "error of each zero (half-width), separated by spaces", LENGTH)
SWEEP_COLUMNS = Columns(
    of_cases("folder", "folder of the case, in that of the sweep"),
    OF_CASES,
    of_cases("warnings", "warnings in run.json of the case, separated by semicolons"),
    ZEROS,
    of_cases("stable", "whether each zero is stable: true or false"),
    ZEROS_ERROR,
    of_cases(
        "d_peak",
        "distance of the largest |dU| of the curve, which may lie between two points",
        LENGTH,
        GAP,
        half_width="d_peak_error",
    ),
    of_cases("d_peak_error", "error of d_peak (half-width)", LENGTH, GAP),
    of_cases("dU_peak", "largest |dU| of the curve, with its sign", VELOCITY, GAP, half_width="dU_error"),
    of_cases("dU_error", "error of dU_peak, or of dU of a run (half-width)", VELOCITY, GAP),
    DU_INPUTS,
    DU_SPREAD,
    SEPARATE,
)
"""The columns of results.csv other than those of the main table of its question."""
