"""Newton's method for T R(x(y)) = 0 with PETSc SNES and MUMPS.

The matrix T A P is assembled directly from the cells, and reused while the iteration contracts well. See "Nonlinear
and linear solvers" in docs/explanation/numerics.md.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from pairsim.fem.algebra.constraints import Constraints, PositionUpdate
from pairsim.fem.scene import Scene
from pairsim.runtime.arrays import Array
from pairsim.runtime.clock import Clock
from pairsim.runtime.fenicsx import PETSc
from pairsim.runtime.monitor import Monitor
from pairsim.solvers.nonlinear.convergence import Convergence, Report
from pairsim.solvers.nonlinear.factors import EXACT, Factors, MumpsOptions, ReducedSystem
from pairsim.solvers.nonlinear.jacobian_lagging import LaggedMatrix, MatrixPolicy

_PREFIXES = itertools.count()

REASONS = {-3: "the matrix is singular", -4: "the residual is not a number", -5: "too many iterations"}
# Size of a step above which the next linear system is solved roughly, as with a lagged matrix: the step itself then
# leaves a larger error than its linear system. Chosen.
NONLINEAR = 1e-2
# For liquids with a yield stress, where a lagged matrix leads astray and the line search shortens many steps. Of three
# dragged spheres and two pairs at Bn .5 to 50 none failed with more iterations and newer matrices, and two did with
# either of these alone; measured.
KINKED_ITERATIONS = 30
KINKED_FAR = 1e-3
KINKED_TOLERANCE = 1e-8  # takes one or two iterations more than 1e-4; the last ones contract faster than elsewhere


@dataclass(frozen=True)
class NewtonOptions:
    """Options of Newton's method.

    Attributes:
        tolerance: Largest estimated error of a field after the last iteration, relative to the norm of the field.
        max_iterations: Largest number of iterations in one solve.
        line_search: Whether steps are shortened by a line search in shear-thinning liquids without a memory: where the
            shear rate vanishes, a whole step changes their viscosity too much. With a yield stress they always are.
        single: Whether the factors are in single precision until the refinement of a solution fails.
        matrix: Criteria for a new matrix.
        mumps: Control parameters of the factorisation.
    """

    tolerance: float = 1e-8
    max_iterations: int = 12
    line_search: bool = False
    single: bool = True
    matrix: MatrixPolicy = field(default_factory=MatrixPolicy)
    mumps: MumpsOptions = field(default_factory=MumpsOptions)

    def for_kinks(self) -> NewtonOptions:
        """Options for a stress with a kink: more iterations, and a new matrix after all but the smallest steps."""
        matrix = replace(self.matrix, far=KINKED_FAR)
        return replace(self, tolerance=KINKED_TOLERANCE, max_iterations=KINKED_ITERATIONS, matrix=matrix)


# The factors of the last iterations also serve to compute derivatives at the solution. The tolerance is loose because
# `SteadySolver.linearise` adds an iteration with the matrix at the solution: a tolerance of 1e-6 in place of 1e-4
# changed no dU by more than 2e-6 of the peak.
STEADY = NewtonOptions(tolerance=1e-4, line_search=True, matrix=MatrixPolicy(slow=0.05, far=0.3))
# In time-dependent problems the matrix is reused for longer, at the cost of more iterations.
TRANSIENT = NewtonOptions(tolerance=1e-9, max_iterations=25, matrix=MatrixPolicy(slow=0.3))


class Newton:
    """Newton's method on one scene with one set of constraints.

    Args:
        scene: The scene.
        constraints: Its constraints.
        options: Tolerance, reuse of the matrix, and options of the factorisation.
        clock: Stopwatch for the phases of the computation.
        monitor: Asked before every iteration whether the process has received a signal.
    """

    def __init__(
        self,
        scene: Scene,
        constraints: Constraints,
        options: NewtonOptions | None = None,
        *,
        clock: Clock | None = None,
        monitor: Monitor | None = None,
    ) -> None:
        options, kinked = options or NewtonOptions(), bool(scene.material.regularisation)
        self.scene, self.constraints, self.options = scene, constraints, options.for_kinks() if kinked else options
        self.clock, self.matrix = clock or Clock(), LaggedMatrix(self.options.matrix)
        self.monitor = monitor or Monitor()
        self._update = PositionUpdate(np.zeros(scene.h_size))  # of the solve under way, for PETSc's callbacks alone
        self._convergence = Convergence(
            self.options.tolerance, self.options.max_iterations, self.matrix, steps_may_grow=kinked
        )
        with self.clock("symbolic"):
            self._create()

    def _create(self) -> None:
        self._system = ReducedSystem(self.scene, self.constraints)
        self._A = self._system.A
        self._y, self._r = self._A.createVecs()
        prefix = f"pairsim_{next(_PREFIXES)}_"
        self._snes = PETSc.SNES().create(PETSc.COMM_SELF)
        self._snes.setOptionsPrefix(prefix)
        self._snes.setFunction(self._residual, self._r)
        self._snes.setJacobian(self._jacobian, self._A)
        self._snes.setConvergenceTest(self._converged)
        self._snes.setType("newtonls")
        self._snes.setMaxFunctionEvaluations(-1)
        self._factors = Factors(self._system, self._snes.getKSP(), prefix, self.options.mumps, self.options.single)
        database, liquid = PETSc.Options(), self.scene.material
        thinning = self.options.line_search and not (liquid.has_memory or liquid.newtonian)
        search = "bt" if thinning or liquid.regularisation else "basic"
        names = {f"{prefix}snes_linesearch_type": search, f"{prefix}snes_max_it": self.options.max_iterations}
        names |= {f"{prefix}{k}": v for k, v in self._factors.options.items()}
        for name, value in names.items():
            database[name] = value
        self._snes.setFromOptions()
        self._snes.getKSP().setFromOptions()
        self._names = list(names)

    def _residual(self, snes: Any, y: Any, r: Any) -> None:
        self._system.scatter(self.residual_at(self._system.gather(y), self._update), r)

    def restricted(self, local: list[Array], x: Array, g: float = 1.0) -> Array:
        """T R(x), shape (n_y,), from the residuals of all phases.

        Args:
            local: Residual of each phase, in the numbering of its unknowns.
            x: Full vector, shape (n,).
            g: gamma dt, by which the rows of `Constraints.integrated` are divided.
        """
        reduced = self.constraints.T @ np.concatenate([*local, np.zeros(self.scene.size - self.scene.m)])
        reduced += self.constraints.T @ (self.scene.scalar_terms.matrix @ x + self.scene.load())
        reduced[self.constraints.integrated] /= g
        return np.asarray(reduced)

    def _jacobian(self, snes: Any, y: Any, A: Any, _: Any) -> None:
        rough = not self.matrix.due or (snes.getIterationNumber() > 0 and self._convergence.leading > NONLINEAR)
        self._factors.tolerate(rough)
        if self.matrix.due:
            self._factor(self._update.g)

    def _factor(self, g: float) -> None:
        """Assemble at the present state of the phases, and factorise."""
        with self.clock("assembly"):
            self._system.assemble(g)
        with self.clock("factorisation"):
            self._factors.make()
        self.matrix.made(g)

    @property
    def single(self) -> bool:
        """Whether the factors are in single precision."""
        return self._factors.single

    @property
    def factorisations(self) -> int:
        """Number of matrices factorised so far."""
        return self._factors.count

    def _forget_factor(self) -> None:
        """Discard the factors and the symbolic analysis."""
        self._factors.forget()
        self.matrix.forget()

    def use_double(self) -> None:
        """Discard the factors, and use double precision on this scene from now on."""
        self._factors.use_double()
        self.matrix.forget()

    def _converged(self, snes: Any, its: int, norms: tuple[float, float, float]) -> int:
        self.monitor.check_signals()
        return self._convergence.test(its, norms[2], lambda: self._last_steps(snes))

    def _last_steps(self, snes: Any) -> dict[str, float]:
        vectors = snes.getSolutionUpdate(), snes.getSolution()
        return self.scaled(*map(self._system.gather, vectors))

    def forget(self) -> None:
        """Discard the matrix; the next solve assembles and factorises a new one."""
        self.matrix.forget()

    def scaled(self, step: Array, y: Array) -> dict[str, float]:
        """Norms of a step by field, relative to the norms of the same fields of y."""
        return {
            name: float(np.linalg.norm(step[i]) / max(np.linalg.norm(y[i]), 1e-3 * np.sqrt(len(i))))
            for name, i in self.constraints.fields.items()
            if len(i)
        }

    def solve(self, y: Array, update: PositionUpdate, star: Array | None = None) -> tuple[Array, Report]:
        """Solve from a first guess.

        Args:
            y: First guess, shape (n_y,).
            update: How the positions of the material follow from the unknowns.
            star: Part of the full vector that the time scheme fixes, shape (n,); needed in a time step of a scene that
                `has_rates`, of a liquid with a memory or viscous solids.

        Returns:
            The solution, or the last iterate if it did not converge, and a report.

        Raises:
            Stopped: The process has received a signal, which is checked before every iteration; a factorisation by
                MUMPS cannot be interrupted.
        """
        self._update = update
        if star is not None:
            self.scene.set_step(star, update.g, update.U_m)
        before, iterations, failure = self.factorisations, 0, ""
        with self.clock("solve"):
            inside = sum(self.clock.seconds[k] for k in ("assembly", "factorisation"))
            try:
                iterations = self._iterate(y)
                while self._matrix_failed(before):
                    iterations += self._iterate(y)
                converged = self._snes.getConvergedReason() > 0
            except PETSc.Error as error:
                if isinstance(error.__cause__, KeyboardInterrupt):  # raised in a callback
                    self._forget_factor()
                    raise error.__cause__ from None
                converged, failure = False, str(error)
            inside = sum(self.clock.seconds[k] for k in ("assembly", "factorisation")) - inside
        self.clock.seconds["solve"] -= inside
        solution = self._system.gather(self._y)
        if converged:
            failure = self.overstretched(solution, update)
            converged = not failure
        end, code = self._convergence, self._snes.getConvergedReason()
        if not converged:
            self._forget_factor()
            failure = failure or end.reason or REASONS.get(code, f"SNES reason {code}")
        made = self.factorisations - before
        return solution, Report(converged, iterations, made, failure or end.reason, dict(end.steps), end.residual)

    def _iterate(self, y: Array) -> int:
        """Run Newton's method from a first guess y, shape (n_y,); returns the number of iterations."""
        self.matrix.begin_solve(self._update.g)
        self._convergence.begin()
        self._system.scatter(y, self._y)
        self._snes.solve(None, self._y)
        return int(self._snes.getIterationNumber())

    def _matrix_failed(self, before: int) -> bool:
        """Whether the last solve failed, and may succeed with another matrix; a failure discards the present one.

        This is so if refinement in single precision failed, or if the whole solve used the matrix of an earlier one:
        with the matrix of the present state its steps might not have grown.

        Args:
            before: Number of factorisations before the solve.
        """
        reason = self._snes.getConvergedReason()
        if reason > 0:
            return False
        inexact = reason == PETSc.SNES.ConvergedReason.DIVERGED_LINEAR_SOLVE and self._factors.single
        kept = self.matrix.g is not None and self.factorisations == before
        (self.use_double if inexact else self.matrix.forget)()
        return inexact or kept

    def overstretched(self, y: Array, update: PositionUpdate) -> str:
        """Message if tr c exceeds the bound of a law, beyond which solutions are spurious; otherwise empty."""
        return self.scene.overstretched(self.constraints.state(y, update)[1])

    def factor_at(self, y: Array, update: PositionUpdate) -> bool:
        """Assemble and factorise the matrix at y, for `linear_solve` and for the next solve.

        Returns:
            Whether the factorisation succeeded; otherwise `linear_solve` must not be called.
        """
        if not np.isfinite(self.residual_at(y, update)).all():  # MUMPS may crash on such a matrix
            self._forget_factor()
            return False
        self._factor(update.g)
        self.matrix.fresh = False
        if not self._factors.regular:
            self._forget_factor()
            return False
        return True

    def linearise_at(self, y: Array, update: PositionUpdate) -> bool:
        """Assemble the matrix at a solution y for `linear_solve`, and factorise it unless the present factors will do.

        They do if they are in single precision and the last iterations contracted well with them: solutions are then
        refined with the exact matrix.

        Returns:
            Whether `linear_solve` may be called.
        """
        if not (self.single and self.matrix.is_near()):
            return self.factor_at(y, update)
        if not np.isfinite(self.residual_at(y, update)).all():
            return False
        with self.clock("assembly"):
            self._system.assemble(update.g)
        self._factors.keep()
        return True

    @property
    def factor_megabytes(self) -> int:
        """Memory of the current factors [1e6 bytes]."""
        return self._factors.megabytes

    def linear_solve(self, rhs: Array, *, transposed: bool = False, tolerance: float = EXACT) -> Array:
        """Solve with the matrix that was assembled last, or with its transpose.

        Args:
            rhs: One right-hand side, shape (n_y,), or several, shape (k, n_y).
            transposed: Whether to solve with the transposed matrix.
            tolerance: Residual of every system, relative to its right-hand side.

        Returns:
            The solutions, of the same shape.
        """
        with self.clock("solve"):
            solutions = self._factors.solve(np.atleast_2d(rhs), transposed=transposed, tolerance=tolerance)
            return solutions.reshape(rhs.shape)

    def reduce(self, x: Array, g: float = 1.0) -> Array:
        """T R, (n_y,), of a full vector x, (n,), which may violate the constraints; g is that of `restricted`."""
        with self.clock("assembly"):
            self.scene.set(x)
            return self.restricted([phase.residual() for phase in self.scene.phases], x, g)

    def residual_at(self, y: Array, update: PositionUpdate) -> Array:
        """Residual T R at y, shape (n_y,)."""
        return self.reduce(self.constraints.state(y, update)[1], update.g)

    def jacobian_times(self, y: Array, update: PositionUpdate, direction: Array) -> Array:
        """Product of T A P at y with a direction, shape (n_y,); the next solve assembles a new matrix."""
        self.residual_at(y, update)
        self._system.assemble(update.g)
        self.matrix.forget()
        return self._system.times(direction)

    def destroy(self) -> None:
        """Destroy all PETSc objects and remove the options of this solver from PETSc's database."""
        options = PETSc.Options()
        for name in self._names:
            options.delValue(name)
        for thing in (self._snes, self._A, self._y, self._r):
            thing.destroy()
