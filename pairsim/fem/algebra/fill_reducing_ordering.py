"""Fill-reducing order of elimination: nested dissection on the graph of mesh nodes.

Unknowns of one node have nearly the same neighbours. The graph of nodes is several times smaller than that of the
unknowns, which METIS would have to compress first.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse

from pairsim.fem.algebra.constraints import Constraints
from pairsim.fem.scene import Scene
from pairsim.runtime.arrays import Indices
from pairsim.runtime.fenicsx import PETSc
from pairsim.runtime.signals import sigterm_waits

# Fraction of the nodes: an unknown connected to more than this, such as a multiplier or the velocity of a rigid
# particle, is eliminated last; chosen.
DENSE = 0.05


def dependence_on_unknowns(constraints: Constraints) -> sparse.csr_matrix:
    """Pattern of the dependence of the full vector on the free unknowns, shape (n, n_y)."""
    return sparse.csr_matrix(abs(constraints.N) + abs(constraints.C @ constraints.M))


def node_of_unknowns(scene: Scene, dependence: sparse.csr_matrix) -> Indices:
    """Node of every free unknown, numbered over all phases; -1 if it does not belong to a node; shape (n_y,)."""
    node_of = np.full(scene.size, -1)
    first = 0
    for phase, offset in zip(scene.phases, scene.offsets, strict=False):
        node_of[offset : offset + phase.size] = first + phase.nodes
        first += len(phase.six_node_mesh.points)
    by_unknown = sparse.csc_matrix(dependence)
    by_unknown.sort_indices()
    count = np.diff(by_unknown.indptr)
    found = np.full(dependence.shape[1], -1)
    some = np.flatnonzero((count > 0) & (count < DENSE * first))
    found[some] = node_of[by_unknown.indices[by_unknown.indptr[some]]]
    return found


def fill_reducing_ordering(scene: Scene, constraints: Constraints) -> Indices | None:
    """Free unknowns in the order in which they are eliminated, shape (n_y,).

    None if PETSc was built without METIS.
    """
    dependence = dependence_on_unknowns(constraints)
    node = node_of_unknowns(scene, dependence)
    used, group = np.unique(node[node >= 0], return_inverse=True)
    unknowns = np.flatnonzero(node >= 0)
    members = sparse.csr_matrix((np.ones(len(unknowns)), (unknowns, group)), shape=(constraints.size, len(used)))
    touched = []
    for phase, offset in zip(scene.phases, scene.offsets, strict=False):
        cells = phase.cell_jacobian().dofs
        pointer = np.arange(len(cells) + 1) * cells.shape[1]
        incidence = sparse.csr_matrix(
            (np.ones(cells.size), cells.ravel() + offset, pointer), shape=(len(cells), scene.size)
        )
        touched.append(sparse.csr_matrix(incidence @ (dependence @ members)))
    touch = sparse.vstack(touched, format="csr")
    graph = sparse.csr_matrix(touch.T @ touch)
    graph.sort_indices()
    matrix = PETSc.Mat().createAIJ(
        graph.shape,
        csr=(graph.indptr.astype(PETSc.IntType), graph.indices.astype(PETSc.IntType), graph.data),
        comm=PETSc.COMM_SELF,
    )
    try:
        with sigterm_waits():
            rows, columns = matrix.getOrdering("metisnd")
    except PETSc.Error:
        return None
    finally:
        matrix.destroy()
    rank = np.empty(len(used), dtype=np.int64)
    rank[rows.getIndices()] = np.arange(len(used))
    rows.destroy()
    columns.destroy()
    last = np.full(constraints.size, len(used))
    last[unknowns] = rank[group]
    return np.argsort(last, kind="stable")
