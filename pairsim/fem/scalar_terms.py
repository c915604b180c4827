"""Terms with scalar unknowns in a scene: integrals over the liquid's mesh and its ends, which no form contains.

The scalar unknowns are Lagrange multipliers: m of the zero mean pressure, with periodic ends the pressure drop dp of
the flow rate, and the forces F of prescribed velocities of particles.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import sparse

from pairsim.fem.meshes.liquid_nodes import LiquidNodes
from pairsim.fem.meshes.quadrature import CellQuadrature, end_load
from pairsim.fem.phases.phase import Phase
from pairsim.physics.liquids import Liquid
from pairsim.quantities.scales import FLOW_RATE
from pairsim.runtime.arrays import Array, Indices


@dataclass(frozen=True)
class ScalarTerms:
    """The terms with m, dp and F in the equations of the full vector x, shape (n,).

    Attributes:
        liquid: The liquid, whose unknowns are the first ones of x.
        nodes: The nodes of its mesh on the boundaries.
        size: Number n of entries of x.
        m: Index of the Lagrange multiplier of the zero mean pressure.
        dp: Index of the pressure drop, None unless the ends are periodic.
        F: Indices of the forces that move the particles at the prescribed velocity, shape (N,) or (0,).
    """

    liquid: Phase[Liquid]
    nodes: LiquidNodes
    size: int
    m: int
    dp: int | None
    F: Indices

    @cached_property
    def gauge(self) -> tuple[Indices, Array]:
        """Indices and weights of the integral int p_f 2 pi r dX of the liquid's pressure."""
        vertices = self.liquid.six_node_mesh.vertices
        return self.liquid.index("p", vertices), CellQuadrature(self.liquid.six_node_mesh).p1_load

    def _end(self, name: str, nodes: Indices) -> tuple[Indices, Array]:
        degree = 2 if name == "u" else 1
        chosen = nodes if degree == 2 else nodes[::2]
        load = end_load(self.liquid.six_node_mesh, nodes, degree)
        return self.liquid.index(name, chosen), load if degree == 2 else load[::2]

    @cached_property
    def flow_rate(self) -> tuple[Indices, Array]:
        """Indices and weights of the flow rate int u_z 2 pi r dr through the inlet."""
        return self._end("u", self.nodes.inlet)

    @cached_property
    def drop(self) -> tuple[Indices, Array]:
        """Indices and weights of the mean pressure at the inlet minus that at the outlet (means over the area)."""
        (i, w), (j, v) = self._end("p", self.nodes.inlet), self._end("p", self.nodes.outlet)
        return np.concatenate([i, j]), np.concatenate([w, -v]) / FLOW_RATE

    @cached_property
    def matrix(self) -> sparse.csr_matrix:
        """The terms with scalar unknowns, which are not part of the forms, as a matrix of shape (n, n).

        m int q is added to continuity, and the equation of m is int p_f = 0. With periodic ends dp int_inlet v_z is
        subtracted from momentum (Eq. (9) of the paper), and the equation of dp is the flow rate (Eq. (14)). In a
        reference domain with planes this is the mean of the flow rates through inlet and planes, since discrete flow
        rates depend a little on the particles near a section. The force F on a particle is subtracted from the momentum
        equation at its downstream pole, which the constraints add to those of the whole surface, and the equation of F
        prescribes the velocity of the pole.
        """
        index, weight = self.gauge
        m = np.full(len(index), self.m)
        rows, columns, values = [index, m], [m, index], [weight, weight]
        if self.dp is not None:
            index, weight = self.flow_rate
            dp = np.full(len(index), self.dp)
            rows.append(index)
            columns.append(dp)
            values.append(-weight)
            sections = [(index, weight), *(self._end("u", nodes) for nodes in self.nodes.planes)]
            for index, weight in sections:
                rows.append(dp)
                columns.append(index)
                values.append(-weight / len(sections))
        if len(self.F):
            index = self.liquid.index("u", np.array([at[0] for at in self.nodes.interfaces]), 0)
            rows += [index, self.F]
            columns += [self.F, index]
            values += [-np.ones(len(self.F))] * 2
        entries = np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))
        return sparse.csr_matrix(sparse.coo_matrix(entries, shape=(self.size, self.size)))

    def pressure_drop(self, x: Array) -> float:
        """Pressure drop dp over the length of the tube [eta_0 U_av/D_c]."""
        index, weight = self.drop
        return float(weight @ x[index])
