"""State of a time integration: accepted values of the last steps, and the mesh."""

from __future__ import annotations

from dataclasses import dataclass, field

from pairsim.fem.meshes.geometry import Reference
from pairsim.fem.meshes.six_node_mesh import SixNodeMesh
from pairsim.runtime.arrays import Array
from pairsim.solvers.nonlinear.renewal import MatrixState


@dataclass
class Counts:
    """Counters of the work of a run."""

    steps: int = 0
    rejected: int = 0
    newton: int = 0
    factorisations: int = 0
    remeshings: int = 0


@dataclass
class History:
    """Accepted values of the last steps, newest first. Lists and arrays are replaced, never changed in place.

    Attributes:
        t: Times of h and x, at most three [D_c/U_av].
        h: Positions of the material, shape (n_h,) each.
        x: Full vectors, shape (n,) each.
        y: Free unknowns on the present mesh, at most four, shape (n_y,) each; extrapolated for the next first guess.
        t_y: Times of y.
    """

    t: list[float] = field(default_factory=list)
    h: list[Array] = field(default_factory=list)
    x: list[Array] = field(default_factory=list)
    y: list[Array] = field(default_factory=list)
    t_y: list[float] = field(default_factory=list)

    def push(self, t: float, h: Array, x: Array, y: Array) -> None:
        self.t, self.h, self.x = [t, *self.t[:2]], [h, *self.h[:2]], [x, *self.x[:2]]
        self.t_y, self.y = [t, *self.t_y[:3]], [y, *self.y[:3]]


@dataclass
class Errors(History):
    """Estimated exact minus discrete values of the last steps.

    Attributes:
        U: Estimates of the velocities of the particles at the last steps, at most two, shape (N,) each [U_av].
        imbalance: What imbalance of momentum after the last remeshing has in the velocities of the error equation
            [U_av], shape (N,).
        start: Half-width of the error of dU in the state that the run started from [U_av], shape (N-1,); h, x and U do
            not contain it.
    """

    U: list[Array] = field(default_factory=list)
    imbalance: Array | float = 0.0
    start: Array | float = 0.0


@dataclass(frozen=True)
class State:
    """State of a time integration after an accepted step, from which it can be continued.

    Attributes:
        history: Accepted values of the last steps.
        reference: Reference domain of the liquid.
        mesh: Mesh of the reference domain.
        inside: Meshes of the particles, None for a rigid one.
        dt: Size of the next step [D_c/U_av].
        U_m: Velocity of the frame in the next step [U_av].
        matrix_state: Matrix that the solver reuses in the next step, None if the next step assembles one.
        due: Whether the liquid is remeshed before the next step.
        counts: Work since the start of the run.
        seconds: Wall time since the start of the run by phase of the computation [s].
        errors: Estimated exact minus discrete values of the last steps, None if they are not estimated.
    """

    history: History
    reference: Reference
    mesh: SixNodeMesh
    inside: tuple[SixNodeMesh | None, ...]
    dt: float
    U_m: float
    matrix_state: MatrixState | None
    due: bool
    counts: Counts
    seconds: dict[str, float]
    errors: Errors | None = None

    @property
    def start_error(self) -> Array | float:
        """Half-width of the error of dU in the state that the run started from; 0 if it is not estimated."""
        return 0.0 if self.errors is None else self.errors.start
