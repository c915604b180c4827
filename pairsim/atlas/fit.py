"""Make an atlas of master curves: a regression on values and gradients, with half-widths from curves left out.

Of each curve there are, at fixed distances, dU on the slow manifold with its half-width, and derivatives of the
discrete dU with the distance held by beta, De and Ca_e (their adjoints are exact). What motion and the estimate of the
error add to dU is small and smooth; its derivatives are those of a regression on its values, without gradients.

The coefficients of a polynomial (`pairsim.atlas.basis`) have independent normal distributions before data are seen,
whose deviations fall geometrically with the degree. That is a Gaussian process of finite rank (Rasmussen and Williams
2006, section 2.1), here with derivatives as further data (Solak et al. 2003). How fast they fall, and how exact
derivatives are, is chosen by curves left out, one after the other.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy.optimize

from pairsim.atlas.atlas import Atlas, Quantity
from pairsim.atlas.basis import PARAMETERS, Basis, distance_terms, nodes
from pairsim.runtime.arrays import Array

DEGREE = 9  # largest total degree in the parameters; the decay of the deviations makes it matter little
COLUMNS = 28  # Chebyshev polynomials of the distance: more than curves have points
VALUE_ERROR = 3e-3  # standard error of the values of a curve, relative to its peak; chosen
COVERED = 0.95  # part of all places that intervals hold
NEIGHBOURS = 2  # distances on either side whose errors count for the half-width at one
FIRST = (0.4, 0.4, 0.3, 0.02)  # first guess of the decays and of the error of derivatives


@dataclass(frozen=True)
class Samples:
    """A quantity of curves at fixed distances.

    Attributes:
        places: beta, De and Ca_e of the curves, shape (curves, 3).
        values: Values, shape (curves, distances).
        gradients: Derivatives by beta, De and Ca_e, not a number where unknown, (3, curves, distances); None without.
        errors: Half-widths of the values, shape (curves, distances).
    """

    places: Array
    values: Array
    gradients: Array | None
    errors: Array

    def only(self, chosen: Any) -> Samples:
        """A selection of the curves."""
        gradients = None if self.gradients is None else self.gradients[:, chosen]
        return Samples(self.places[chosen], self.values[chosen], gradients, self.errors[chosen])


@dataclass(frozen=True)
class Regression:
    """How a quantity is fitted.

    Attributes:
        basis: The terms.
        power: The quantity is divided by this power of beta.
        vanishing: Whether it is zero at De = Ca_e = 0.
        decays: Ratio of the deviations of successive degrees in each parameter.
        gradient_error: Standard error of the derivatives by a parameter that ranges over -1 to 1, relative to the peak.
    """

    basis: Basis
    power: float
    vanishing: bool
    decays: tuple[float, ...] = FIRST[:3]
    gradient_error: float = FIRST[3]

    def solve(self, samples: Samples) -> tuple[Array, Array]:
        """Coefficients (terms, distances), and their covariance up to a factor (terms, terms)."""
        beta = samples.places[:, 0]
        sizes = np.abs(samples.values).max(axis=1) / beta**self.power
        typical = float(np.median(sizes)) or 1.0  # 1.0: what is zero everywhere
        weights = 1 / (VALUE_ERROR * np.maximum(sizes, 1e-2 * typical))
        values = samples.values / beta[:, None] ** self.power
        rows = [self.basis.terms(samples.places, self.vanishing) * weights[:, None]]
        right = [values * weights[:, None]]
        for i, name in enumerate(PARAMETERS if samples.gradients is not None else ()):
            assert samples.gradients is not None
            gradient = samples.gradients[i] / beta[:, None] ** self.power
            if name == "beta":
                gradient = gradient - self.power / beta[:, None] * values
            known = np.isfinite(gradient).all(axis=1)
            low, high = self.basis.box[name]
            weight = (weights * VALUE_ERROR / self.gradient_error * (high - low) / 2)[known, None]
            rows.append(self.basis.terms(samples.places[known], self.vanishing, i) * weight)
            right.append(gradient[known] * weight)
        matrix = np.concatenate(rows)
        deviations = typical * np.prod(np.power(self.decays, self.basis.degrees), axis=1)
        if self.vanishing:
            deviations[self.basis.degrees[:, 1:].sum(axis=1) == 0] = 1e-6 * typical  # terms that are zero
        covariance = np.linalg.inv(matrix.T @ matrix + np.diag(deviations**-2.0))
        return covariance @ (matrix.T @ np.concatenate(right)), covariance

    def predict(self, places: Array, coefficients: Array, covariance: Array) -> tuple[Array, Array]:
        """Values (places, distances) and the root of their variance (places,), up to a factor."""
        terms, scale = self.basis.terms(places, self.vanishing), places[:, 0] ** self.power
        spread = np.sqrt(np.maximum(((terms @ covariance) * terms).sum(axis=1), 0.0))
        return scale[:, None] * (terms @ coefficients), scale * spread

    def left_out(self, samples: Samples) -> tuple[Array, Array]:
        """What the others say of each curve: values (curves, distances) and root of the variance (curves,)."""
        values, spreads = np.empty_like(samples.values), np.empty(len(samples.places))
        for i in range(len(samples.places)):
            others = np.arange(len(samples.places)) != i
            found = self.solve(samples.only(others))
            (values[i],), (spreads[i],) = self.predict(samples.places[i : i + 1], *found)
        return values, spreads

    def chosen(self, samples: Samples) -> Regression:
        """The same with the decays, and the error of derivatives, that predict curves left out best."""

        def made(logs: Array) -> Regression:
            *decays, error = np.exp(logs)
            return replace(self, decays=tuple(map(float, decays)), gradient_error=float(error))

        sizes = np.abs(samples.values).max(axis=1, keepdims=True)

        def error(logs: Array) -> float:
            if (logs[:3] > 0).any():
                return float("inf")
            values, _ = made(logs).left_out(samples)
            return float(np.mean(np.log(np.mean(((values - samples.values) / sizes) ** 2, axis=1) + 1e-8)))

        start = np.log([*self.decays, self.gradient_error])
        found = scipy.optimize.minimize(error, start, method="Nelder-Mead", options={"maxfev": 80, "xatol": 0.05})
        return made(found.x)


def terms_of(box: Mapping[str, tuple[float, float]], degree: int = DEGREE) -> Basis:
    """All terms up to a total degree."""
    each = np.arange(degree + 1)
    degrees = np.stack(np.meshgrid(each, each, each, indexing="ij"), axis=-1).reshape(-1, 3)
    return Basis({name: box[name] for name in PARAMETERS}, degrees[degrees.sum(axis=1) <= degree])


def quantity_of(samples: Samples, regression: Regression, offset: float | None, ends: tuple[float, float]) -> Quantity:
    """A fitted quantity with its half-widths, which hold `COVERED` of the errors at each distance of curves left out.

    Args:
        samples: The curves.
        regression: How they are fitted.
        offset: See `Quantity`; already subtracted from the samples.
        ends: Least and largest distance.
    """
    count = samples.values.shape[1]
    coefficients, covariance = regression.solve(samples)
    values, spreads = regression.left_out(samples)
    ratios = np.abs(values - samples.values) / spreads[:, None]
    rank = min(COVERED * (len(ratios) + 1) / len(ratios), 1.0)
    by_distance = np.quantile(ratios, rank, axis=0, method="higher")
    padded = np.pad(by_distance, NEIGHBOURS, mode="edge")
    widths = np.lib.stride_tricks.sliding_window_view(padded, 2 * NEIGHBOURS + 1).max(axis=1)
    own = np.quantile(samples.errors / np.abs(samples.values).max(axis=1, keepdims=True), COVERED, axis=0)
    across = np.linalg.inv(distance_terms(nodes(ends, count), ends, count)).T
    return Quantity(coefficients @ across, regression.power, offset, covariance, widths, own)


def fit(
    samples: Mapping[str, Samples],
    rest: Array,
    box: Mapping[str, tuple[float, float]],
    provenance: Mapping[str, Any],
    regression: Regression | None = None,
) -> tuple[Atlas, Regression]:
    """Make an atlas of curves at the distances of `nodes`.

    Args:
        samples: dU, t_relax, stretch and U of the curves; the gradients of dU are those at held distances.
        rest: What motion and estimates add to the discrete dU at held distances, (curves, distances).
        box: The box of the atlas.
        provenance: What is known of the curves.
        regression: That of dU; chosen here if None.

    Returns:
        The atlas, and the regression of dU.
    """
    basis = terms_of(box)
    dU = samples["dU"]
    assert dU.gradients is not None
    values_only = Regression(basis, POWER, True)
    of_rest = values_only.solve(replace(dU, values=rest, gradients=None))[0]
    moved = np.array([_derivative(values_only, dU.places, of_rest, i) for i in range(3)])
    dU = replace(dU, gradients=dU.gradients + moved)
    regression = regression or Regression(basis, POWER, True).chosen(dU)
    quantities = {"dU": quantity_of(dU, regression, 0.0, box["d"])}
    for name, offset in OFFSETS.items():
        shifted = replace(samples[name], values=samples[name].values - (offset or 0.0))
        quantities[name] = quantity_of(shifted, Regression(basis, 0.0, offset is not None), offset, box["d"])
    count = dU.values.shape[1]
    return Atlas(box, basis, quantities, nodes(box["d"], count), provenance), regression


POWER = 4.0  # of beta, by which dU is divided: of the order of what dU grows with
OFFSETS: Mapping[str, float | None] = {"t_relax": 0.0, "stretch": 1.0, "U": None}
"""Other quantities, and their values at De = Ca_e = 0 where these do not depend on beta and d."""


def _derivative(regression: Regression, places: Array, coefficients: Array, along: int) -> Array:
    """Derivative of fitted values by a parameter, shape (places, distances)."""
    beta, power = places[:, :1], regression.power
    found = beta**power * (regression.basis.terms(places, regression.vanishing, along) @ coefficients)
    if along == 0:
        found = found + power * beta ** (power - 1) * (
            regression.basis.terms(places, regression.vanishing) @ coefficients
        )
    return np.asarray(found)


def predictions(regression: Regression, samples: Samples, candidates: Array, count: int) -> Sequence[int]:
    """The candidates at which further curves tell most, each chosen as if the ones before were known.

    Args:
        regression: That of dU.
        samples: dU of the curves.
        candidates: beta, De and Ca_e, shape (candidates, 3).
        count: How many are wanted.
    """
    found: list[int] = []
    coefficients, _ = regression.solve(samples)
    known = samples
    for _ in range(count):
        _, covariance = regression.solve(known)
        values, spreads = regression.predict(candidates, coefficients, covariance)
        relative = spreads / np.maximum(np.abs(values).max(axis=1), 1e-3 * np.abs(values).max())
        relative[found] = 0.0
        found.append(int(relative.argmax()))
        chosen = candidates[found[-1:]]
        expected = regression.predict(chosen, coefficients, covariance)[0]
        known = Samples(
            np.concatenate([known.places, chosen]),
            np.concatenate([known.values, expected]),
            np.concatenate([known.gradients, np.zeros((3, *expected.shape))], axis=1),
            np.concatenate([known.errors, 0 * expected]),
        )
    return found
