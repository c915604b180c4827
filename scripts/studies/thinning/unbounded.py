"""The drag of a sphere in an unbounded power-law liquid, from above by the least dissipation of trial functions."""

from __future__ import annotations

import numpy as np
from numpy.polynomial import chebyshev, legendre

from pairsim.runtime.arrays import Array


def ritz(n: float, orders: tuple[int, ...] = (1, 3), count: int = 8) -> float:
    """Upper bound of the drag of a sphere in an unbounded power-law liquid, over 3 pi K V^n D_p^(2 - n).

    A stream function sum_k f_k(r) (1 - x^2) P_k'(x)/(k (k + 1)), x = cos(theta), with f_k = r (1 - s)^2 T_j(2 s - 1),
    s = 1/r, added to that of Stokes, minimises the dissipation int gamma^(n + 1) dV.
    """
    t, weights = legendre.leggauss(160)
    t, weights = (t + 1) / 2, weights / 2
    s, x, wx = t**6, *legendre.leggauss(40)
    r, sin = 1 / s, np.sqrt(1 - x**2)
    volume = np.outer(2 * np.pi * weights * 6 * t**5 * s**-4, wx)

    def strains(f: Array, f1: Array, f2: Array, k: int) -> Array:
        P, c = legendre.Legendre.basis(k), k * (k + 1)
        P0, P1 = P(x), P.deriv()(x)
        rr = np.outer(f1 / r**2 - 2 * f / r**3, P0)
        hoop = np.outer(f / r**3, P0) - np.outer(f1 / r**2, x * P1 / c)
        rt = (np.outer(2 * f1 / r**2 - f2 / r, sin * P1 / c) - np.outer(f / r**3, sin * P1)) / 2
        return np.sqrt(2) * np.stack([rr, -rr - hoop, hoop, np.sqrt(2) * rt])

    base = strains(1.5 * r - 0.5 / r, 1.5 + 0.5 / r**2, -1 / r**3, 1)
    columns = []
    for k in orders:
        for j in range(count):
            T = chebyshev.Chebyshev.basis(j)
            T0, T1, T2 = T(2 * s - 1), 2 * T.deriv()(2 * s - 1), 4 * T.deriv(2)(2 * s - 1)
            g, g1 = (1 - s) ** 2 * T0, -2 * (1 - s) * T0 + (1 - s) ** 2 * T1
            g2 = 2 * T0 - 4 * (1 - s) * T1 + (1 - s) ** 2 * T2
            in_r, twice = -g1 * s**2, g2 * s**4 + 2 * g1 * s**3
            columns.append(strains(r * g, g + r * in_r, 2 * in_r + r * twice, k).ravel())
    A, b = np.column_stack(columns), base.ravel()
    total, left = np.inf, np.zeros(A.shape[1])
    for _ in range(60):
        gamma2 = ((A @ left + b).reshape(base.shape) ** 2).sum(axis=0)
        total = float((volume * gamma2 ** ((n + 1) / 2)).sum())
        root = np.broadcast_to(np.sqrt(volume * gamma2 ** ((n - 1) / 2)), base.shape).ravel()
        left = np.linalg.lstsq(A * root[:, None], -b * root, rcond=1e-12)[0]
    return total / (3 * np.pi * 2 ** (2 - n))
