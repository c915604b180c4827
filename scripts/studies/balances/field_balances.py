"""Balances of mass, force and energy on written fields, without pairsim: numpy, scipy, meshio and ruamel.yaml alone.

usage: field_balances.py FOLDER

Reads fields.xdmf and case.yaml of a folder of `pairsim run` or `pairsim curve`, integrates the fields of each frame
over the six-node triangles, and prints JSON, one entry a frame.

Mass: the flow rate through cross-sections, averaged over slices of tube with a smooth weight, particles included if
they are soft; and the volumes of soft particles. Force: with a smooth v that is 1 on a particle and 0 on the wall, the
ends and the other particles, int sigma : grad(v e_z) over the liquid is the force along the tube that must act on the
particle from outside. Energy: what the pressure drop and the forces put in is what liquid and particles take up,
int sigma : grad u.
"""

from __future__ import annotations

import json
import sys
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import meshio
import numpy as np
from ruamel.yaml import YAML
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.stats import beta

type Array = np.ndarray[Any, Any]

SLICES = 9  # slices of tube whose flow rates are compared
SIDES = ((0, 1, 3), (1, 2, 4), (2, 0, 5))  # nodes of the sides of a six-node triangle: both ends and the middle
COMPONENTS = {"zz": [(0, 0)], "zr": [(0, 1), (1, 0)], "rr": [(1, 1)], "tt": [(2, 2)]}  # of the stresses in the file


class Extent(NamedTuple):
    """Least z, largest z and largest r of a particle."""

    start: float
    stop: float
    width: float


def element() -> tuple[Array, Array, Array]:
    """The six-node triangle: shape functions (6, q), their derivatives (6, 2, q) and weights (q,) of quadrature.

    The points are those of Gauss on a square that is collapsed onto the triangle.
    """
    line, weight = np.polynomial.legendre.leggauss(5)
    s, t = np.meshgrid((line + 1) / 2, (line + 1) / 2)
    a = np.stack([1 - t - s * (1 - t), s * (1 - t), t]).reshape(3, -1)  # barycentric coordinates
    da = np.array([[-1.0, -1.0], [1.0, 0.0], [0.0, 1.0]])[..., None]
    b, db = np.roll(a, -1, axis=0), np.roll(da, -1, axis=0)  # those of the next corner
    N, dN = [a * (2 * a - 1), 4 * a * b], [(4 * a - 1)[:, None] * da, 4 * (a[:, None] * db + b[:, None] * da)]
    return np.concatenate(N), np.concatenate(dN), (np.outer(weight, weight) * (1 - t)).ravel() / 4


class Phase:
    """Fields of the liquid or of one particle at the points of quadrature; components by z, r and the hoop.

    Attributes:
        z, r: Places, (cells, q).
        volume: Weights of integrals over the volume, (cells, q).
        u_z: Velocity along the tube, (cells, q).
        grad_u: Gradient of the velocity, (3, 3, cells, q).
        sigma: Stress -p I + solvent (grad u + grad u^T) + tau, (3, 3, cells, q).
    """

    def __init__(self, cells: Array, data: dict[str, Array], solvent: float) -> None:
        N, dN, weight = element()

        def at_points(name: str) -> Array:
            return np.einsum("aq,ma...->...mq", N, data[name][cells])

        self.z, self.r, _ = at_points("position")
        self.u_z, u_r, _ = at_points("velocity")
        J = np.einsum("ajq,mai->mqij", dN, data["position"][cells, :2])
        self.volume = 2 * np.pi * self.r * np.abs(np.linalg.det(J)) * weight
        self.grad_u = np.zeros((3, 3, *self.z.shape))
        self.grad_u[:2, :2] = np.einsum("akq,mqkj,mai->ijmq", dN, np.linalg.inv(J), data["velocity"][cells, :2])
        self.grad_u[2, 2] = u_r / self.r
        self.sigma = solvent * (self.grad_u + self.grad_u.swapaxes(0, 1))
        self.sigma -= np.multiply.outer(np.eye(3), at_points("pressure"))
        for component, places in COMPONENTS.items():
            for name in {f"tau_p_{component}", f"tau_s_{component}"} & data.keys():  # of polymer and elastic solid
                for place in places:
                    self.sigma[place] += at_points(name)

    def power(self) -> float:
        """int sigma : grad u."""
        return float(np.einsum("mq,ijmq,ijmq", self.volume, self.sigma, self.grad_u))


def step(start: float, stop: float) -> Any:
    """A distribution whose cdf rises from 0 to 1 between two places, with three derivatives."""
    return beta(4, 4, loc=start, scale=stop - start)


def particles_in(position: Array, liquid: Array) -> list[Extent]:
    """Extents of the particles, from upstream: of the connected parts of the liquid's boundary inside the tube."""
    sides = liquid[:, SIDES].reshape(-1, 3)
    z, r, _ = position[sides[:, 2]].T
    inside = (r > 1e-6) & (r < 0.5 - 1e-6) & (z > position[:, 0].min() + 1e-6) & (z < position[:, 0].max() - 1e-6)
    outer = np.bincount(sides[:, 2])[sides[:, 2]] == 1  # sides of one cell alone
    surface = sides[inside & outer]
    joined = coo_array((np.ones(len(surface)), surface[:, :2].T), shape=(len(position), len(position)))
    part = connected_components(joined, directed=False)[1][surface[:, 0]]
    outlines = [position[surface[part == k]] for k in np.unique(part)]
    return sorted(Extent(float(x[..., 0].min()), float(x[..., 0].max()), float(x[..., 1].max())) for x in outlines)


def forces(liquid: Phase, particles: list[Extent]) -> list[float]:
    """The force from outside along the tube on every particle, with v = rise(z) (1 - fall(z)) (1 - sink(r))."""
    z, r = liquid.z, liquid.r
    upstream = [max(particles[0].start - 1.0, z.min() + 0.1), *(each.stop for each in particles[:-1])]
    downstream = [*(each.start for each in particles[1:]), min(particles[-1].stop + 1.0, z.max() - 0.1)]
    result = []
    for start, particle, stop in zip(upstream, particles, downstream, strict=True):
        rise, fall, sink = step(start, particle.start), step(particle.stop, stop), step(particle.width, 0.49)
        by_z = (rise.pdf(z) * fall.sf(z) - rise.cdf(z) * fall.pdf(z)) * sink.sf(r)
        by_r = -rise.cdf(z) * fall.sf(z) * sink.pdf(r)
        result.append(float(np.sum(liquid.volume * (liquid.sigma[0, 0] * by_z + liquid.sigma[0, 1] * by_r))))
    return result


def flow_rates(phases: list[Phase]) -> list[float]:
    """Flow rates through slices of tube, each averaged with a smooth weight."""
    ends = np.linspace(min(p.z.min() for p in phases), max(p.z.max() for p in phases), SLICES + 1)
    weights = [step(start, stop) for start, stop in pairwise(ends)]
    return [float(sum(np.sum(p.volume * p.u_z * weight.pdf(p.z)) for p in phases)) for weight in weights]


def balances(cells: Array, region: Array, data: dict[str, Array], solvent: float) -> dict[str, Any]:
    """The balances of one frame; region 0 is the liquid, the others are soft particles."""
    liquid = Phase(cells[region == 0], data, solvent)
    soft = [Phase(cells[region == k], data, 0.0) for k in np.unique(region)[1:]]
    return {
        "flow_rates": flow_rates([liquid, *soft]),
        "volumes": [float(p.volume.sum()) for p in soft],
        "forces": forces(liquid, particles_in(data["position"], cells[region == 0])),
        "liquid_power": liquid.power(),
        "particles_power": sum(p.power() for p in soft),
    }


def main(folder: Path) -> None:
    """Print the balances of every frame."""
    case, frames = YAML(typ="safe", pure=True).load(folder / "case.yaml"), []
    solvent = case["xi"] if case["De"] else 1.0
    with meshio.xdmf.TimeSeriesReader(folder / "fields.xdmf") as file:
        _, (cells,) = file.read_points_cells()
        for k in range(file.num_steps):
            t, data, by_cell = file.read_data(k)
            frames.append({"t": t} | balances(cells.data, by_cell["region"][0], data, solvent))
    print(json.dumps(frames))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
