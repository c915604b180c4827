"""The data of a frame of fields.xdmf that can be drawn: the surfaces of particles, and fields."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.sparse import coo_array
from scipy.sparse.csgraph import depth_first_order

from pairsim.physics import declared
from pairsim.physics.material import LawField
from pairsim.quantities.kinds import PURE, STRESS, VELOCITY, Kind
from pairsim.record.xdmf import TENSOR, FieldFrame
from pairsim.runtime.arrays import Array, Indices
from pairsim.runtime.errors import Argument, InputError

SAME_END = 1e-9  # z of nodes at an end of the tube [D_c]
EDGES = [(0, 1, 3), (1, 2, 4), (2, 0, 5)]  # corners and mid-node of the edges of a cell (VTK's order)
ON_AXIS = 1e-8
PIECES = 6  # number of straight pieces as which an edge of a cell is drawn


def surface_nodes(frame: FieldFrame) -> list[Indices]:
    """The nodes of the liquid's cells on each particle, corners and mid-nodes in turn, (2k + 1,), from upstream.

    They are taken from the cells of the liquid, as rigid particles have no cells of their own.
    """
    cells, (z, r) = frame.cells[frame.region == 0], frame.points.T
    edges = np.vstack([cells[:, edge] for edge in EDGES])
    _, first, count = np.unique(np.sort(edges[:, :2], axis=1), axis=0, return_index=True, return_counts=True)
    edges = edges[first[count == 1]]
    edges = edges[(r[edges] > ON_AXIS).any(axis=1)]
    a, b, middle = edges.T
    # Halves of edges form paths: the surface of each particle from pole to pole, and wall and ends of the tube in one.
    halves, n = (np.concatenate([a, middle]), np.concatenate([middle, b])), len(r)
    graph = coo_array((np.ones(2 * len(edges)), halves), shape=(n, n)).tocsr()
    poles = np.flatnonzero(np.bincount(np.concatenate(halves), minlength=n) == 1)
    paths = [depth_first_order(graph, pole, directed=False, return_predecessors=False) for pole in poles]
    inner = [path for path in paths if r[path].max() < (1 - 1e-6) * r.max() and z[path[0]] <= z[path[-1]]]
    return sorted((path.astype(np.int64) for path in inner), key=lambda path: float(z[path].mean()))


def outlines(frame: FieldFrame) -> list[Array]:
    """The surface of each particle from one pole to the other, from upstream: polylines (k, 2)."""
    s = np.linspace(0, 1, PIECES + 1)[:-1]
    shapes = np.stack([(1 - s) * (1 - 2 * s), s * (2 * s - 1), 4 * s * (1 - s)], axis=-1)  # of both ends, middle
    found = []
    for path in surface_nodes(frame):
        arc = frame.points[np.stack([path[:-2:2], path[2::2], path[1::2]], axis=1)]
        found.append(np.vstack([np.einsum("sa,mai->msi", shapes, arc).reshape(-1, 2), arc[-1, 1]]))
    return found


@dataclass(frozen=True)
class Field:
    """A field that can be drawn."""

    symbol: str  # its symbol (TeX)
    unit: Kind  # its unit in fields.xdmf
    values: Callable[[FieldFrame], Array]  # at the nodes (n,), from a frame
    liquid: str  # the field of fields.xdmf without which the liquid stays blank
    solid: str = ""  # likewise for the particles; "" if they have no such field
    diverging: bool = True  # whether colours are centred on zero

    def there(self, frame: FieldFrame) -> bool:
        """Whether a frame has the data for it, in the liquid or in the particles."""
        return self.liquid in frame.point_data or self.solid in frame.point_data


def axial_velocity(frame: FieldFrame) -> Array:
    """u_z at the nodes."""
    return frame.point_data["velocity"][:, 0]


def particle_velocity(frame: FieldFrame) -> float:
    """Mean axial velocity of the particles' surfaces; 0 without particles."""
    nodes = surface_nodes(frame)
    return float(np.mean([axial_velocity(frame)[path].mean() for path in nodes])) if nodes else 0.0


def velocity_without_particles(frame: FieldFrame) -> Array:
    """The axial velocity at the end of the tube, at the radii of all nodes."""
    z, r = frame.points.T
    end = np.flatnonzero(z < z.min() + SAME_END)
    radii, first = np.unique(r[end].round(9), return_index=True)
    return np.asarray(CubicSpline(radii, axial_velocity(frame)[end[first]])(r))


def stress(frame: FieldFrame, component: str) -> Array:
    """A component of the polymer's stress in the liquid and of the elastic one in particles; each is zero elsewhere."""
    parts = [frame.point_data[name] for name in ("tau_p", "tau_s") if name in frame.point_data]
    return np.asarray(sum(part[:, TENSOR.index(component)] for part in parts))


def _stored(name: str) -> Callable[[FieldFrame], Array]:
    return lambda frame: frame.point_data[name]


def _of_law(name: str, field: LawField) -> Field:
    """A field that a law adds; if it has a level, its difference from this, with values cut off at twice the level."""
    if (level := field.level) is None:
        return Field(field.symbol, PURE, _stored(name), name, diverging=False)
    return Field(f"{field.symbol} - {level:g}", PURE, lambda f: np.minimum(f.point_data[name], 2 * level) - level, name)


FIELDS: dict[str, Field] = {
    "velocity": Field(r"u_z", VELOCITY, axial_velocity, "velocity", "tau_s", diverging=False),
    "streamlines": Field(r"u_z - U", VELOCITY, lambda f: axial_velocity(f) - particle_velocity(f), "velocity"),
    "tr_c": Field(r"\mathrm{tr}\,c", PURE, _stored("tr_c"), "tr_c", diverging=False),
    "N1": Field(r"\tau_{zz} - \tau_{rr}", STRESS, lambda f: stress(f, "zz") - stress(f, "rr"), "tau_p", "tau_s"),
    "tau_zz": Field(r"\tau_{zz}", STRESS, lambda f: stress(f, "zz"), "tau_p", "tau_s"),
    "pressure": Field(r"p", STRESS, _stored("pressure"), "pressure", diverging=False),
    "velocity_extra": Field(
        r"u_z - u_{z\infty}", VELOCITY, lambda f: axial_velocity(f) - velocity_without_particles(f), "velocity"
    ),
    "tau_zz_extra": Field(r"\tau_{zz} - \tau_{zz\infty}", STRESS, _stored("tau_p_zz_extra"), "tau_p_zz_extra"),
    "pressure_extra": Field(r"p - p_\infty", STRESS, _stored("pressure_extra"), "pressure_extra"),
    **{name: _of_law(name, field) for name, field in declared.FIELDS.items()},
}
"""The fields by the names that `pairsim plot --field` takes."""


def chosen_fields(words: str, frame: FieldFrame, where: str) -> list[str]:
    """The names of fields in words separated by commas, or "all" for those that a frame has; messages name its file.

    Raises:
        InputError: A name is unknown, or the frame does not have that field.
    """
    there = [name for name, entry in FIELDS.items() if entry.there(frame)]
    names = there if words == "all" else list(dict.fromkeys(name.strip() for name in words.split(",")))
    for name in names:
        if name not in FIELDS:
            raise InputError(Argument("field"), "", name, f"must be one or more of {', '.join(FIELDS)}, or all")
        if name not in there:
            raise InputError(Argument("field"), "", name, f"must be one of {', '.join(there)}, which {where} has")
    return names
