"""The mean velocity that a pressure drop drives through a tube."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from pairsim.cases.case import SceneCase
from pairsim.cases.quantity_text import A_LENGTH, measured
from pairsim.quantities import kinds
from pairsim.quantities.measurable import Measurable
from pairsim.runtime.errors import Argument, InputError, NoSteadyState

PRESSURE = Measurable("pressure", kinds.PRESSURE, "pressure drop", "20 kPa")
SLOWEST, FASTEST, COUNT = 1e-7, 10.0, 33  # range [m/s] and number of the mean velocities that are searched; chosen
STEP = 0.01  # of the logarithm of the velocity, to either side, for the slope that half-widths are divided by; chosen


def velocity_for(pressure: str, over: str, case_at: Callable[[str], SceneCase]) -> str:
    """The mean velocity that a pressure drop gives in a tube without particles.

    Args:
        pressure: The pressure drop with its unit; may have a half-width.
        over: The length of tube over which the pressure falls, with its unit; may have a half-width.
        case_at: Makes the case of a mean velocity, which is given with its unit.

    Returns:
        The mean velocity in mm/s; with the half-width that follows to first order from those given, if any.

    Raises:
        InputError: `pressure` or `over` is not a quantity of its kind; no velocity, or more than one, has this
            pressure drop.
    """
    from scipy.optimize import brentq  # takes longer to load than an atlas to answer

    from pairsim.physics.pipe import Pipe

    drop, drop_half_width = _measured("pressure", pressure, PRESSURE)
    length, length_half_width = _measured("over", over, A_LENGTH)
    wanted = drop / length

    def excess(log_velocity: float) -> float:
        """Logarithm of the pressure gradient over the one wanted; nan without a valid case or a steady flow."""
        try:
            case = case_at(f"{math.exp(log_velocity):.17g} m/s")
            scales = case.scales
            assert scales is not None
            return math.log(Pipe(case.liquid_model).steady().gradient * scales.stress / scales.length / wanted)
        except (InputError, NoSteadyState):
            return math.nan

    places = np.linspace(math.log(SLOWEST), math.log(FASTEST), COUNT)
    off = np.array([excess(place) for place in places])
    if np.isnan(off).all():
        case_at(f"{math.exp(places[COUNT // 2]):.17g} m/s")  # raises an error of the case itself
    found = [i for i in range(COUNT - 1) if off[i] * off[i + 1] <= 0]
    if len(found) != 1:
        fitting = ", ".join(f"{math.exp(places[i]):.2g} m/s" for i in found)
        several = f"drives several mean velocities, near {fitting}: give `flow_rate` or `velocity`"
        allowed = several if found else f"drives no mean velocity from {SLOWEST:g} to {FASTEST:g} m/s"
        raise InputError("pairsim units", Argument("pressure"), pressure, allowed)
    (i,) = found
    at = brentq(excess, places[i], places[i + 1], xtol=1e-12)
    velocity, relative = math.exp(at), math.hypot(drop_half_width / drop, length_half_width / length)
    if not relative:
        return f"{1e3 * velocity:.10g} mm/s"
    low, high = max(at - STEP, places[i]), min(at + STEP, places[i + 1])
    slope = (excess(high) - excess(low)) / (high - low)
    return f"{1e3 * velocity:.10g} +- {1e3 * velocity * relative / slope:.3g} mm/s"


def _measured(name: str, text: str, of: Measurable) -> tuple[float, float]:
    """The value and the half-width of an argument in its SI unit; InputError if it is not a quantity of this kind."""
    try:
        return measured(text, of)
    except ValueError as error:
        raise InputError("pairsim units", Argument(name), text, str(error)) from None
