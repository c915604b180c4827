"""Whether particles stay on the axis: growth rates of small displacements, with an interval, and a verdict."""

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

EXACTLY = 1e-8  # growth rates and frequencies below are the rounding of zero [U_av/D_c]; up to 3e-13 were found
SLOPE = 1e-3  # part of a Reynolds number that growth rates are compared over for their slope; chosen
DRAWS = 400  # matrices within the half-widths, from which the half-width of the largest growth rate is taken; chosen
SEED = 0  # of these draws, so that results are reproducible


class Verdict(StrEnum):
    """What becomes of small displacements from the axis."""

    FOCUSES = "focuses"
    LEAVES = "leaves"
    SWINGS = "swings"
    STAYS = "stays"
    UNDECIDED = "undecided"


@dataclass(frozen=True)
class Stability:
    """Small displacements of the N particles of a scene from the axis, and what becomes of them.

    Attributes:
        disturbance: What unit displacements do.
        scene: The disturbed scene.
        half_widths: Half-widths of its rates, shape (N, N).
        growth: Growth rates of the N modes, complex, the largest first, shape (N,) [U_av/D_c].
        growth_error: Half-width of the largest one, infinite where it is not known.
        Re_most: The Reynolds number up to which displacements decay, to first order in it: 0 where they do not decay
            without inertia, infinite where inertia does not prevent it, nan where the verdict is undecided.
        Re_error: Its half-width, infinite where it is not known, and nan where `Re_most` is no number above 0.
    """

    disturbance: Disturbance
    scene: DisturbedScene
    half_widths: Array
    growth: Array
    growth_error: float
    Re_most: float
    Re_error: float

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
                # Particles move on before stresses are forgotten: the rates say nothing of how displacements grow.
                modes = slowest_modes(displacement.scene, len(found.rates))
                return cls(found, displacement.scene, widths.rates, modes.rates, np.inf, np.nan, np.nan)
        error = growth_half_width(found.rates, widths.rates)
        match verdict_of(found.growth, error):
            case Verdict.FOCUSES if by_Re is not None and widths.by_Re is not None:
                Re_most, Re_error = with_half_width(found.rates, by_Re, widths.rates, widths.by_Re)
            case Verdict.UNDECIDED:
                Re_most, Re_error = np.nan, np.nan
            case _:
                Re_most, Re_error = 0.0, np.nan
        return cls(found, displacement.scene, widths.rates, found.growth, error, Re_most, Re_error)

    @property
    def verdict(self) -> Verdict:
        """What becomes of small displacements."""
        return verdict_of(self.growth, self.growth_error)


def growth_half_width(rates: Array, half_widths: Array) -> float:
    """Half-width of the largest growth rate, from matrices whose entries are at the ends of their intervals.

    Near a double eigenvalue the rate is no smooth function of the entries, and its derivatives would not do.

    Args:
        rates: The rates, shape (N, N).
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

    The half-width is that of the growth rate there over its slope.

    Args:
        rates: Rates without inertia, shape (N, N).
        by_Re: Their derivatives by the Reynolds number.
        error: Half-widths of the rates.
        error_by_Re: Those of the derivatives.
    """
    Re = stable_up_to(rates, by_Re)
    if Re == 0 or not np.isfinite(Re):
        return Re, np.nan
    at, step = rates + Re * by_Re, SLOPE * Re
    growth = [np.linalg.eigvals(at + change * by_Re).real.max() for change in (-step, step)]
    slope = (growth[1] - growth[0]) / (2 * step)
    return Re, growth_half_width(at, error + Re * error_by_Re) / slope


def verdict_of(growth: Array, half_width: float) -> Verdict:
    """The verdict on modes with growth rates, complex, the largest first, shape (N,), and the half-width of the first.

    Modes swing if none of them grows or decays by more than the half-width, and one oscillates faster than that.
    """
    if np.abs(growth).max() < EXACTLY:
        return Verdict.STAYS
    largest = growth[0].real
    if abs(largest) > half_width:
        return Verdict.LEAVES if largest > 0 else Verdict.FOCUSES
    if np.abs(growth.real).max() <= half_width < np.abs(growth.imag).max():
        return Verdict.SWINGS
    return Verdict.UNDECIDED
