"""The state of a run after an accepted step, from which it can be continued."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from pairsim.fem.meshes.geometry import Reference
from pairsim.fem.meshes.six_node_mesh import SixNodeMesh
from pairsim.runtime.arrays import Array
from pairsim.solvers.errors.run_errors import RunErrors
from pairsim.solvers.stepping.history import ErrorHistory, History
from pairsim.solvers.stepping.step import Step
from pairsim.solvers.transient.cycles import Cycles


@dataclass
class Counts:
    """Counters of the work that a run has taken."""

    steps: int = 0
    rejected: int = 0
    newton: int = 0
    factorisations: int = 0
    remeshings: int = 0


@dataclass
class Extremes:
    """Extreme values over a run, from which it is judged whether cells were small and the tube long enough.

    Attributes:
        s_jump: Largest change of s = log c within a cell.
        span: Largest sum of the diameters and distances of all particles [D_c].
        narrowest: A distance and the longer one of the adjacent arcs [D_c], where their ratio was smallest.
    """

    s_jump: float = 0.0
    span: float = 0.0
    narrowest: tuple[float, float] = (1.0, 0.0)

    def add(self, step: Step) -> None:
        """Add an accepted step."""
        reference, d = step.scene.reference, step.observation.d
        self.s_jump = max(self.s_jump, step.observation.s_jump)
        self.span = max(self.span, sum(reference.geometry.betas) + float(d.sum()))
        for gap, (upstream, downstream) in zip(map(float, d), pairwise(reference.outlines), strict=True):
            arc = max(upstream.size_at(0.0), downstream.size_at(float(np.pi)))
            self.narrowest = max(self.narrowest, (gap, arc), key=lambda each: each[1] / each[0])


@dataclass(frozen=True)
class State:
    """State of a time integration after an accepted step.

    Attributes:
        history: Accepted values of the last steps.
        reference: Reference domain of the liquid.
        mesh: Mesh of the reference domain.
        inside: Meshes of the particles, None for rigid ones.
        dt: Size of the next step [D_c/U_av].
        U_m: Velocity of the frame in the next step [U_av].
        due: Whether the liquid is remeshed before the next step.
        counts: Work since the start of the run.
        seconds: Wall time since the start of the run, by phase of the computation [s].
        origin: Positions h of the material at t = 0 [D_c], shape (n_h,).
        gaps: Distances between the particles [D_c], N-1 values.
        run_errors: Errors of goals up to this step.
        extremes: Extreme values up to this step.
        error_history: Estimated exact minus discrete values of the last steps; None if they are not estimated.
        cycles: Changes of the distances over the cycles of a flow that varies; None if it does not.
        per_flow: Ratio of the velocity of the frame to the flow, with which the frame follows a flow that varies.
    """

    history: History
    reference: Reference
    mesh: SixNodeMesh
    inside: tuple[SixNodeMesh | None, ...]
    dt: float
    U_m: float
    due: bool
    counts: Counts
    seconds: dict[str, float]
    origin: Array
    gaps: tuple[float, ...]
    run_errors: RunErrors
    extremes: Extremes = field(default_factory=Extremes)
    error_history: ErrorHistory | None = None
    cycles: Cycles | None = None
    per_flow: float = 0.0
