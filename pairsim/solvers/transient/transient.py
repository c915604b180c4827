"""Runs in time: variable-step BDF3 with error control; see "Time integration" in docs/explanation/numerics.md."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from pairsim.fem import diagnostics
from pairsim.fem.diagnostics import Observation
from pairsim.quantities.kinds import TIME
from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import InvertedCell, MeshFailure, NewtonFailure, StepTooSmall
from pairsim.runtime.message import Message
from pairsim.solvers.errors.error_transport import ErrorTransport
from pairsim.solvers.errors.run_errors import RunErrors
from pairsim.solvers.goals import IN_TIME, Goal, dU
from pairsim.solvers.meshed_scene import needs_mesh
from pairsim.solvers.nonlinear.convergence import Report
from pairsim.solvers.problems import Problem
from pairsim.solvers.solution import Solution
from pairsim.solvers.stepping.history import ErrorHistory, History
from pairsim.solvers.stepping.step import Step, at_step
from pairsim.solvers.stepping.step_size import Scheme, extrapolation_weights, land, reached, velocity_error
from pairsim.solvers.transient.cycles import Cycles
from pairsim.solvers.transient.scene import StepSolver
from pairsim.solvers.transient.start import at_rest, quasi_steady, settled_errors, settles
from pairsim.solvers.transient.state import Counts, Extremes, State

# Weight of errors of the distances between particles relative to errors of the shapes. Measured: dU to 0.15 % in 75
# steps, against 0.34 % in 92 steps with weight 1.
RELATIVE_WEIGHT = 20.0
# Fraction of the largest flow below which the ratio of velocity to flow is not updated, as elastic recoil falsifies it;
# chosen.
SLOW = 0.03
# Smallest error in units of the tolerance, that of scenes that do not change, as 0 stands for an unknown error.
NO_ERROR = 1e-12


class Transient(StepSolver):
    """Time integration of one case.

    Args:
        problem: The problem.
        state: State of an earlier run to continue; None to start as the problem says.
        settled: Errors of goals in the quasi-steady state that the run approaches (see `settles`), by their names, (k,)
            each; None to compute them where they are needed.

    Attributes:
        counts: Work since the start of the run.
        run_errors: Errors of goals up to the last step.
        extremes: Extreme values up to the last step.
        origin: Positions h of the material at t = 0 [D_c], shape (n_h,).
        gaps: Distances after the last step [D_c], N-1 values.
        cycles: Changes of the distances over the cycles of a flow that varies; None if it does not.

    Raises:
        MeshFailure: The first mesh could not be generated.
        NoSteadyState: The flow without particles could not be integrated, or there is no quasi-steady state to start
            from.
    """

    def __init__(
        self, problem: Problem, state: State | None = None, settled: Mapping[str, Array] | None = None
    ) -> None:
        super().__init__(problem)
        self.counts, self.run_errors, self.extremes = Counts(), RunErrors.of(problem.liquid), Extremes()
        self.gaps = problem.gaps
        self._U_m, self._dt, self._due = problem.U_m, problem.control.fixed or problem.first_step, False
        # Ratio of the frame's velocity to the flow, and rate of the distances at the last kink, for `_hold` after it.
        self._per_flow, self._rate = problem.U_m, np.zeros(len(problem.gaps))
        if problem.drive.varies:
            self._U_m *= problem.drive.flow
        self.cycles = Cycles.of(problem)
        self._error: ErrorTransport | None = None
        if state is None:
            self._begin(settled)
        else:
            self._restore(state)

    def _begin(self, settled: Mapping[str, Array] | None) -> None:
        """Start from rest, or from the quasi-steady state at the first distances."""
        problem = self.problem
        start = (quasi_steady if problem.from_steady else at_rest)(problem, self.clock)
        self._make_particles(start.reference.outlines, start.insides)
        self.meshed.put(start.reference, start.mesh)
        self.origin, frame = (
            start.h,
            [-float(place) for place in diagnostics.centres(self.bodies, start.h)[:1]] or [0.0],
        )
        self.history = History([0.0], [start.h], [self.scene.at_rest], frame=frame)
        errors = ErrorHistory([0.0], [np.zeros(self.scene.h_size)], [np.zeros(self.scene.size)])
        if start.flow is not None:
            y = start.flow.unknowns(self.scene, self.constraints)
            self._drive_at(self.constraints.base, 0.0)
            x = self.constraints.expand(y, start.h)
            self.history = History([0.0], [start.h], [x], [y], [0.0], frame)
            self._U_m = float(start.flow.U.mean()) if start.flow.U.size else 0.0
            self.run_errors.begin(start.flow.errors)
        if settles(problem):
            errors_there = settled_errors(problem, self.clock) if settled is None else settled
            self.run_errors.begin(errors_there, problem.liquid.longest)
        self.counts.newton, self.counts.factorisations = start.newton, start.factorisations
        if problem.dU_error:
            self._error = ErrorTransport(errors)

    def _restore(self, state: State) -> None:
        """Start from the state of an earlier run."""
        self._make_particles(state.reference.outlines, state.inside)
        self.meshed.put(state.reference, state.mesh)
        self.history, self.origin, self.counts = replace(state.history), state.origin, replace(state.counts)
        self.run_errors, self.extremes = state.run_errors.copy(), replace(state.extremes)
        self.gaps, self.cycles = state.gaps, state.cycles.copy() if state.cycles is not None else None
        self._U_m, self._dt, self._due = state.U_m, state.dt, state.due
        self._per_flow = state.per_flow
        if state.error_history is not None:
            self._error = ErrorTransport(replace(state.error_history))
        for name, seconds in state.seconds.items():
            self.clock.seconds[name] += seconds

    @property
    def state(self) -> State:
        """State from which the run can be continued, which later steps do not change."""
        return State(
            history=replace(self.history),
            reference=self.scene.reference,
            mesh=self.scene.liquid.six_node_mesh,
            inside=tuple(body.phase.six_node_mesh if body.phase is not None else None for body in self.bodies),
            dt=self._dt,
            U_m=self._U_m,
            due=self._due,
            counts=replace(self.counts),
            seconds=dict(self.clock.seconds),
            origin=self.origin,
            gaps=self.gaps,
            run_errors=self.run_errors.copy(),
            extremes=replace(self.extremes),
            error_history=replace(self._error.errors) if self._error is not None else None,
            cycles=self.cycles.copy() if self.cycles is not None else None,
            per_flow=self._per_flow,
        )

    def _frame_velocity(self, t: float) -> float:
        """Velocity of the frame in a step that ends at time t [U_av]: a prediction of the particles' mean velocity."""
        drive = self.problem.drive
        if not drive.varies:
            return self._U_m
        return self._U_m + self._per_flow * (drive.flow_at(t) - drive.flow_at(self.history.t[0]))

    def _attempt(self, dt: float, gradually: bool = False) -> tuple[Array, Array, Array, Report, float]:
        """Try a step of size dt.

        Args:
            dt: Size of the step.
            gradually: Whether smaller steps are solved first (see `_approached`).

        Returns:
            y, h, x, the report of Newton's method, and the local error in units of the tolerance; 0 if it is unknown.
        """
        past, t = self.history, self.history.t[0] + dt
        U_m = self._frame_velocity(t)
        guess = self._guess(t)
        y, report = self._approached(guess, dt, U_m) if gradually else self._solved(guess, dt, U_m)
        h, x = self.constraints.state(y, self._update(dt, U_m))
        error = 0.0
        if len(past.t) > 2 and report.converged:
            weights = extrapolation_weights(past.t, t)
            predicted = sum(w * old for w, old in zip(weights, past.h, strict=True))
            size = self._size_of(h - predicted)
            if weighted := [field for field in self.problem.liquid.fields if field.step_weight]:
                change = x - sum(w * old for w, old in zip(weights, past.x, strict=True))
                for field in weighted:
                    off = self.scene.liquid.nodal(field.name, change)
                    size = max(size, field.step_weight * float(np.sqrt(np.mean(off**2))))
            error = size * velocity_error(past.t, t) / self.problem.control.tolerance
            error = max(error, NO_ERROR)
        return y, h, x, report, error

    def _size_of(self, difference: Array) -> float:
        """Norm of a difference of material positions, shape (n_h,), in the estimate of the local error.

        Differences of the distances are weighted by RELATIVE_WEIGHT, since dU is a small difference of velocities of
        order one. The common translation is subtracted, as the motion of the frame is not an error.
        """
        if difference.size == 0:
            return 0.0
        on_axis = self.constraints.a > 0
        difference = difference.copy()
        difference[on_axis] -= difference[on_axis].mean()
        shape = float(np.sqrt(2 * np.mean(difference**2)))
        centres = [difference[body.start : body.start + body.size : 2].mean() for body in self.bodies]
        return max(shape, RELATIVE_WEIGHT * float(np.ptp(centres)))

    def _hold(self, dt: float) -> None:
        """Shift the particles such that the distances after a step of size dt are about those at the start of the run.

        A particle is shifted by the same amount at all past times. As its velocity follows from differences of its
        positions, neither velocities nor shapes nor stresses change.
        """
        past, errors = self.history, self._error.errors if self._error is not None else ErrorHistory()
        distances = [diagnostics.gaps(self.bodies, h) for h in past.h]
        rate = (distances[0] - distances[1]) / (past.t[0] - past.t[1]) if len(past.t) > 1 else self._rate
        past.h = [h + self._moved(self.problem.gaps - distances[0] - dt * rate) for h in past.h]
        if errors.h:
            off = diagnostics.gaps(self.bodies, past.h[0] + errors.h[0]) - diagnostics.gaps(self.bodies, past.h[0])
            errors.h = [h - self._moved(off) for h in errors.h]

    def _moved(self, longer: Array) -> Array:
        """Displacement of the material, shape (n_h,), that makes the distances longer by `longer`, shape (N-1,)."""
        places = np.concatenate([[0.0], np.cumsum(longer)])
        moved = np.zeros(self.scene.h_size)
        for body, place in zip(self.bodies, places - places.mean(), strict=True):
            moved[body.start : body.start + body.size : 2] = place
        return moved

    def _remesh(self) -> None:
        try:
            geometry = self.meshed.geometry_at(self.history.h[0])
            self.counts.remeshings += 1
            self._on_new_mesh(geometry, self._U_m, self._error.errors if self._error is not None else None)
        except MeshFailure as failure:
            at = at_step(self.history.t[0], self.counts.steps)
            advice = "a larger mesh.Np; very soft particles may have no steady shape"
            raise MeshFailure(failure.message, at=at, advice=advice) from failure

    def steps(self, milestones: Iterator[float]) -> Iterator[Step]:
        """Integrate in time up to the last milestone.

        Args:
            milestones: Times at which a step must end, ascending [D_c/U_av].

        Yields:
            Every accepted step.

        Raises:
            MeshFailure: The liquid could not be remeshed.
            NewtonFailure: Newton's method did not converge with the smallest step.
            InvertedCell: A cell was inverted with the smallest step.
            StepTooSmall: The local error exceeds the tolerance with the smallest step.
        """
        control, drive = self.problem.control, self.problem.drive
        remeshed = False
        for milestone in milestones:
            while not reached(self.history.t[0], milestone):
                t = self.history.t[0]
                if self._due:
                    self._remesh()
                    self._due, remeshed = False, True
                stop = min(milestone, drive.next_kink(t), self.cycles.next_end() if self.cycles else milestone)
                size = land(t, self._dt, stop)
                if self.problem.held:
                    self._hold(size)
                unknown = not self.counts.steps or (control.fixed is not None and remeshed)
                y, h, x, report, error = self._attempt(size, gradually=unknown and not self.history.y)
                self.counts.newton += report.iterations
                self.counts.factorisations += report.factorisations
                valid = report.converged and diagnostics.solid_distortion(self.bodies, h) > 0
                distortion = diagnostics.liquid_distortion(self.scene, x) if valid else 0.0
                if valid and distortion > 0 and control.accepts(error):
                    remeshed = False
                    yield self._accept(size, y, h, x, report, error, distortion)
                    continue
                self.counts.rejected += 1
                if valid and distortion > 0:
                    self._dt = min(control.next(size, size, error), 0.7 * size)
                elif not remeshed and self.history.y:
                    self._remesh()
                    remeshed = True
                elif control.fixed is not None:
                    self._give_up(t, report, False, error)
                else:
                    self._dt = size / 3
                if self._dt < control.smallest:
                    self._give_up(t, report, valid and distortion > 0, error)

    def _accept(
        self, size: float, y: Array, h: Array, x: Array, report: Report, error: float, distortion: float
    ) -> Step:
        """Accept a step: estimate the errors of its solution, and choose the size of the next step.

        Args:
            size: Size of the step.
            y: The solution, shape (n_y,).
            h: Positions of the material in it, shape (n_h,).
            x: Its full vector, shape (n,).
            report: Report of Newton's method.
            error: Local error in units of the tolerance; 0 if it is unknown.
            distortion: Smallest ratio of a liquid cell's current to its reference Jacobian.
        """
        t = self.history.t[0] + size
        before, U_m = self.history.t[0], self._frame_velocity(t)
        self.counts.steps += 1
        without_particles = self.pipe(t).gradient * self.problem.length
        observation = diagnostics.observe(self.scene, self.constraints, y, h, x, without_particles)
        scheme, free = Scheme.bdf(self.history.t, t), self.problem.room(observation.d.tolist())
        gradient = self.pipe(t).gradient
        solution = Solution(self.scene, self.constraints, y, h, x, g=scheme.g, free=free, gradient=gradient)
        corrections = self._estimated(t, U_m, solution, observation)
        frame = float(np.dot(scheme.weights, self.history.frame)) + scheme.g * U_m
        self.history.push(t, h, x, y, frame)
        self.gaps = tuple(map(float, observation.d))
        self._U_m = float(observation.U.mean()) if observation.U.size else 0.0
        if self.problem.drive.varies and abs(flow := self.scene.flow) > SLOW * self.problem.drive.largest:
            self._per_flow = self._U_m / flow
        self._dt = self.problem.control.next(self._dt, size, error)
        self._due = needs_mesh(distortion, observation.d, self.scene.reference.geometry.gaps)
        known = self.problem.dU_error or (self.problem.from_steady and not self.problem.drive.varies)
        goals = (IN_TIME if known else (dU,)) if observation.dU.size else ()
        discrete = {goal: goal.value(solution, observation) for goal in goals}
        # Without `dU_error` nothing is added: from a quasi-steady state half-widths follow from the error at the start.
        signed = corrections or {goal: np.zeros_like(values) for goal, values in discrete.items()}
        mesh, closer = self.counts.remeshings, float(np.max(self.problem.gaps / observation.d, initial=1.0))
        irregular = self._error.irregular if self._error is not None else {}
        step = Step(
            t=t,
            dt=size,
            error=error,
            report=report,
            observation=observation,
            distortion=distortion,
            scene=self.scene,
            mesh_id=mesh,
            x=x,
            h=h,
            velocity=self.constraints.M @ y,
            z=diagnostics.centres(self.bodies, h) + frame,
            corrections=corrections,
            half_widths=self.run_errors.add(
                t, mesh, discrete, signed if known else None, observation.s_jump, closer, irregular
            ),
        )
        self.extremes.add(step)
        if self.cycles is not None:
            half_width = step.half_widths.get(dU, self.run_errors[dU].steps.largest)
            added = np.diff(step.U) - observation.dU if corrections else 0.0
            self.cycles.add(t, observation.d, step.dU, added, half_width)
        if reached(t, self.problem.drive.next_kink(before)):
            self._pass_kink(t)
        return step

    def _pass_kink(self, t: float) -> None:
        """Begin again with first-order steps after a time at which the flow jumps or has a kink."""
        problem, past, waveform = self.problem, self.history, self.problem.drive.waveform
        if waveform is not None and waveform.after(t) == waveform.at(t) and len(past.t) > 1:
            distances = [diagnostics.gaps(self.bodies, h) for h in past.h[:2]]
            self._rate = (distances[0] - distances[1]) / (past.t[0] - past.t[1])
        else:
            self._rate = np.zeros(len(problem.gaps))
        if (control := problem.control).fixed is None:
            self._dt = min(self._dt, max(problem.first_step, self._longest_first_step(t)), control.largest)
        self._begin_again()
        self.run_errors.begin_again(t)
        if self._error is not None:
            self._error.errors.forget_all_but_last()
        if self.cycles is not None:
            self.cycles.begin_again()

    def _longest_first_step(self, t: float) -> float:
        """Largest size of the first step after a kink, which is of first order [D_c/U_av].

        The error of its velocities is half the step times their rate of change: the rate before the kink, and a bound
        on what the kink adds to it. This error is to be the tolerance. After a jump, or with fewer than three values in
        the history, the rate is not known, and 0 is returned.
        """
        past, waveform = self.history, self.problem.drive.waveform
        assert waveform is not None, "a constant flow has no kinks"
        if waveform.after(t) != waveform.at(t) or len(past.t) < 3:
            return 0.0
        (a, b, c), rate = past.t, abs(waveform.slope_after(t) - waveform.slope(t))
        weights = 2 / ((a - b) * (a - c)), -2 / ((a - b) * (b - c)), 2 / ((a - c) * (b - c))
        size = self._size_of(np.asarray(sum(w * h for w, h in zip(weights, past.h, strict=True))))
        for field in self.problem.liquid.fields:
            if field.step_weight:
                off = sum(w * self.scene.liquid.nodal(field.name, x) for w, x in zip(weights, past.x, strict=True))
                size = max(size, field.step_weight * float(np.sqrt(np.mean(np.asarray(off) ** 2))))
        return 2 * self.problem.control.tolerance / max(size + 2 * rate, NO_ERROR)

    def _estimated(self, t: float, U_m: float, solution: Solution, observation: Observation) -> dict[Goal, Array]:
        """Estimated exact minus discrete values of goals after a step, (k,) each; NaN once they diverge.

        The dictionary is empty if errors are not to be estimated.
        """
        if not self.problem.dU_error:
            return {}
        if self._error is None:
            return {goal: np.full_like(goal.value(solution, observation), np.nan) for goal in IN_TIME}
        found = self._error.advance(self.newton, self.history, t, U_m, solution, observation)
        if any(np.isnan(each).any() for each in found.values()):
            self._error = None
        return found

    def _give_up(self, t: float, report: Report, valid: bool, error: float) -> None:
        at, fixed, kept = at_step(t, self.counts.steps), self.problem.control.fixed, Message("")
        if fixed is not None:
            kept = Message("the step time.fixed_step = {} failed at t = {}: ", f"{fixed:g}", TIME(t, "g"))
        advice = "a smaller time.fixed_step, or automatic steps without it" if kept else "a larger mesh.Np"
        if not report.converged:
            advice += "" if kept else " or a smaller time.first_step"
            raise NewtonFailure(kept + report.reason, at=at, advice=advice)
        if not valid:
            raise InvertedCell(kept + "a cell was inverted", at=at, advice=advice)
        message = f"the local error is {error:.2g} times the tolerance at the smallest step"
        raise StepTooSmall(message, at=at, advice="a larger time.tol")
