"""The mesh with which the computation of a case begins."""

from __future__ import annotations

import math

import numpy as np

from pairsim.cases.case import SceneCase
from pairsim.cases.run_case import Case
from pairsim.computing.problems import mesh_settings, problem_of, steady_problem
from pairsim.fem.meshes.liquid_nodes import LiquidNodes
from pairsim.fem.meshes.meshing import liquid_mesh
from pairsim.fem.meshes.six_node_mesh import match
from pairsim.record.mesh_files import NamedMesh
from pairsim.runtime.clock import Clock
from pairsim.solvers.meshed_scene import Cells
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.steady.scene import cells_around_spheres
from pairsim.solvers.transient.start import at_rest, steady_scene

ON_AXIS = 1e-12  # distance from the axis below which a node is on it [D_c]
SIDES = [[0, 1, 3], [1, 2, 4], [2, 0, 5]]  # of a six-node triangle: ends, then middle


def first_mesh(case: SceneCase) -> NamedMesh:
    """The mesh of the first distances of a case, before it is adapted to a solution [D_c].

    Liquid and particles share the nodes on the surfaces. A rigid particle has no cells and is therefore not a region;
    its surface is a boundary.

    Raises:
        MeshFailure: A mesh could not be generated.
    """
    first = case.first_case
    cells = _first_cells(first)
    reference, liquid = cells.reference, liquid_mesh(cells.reference, mesh_settings(first))
    nodes = LiquidNodes.find(liquid, reference)
    points, regions = liquid.points, {"liquid": liquid.cells}
    parts = zip(cells.insides, reference.outlines, nodes.interfaces, reference.geometry.centres, strict=True)
    for number, (inside, outline, surface, centre) in enumerate(parts, 1):
        if inside is not None:
            on_surface = match(inside.points, outline.nodes)
            own = np.setdiff1d(np.arange(len(inside.points)), on_surface)
            numbers = np.empty(len(inside.points), dtype=np.int64)
            numbers[on_surface], numbers[own] = surface, len(points) + np.arange(len(own))
            points = np.vstack([points, inside.points[own] + [centre, 0.0]])
            regions[f"particle_{number}"] = numbers[inside.cells]
    boundaries = {
        **{"wall": nodes.wall, "inlet": nodes.inlet, "outlet": nodes.outlet},
        **{"axis": np.flatnonzero(points[:, 1] < ON_AXIS)},
        **{f"surface_{number}": surface for number, surface in enumerate(nodes.interfaces, 1)},
    }
    sides = np.vstack([*regions.values()])[:, SIDES].reshape(-1, 3)
    sides = sides[np.unique(sides[:, 2], return_index=True)[1]]  # each side once, identified by its mid-side node
    return NamedMesh(points, regions, {name: sides[np.isin(sides, on).all(axis=1)] for name, on in boundaries.items()})


def _first_cells(case: SceneCase) -> Cells:
    """Cells around undeformed spheres."""
    if isinstance(case, Case):
        problem = problem_of(case)
        if problem.from_steady:
            return cells_around_spheres(*steady_scene(problem, problem.gaps))
        start = at_rest(problem, Clock())
        return Cells(start.insides, start.reference)
    narrowest = case.range_of_d[0] if case.n > 1 else math.inf
    parameters = Parameters(case.first_gaps, case.solid_models, case.liquid_model)
    return cells_around_spheres(steady_problem(case, narrowest), parameters)
