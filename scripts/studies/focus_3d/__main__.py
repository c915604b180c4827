"""Three-dimensional flow around a rigid bead off the axis of a tube: plain DOLFINx and gmsh, nothing of pairsim.

usage, in scripts: python -m studies.focus_3d [--near H] [--growth G] [--far H] [--half-length L] [--beta B]
    [--De DE,DE,...] [--at X,X,...]

Half of the tube is filled with six-node-sided tetrahedra whose bead is displaced by X along x. Printed are: in a
Newtonian liquid the lateral velocity of the bead (zero), its velocity, rotation and resistances; then, of a Giesekus
liquid with each De in turn, the same velocities in its steady flow, as lateral velocity per displacement what `pairsim
focus` calls at_rest. A first De that is small gives, after one step, the limit of a second-order liquid: the
conformation in the Newtonian flow, and by the reciprocal theorem the velocity that follows from its stress.
"""

from __future__ import annotations

import argparse
import time
from collections import deque
from typing import Any

import numpy as np
from mpi4py import MPI  # noqa: F401  # ahead of modules that are compiled with it

# isort: split
from .conformation import ACCURATELY, REDUCTION, Conformation, Developed, Giesekus
from .mesh import Array, Sizes, displacement, half_tube
from .stokes import Places, Stokes, places_in

TOLERANCE = 2e-5  # of the lateral velocity from one step to the next, of its own size; chosen
LARGEST_CHANGE = 1e-4  # of the velocity [U_av]; chosen
MOST_STEPS = 150
DEPTH = 12  # steps that Anderson's method remembers; chosen
START = time.monotonic()


def say(text: str) -> None:
    """Print with the seconds since the start."""
    print(f"{time.monotonic() - START:7.0f} s  {text}", flush=True)


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


def steady(stokes: Stokes, law: Giesekus, developed: Developed, start: tuple[Any, ...] | None) -> tuple[Any, ...]:
    """The steady flow of a Giesekus liquid, from the flow, motion and conformation at a start."""
    problem = Conformation(stokes, law)
    at_rest = np.zeros(len(stokes.fixed_values))
    x, motion = stokes.free(at_rest) if start is None else start[:2]
    problem.c.x.array[:] = np.tile([1.0, 0, 0, 1, 0, 1], len(problem.c.x.array) // 6) if start is None else start[2]
    problem.at_ends(developed)
    problem.flow(x, motion[1])
    problem.renew()
    accelerated = Anderson()
    for step in range(1, MOST_STEPS + 1):
        problem.flow(x, motion[1])
        iterations = problem.solve(ACCURATELY if step == 1 and start is None else REDUCTION)
        image, moved = stokes.free(problem.load())
        if step == 1 and start is None:
            limit = moved[0] / law.De / stokes.centre
            say(f"  De {law.De:g}: V/(De x) of the stress in the Newtonian flow {limit:.5f}")
        velocity, other = (each[stokes.of_velocity] for each in (x, image))
        change, lateral = float(np.abs(other - velocity).max()), abs(moved[0] / motion[0] - 1)
        say(f"  {step:3d}  V/x {moved[0] / stokes.centre:.6f}  change {change:.1e}  GMRES {iterations}")
        if lateral < TOLERANCE and change < LARGEST_CHANGE:
            return image, moved, problem.c.x.array.copy()
        state = accelerated.next(np.append(velocity, motion), np.append(other, moved))
        x, motion = image, state[-3:]
        x[stokes.of_velocity] = state[:-3]
    raise RuntimeError(f"no steady flow within {MOST_STEPS} steps")


def numbers(text: str) -> list[float]:
    """Numbers between commas."""
    return [float(each) for each in text.split(",") if each]


def main() -> None:
    """Compute what is asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name, value in (("near", 0.05), ("growth", 0.15), ("far", 0.14), ("half-length", 1.7), ("beta", 0.4)):
        parser.add_argument(f"--{name}", type=float, default=value)
    parser.add_argument("--De", type=numbers, default=[0.01, 0.1, 0.2, 0.3, 0.4, 0.5])
    parser.add_argument("--at", type=numbers, default=[0.05])
    given = parser.parse_args()
    sizes = Sizes(given.beta / 2, given.half_length, given.near, given.growth, given.far)
    say(f"{sizes}")
    for centre in given.at:
        mesh = half_tube(sizes)
        places: Places = places_in(mesh, sizes.bead, sizes.half_length)
        mesh.geometry.x[:, 0] += centre * displacement(mesh.geometry.x, sizes.bead)
        cells = mesh.topology.index_map(3).size_local
        stokes = Stokes(mesh, places, centre, lambda r: 2 * (1 - 4 * r**2))
        say(f"x = {centre}: {cells} cells, {len(stokes.fixed_values)} unknowns of the flow")
        _, (V, U, Omega) = stokes.free(np.zeros(len(stokes.fixed_values)))
        lateral, rotation = stokes.drag
        say(f"Newtonian: V {V:.2e}  U {U:.5f}  Omega/x {Omega / centre:.4f}  drag {lateral:.4f}  torque {rotation:.4f}")
        found = None
        for De in given.De:
            law = Giesekus(De)
            developed = Developed(law)
            stokes.develop(developed.velocity)
            found = steady(stokes, law, developed, found)
            V, U, Omega = found[1]
            say(f"De {De:g}: V/x {V / centre:.5f}  U {U:.5f}  Omega/x {Omega / centre:.4f}")
        stokes.close()


if __name__ == "__main__":
    main()
