"""Three-dimensional flow around a rigid bead off the axis of a tube: plain DOLFINx and gmsh, nothing of pairsim.

Half of the tube is filled with tetrahedra whose bead is displaced by x. In a Newtonian liquid the lateral velocity of
the bead is zero; in a Giesekus liquid it is, per displacement, what `pairsim focus` calls at_rest. The conformation in
the Newtonian flow gives the limit of a second-order liquid, by the reciprocal theorem.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from math import nan
from pathlib import Path

import numpy as np
from mpi4py import MPI  # noqa: F401  # ahead of modules that are compiled with it

# isort: split
from studies.focus_3d.conformation import ACCURATELY, REDUCTION, Conformation, Developed, Giesekus
from studies.focus_3d.mesh import Array, Sizes, displacement, half_tube
from studies.focus_3d.stokes import Places, Stokes, places_in

TOLERANCE = 2e-5  # of the lateral velocity from one step to the next, of its own size; chosen
LARGEST_CHANGE = 1e-4  # of the velocity [U_av]; chosen
MOST_STEPS = 150
DEPTH = 12  # steps that Anderson's method remembers; chosen


class Anderson:
    """Anderson's acceleration of x = G(x)."""

    def __init__(self) -> None:
        self._x, self._f = deque[Array](maxlen=DEPTH), deque[Array](maxlen=DEPTH)

    def next(self, x: Array, image: Array) -> Array:
        """The next x after its image G(x)."""
        self._x.append(x)
        self._f.append(image - x)
        if len(self._x) == 1:
            return image
        dF, dX = (np.diff(np.array(each), axis=0).T for each in (self._f, self._x))
        share, *_ = np.linalg.lstsq(dF, self._f[-1], rcond=1e-8)
        return np.asarray(image - (dX + dF) @ share)


@dataclass(frozen=True)
class State:
    """A steady flow.

    Attributes:
        x: Unknowns of the flow.
        motion: Lateral velocity, velocity along the tube and rotation of the bead.
        c: Unknowns of the conformation.
        limit: Lateral velocity over De that the stress in the Newtonian flow causes, per displacement; NaN where the
            iteration began elsewhere.
    """

    x: Array
    motion: Array
    c: Array
    limit: float = nan


def steady(stokes: Stokes, law: Giesekus, developed: Developed, start: State | None) -> State:
    """The steady flow of a Giesekus liquid, from that at another De, or from the Newtonian one.

    Raises:
        RuntimeError: It is not found.
    """
    problem = Conformation(stokes, law)
    at_rest = np.zeros(len(stokes.fixed_values))
    x, motion = stokes.free(at_rest) if start is None else (start.x, start.motion)
    problem.c.x.array[:] = np.tile([1.0, 0, 0, 1, 0, 1], len(problem.c.x.array) // 6) if start is None else start.c
    problem.at_ends(developed)
    problem.flow(x, motion[1])
    problem.renew()
    accelerated, limit = Anderson(), nan
    for step in range(1, MOST_STEPS + 1):
        problem.flow(x, motion[1])
        problem.solve(ACCURATELY if step == 1 and start is None else REDUCTION)
        image, moved = stokes.free(problem.load())
        if step == 1 and start is None:
            limit = float(moved[0] / law.De / stokes.centre)
        velocity, other = (each[stokes.of_velocity] for each in (x, image))
        change, lateral = float(np.abs(other - velocity).max()), abs(moved[0] / motion[0] - 1)
        if lateral < TOLERANCE and change < LARGEST_CHANGE:
            return State(image, moved, problem.c.x.array.copy(), limit)
        state = accelerated.next(np.append(velocity, motion), np.append(other, moved))
        x, motion = image, state[-3:]
        x[stokes.of_velocity] = state[:-3]
    raise RuntimeError(f"no steady flow within {MOST_STEPS} steps")


@contextmanager
def flow_around(sizes: Sizes, centre: float) -> Iterator[Stokes]:
    """The flow around a bead that is displaced so far."""
    mesh = half_tube(sizes)
    places: Places = places_in(mesh, sizes.bead, sizes.half_length)
    mesh.geometry.x[:, 0] += centre * displacement(mesh.geometry.x, sizes.bead)
    stokes = Stokes(mesh, places, centre, lambda r: 2 * (1 - 4 * r**2))
    try:
        yield stokes
    finally:
        stokes.close()


def newtonian(sizes: Sizes, centre: float) -> dict[str, float]:
    """Motion and resistances of a bead in a Newtonian liquid."""
    with flow_around(sizes, centre) as stokes:
        _, (V, U, Omega) = stokes.free(np.zeros(len(stokes.fixed_values)))
        lateral, torque = stokes.drag
    return {"V": float(V / centre), "U": float(U), "rotation": float(Omega / centre), "drag": lateral, "torque": torque}


def giesekus(sizes: Sizes, centre: float, ladder: Sequence[float], files: Sequence[Path]) -> dict[str, float]:
    """Motion of a bead in a Giesekus liquid.

    Args:
        sizes: Of the mesh.
        centre: Displacement of the bead.
        ladder: De from the first one, which is found from the Newtonian flow, to the wanted one.
        files: Files for the flow at each of them; one that is there is not computed again.
    """
    found = None
    with flow_around(sizes, centre) as stokes:
        for De, file in zip(ladder, files, strict=True):
            law = Giesekus(De)
            if file.exists():
                with np.load(file) as kept:
                    found = State(kept["x"], kept["motion"], kept["c"], float(kept["limit"]))
                continue
            developed = Developed(law)
            stokes.develop(developed.velocity)
            found = steady(stokes, law, developed, found)
            file.parent.mkdir(parents=True, exist_ok=True)
            np.savez(file, x=found.x, motion=found.motion, c=found.c, limit=found.limit)
    assert found is not None
    V, U, Omega = found.motion
    limit = {"limit": found.limit} if len(ladder) == 1 else {}
    return {"V": float(V / centre), "U": float(U), "rotation": float(Omega / centre), **limit}
