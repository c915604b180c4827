"""What the first user asked of pairsim, each sentence by name: as typed in a shell, read by other programs."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import meshio
import numpy as np
import pytest
import pyvista
from support.commands import Pairsim
from support.inputs import CONFIGS

CASE = """
beta: 0.4
De: 0
Ca_e: 0.1
d0: 0.1
ends: developed
length: 3
mesh: {Np: 10}
time: {end: 0.1}
"""


def rows(table: Path) -> list[dict[str, str]]:
    with table.open() as file:
        return list(csv.DictReader(file))


@pytest.fixture
def ran(tmp_path: Path, pairsim: Pairsim) -> Path:
    """The folder of `pairsim run case.yaml`."""
    (tmp_path / "case.yaml").write_text(CASE)
    done = pairsim("run", "case.yaml", "-o", "out", "-q")
    assert done.returncode == 0, done.stderr
    return tmp_path / "out"


@pytest.mark.slow
def test_a_yaml_case_of_four_numbers_gives_a_csv_series_of_dU_and_taylor_D(ran: Path) -> None:
    series = rows(ran / "series.csv")
    assert {"t", "d", "dU", "D_L", "D_T"} <= set(series[0])
    assert float(series[-1]["t"]) == 0.1
    assert float(series[-1]["dU"]) != 0
    assert abs(float(series[-1]["D_L"])) > abs(float(series[0]["D_L"]))


@pytest.mark.slow
def test_a_run_writes_xdmf_that_pyvista_and_meshio_open(ran: Path) -> None:
    reader = pyvista.get_reader(ran / "fields.xdmf")
    times = reader.time_values
    assert times == sorted(times)
    assert times[-1] == 0.1
    reader.set_active_time_value(times[-1])
    mesh = reader.read()
    mesh = mesh.combine() if isinstance(mesh, pyvista.MultiBlock) else mesh
    assert np.linalg.norm(mesh.point_data["velocity"], axis=1).max() == pytest.approx(2, rel=0.1)  # that of Poiseuille
    with meshio.xdmf.TimeSeriesReader(str(ran / "fields.xdmf")) as frames:
        frames.read_points_cells()
        assert frames.num_steps == len(times)
        t, point_data, _ = frames.read_data(frames.num_steps - 1)
        assert t == times[-1]
        assert "velocity" in point_data


@pytest.mark.slow
def test_a_sweep_under_mpirun_has_a_row_a_case(tmp_path: Path, pairsim: Pairsim) -> None:
    base = CASE.replace("d0: 0.1\n", "").replace("\n", "\n  ")
    (tmp_path / "grid.yaml").write_text(f"base:{base}\ngrid:\n  d0: [0.1, 0.2, 0.3]\n")
    done = pairsim("sweep", "grid.yaml", "-o", "swept", "-q", ranks=2)
    assert done.returncode == 0, done.stderr
    table = rows(tmp_path / "swept" / "results.csv")
    assert [row["d0"] for row in table] == ["0.1", "0.2", "0.3"]
    assert [row["status"] for row in table] == ["finished"] * 3
    assert all(float(row["dU"]) for row in table)


@pytest.mark.slow
def test_a_study_reports_speed_against_error(tmp_path: Path, pairsim: Pairsim) -> None:
    base = CASE.replace("mesh: {Np: 10}\n", "").replace("\n", "\n  ")
    (tmp_path / "study.yaml").write_text(
        f"base:{base}\nat: [0.1]\ndiscretisations: [{{mesh.Np: 8}}, {{mesh.Np: 11}}, {{mesh.Np: 16}}]\n"
    )
    done = pairsim("study", "study.yaml", "-o", "studied", "-q")
    assert done.returncode == 0, done.stderr
    table = rows(tmp_path / "studied" / "study.csv")
    errors = [float(row["error"]) for row in table if row["error"]]
    assert len(errors) == 2  # the finest mesh is the reference
    assert errors[1] < errors[0]
    assert all(float(row["wall_time"]) > 0 for row in table)


@pytest.mark.slow
@pytest.mark.parametrize("config", CONFIGS, ids=lambda config: config.stem)
def test_smoke_cases_run(config: Path, tmp_path: Path, pairsim: Pairsim) -> None:
    """Each shipped case of `run`, on a coarse mesh for a few steps."""
    short = ("time.end=0.02", "output.times=[]", "mesh.Np=8", "accuracy=5%")
    done = pairsim("run", str(config), "-o", "out", "-q", *(word for setting in short for word in ("--set", setting)))
    assert done.returncode == 0, done.stderr
    assert json.loads((tmp_path / "out" / "run.json").read_text())["status"] == "finished"
