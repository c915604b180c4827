"""Single time steps on the present mesh of a run, and the transition to a new mesh.

See "Remeshing" in docs/explanation/numerics.md. At a remeshing the particles keep their meshes and histories. In the
liquid only transported fields have a history, which is interpolated to the new mesh.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from pairsim.fem.algebra.constraints import Constraints, PositionUpdate
from pairsim.fem.algebra.scene_constraints import transient_constraints
from pairsim.fem.meshes.geometry import Geometry, Outline
from pairsim.fem.meshes.six_node_mesh import SixNodeMesh
from pairsim.fem.scene import Scene
from pairsim.physics.liquids import Liquid
from pairsim.physics.pipe import Pipe, PipeState
from pairsim.physics.pulsating_pipe import PulsatingPipe
from pairsim.runtime.arrays import Array
from pairsim.runtime.clock import Clock
from pairsim.solvers.mesh_transfer import free_unknowns
from pairsim.solvers.meshed_scene import FRESH_DISTORTION, MeshedScene, MeshedSolver
from pairsim.solvers.nonlinear.convergence import Report
from pairsim.solvers.problems import Problem
from pairsim.solvers.stepping.history import ErrorHistory, History
from pairsim.solvers.stepping.step_size import Scheme, extrapolation_weights
from pairsim.solvers.transient.stress_balance import balanced

# Size of a first step with which Newton's method converges from a liquid at rest [D_c/U_av]; chosen.
SURE_STEP = 1e-3
THINNER = 0.2  # first step of the continuation to a strongly thinning liquid, as a fraction of the way; chosen
FEW_ITERATIONS = 8  # Newton iterations up to which the next step of this continuation is larger; chosen
# Largest factor of a jump of the flow at which the velocities of the first guess are scaled by this factor; chosen.
# After larger jumps it is the first guess of a start from rest: elastic recoil is too small a part of the new flow.
MOST_TIMES_FASTER = 4.0


class StepSolver(MeshedSolver):
    """Solver of single time steps, on the meshes that `_make_particles` and `MeshedScene.put` create.

    Args:
        problem: The problem.

    Attributes:
        pipe: The flow without particles.
        history: Accepted values of the last steps.

    Raises:
        NoSteadyState: The flow without particles could not be integrated.
    """

    def __init__(self, problem: Problem) -> None:
        self.problem, self.clock = problem, Clock()
        # The flow without particles is needed for developed ends and for the excess pressure drop.
        self.pipe = _flow_without_particles(problem)
        self.history = History()
        # Free unknowns of the particles in the last solution before a remeshing.
        self._carried: Array | None = None

    def _make_particles(self, outlines: Sequence[Outline], insides: Sequence[SixNodeMesh | None]) -> None:
        solids, liquid = self.problem.solids, self.problem.liquid
        self.meshed = MeshedScene(
            *(self.problem, outlines, insides, solids),
            liquid=liquid,
            steady=False,
            constrain=self._constrain,
            clock=self.clock,
        )

    def _constrain(self, meshed: MeshedScene) -> Constraints:
        """Constraints on a new mesh; discards the free unknowns of the old one."""
        self.history.y, self.history.t_y = [], []
        return transient_constraints(meshed.scene)

    def _drive_at(self, x: Array, t: float) -> None:
        """Set the flow, and the fields at developed ends in a full vector x, (n,), to those at time t [D_c/U_av]."""
        drive = self.problem.drive
        if drive.varies:
            self.scene.set_flow(x, drive.flow_at(t))
        if not (self.problem.periodic or self.problem.liquid.newtonian):
            self.scene.prescribe_ends(x, self.pipe(t))

    def _begin_again(self) -> None:
        """Discard the history before the last step, at whose end the flow jumps or has a kink; adapt its velocities.

        The velocities are a first guess for the next step, in which no cell may be sheared more than in the solution
        (see `_first_guess`).
        """
        waveform, past = self.problem.drive.waveform, self.history
        assert waveform is not None, "a constant flow has no kinks"
        past.forget_all_but_last()
        before, after = waveform.at(past.t[0]), waveform.after(past.t[0])
        if not past.y or before == after:
            return
        constraints, y = self.constraints, past.y[0].copy()
        momentum = np.concatenate([constraints.fields[f] for f in ("u", "v", "U_p") if f in constraints.fields])
        if abs(after) <= MOST_TIMES_FASTER * abs(before):
            y[momentum] *= after / before
        else:
            y[momentum] = free_unknowns(self.scene, constraints, self.scene.starting(after))[momentum]
        past.y = [y]

    def _guess(self, t: float) -> Array:
        """First guess of the solution at a time, (n_y,): extrapolated from the last ones on this mesh, if any."""
        past, known = self.history, self.problem.extrapolated
        if not past.y:
            return self._first_guess()
        weights = extrapolation_weights(past.t_y[:known], t)
        return np.asarray(sum(w * y for w, y in zip(weights, past.y[:known], strict=True)))

    def _first_guess(self) -> Array:
        """First guess on a new mesh, shape (n_y,).

        After a remeshing it has the interpolated fields (a Newtonian liquid is at rest) and the last unknowns of the
        particles. On the first mesh everything is at rest; but in a liquid with a memory between developed ends the
        velocity decreases from the ends to the particles. If ends or particles moved in a liquid at rest, they would
        shear the cells beside them, at a rate that grows as cells become smaller. SUPG weights this rate with the
        velocity relative to the mesh, which the first iteration changes: stresses would become up to hundreds of times
        too large, and Newton's method would diverge.
        """
        x = self.history.x[0]
        if self._carried is None and self.problem.liquid.has_memory and not self.problem.periodic:
            x = self.scene.at_rest_between(self.pipe(self.history.t[0]))
        y = free_unknowns(self.scene, self.constraints, x)
        if self._carried is not None:
            y[self.meshed.material] = self._carried
        return y

    def _update(self, dt: float, U_m: float) -> PositionUpdate:
        """How the positions of the material follow from the unknowns in a step of size dt."""
        past = self.history
        scheme = Scheme.bdf(past.t, past.t[0] + dt)
        h_star = np.asarray(sum(w * h for w, h in zip(scheme.weights, past.h, strict=True)))
        return PositionUpdate(h_star, scheme.g, U_m)

    def _solved(self, guess: Array, dt: float, U_m: float) -> tuple[Array, Report]:
        """Solve a step of size dt by Newton's method."""
        past, t, star = self.history, self.history.t[0] + dt, None
        scheme, update = Scheme.bdf(past.t, t), self._update(dt, U_m)
        self._drive_at(self.constraints.base, t)
        if self.scene.has_rates:
            star = np.asarray(sum(w * x for w, x in zip(scheme.weights, past.x, strict=True)))
            star = self.scene.with_displacements(star, update.h_star)
        if len(past.y) < 3 and self.scene.moving:
            # With fewer than three solutions, extend the mesh displacement from the guess instead of extrapolating it.
            h = self.constraints.positions(guess, update)
            guess[self.constraints.fields["eta"]], _ = self.meshed.extend(h)
        return self.newton.solve(guess, update, star)

    def _approached(self, guess: Array, dt: float, U_m: float) -> tuple[Array, Report]:
        """Solve a step for which there is no earlier solution on this mesh, by way of easier liquids and smaller steps.

        From a liquid at rest Newton's method does not converge for steps in which the particles deform strongly, nor
        for a viscosity that depends strongly on the shear rate.
        """
        sizes, reports = [dt], list[Report]()
        while sizes[0] > SURE_STEP:
            sizes.insert(0, sizes[0] / 10)
        for liquid in self._easier_liquids(reports):
            with self.scene.liquid.changed_to(liquid):
                found, report = self._solved(guess.copy(), sizes[0], U_m)
            reports.append(report)
            guess = found if report.converged else guess
        for size in sizes:
            guess, report = self._solved(guess, size, U_m)
            reports.append(report)
            if not report.converged:
                break
        counts = {name: sum(getattr(each, name) for each in reports) for name in ("iterations", "factorisations")}
        return guess, replace(report, **counts)

    def _easier_liquids(self, reports: Sequence[Report]) -> Iterator[Liquid]:
        """Liquids on the way to a strongly thinning one, in smaller steps after a failure, the last of `reports`."""
        wanted = self.problem.liquid
        easier = replace(wanted, solvent=wanted.solvent.easier())
        done, step = -THINNER, THINNER
        while easier != wanted and done < 1.0 and step > THINNER / 64:
            tau = min(done + step, 1.0)
            yield easier.towards(wanted, tau)
            if reports[-1].converged:
                done, step = tau, step * (1.5 if reports[-1].iterations <= FEW_ITERATIONS else 1.0)
            else:
                step = (tau - done) / 2

    def _on_new_mesh(self, geometry: Geometry, U_m: float, errors: ErrorHistory | None) -> None:
        """Remesh the liquid at the current distances; the particles keep their meshes and histories.

        The reference domain is that around undeformed spheres while the distortion allows it, and afterwards always
        that around the deformed shapes.

        Args:
            geometry: Geometry at the current distances.
            U_m: Velocity of the frame [U_av].
            errors: Errors of the last steps, which are interpolated too; None if they are not estimated.

        Raises:
            MeshFailure: The liquid could not be remeshed.
        """
        h = self.history.h[0]
        # Shift everything back to the middle of the tube: as the ends are periodic or far away, the solution remains.
        centres = [h[body.start : body.start + body.size : 2].mean() for body in self.bodies]
        shift = float(np.mean(geometry.centres) - np.mean(centres))
        self.history.h = [positions + shift * (self.constraints.a > 0) for positions in self.history.h]
        self.history.frame = [position - shift for position in self.history.frame]
        h = self.history.h[0]
        if self.history.y:
            self._carried = self.history.y[0][self.meshed.material]
        old = self.scene
        spheres = None if old.reference.deformed else geometry
        self.meshed.remesh(h, geometry, spheres, lambda distortion: distortion >= FRESH_DISTORTION)
        if errors is not None:
            self._carry_errors(errors, old, shift)
        past = zip(self.history.t, self.history.x, self.history.h, strict=True)
        self.history.x = [self._carried_over(old, t, x, h, shift) for t, x, h in past]
        if self.problem.liquid.modes and self._carried is not None:
            self._balance(U_m)

    def _carried_over(self, old: Scene, t: float, x: Array, h: Array, shift: float) -> Array:
        """Interpolate the liquid at an old time to the new mesh, (n,); zeros for a Newtonian one, without history."""
        if self.problem.liquid.newtonian:
            return np.zeros(self.scene.size)
        new = self.meshed.carried(old, x, h, shift)
        self._drive_at(new, t)
        return new

    def _carry_errors(self, errors: ErrorHistory, old: Scene, shift: float) -> None:
        """Interpolate the errors to the new mesh, as differences of interpolated corrected and discrete solutions."""
        past = self.history
        errors.t_y, errors.y = [], []
        levels = zip(past.t, past.x, past.h, errors.x, errors.h, strict=True)
        errors.x = [
            self._carried_over(old, t, x + dx, h + dh, shift) - self._carried_over(old, t, x, h, shift)
            for t, x, h, dx, dh in levels
        ]

    def _balance(self, U_m: float) -> None:
        """Restore the momentum balance of the interpolated s, with the same change of s at all old times."""
        liquid, h = self.scene.liquid, self.history.h[0]
        self._drive_at(self.constraints.base, self.history.t[0])
        y = self._first_guess()
        x = self.constraints.expand(y, h)
        # Let viscous solids move as in the first guess; the last solve left other rates in their forms.
        moved = self.constraints.M @ y
        self.scene.set_solid_rates(self.scene.with_displacements(x, h - moved), 1.0)
        change = balanced(self.scene, x, h, self.constraints.M @ y, U_m, self.clock) - x
        self.history.x = [x + change, *map(np.copy, self.history.x[1:])]
        for past in self.history.x[1:]:
            for field in self.problem.liquid.transported:
                liquid.nodal(field.name, past)[:] += liquid.nodal(field.name, change)


def _flow_without_particles(problem: Problem) -> Callable[[float], PipeState]:
    """The flow without particles as a function of time.

    Raises:
        NoSteadyState: It could not be integrated.
    """
    liquid, drive = problem.liquid, problem.drive
    pipe = Pipe(liquid, drive.flow)
    if problem.from_steady and liquid.yielding is None and not drive.varies:
        return pipe.constant()
    start = Pipe(replace(liquid, yielding=None), drive.flow).steady() if problem.from_steady else None
    if drive.waveform is not None:
        return PulsatingPipe(liquid, drive.waveform, start)
    return pipe.until(problem.t_end, start)
