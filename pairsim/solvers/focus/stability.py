"""Whether particles stay on the axis: growth rates of small displacements, with half-widths, and a verdict."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from pairsim.fem.azimuthal.scene import DisturbedScene
from pairsim.runtime.arrays import Array
from pairsim.solvers.focus.errors import half_widths
from pairsim.solvers.focus.inertia import by_inertia, stable_up_to
from pairsim.solvers.focus.modes import slowest_modes
from pairsim.solvers.focus.rates import Displacement, Disturbance
from pairsim.solvers.steady.scene import SteadySolver

EXACTLY = 1e-8  # growth rates and frequencies up to this are rounding errors of 0 [U_av/D_c]; up to 3e-13 were found
SLOPE = 1e-3  # relative change of the Reynolds number in differences of growth rates; chosen
DRAWS = 400  # random matrices within the half-widths, whose largest growth rates give its half-width; chosen
SEED = 0  # of these random matrices, so that results are reproducible


class Verdict(StrEnum):
    """The fate of small displacements from the axis."""

    FOCUSES = "focuses"
    LEAVES = "leaves"
    OSCILLATES = "oscillates"
    NEUTRAL = "neutral"
    UNDECIDED = "undecided"


@dataclass(frozen=True)
class Stability:
    """Small displacements of the N particles of a scene from the axis, and their fate.

    Attributes:
        disturbance: The response to unit displacements.
        scene: The disturbed scene.
        half_widths: Half-widths of the rates of the disturbance [U_av/D_c], shape (N, N).
        growth: Growth rates of the N modes, complex, the largest first, shape (N,) [U_av/D_c].
        growth_error: Half-width of the largest one; infinite if it is not known.
        Re_c: The Reynolds number up to which displacements decay, to first order in it: 0 if they do not decay
            without inertia, infinite if inertia does not prevent the decay, NaN if the verdict is undecided.
        Re_c_error: Half-width of `Re_c`; infinite if it is not known, NaN unless `Re_c` is positive and finite.
    """

    disturbance: Disturbance
    scene: DisturbedScene
    half_widths: Array
    growth: Array
    growth_error: float
    Re_c: float
    Re_c_error: float

    @classmethod
    def of(cls, steady: SteadySolver) -> Stability:
        """The stability of a scene at its solution, in a tube with two ends.

        Raises:
            NoSteadyState: A matrix is singular.
        """
        with Displacement(steady) as displacement:
            found = displacement.found
            decays = found.converged and found.growth[0].real < -EXACTLY
            by_Re = by_inertia(displacement).rates if decays else None
            widths = half_widths(displacement, by_Re)
            if not found.converged:
                # The particles move faster than stresses relax: the growth of displacements does not follow from rates.
                modes = slowest_modes(displacement.scene, len(found.rates))
                return cls(found, displacement.scene, widths.rates, modes.rates, np.inf, np.nan, np.nan)
        error = growth_half_width(found.rates, widths.rates)
        match verdict_of(found.growth, error):
            case Verdict.FOCUSES if by_Re is not None and widths.by_Re is not None:
                Re_c, Re_c_error = with_half_width(found.rates, by_Re, widths.rates, widths.by_Re)
            case Verdict.UNDECIDED:
                Re_c, Re_c_error = np.nan, np.nan
            case _:
                Re_c, Re_c_error = 0.0, np.nan
        return cls(found, displacement.scene, widths.rates, found.growth, error, Re_c, Re_c_error)

    @property
    def verdict(self) -> Verdict:
        """The fate of small displacements."""
        return verdict_of(self.growth, self.growth_error)


def growth_half_width(rates: Array, half_widths: Array) -> float:
    """Half-width of the largest growth rate, from random matrices with entries at the ends of their intervals.

    Near a double eigenvalue the growth rate is not a smooth function of the entries, and derivatives would not suffice.

    Args:
        rates: The rates [U_av/D_c], shape (N, N).
        half_widths: Their half-widths, of the same shape.
    """
    if not np.isfinite(half_widths).all():
        return np.inf
    if len(rates) == 1:
        return float(half_widths[0, 0])
    signs = np.random.default_rng(SEED).choice([-1.0, 1.0], (DRAWS, *rates.shape))
    drawn = np.linalg.eigvals(rates + signs * half_widths).real.max(axis=1)
    return float(np.abs(drawn - np.linalg.eigvals(rates).real.max()).max())


def with_half_width(rates: Array, by_Re: Array, error: Array, error_by_Re: Array) -> tuple[float, float]:
    """The Reynolds number up to which displacements decay, and its half-width.

    The half-width is that of the growth rate there, divided by the slope of the growth rate.

    Args:
        rates: Rates without inertia [U_av/D_c], shape (N, N).
        by_Re: Their derivatives with respect to the Reynolds number, shape (N, N).
        error: Half-widths of the rates, shape (N, N).
        error_by_Re: Half-widths of the derivatives, shape (N, N).
    """
    Re = stable_up_to(rates, by_Re)
    if Re == 0 or not np.isfinite(Re):
        return Re, np.nan
    at, step = rates + Re * by_Re, SLOPE * Re
    growth = [np.linalg.eigvals(at + change * by_Re).real.max() for change in (-step, step)]
    slope = (growth[1] - growth[0]) / (2 * step)
    return Re, growth_half_width(at, error + Re * error_by_Re) / slope


def verdict_of(growth: Array, half_width: float) -> Verdict:
    """The verdict on modes.

    Modes oscillate if none of them grows or decays faster than the half-width, and one has a frequency above it.

    Args:
        growth: Growth rates, complex, the largest first [U_av/D_c], shape (N,).
        half_width: Half-width of the first one [U_av/D_c].
    """
    if np.abs(growth).max() < EXACTLY:
        return Verdict.NEUTRAL
    largest = growth[0].real
    if abs(largest) > half_width:
        return Verdict.LEAVES if largest > 0 else Verdict.FOCUSES
    if np.abs(growth.real).max() <= half_width < np.abs(growth.imag).max():
        return Verdict.OSCILLATES
    return Verdict.UNDECIDED
