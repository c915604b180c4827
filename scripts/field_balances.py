"""Balances of mass, force and energy on written fields, without pairsim: numpy and meshio alone.

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
from collections.abc import Callable
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import yaml

type Array = np.ndarray[Any, Any]

# Gauss points of degree 7 on the triangle by collapsed coordinates.
LINE, WEIGHT = np.polynomial.legendre.leggauss(5)
SLICES = 9  # slices of tube whose flow rates are compared


def points() -> tuple[Array, Array]:
    """Points (q, 2) and weights (q,) of quadrature on the reference triangle."""
    s, w = (LINE + 1) / 2, WEIGHT / 2
    x, y = np.meshgrid(s, s, indexing="ij")
    return np.column_stack([(x * (1 - y)).ravel(), y.ravel()]), (np.outer(w, w) * (1 - y)).ravel()


def shapes(at: Array) -> tuple[Array, Array]:
    """Quadratic shape functions (q, 6) and their derivatives (q, 6, 2); corners first, then the sides 01, 12, 20."""
    x, y = at.T
    z, zero, one = 1 - x - y, np.zeros_like(x), np.ones_like(x)
    values = [z * (2 * z - 1), x * (2 * x - 1), y * (2 * y - 1), 4 * x * z, 4 * x * y, 4 * y * z]
    by_x = [1 - 4 * z, 4 * x - 1, zero, 4 * (z - x), 4 * y, -4 * y]
    by_y = [1 - 4 * z, zero, 4 * y - 1, -4 * x, 4 * x, 4 * (z - y)]
    return np.stack(values, 1), np.stack([np.stack(by_x, 1), np.stack(by_y, 1)], 2) * one[:, None, None]


class Fields:
    """Fields of one phase at the points of quadrature.

    Attributes:
        z, r: Places, (cells, q).
        volume: Weights of integrals over the volume, (cells, q).
        u: Velocity, (cells, q, 2).
        L: Its gradient with the hoop rate, components zz, zr, rz, rr, tt, (cells, q, 5).
        p: Pressure, (cells, q).
    """

    def __init__(self, position: Array, cells: Array, data: dict[str, Array]) -> None:
        at, weight = points()
        N, dN = shapes(at)
        x = position[:, :2][cells]
        self.z, self.r = (np.einsum("qa,ma->mq", N, x[..., k]) for k in (0, 1))
        J = np.einsum("qak,mai->mqik", dN, x)
        self.volume = 2 * np.pi * self.r * np.abs(np.linalg.det(J)) * weight
        gradient = np.einsum("qak,mqki->mqai", dN, np.linalg.inv(J))
        velocity = data["velocity"][:, :2][cells]
        self.u = np.einsum("qa,mai->mqi", N, velocity)
        L = np.einsum("mqak,mai->mqik", gradient, velocity)
        self.L = np.stack([L[..., 0, 0], L[..., 0, 1], L[..., 1, 0], L[..., 1, 1], self.u[..., 1] / self.r], axis=-1)
        self.p = np.einsum("qa,ma->mq", N, data["pressure"][cells])
        self._N, self._cells, self._data = N, cells, data

    def nodal(self, name: str) -> Array:
        """A stress with components zz, zr, rr, tt at the points, (cells, q, 4); zero if it was not written."""
        if f"{name}_zz" not in self._data:
            return np.zeros((*self.p.shape, 4))
        values = [
            np.einsum("qa,ma->mq", self._N, self._data[f"{name}_{k}"][self._cells]) for k in ("zz", "zr", "rr", "tt")
        ]
        return np.stack(values, axis=-1)

    def power(self, sigma: Array) -> float:
        """int sigma : grad u for a stress with components zz, zr, rr, tt."""
        zz, zr, rz, rr, tt = np.moveaxis(self.L, -1, 0)
        density = sigma[..., 0] * zz + sigma[..., 1] * (zr + rz) + sigma[..., 2] * rr + sigma[..., 3] * tt
        return float(np.sum(self.volume * density))


def total_stress(phase: Fields, solvent: float) -> Array:
    """-p I + solvent (grad u + grad u^T) + tau, components zz, zr, rr, tt."""
    zz, zr, rz, rr, tt = np.moveaxis(phase.L, -1, 0)
    rates = np.stack([2 * zz, zr + rz, 2 * rr, 2 * tt], axis=-1)
    isotropic = np.array([1.0, 0.0, 1.0, 1.0])
    return solvent * rates + phase.nodal("tau_p") + phase.nodal("tau_s") - phase.p[..., None] * isotropic


def step(x: Array) -> tuple[Array, Array]:
    """A function that rises smoothly from 0 at 0 to 1 at 1, with three derivatives, and its derivative."""
    t = np.clip(x, 0.0, 1.0)
    return t**4 * (35 - 84 * t + 70 * t**2 - 20 * t**3), 140 * t**3 * (1 - t) ** 3


def outlines(position: Array, cells: Array, soft: list[Array]) -> list[tuple[float, float, float]]:
    """Extents (least z, largest z, largest r) of the particles from upstream."""
    if soft:
        found = [position[np.unique(each)] for each in soft]
    else:
        sides = np.sort(np.concatenate([cells[:, [0, 1]], cells[:, [1, 2]], cells[:, [2, 0]]]), axis=1)
        unique, count = np.unique(sides, axis=0, return_counts=True)
        edge = unique[count == 1]
        middle = position[edge].mean(axis=1)
        ends = position[:, 0].min() + 1e-6, position[:, 0].max() - 1e-6
        inside = (
            (middle[:, 1] > 1e-6) & (middle[:, 1] < 0.5 - 1e-6) & (middle[:, 0] > ends[0]) & (middle[:, 0] < ends[1])
        )
        nodes = position[np.unique(edge[inside])]
        nodes = nodes[np.argsort(nodes[:, 0])]
        on_axis = nodes[nodes[:, 1] < 1e-9][:, 0].reshape(-1, 2)
        found = [nodes[(nodes[:, 0] >= a - 1e-9) & (nodes[:, 0] <= b + 1e-9)] for a, b in on_axis]
    return sorted((float(x[:, 0].min()), float(x[:, 0].max()), float(x[:, 1].max())) for x in found)


def forces(liquid: Fields, sigma: Array, extents: list[tuple[float, float, float]]) -> list[float]:
    """The force from outside along the tube on every particle."""
    result = []
    length = liquid.z.min(), liquid.z.max()
    for k, (start, stop, width) in enumerate(extents):
        before = extents[k - 1][1] if k else max(start - 1.0, length[0] + 0.1)
        after = extents[k + 1][0] if k + 1 < len(extents) else min(stop + 1.0, length[1] - 0.1)
        rise, rising = step((liquid.z - before) / (start - before))
        fall, falling = step((liquid.z - stop) / (after - stop))
        across, sinking = step((liquid.r - width) / (0.49 - width))
        by_z = (rising / (start - before) * (1 - fall) - rise * falling / (after - stop)) * (1 - across)
        by_r = -rise * (1 - fall) * sinking / (0.49 - width)
        result.append(float(np.sum(liquid.volume * (sigma[..., 0] * by_z + sigma[..., 1] * by_r))))
    return result


def flow_rates(phases: list[Fields]) -> list[float]:
    """Flow rates through slices of tube, each averaged with a smooth weight."""
    start, stop = min(p.z.min() for p in phases), max(p.z.max() for p in phases)
    width = (stop - start) / SLICES
    rates = []
    for k in range(SLICES):
        weighted = [np.sum(p.volume * p.u[..., 0] * step((p.z - start - k * width) / width)[1]) / width for p in phases]
        rates.append(float(sum(weighted)))
    return rates


def frame(position: Array, cells: Array, region: Array, data: dict[str, Array], case: dict[str, Any]) -> dict[str, Any]:
    """The balances of one frame."""
    each = [cells[region == k] for k in range(int(region.max()) + 1)]
    liquid, *particles = (Fields(position, part, data) for part in each)
    sigma = total_stress(liquid, case["xi"] if case["De"] else 1.0)
    solid = [total_stress(p, 0.0) for p in particles]
    return {
        "flow_rates": flow_rates([liquid, *particles]),
        "volumes": [float(p.volume.sum()) for p in particles],
        "forces": forces(liquid, sigma, outlines(position, each[0], each[1:])),
        "liquid_power": liquid.power(sigma),
        "particles_power": sum(p.power(s) for p, s in zip(particles, solid, strict=True)),
    }


def read(folder: Path, use: Callable[..., dict[str, Any]]) -> list[dict[str, Any]]:
    """Apply a function to every frame."""
    case, found = yaml.safe_load((folder / "case.yaml").read_text()), []
    with meshio.xdmf.TimeSeriesReader(folder / "fields.xdmf") as file:
        _, cells = file.read_points_cells()
        for k in range(file.num_steps):
            t, data, by_cell = file.read_data(k)
            found.append({"t": t} | use(data["position"], cells[0].data, by_cell["region"][0], data, case))
    return found


if __name__ == "__main__":
    print(json.dumps(read(Path(sys.argv[1]), frame)))
