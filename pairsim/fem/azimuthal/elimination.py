"""Order of elimination of a disturbed scene's unknowns: nested dissection on the graph of mesh nodes.

As in `pairsim.fem.algebra.fill_reducing_ordering` for axisymmetric scenes, all unknowns of a node are eliminated one
after the other. The graph of nodes is many times smaller than that of the unknowns.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse

from pairsim.fem.algebra.fill_reducing_ordering import DENSE
from pairsim.fem.azimuthal.scene import DisturbedScene
from pairsim.runtime.arrays import Indices
from pairsim.runtime.fenicsx import PETSc
from pairsim.runtime.signals import sigterm_waits


def elimination_order(scene: DisturbedScene) -> Indices | None:
    """Free unknowns in the order in which they are eliminated, shape (n_y,); None if PETSc was built without METIS."""
    node = node_of_unknowns(scene)
    used, group = np.unique(node[node >= 0], return_inverse=True)
    unknowns = np.flatnonzero(node >= 0)
    members = sparse.csr_matrix((np.ones(len(unknowns)), (unknowns, group)), shape=(len(node), len(used)))
    matrix = scene.matrix
    coupled = sparse.csr_matrix((np.ones(matrix.nnz), matrix.indices, matrix.indptr), shape=matrix.shape)
    graph = sparse.csr_matrix(members.T @ (coupled @ members))
    rank = _nested_dissection(sparse.csr_matrix(graph + graph.T))
    if rank is None:
        return None
    last = np.full(len(node), len(used))
    last[unknowns] = rank[group]
    return np.argsort(last, kind="stable")


def node_of_unknowns(scene: DisturbedScene) -> Indices:
    """Node, numbered over all phases, of every free unknown; -1 for motions of particles, shape (n_y,)."""
    nodes, first = [], 0
    for phase in scene.phases:
        numbering = phase.numbering
        nodes += [first + np.repeat(numbering.carriers(f.name), f.components) for f in numbering.fields]
        first += len(phase.mesh.points)
    dependence = sparse.csc_matrix(scene.constraints.N)
    many = np.diff(dependence.indptr) >= DENSE * first
    # Factors of 1/2 are those of mesh nodes displaced by the mean of two vertices, to which the unknowns belong.
    dependence.data = np.where(np.abs(dependence.data) > 0.5, 1.0, 0.0)
    dependence.eliminate_zeros()
    dependence.sort_indices()
    found = np.full(dependence.shape[1], -1)
    own = np.flatnonzero(~many & (np.diff(dependence.indptr) > 0))
    found[own] = np.concatenate(nodes)[dependence.indices[dependence.indptr[own]]]
    return found


def _nested_dissection(graph: sparse.csr_matrix) -> Indices | None:
    """Position of each node of a symmetric graph in the order of elimination; None without METIS."""
    graph.sort_indices()
    csr = graph.indptr.astype(PETSc.IntType), graph.indices.astype(PETSc.IntType), graph.data
    matrix = PETSc.Mat().createAIJ(graph.shape, csr=csr, comm=PETSc.COMM_SELF)
    try:
        with sigterm_waits():
            rows, columns = matrix.getOrdering("metisnd")
    except PETSc.Error:
        return None
    finally:
        matrix.destroy()
    rank = np.empty(graph.shape[0], dtype=np.int64)
    rank[rows.getIndices()] = np.arange(graph.shape[0])
    rows.destroy()
    columns.destroy()
    return rank
