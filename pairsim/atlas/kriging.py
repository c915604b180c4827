"""Gradient-enhanced kriging: functions of a few parameters from values and derivatives at places (numpy alone)."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from pairsim.runtime.arrays import Array, Indices

TINY = 1e-30  # step into the complex plane, without rounding (Squire and Trapp 1998)
NUGGET = 1e-10  # added to variances of data, relative to that of the function; rounding


def covariance(X: Array, Z: Array, lengths: Array, vanishing: Sequence[int]) -> Array:
    """Covariances of a random function and its derivatives at places with those at other places.

    The function is a random g or, if some parameters i are `vanishing`, the sum of g_i x_i over these with random g_i,
    so that it is zero where they are. Each g has the covariance exp(-|x - z|^2/2), with x and z over the lengths
    (Rasmussen and Williams 2006, section 9.4).

    Args:
        X: Places, shape (n, p).
        Z: Other places, shape (m, p).
        lengths: Correlation length along each parameter, shape (p,).
        vanishing: Indices of the parameters of this sum; none where the function is g.

    Returns:
        Array of shape (1 + p, n, 1 + p, m): the function, then its derivatives by each parameter.
    """
    places = [X, *(X + 1j * TINY * unit for unit in np.eye(X.shape[1]))]  # the imaginary part is a derivative
    rows = [_by_place(there, Z, lengths, vanishing) for there in places]
    return np.stack([rows[0], *(row.imag / TINY for row in rows[1:])])


def _by_place(X: Array, Z: Array, lengths: Array, vanishing: Sequence[int]) -> Array:
    """Covariances of the function with it and its derivatives by other places, analytic in X: shape (n, 1 + p, m)."""
    D = (X[:, None] - Z) / lengths
    factor, by_z = np.ones((len(X), len(Z))), np.zeros_like(D)
    if vanishing:
        factor = np.sum([X[:, None, i] * Z[:, i] for i in vanishing], axis=0)
        by_z[:, :, list(vanishing)] = X[:, None, list(vanishing)]
    slopes = by_z + factor[:, :, None] * D / lengths
    whole = np.concatenate([factor[:, None], np.moveaxis(slopes, 2, 1)], axis=1)
    return np.asarray(whole * np.exp(-(D**2).sum(axis=2) / 2)[:, None])


@dataclass(frozen=True)
class Kriging:
    """Functions of the same parameters that are known at the same places."""

    places: Array  # places, shape (n, p)
    lengths: Array  # as in `covariance`, shape (p,)
    known: Indices  # indices of the data among function and derivatives (1 + p) at all places (n), flattened, (data,)
    weights: Array  # of the data in each function, shape (data, functions)
    root: Array  # inverse of the Cholesky factor of the covariance of the data, lower triangular, (data, data)
    vanishing: Sequence[int]  # as in `covariance`

    @classmethod
    def of(cls, places: Array, data: Array, errors: Array, lengths: Array, vanishing: Sequence[int]) -> Kriging:
        """The functions that interpolate data.

        Args:
            places: Places, shape (n, p).
            data: Values and derivatives of each function, shape (1 + p, n, functions); nan where not known.
            errors: Standard errors of the data over the standard deviation of g, shape (1 + p, n).
            lengths, vanishing: As in `covariance`.
        """
        n = data.shape[0] * data.shape[1]
        known = np.flatnonzero(np.isfinite(data).all(axis=2))
        whole = covariance(places, places, lengths, vanishing).reshape(n, n)[np.ix_(known, known)]
        root = np.linalg.inv(np.linalg.cholesky(whole + np.diag(errors.reshape(n)[known] ** 2 + NUGGET)))
        return cls(places, lengths, known, root.T @ (root @ data.reshape(n, -1)[known]), root, vanishing)

    def __call__(self, X: Array) -> tuple[Array, Array]:
        """Functions and their derivatives at places, shape (1 + p, m, functions), and standard deviations, (m,).

        Standard deviations are those of the functions over that of g. A variance is what the data leave of that of the
        function, often 1e-9 of it: with the inverse of the covariance, in place of its root, it would be lost in
        rounding.
        """
        cross = covariance(X, self.places, self.lengths, self.vanishing)
        rows = cross.reshape(cross.shape[0], len(X), -1)[:, :, self.known]
        return rows @ self.weights, self._deviations(X, rows[0])

    def values(self, X: Array) -> tuple[Array, Array]:
        """Functions alone at places, shape (m, functions), and their standard deviations, (m,), in less time."""
        row = _by_place(X, self.places, self.lengths, self.vanishing).reshape(len(X), -1)[:, self.known]
        return row @ self.weights, self._deviations(X, row)

    def _deviations(self, X: Array, row: Array) -> Array:
        """Standard deviations at places, from the covariances of the functions there with the data, (m, data)."""
        here = (X[:, list(self.vanishing)] ** 2).sum(axis=1) if self.vanishing else np.ones(len(X))
        spread = here - ((row @ self.root.T) ** 2).sum(axis=1)
        return np.asarray(np.sqrt(np.maximum(spread, 0.0)))

    def left_out(self, which: Iterable[int] | None = None) -> tuple[Array, Array]:
        """The kriging without a place minus the values there, (n, functions), and its standard deviation there, (n,).

        This is done for each place, or for those with the indices `which`, all of which must have values.
        """
        n, residuals, spreads = len(self.places), [], []
        for i in range(n) if which is None else which:
            own = np.flatnonzero(self.known % n == i)
            block = np.linalg.inv(self.root[:, own].T @ self.root[:, own])
            residuals.append(-(block @ self.weights[own])[0])
            spreads.append(np.sqrt(block[0, 0]))
        return np.array(residuals), np.array(spreads)
