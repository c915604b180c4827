"""Modes of displaced particles together with stresses and shapes: which of them decays most slowly?"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import ArpackNoConvergence, LinearOperator, eigs

from pairsim.fem.azimuthal.scene import DisturbedScene
from pairsim.runtime.arrays import Array
from pairsim.solvers.nonlinear.direct import DirectSolver

MORE = 4  # modes computed in addition to those wanted, since modes of the stress may be as close to zero; chosen
ACCURACY = 1e-4  # relative, of 1/rate; the rates of stresses lie so densely that a smaller one takes four times as long
VECTORS = 40  # of Arnoldi's method between restarts; ARPACK would take 20 and needs a tenth more solutions
SEED = 0  # of the start vector, so that results are reproducible


@dataclass(frozen=True)
class Modes:
    """Modes that grow as exp(rate t), the least damped first.

    Attributes:
        rates: Growth rates [U_av/D_c], complex, shape (k,).
        displacements: Displacements of the N particles in each mode, scaled such that the largest is 1, complex, shape
            (N, k).
    """

    rates: Array
    displacements: Array


def slowest_modes(scene: DisturbedScene, count: int) -> Modes:
    """The least damped ones of the modes whose growth rates are closest to zero, without inertia.

    With displacements d as unknowns beside y, and the lateral velocity of each particle as rate of its displacement,
    the disturbed equations are K z + rate B z = 0 for z = (y, d). Arnoldi's method finds the largest eigenvalues
    1/rate of -K^-1 B. There must be something with a rate of change: a memory or soft particles.

    Args:
        scene: The disturbed scene.
        count: Number of modes.

    Raises:
        NoSteadyState: K is singular: a displacement neither grows nor decays.
    """
    c, E, particles = scene.constraints, scene.equations, len(scene.constraints.lateral)
    follows, size = E @ c.follows, c.N.shape[1]
    changing = follows if scene.memory is None else follows + c.T @ scene.memory
    velocity = sparse.csr_matrix((np.ones(particles), (np.arange(particles), c.lateral)), (particles, size))
    K = sparse.bmat([[E @ c.N, E @ c.D - c.pinned], [velocity, None]], format="csr")
    of_displacements = changing @ c.D - E @ c.moves
    B = sparse.bmat([[changing @ c.N, of_displacements], [None, -sparse.eye(particles)]], format="csr")
    solver = DirectSolver(K)
    try:
        inverse = LinearOperator(K.shape, matvec=lambda z: -solver.solve((B @ z).reshape(-1, 1)).ravel(), dtype=float)
        start = np.random.default_rng(SEED).standard_normal(K.shape[0])
        values, vectors = eigs(inverse, k=count + MORE, ncv=VECTORS, v0=start, tol=ACCURACY)
    except ArpackNoConvergence as found:
        values, vectors = found.eigenvalues, found.eigenvectors
    finally:
        solver.close()
    rates, d = 1 / values, vectors[-particles:]
    order = np.argsort(-rates.real)[:count]
    d = d[:, order]
    largest = d[np.abs(d).argmax(axis=0), np.arange(d.shape[1])]
    return Modes(rates[order], d / largest)
