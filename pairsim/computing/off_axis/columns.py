"""Columns of tables of rates off the axis, of `pairsim focus` and of other questions with the key `focus`."""

from __future__ import annotations

from pairsim.quantities.kinds import POSITION, RATE
from pairsim.record.column import ENTRY, MODE, Column, Columns, Shown
from pairsim.record.columns import CA_E, DE, DISTANCE, FOLLOWED, NEWTON, POLYMER_HEALTH, STEADY_HEALTH, U_ERROR, U

NAME = "focus"
"""The name of these tables."""

VERDICT = Column(
    "verdict",
    "",
    "focuses: small displacements from the axis decay; leaves: some grow; oscillates: they neither decay nor "
    "grow, but oscillate; neutral: they do not change at all; undecided: not certain",
)
GROWTH = Column(
    "growth",
    r"\mathrm{Re}\,\lambda",
    "largest growth rate of displacements; negative: they decay",
    RATE,
    half_width="growth_error",
)
GROWTH_ERROR = Column(
    "growth_error",
    r"\epsilon",
    "half-width of the interval of growth: error due to the mesh; empty where it is not known",
    RATE,
    unknown=True,
)
TUBE = Column(
    "tube",
    "L",
    "length of tube within which a small displacement falls to a tenth (leaves: grows tenfold), ln(10) U/|growth|; "
    "empty unless it certainly decays or certainly grows",
    POSITION,
    unknown=True,
)
TUBE_LEAST = Column(
    "tube_least",
    r"L_\mathrm{min}",
    "smallest such length within the interval of growth, ln(10) U/(|growth| + growth_error)",
    POSITION,
    unknown=True,
)
TUBE_MOST = Column(
    "tube_most",
    r"L_\mathrm{max}",
    "largest such length within the interval of growth, ln(10) U/(|growth| - growth_error)",
    POSITION,
    unknown=True,
)
RE_C = Column(
    "Re_c",
    r"\mathrm{Re}_c",
    "Reynolds number rho U_av D_c/eta_0 up to which displacements decay, to first order in it; 0: they do not decay "
    "without inertia; empty: inertia does not prevent it, or it is not known",
    unknown=True,
    half_width="Re_c_error",
)
RE_C_ERROR = Column("Re_c_error", r"\epsilon", "half-width of its interval: error due to the mesh", unknown=True)
RE = Column("Re", r"\mathrm{Re}", "Reynolds number of the experiment, with physical.density")
A = Column("a", r"a{_}", "velocity away from the axis of {of}", RATE, ENTRY, half_width="a_error")
A_ERROR = Column(
    "a_error", r"\epsilon{_}", "half-width of the interval of a{_}: error due to the mesh", RATE, ENTRY, unknown=True
)
AT_REST = Column(
    "at_rest",
    r"a^0{_}",
    "a{_} with stresses and shapes steady, as at constant displacements",
    RATE,
    ENTRY,
    Shown.ON_REQUEST,
)
MODE_GROWTH = Column("rate", r"\mathrm{Re}\,\lambda{_}", "growth rate of {of}", RATE, MODE)
FREQUENCY = Column("frequency", r"\mathrm{Im}\,\lambda{_}", "angular frequency of {of}", RATE, MODE)
UNKNOWNS = Column("disturbed", "n", "unknowns of the disturbances", shown=Shown.ON_REQUEST, whole=True)
INTERVALS = VERDICT, GROWTH, GROWTH_ERROR, TUBE, TUBE_LEAST, TUBE_MOST, RE_C, RE_C_ERROR
MATRIX = A, A_ERROR, AT_REST, MODE_GROWTH, FREQUENCY
TABLE = Columns(
    *(DISTANCE, CA_E, DE, FOLLOWED, U, U_ERROR, *INTERVALS, RE, *MATRIX),
    *(NEWTON, UNKNOWNS, *STEADY_HEALTH, *POLYMER_HEALTH),
)
"""The columns that focus.csv may have, in their order."""
