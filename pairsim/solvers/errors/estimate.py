"""Discretisation error of a quasi-steady solution by the adjoint-weighted residual.

For a functional J and the adjoint z of its linearisation, J(exact) - J(discrete) = -R(discrete; z - z_h) up to terms of
second order in the error, whatever discrete z_h is taken away (Becker & Rannacher, Acta Numerica 10, 1, 2001). Here
z is the discrete adjoint (`pairsim.solvers.errors.adjoints`), recovered one degree higher
(`pairsim.fem.recovery.weighted_residual`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pairsim.fem.diagnostics import Observation
from pairsim.fem.meshes.size_field import ORDER, VISCOUS_ORDER, CellIndicators
from pairsim.fem.recovery.enriched_residual import EnrichedTests, EnrichedUnknowns
from pairsim.fem.recovery.enriched_scene import EnrichedScene
from pairsim.fem.recovery.recovered_solution import RecoveredSolution
from pairsim.fem.recovery.weighted_residual import WeightedResidual
from pairsim.quantities.scales import FLOW_RATE
from pairsim.runtime.arrays import Array
from pairsim.solvers.errors.adjoints import MEASURES, Adjoints
from pairsim.solvers.errors.end_effects import end_effects
from pairsim.solvers.errors.regularisation import by_regularisation, left_by_regularisation
from pairsim.solvers.errors.run_errors import OF_POINTS, widening
from pairsim.solvers.steady.linearisation import Linearisation
from pairsim.solvers.steady.scene import SteadySolver

# Factors of the scatter in a half-width. Determined on twelve solutions without a memory, and on half of the other
# scenes of scripts/error_bars with the larger one of scatter and correction in place of their sum
# (docs/explanation/error-estimate.md).
VISCOUS, ELASTIC = 3.0, 1.6
# What is left of parts of the estimate that cancel between the liquid and soft particles, relative to them. Where
# spheres are far apart the parts are a hundred times their sum. Determined on Newtonian curves of beta .4 (all of 30
# intervals hold), and checked on those of beta .2 and .6 (98 % of 51).
OF_CANCELLED = 0.015
# Least part of what is left in one gap of that in another: the estimate of a single gap may vanish by chance. Chosen.
OF_OTHER_GAPS = 0.1
OF_ENDS = 2.0  # what the ends may do over what they are found to do; chosen
# What rounding adds to the half-width of a relative velocity [U_av]. That of equal rigid spheres in a Newtonian liquid,
# which is 0, was up to 5e-15 on 24 meshes.
ROUNDING_OF_DU = 1e-13
# Scatter over the magnitude of the estimate above which the estimate has no certain sign, and is not added.
CANCELLING = 4.0


@dataclass(frozen=True)
class ErrorEstimate:
    """Signed estimates of exact minus discrete values, and the error to quote.

    Attributes:
        U: Of the particles' velocities, (N,).
        dp_plus: Of the pressure drop that the particles cause.
        dp_plus_error: Half-width of the interval around this pressure drop, with the estimate where it is trusted.
        shape_errors: Half-widths of the intervals around the measures of the shape of a single soft particle, which
            do not contain their estimates.
        U_error: Half-widths of the intervals around the velocities, of the same terms as `dU_error`, (N,).
        F: Of the forces that move the particles at a prescribed velocity, (N,), or (0,).
        F_error: Half-widths of the intervals around these forces, of the same terms as `dU_error`, (N,), or (0,).
        F_regularisation: The parts of these that are due to the regularisation of the liquid, (N,), or (0,).
        newton_dU: What Newton's method has left in every dU, to first order, (N-1,).
        spread_dU: By how much another recovery of the adjoint pressures changes the estimates of dU, (N-1,).
        cancelled_dU: What cancels in the estimates of dU between the liquid and the particles, (N-1,).
        scatter_dU: Root of the sum over the cells of the squares of what each has of the estimates of dU by the
            constitutive equation, (N-1,). Where stress or adjoint are not resolved the signs are random, and the
            estimate is no more than the remainder of a sum of this size. In a liquid without modes it is what errors
            do to the viscosity beyond the first order (`pairsim.fem.recovery.viscosity_scatter`), 0 in a Newtonian one.
        ends_dU: By how much the ends of the tube change every dU, (N-1,).
        by_regularisation: First and second derivatives of the velocities by the logarithm of a regularisation, (2, N).
        widening: Factor of the cells' part of the half-widths where they do not resolve the stress of a polymer.
        of_scatter: Factor of the scatter in half-widths.
        trusted: Whether the estimates of all dU, or of all forces, have a certain sign, so that they are added to the
            solution. They have none where they are what remains of much larger contributions of both signs. In liquids
            without modes they always have one: `scatter_dU` is no part of the estimates there.
        cells: What the cells have of `scatter_dU`; None unless it was asked for.
    """

    U: Array
    dp_plus: float
    dp_plus_error: float
    shape_errors: dict[str, float]
    U_error: Array
    F: Array
    F_error: Array
    F_regularisation: Array
    newton_dU: Array
    spread_dU: Array
    cancelled_dU: Array
    scatter_dU: Array
    ends_dU: Array
    by_regularisation: Array
    widening: float
    of_scatter: float
    trusted: bool
    cells: CellIndicators | None = None

    @property
    def dU(self) -> Array:
        """Of the relative velocity over every gap, (N-1,)."""
        return np.diff(self.U)

    @property
    def dU_error(self) -> Array:
        """Half-width of the interval around the corrected dU that should hold the exact one, (N-1,)."""
        return self.cells_dU + self.ends_error + self.regularisation_error + np.abs(self.newton_dU) + ROUNDING_OF_DU

    @property
    def regular_dU(self) -> Array:
        """What corrections leave of the cells' part of the error where cells resolve stress and adjoint, (N-1,)."""
        regular = _regular(self.dU, self.spread_dU, self.cancelled_dU)
        return np.maximum(regular, OF_OTHER_GAPS * regular.max(initial=0.0))

    @property
    def irregular_dU(self) -> Array:
        """What is left where cells do not resolve them, (N-1,)."""
        return self.of_scatter * self.scatter_dU

    @property
    def cells_dU(self) -> Array:
        """The cells' part of the half-width, (N-1,).

        The scatter adds to what is left of a correction that lacks a part of the error, as it may have the same sign.
        """
        return self.widening * (self.regular_dU + self.irregular_dU)

    @property
    def ends_error(self) -> Array:
        """The part of `dU_error` that is due to the ends of the tube, (N-1,)."""
        return OF_ENDS * self.ends_dU

    @property
    def regularisation_error(self) -> Array:
        """The part of `dU_error` that is due to the regularisation of the liquid, (N-1,)."""
        return left_by_regularisation(np.diff(self.by_regularisation))

    def corrected(self, discrete: Observation) -> Observation:
        """A solution's quantities with the estimates of their errors added, if they are trusted."""
        if not self.trusted:
            return discrete
        return replace(discrete, U=discrete.U + self.U, F=discrete.F + self.F, dp=discrete.dp + self.dp_plus)


class ErrorEstimator:
    """Estimates the discretisation error of quasi-steady solutions, and keeps what further ones on a mesh share.

    Args:
        cells: Whether estimates keep what single cells contribute.
    """

    def __init__(self, cells: bool = False) -> None:
        self._cells = cells
        self._enriched: EnrichedScene[EnrichedTests] | None = None
        self._recovered: EnrichedScene[EnrichedUnknowns] | None = None

    def estimate(self, at: Linearisation, adjoints: Adjoints, discrete: Observation) -> ErrorEstimate:
        """The estimate at a solution: one assembly of the enriched residual.

        Args:
            at: The solution.
            adjoints: Its adjoints.
            discrete: Its quantities.
        """
        steady = at.steady
        scene, constraints = steady.scene, steady.constraints
        with steady.clock("jit"):
            if self._enriched is None or self._enriched.scene is not scene:
                self._enriched = EnrichedScene(scene, EnrichedTests, self._enriched)
        z, drop, count = adjoints.all, adjoints.drop, len(adjoints.velocities)
        residual = at.residual
        left = -z @ residual
        changes = -z @ _flow_rate_defect(steady, residual)
        ends = end_effects(steady, z, residual)
        sharper = by_regularisation(at, z, drop.apart)
        regularised = left_by_regularisation(sharper)
        with steady.clock("assembly"):
            x = steady.state()[1]
            scene.set(x)
            tested = WeightedResidual.of(self._enriched, x, (constraints.T.T @ z.T).T)
        changes = changes - tested.sums
        difference = np.eye(len(z))[1:count] - np.eye(len(z))[: count - 1]
        scatter = np.sqrt(np.diagonal(tested.stress_products))
        scatter_dU = np.sqrt(np.maximum(np.einsum("ik,kl,il->i", difference, tested.stress_products, difference), 0.0))
        F, shape = slice(count, count + adjoints.forces), slice(count + adjoints.forces, -1)
        moved = len(changes[F]) > 0
        elastic = scene.material.has_memory
        of_scatter = ELASTIC if elastic else VISCOUS
        cancelling = (scatter[F] if moved else scatter_dU) > CANCELLING * np.abs(
            changes[F] if moved else np.diff(changes[:count])
        )
        wider = widening(discrete.s_jump, OF_POINTS)
        regular = _regular(changes, tested.changes, _cancelled(tested))
        errors = wider * (regular + of_scatter * scatter) + np.abs(left)
        errors += OF_ENDS * np.abs(ends).max(axis=0) + regularised
        if count == 1 and adjoints.forces == 0 and steady.bodies[0].phase is not None and not elastic:
            errors[:1] += np.abs(self._of_recovered_solution(steady, z[:1], x) - changes[:1])
        dp_plus = drop.value - scene.pressure_drop(steady.state()[1]) + float(changes[-1])
        trusted = not (elastic and bool(cancelling.any()))
        measured = (errors + np.abs(changes))[shape]
        return ErrorEstimate(
            U=changes[:count],
            dp_plus=dp_plus,
            dp_plus_error=float(errors[-1]) + (0.0 if trusted else abs(dp_plus)),
            shape_errors=dict(zip(MEASURES, measured.tolist(), strict=False)),
            U_error=errors[:count],
            F=changes[F],
            F_error=errors[F],
            F_regularisation=regularised[F],
            newton_dU=difference @ left,
            spread_dU=difference @ tested.changes,
            cancelled_dU=_cancelled(tested, difference),
            scatter_dU=scatter_dU,
            ends_dU=np.abs(np.diff(ends[:, :count])).max(axis=0),
            by_regularisation=sharper[:, :count],
            widening=wider,
            of_scatter=of_scatter,
            trusted=trusted,
            cells=_indicators(self._enriched, tested, count) if self._cells else None,
        )

    def _of_recovered_solution(self, steady: SteadySolver, z: Array, x: Array) -> Array:
        """Estimates from the residual of the recovered solution, tested with the discrete adjoints, (k,).

        They differ from those of the discrete solution, tested with the recovered adjoints, by twice the term of second
        order that both lack. This term is not added, and counts twice in the half-width: once itself, once for the
        error of its estimate. It is small except on squeezed cells of soft particles.

        Args:
            steady: The solution.
            z: Adjoints, (k, n_y).
            x: The solution as a full vector, (n,).
        """
        with steady.clock("jit"):
            if self._recovered is None or self._recovered.scene is not steady.scene:
                self._recovered = EnrichedScene(steady.scene, EnrichedUnknowns, self._recovered)
        with steady.clock("assembly"):
            recovered = RecoveredSolution.of(self._recovered, x, None, steady.constraints.V @ steady.y)
            return np.asarray(-z @ steady.newton.restricted(recovered.residuals(x, None), x))


def _indicators(enriched: EnrichedScene[EnrichedTests], tested: WeightedResidual, count: int) -> CellIndicators | None:
    """The contributions of the cells to the scatter of every dU."""
    if tested.stress_by_cell is None:
        return None
    reference, squares = enriched.scene.reference, np.diff(tested.stress_by_cell[:count], axis=0).T ** 2
    order = ORDER if enriched.scene.material.has_memory else VISCOUS_ORDER
    return CellIndicators(reference.geometry, reference.mirrored, tested.corners, squares, order)


def _cancelled(tested: WeightedResidual, combined: Array | None = None) -> Array:
    """What cancels between liquid and particles in functionals, or in combinations (j, k) of them."""
    parts = np.array([tested.in_liquid, tested.sums - tested.in_liquid])
    parts = parts if combined is None else parts @ combined.T
    return np.asarray(np.abs(parts).sum(axis=0) - np.abs(parts.sum(axis=0)))


def _regular(change: Array, spread: Array, cancelled: Array) -> Array:
    """What signed estimates leave once they are added: their size, their spread, and a part of what cancels in them."""
    return np.asarray(np.abs(change) + np.abs(spread) + OF_CANCELLED * cancelled)


def _flow_rate_defect(steady: SteadySolver, residual: Array) -> Array:
    """Change of the residual when the velocity at prescribed ends is scaled to the flow rate that it should have.

    What interpolation does to the profile of a viscoelastic liquid changes the flow rate by 4e-5 of itself in coarse
    cells, and every velocity with it; no residual tells.
    """
    scene = steady.scene
    if scene.periodic or scene.drive.flow == 0:
        return np.zeros(steady.constraints.size)
    x = steady.state()[1]
    index, weight = scene.flow_rate
    excess = scene.drive.flow * FLOW_RATE / float(weight @ x[index]) - 1
    for nodes in (scene.nodes.inlet, scene.nodes.outlet):
        x[scene.liquid.index("u", nodes)] *= 1 + excess
    return steady.newton.reduce(x) - residual
