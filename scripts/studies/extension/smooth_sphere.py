"""A sphere whose displacement is a polynomial, for the fold of steady extension."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy import sparse

from pairsim.fem.algebra.constraints import Constraints
from pairsim.runtime.arrays import Array
from pairsim.solvers.meshed_scene import MeshedScene
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.problems import SteadyProblem
from pairsim.solvers.steady.scene import SteadySolver


class SmoothSphere(SteadySolver):
    """A steady scene whose displacement inside the sphere is a polynomial in X, its pressure one of two degrees less.

    Past l = 2.25 the steady equations are not well posed (wrinkles of any length, see docs/explanation/limits.md):
    what cells interpolate is lost there. Liquid, moving mesh, coupling, solver and continuation are those of every
    scene.
    """

    def __init__(self, problem: SteadyProblem, parameters: Parameters, degree: int) -> None:
        self.degree = degree
        super().__init__(problem, parameters)

    def _constraints_on(self, meshed: MeshedScene) -> Constraints:
        constraints, (body,) = super()._constraints_on(meshed), meshed.bodies
        assert body.phase is not None
        mesh = body.phase.six_node_mesh
        X = 2 * mesh.points / self.problem.betas[0]
        # The downstream pole stays where it is.
        axial = (monomials(X, self.degree, 0) - monomials(X[body.nodes[:1]], self.degree, 0))[:, 1:]
        radial = monomials(X, self.degree, 1)
        pressure = monomials(X[mesh.vertices], self.degree - 2, 0)
        n, m = axial.shape[1] + radial.shape[1], pressure.shape[1]
        shapes = np.zeros((len(X), 2, n))
        shapes[:, 0, : axial.shape[1]], shapes[:, 1, axial.shape[1] :] = axial, radial

        h, p, U = constraints.fields["h"], constraints.fields["p_s"], constraints.fields["U_p"][0]
        others = np.setdiff1d(np.arange(constraints.size), np.r_[h, p])
        number = np.full(constraints.size, -1)
        number[others] = n + m + np.arange(len(others))
        place = constraints.M[:, h].tocoo()
        old = np.zeros((len(h), n))
        old[place.col] = shapes.reshape(-1, n)[place.row]
        trial = sparse.lil_matrix((constraints.size, n + m + len(others)))
        trial[h, :n], trial[p, n : n + m], trial[others, number[others]] = old, pressure, 1.0
        tested = trial.copy()
        tested[h[place.col[place.row % 2 == 0]], number[U]] = 1.0  # the force on the whole sphere
        trial, tested = trial.tocsr(), tested.tocsr()

        fields = {name: number[i] for name, i in constraints.fields.items()} | {
            "h": np.arange(n),
            "p_s": n + np.arange(m),
        }
        integrated = np.isin(np.arange(trial.shape[1]), fields["p_s"])
        N, M, V = (sparse.csr_matrix(A @ trial) for A in (constraints.N, constraints.M, constraints.V))
        T = sparse.csr_matrix(tested.T @ constraints.T)
        return replace(constraints, N=N, M=M, V=V, T=T, integrated=integrated, fields=fields)


def monomials(X: Array, degree: int, odd: int) -> Array:
    """z^i r^j up to a degree, j all odd or all even, as columns."""
    powers = [(i, j) for j in range(odd, degree + 1, 2) for i in range(degree + 1 - j)]
    return np.column_stack([X[:, 0] ** i * X[:, 1] ** j for i, j in powers])
