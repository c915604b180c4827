"""`pairsim mesh`: the mesh with which a case would begin, as other programs read it."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest
import pyvista
import yaml
from support.commands import Pairsim
from vtkmodules.vtkIOXdmf2 import vtkXdmfReader

import pairsim as api
from pairsim.computing.first_mesh import first_mesh
from pairsim.fem.meshes.geometry import MeshSettings, Reference
from pairsim.fem.meshes.meshing import liquid_mesh
from pairsim.fem.meshes.six_node_mesh import SixNodeMesh
from pairsim.record.mesh_files import FORMATS, NamedMesh
from pairsim.runtime.errors import MeshFailure

CELLS = {"Np": 10}
PAIR: dict[str, Any] = {"beta": [0.4, 0.3], "De": 0, "Ca_e": 0.1, "d0": 0.1, "length": 4, "mesh": CELLS}
BEADS: dict[str, Any] = {"beta": 0.4, "De": 0, "Ca_e": 0.01, "mesh": CELLS}
CURVE = BEADS | {"d": [0.1, 0.3, 0.2]}
FIRST: dict[str, tuple[str, dict[str, Any]]] = {
    "run": ("run", PAIR),
    "run from a steady state": ("run", PAIR | {"start": "steady"}),
    "curve": ("curve", CURVE),
    "curve of three": ("curve", CURVE | {"particles": 3, "d": [[0.1, 0.2], [0.3, 0.4]]}),
    "curve from rest": ("curve", CURVE | {"after": 1}),
    "critical": ("critical", BEADS | {"d": [0.1, 0.5], "along": {"Ca_e": [0.01]}}),
    "focus": ("focus", BEADS | {"particles": 2, "along": {"d": [0.1, 0.3]}}),
    "shape": ("shape", BEADS | {"particles": 1, "along": [0.01, 0.02]}),
    "pressure": ("pressure", BEADS | {"particles": 1, "along": [0.02]}),
}


def area(points: np.ndarray, cells: np.ndarray) -> float:
    """Of six-node triangles: their Jacobians are of degree 2, for which the rule of the mid-sides is exact."""
    return float(SixNodeMesh(points[:, :2], cells).jacobians[:, 3:6].sum() / 6)


def length(points: np.ndarray, sides: np.ndarray) -> float:
    """Of sides, straight from their ends to their middles."""
    return float(sum(np.linalg.norm(points[sides[:, 2]] - points[sides[:, end]], axis=1).sum() for end in (0, 1)))


def parts(path: Path) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Nodes and named parts of a file, as meshio reads them."""
    mesh = meshio.read(path)
    cells = {block.type: block.data for block in mesh.cells}
    if mesh.field_data:
        numbers = {name: int(tag) for name, (tag, _) in mesh.field_data.items()}
        dimensions = {name: int(dimension) for name, (_, dimension) in mesh.field_data.items()}
        of = {2: "triangle6", 1: "line3"}
        tags = mesh.cell_data_dict["gmsh:physical"]
        return mesh.points, {
            name: cells[of[dimensions[name]]][tags[of[dimensions[name]]] == number] for name, number in numbers.items()
        }
    if not mesh.cell_sets:
        (key,) = mesh.cell_data
        names, values = key.split("-"), mesh.cell_data_dict[key]
        sets = {name: [values[block.type] == i for block in mesh.cells] for i, name in enumerate(names)}
    else:
        sets = mesh.cell_sets
    found = {name: [block.data[at] for block, at in zip(mesh.cells, each, strict=True)] for name, each in sets.items()}
    return mesh.points, {name: next(each for each in blocks if len(each)) for name, blocks in found.items()}


@pytest.mark.parametrize("ending", [ending for ending in FORMATS if ending != ".xdmf"])
def test_regions_and_boundaries_have_names_and_the_sizes_of_spheres_and_tube(
    ending: str, tmp_path: Path, pairsim: Pairsim
) -> None:
    (tmp_path / "case.yaml").write_text(yaml.safe_dump(PAIR))
    done = pairsim("mesh", "case.yaml", "-o", f"new/pair{ending}")
    assert done.returncode == 0, done.stderr
    assert done.stdout == f"new/pair{ending}\n"
    assert "`pairsim run` would begin with this mesh; triangles: liquid" in done.stderr
    points, found = parts(tmp_path / f"new/pair{ending}")
    names = {"liquid", "particle_1", "particle_2", "wall", "inlet", "outlet", "axis", "surface_1", "surface_2"}
    assert set(found) == names
    areas = {name: area(points, cells) for name, cells in found.items() if cells.shape[1] == 6}
    for number, beta in enumerate(PAIR["beta"], 1):
        assert areas[f"particle_{number}"] == pytest.approx(math.pi * beta**2 / 8, rel=1e-4)
        assert length(points, found[f"surface_{number}"]) == pytest.approx(math.pi * beta / 2, rel=1e-2)
    assert sum(areas.values()) == pytest.approx(4 / 2, rel=1e-12)
    lengths = {name: length(points, found[name]) for name in ("wall", "axis", "inlet", "outlet")}
    assert lengths == pytest.approx({"wall": 4, "axis": 4, "inlet": 0.5, "outlet": 0.5}, rel=1e-12)
    assert len(np.unique(np.round(points, 9), axis=0)) == len(points), "liquid and particles have nodes in common"
    assert points[found["surface_1"]][..., 0].max() < points[found["surface_2"]][..., 0].min(), "from upstream"


def test_viewers_open_it(tmp_path: Path, pairsim: Pairsim) -> None:
    (tmp_path / "case.yaml").write_text(yaml.safe_dump(PAIR))
    for ending in (".vtu", ".vtk", ".xdmf"):
        assert pairsim("mesh", "case.yaml", "-o", f"pair{ending}").returncode == 0
    reader = vtkXdmfReader()
    reader.SetFileName(str(tmp_path / "pair.xdmf"))
    reader.Update()
    grids = [pyvista.read(tmp_path / f"pair{ending}") for ending in (".vtu", ".vtk")]
    for grid in (*grids, pyvista.wrap(reader.GetOutputDataObject(0))):
        assert set(grid.celltypes) == {pyvista.CellType.QUADRATIC_EDGE, pyvista.CellType.QUADRATIC_TRIANGLE}
        (name,) = grid.cell_data
        assert name.startswith("liquid-particle_1-particle_2-wall-")
        assert set(grid.cell_data[name]) == set(range(9))
    assert sorted(path.name for path in tmp_path.iterdir()) == ["case.yaml", "pair.vtk", "pair.vtu", "pair.xdmf"]


def test_fenicsx_reads_the_names(tmp_path: Path) -> None:
    from pairsim.runtime.fenicsx import MPI  # isort: skip
    from dolfinx.io import gmsh

    (tmp_path / "pair.msh").write_bytes(first_mesh(api.load(PAIR)).content(".msh"))
    groups = gmsh.read_from_msh(tmp_path / "pair.msh", MPI.COMM_SELF, gdim=2).physical_groups
    assert {"liquid", "particle_1", "wall", "axis", "surface_2"} <= set(groups)


@pytest.mark.parametrize("name", FIRST)
def test_it_is_the_mesh_with_which_the_computation_begins(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    kind, keys = FIRST[name]
    made: list[SixNodeMesh] = []

    def generate(reference: Reference, settings: MeshSettings) -> SixNodeMesh:
        if not made:
            made.append(liquid_mesh(reference, settings))
        raise MeshFailure("the first mesh is enough")

    case = api.load(keys, kind=kind)
    found = first_mesh(case)
    monkeypatch.setattr("pairsim.solvers.meshed_scene.liquid_mesh", generate)
    getattr(api, kind)(case)
    assert np.array_equal(found.points[: len(made[0].points)], made[0].points)
    assert np.array_equal(found.regions["liquid"], made[0].cells)


def areas_of(mesh: NamedMesh) -> dict[str, float]:
    return {name: area(mesh.points, cells) for name, cells in mesh.regions.items()}


def test_of_a_train_it_is_one_period() -> None:
    mesh = first_mesh(api.load(BEADS | {"d": 0.2}, kind="train"))
    assert np.ptp(mesh.points[:, 0]) == pytest.approx(0.6)
    assert areas_of(mesh)["particle_1"] == pytest.approx(math.pi * 0.4**2 / 8, rel=1e-4)


def test_a_rigid_particle_has_a_surface_and_no_cells() -> None:
    mesh = first_mesh(api.load(PAIR | {"Ca_e": [0, 0.1]}))
    assert list(mesh.regions) == ["liquid", "particle_2"]
    assert {"surface_1", "surface_2"} <= set(mesh.boundaries)
    assert areas_of(mesh)["liquid"] == pytest.approx(4 / 2 - math.pi * (0.4**2 + 0.3**2) / 8, rel=1e-4)
    ends = mesh.points[mesh.boundaries["axis"][:, :2]][..., 0]
    assert np.abs(np.diff(ends)).sum() == pytest.approx(4 - 0.4)


def test_lengths_are_in_um_where_the_case_has_a_physical_block(tmp_path: Path, pairsim: Pairsim) -> None:
    block = {"tube": "50 um", "particle": "20 um", "modulus": "5 kPa", "distance": "5 um", "end": "50 ms"}
    block |= {"viscosity": "1 Pa.s", "flow_rate": "1 ul/min"}
    (tmp_path / "case.yaml").write_text(yaml.safe_dump({"physical": block, "mesh": CELLS}))
    radii = {}
    for option in ("", "--dimensionless"):
        done = pairsim("mesh", "case.yaml", "-o", "pair.vtu", "--kind", "run", "--overwrite", *option.split())
        assert done.stderr.endswith("in D_c\n" if option else "in um\n")
        radii[option] = meshio.read(tmp_path / "pair.vtu").points[:, 1].max()
    assert radii == pytest.approx({"": 25, "--dimensionless": 0.5})


def test_files_of_two_commands_are_told_apart_by_what_one_of_them_allows(tmp_path: Path, pairsim: Pairsim) -> None:
    """`along` is a key of `critical`, too, which needs a pair."""
    case = {"beta": 0.4, "De": 0, "particles": 1, "along": {"Ca_e": [0.01, 0.02]}, "Ca_e": 0.01, "mesh": CELLS}
    (tmp_path / "bead.yaml").write_text(yaml.safe_dump(case))
    done = pairsim("mesh", "bead.yaml", "-o", "bead.vtu")
    assert done.returncode == 0
    assert "`pairsim focus` would begin with this mesh" in done.stderr
    assert api.load(case).kind == "focus"
    assert api.load({**case, "particles": 2}).kind == "critical"
    (tmp_path / "bead.yaml").write_text(yaml.safe_dump({**case, "beta": 2}))
    done = pairsim("mesh", "bead.yaml", "-o", "bead.vtu", "--overwrite")
    assert (done.returncode, "beta" in done.stderr) == (2, True)


def test_what_cannot_be_written_is_refused(tmp_path: Path, pairsim: Pairsim) -> None:
    (tmp_path / "case.yaml").write_text(yaml.safe_dump(CURVE))
    (tmp_path / "curve.msh").touch()
    for words, says in (
        ("-o curve.stl", "-o: got 'curve.stl'; must end in .msh or .vtu or .vtk or .xdmf or .inp"),
        ("-o curve.msh", "the file exists; use --overwrite"),
        ("-o curve.vtu --physical", "must be a case with a physical block"),
        ("-o curve.vtu --kind run", "must be a file for `pairsim run`"),
        ("-o curve.vtu --set beta=2", "beta"),
    ):
        done = pairsim("mesh", "case.yaml", *words.split())
        assert done.returncode == 2
        assert says in done.stderr
    assert sorted(path.name for path in tmp_path.iterdir()) == ["case.yaml", "curve.msh"]
    done = pairsim("mesh", "case.yaml", "-o", "curve.msh", "--overwrite", "--set", "mesh.Np=8")
    assert (
        "`pairsim curve` would begin with this mesh (--kind critical or focus or stream or train for another command)"
        in done.stderr
    )
    assert (tmp_path / "curve.msh").stat().st_size
