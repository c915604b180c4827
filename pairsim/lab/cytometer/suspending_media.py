"""Carriers of deformability cytometry, and the flow of a power-law liquid in a square channel."""

from __future__ import annotations

import re

import numpy as np

from pairsim.runtime.errors import Argument, InputError

# Methyl cellulose in phosphate-buffered saline, by per cent of the mass, above 5e3 1/s: eta = K gamma^(n - 1) with
# K = A exp(lambda/T), n = alpha T + beta (Buyukurganci et al., Soft Matter 19, 1739, 2023; A at 0.49 % is that of
# Reichel et al. 2023; as dclab documents them).
ACTIVATION, SLOPE = 3379.7, 0.00223  # lambda [K], alpha [1/K]
METHYL_CELLULOSE = {0.49: (2.30e-6, -0.0056), 0.59: (5.70e-6, -0.0744), 0.83: (16.52e-6, -0.1455)}
"""A [Pa s^n] and beta by concentration."""
MEASURED = 22.0, 37.0  # [degC]
MEASURED_RATES = 5e3, 1.5e5  # [1/s]
LIQUID = 0.0, 100.0  # [degC], between which water is a liquid
NAMES = {0.49: "0.49% MC-PBS", 0.59: "0.59% MC-PBS", 0.83: "0.83% MC-PBS"}
"""Names of the carriers by concentration."""
SAME = {"cellcarrier": 0.49, "cellcarrierb": 0.59, "0.5": 0.49, "0.50": 0.49, "0.6": 0.59, "0.60": 0.59}
SAME |= {"0.8": 0.83, "0.80": 0.83, **{str(percent): percent for percent in NAMES}}
"""Concentrations by other names that are in use, those of dclab."""
# The mean stress at the walls of a tube of hydraulic diameter D is that at the shear rate 8 U/D (b + a/n), with (a, b)
# of a square and of a circle (Kozicki, Chou and Tiu, Chem. Eng. Sci. 21, 665, 1966).
SQUARE, CIRCLE = (0.2121, 0.6771), (0.25, 0.75)


def concentration(name: str) -> float:
    """Concentration [% of the mass] of a carrier by one of its names, such as "0.5% MC-PBS" or CellCarrier B.

    Raises:
        InputError: There is no such carrier.
    """
    plain = re.sub(r"%?(mc(pbs)?)?$", "", re.sub(r"[\s_-]", "", name.lower()))
    if plain not in SAME:
        allowed = "must be 0.49% MC-PBS (CellCarrier), 0.59% MC-PBS (CellCarrier B) or 0.83% MC-PBS"
        raise InputError("pairsim", Argument("carrier"), name, allowed)
    return SAME[plain]


def methyl_cellulose(name: str, celsius: float) -> tuple[float, float]:
    """Consistency K [Pa s^n] and flow index n of a carrier, such as "0.59% MC-PBS", at a temperature [degC].

    Raises:
        InputError: There is no such carrier, or it is no liquid at this temperature.
    """
    A, beta = METHYL_CELLULOSE[concentration(name)]
    if not LIQUID[0] < celsius < LIQUID[1]:
        allowed = "must be above {:g} and below {:g}, in degrees Celsius".format(*LIQUID)
        raise InputError("pairsim", Argument("celsius"), celsius, allowed)
    T = celsius + 273.15
    return A * float(np.exp(ACTIVATION / T)), SLOPE * T + beta


def extrapolated(celsius: float, rate: float) -> list[str]:
    """Warnings where the law of a carrier is extrapolated to this temperature [degC] or shear rate at walls [1/s]."""
    known = "the viscosity of the carrier was measured from"
    (cold, hot), (slow, fast) = MEASURED, MEASURED_RATES
    said = (
        [] if cold <= celsius <= hot else [f"{known} {cold:g} to {hot:g} degC: it is extrapolated to {celsius:g} degC"]
    )
    if not slow <= rate <= fast:
        said.append(f"{known} {slow:,.0f} to {fast:,.0f} 1/s: it is extrapolated to {rate:,.3g} 1/s at the walls")
    return said


def wall_rate(flow_rate: float, width: float, n: float) -> float:
    """Shear rate [1/s] at which a power-law liquid has its mean stress at the walls of a square channel.

    Args:
        flow_rate: Flow rate [m^3/s].
        width: Width of the channel [m].
        n: Flow index.
    """
    return 8 * flow_rate / width**3 * (SQUARE[1] + SQUARE[0] / n)


def gradient_in_square(n: float, ratio: float) -> float:
    """Pressure gradient in a square channel over that in a tube `ratio` times as wide, at the same flow rate."""
    of_square, of_circle = (b + a / n for a, b in (SQUARE, CIRCLE))
    return ratio * float(ratio**3 * np.pi / 4 * of_square / of_circle) ** n
