"""What a march in time depends on: accepted values and the mesh that they are on."""

from __future__ import annotations

from dataclasses import dataclass, field

from pairsim.fem.geometry import Reference
from pairsim.fem.six_node_mesh import SixNodeMesh
from pairsim.runtime.arrays import Array
from pairsim.solvers.matrix_state import MatrixState


@dataclass
class Counts:
    """What a run took."""

    steps: int = 0
    rejected: int = 0
    newton: int = 0
    factorisations: int = 0
    remeshings: int = 0


@dataclass
class History:
    """Accepted values, newest first; the lists and arrays are replaced, never changed in place.

    Attributes:
        t: Times of h and x.
        h: Positions of the material.
        x: Full vectors.
        y: Free unknowns, on the present mesh only, up to four: the next guess extrapolates them.
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


@dataclass(frozen=True)
class State:
    """A march after an accepted step.

    Attributes:
        history: Accepted values.
        reference, mesh: The reference domain of the liquid and its mesh.
        inside: Meshes of the particles, None for a rigid one.
        dt: Size that the next step is to have.
        U_m: Velocity of the frame.
        matrix_state: The solver's matrix, None where the next step makes its own.
        due: Whether a new mesh comes first.
        counts: What the march took so far.
        seconds: Seconds by phase of the work.
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
