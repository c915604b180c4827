"""A case with a physical block, from its file to tables with units and travel times."""

from __future__ import annotations

import csv
import json
import re
from pathlib import Path

import numpy as np
import pytest
import yaml
from support.commands import Pairsim

import pairsim as api
from pairsim.results.table_files import read_table

BEADS = "physical: {{tube: 1 mm, particle: 0.4 mm, velocity: 5 mm/s, young: 1.5 kPa, viscosity: 10 Pa.s, {}}}\n"
MESH = "ends: developed\nlength: auto\nmesh: {Np: 20}\n"
RUN = BEADS.format("distance: 90 um, end: 20 s") + MESH + "limits: {max_gap: 0.16}\noutput: {fields: false}\n"
CURVE = BEADS.format("distance: {start: 80 um, stop: 180 um, num: 3}") + MESH


def header_and_rows(text: str) -> tuple[list[str], np.ndarray]:
    header, *rows = csv.reader(text.splitlines())
    return header, np.array(rows, dtype=float)


@pytest.mark.slow
def test_run_and_curve_in_units(tmp_path: Path, pairsim: Pairsim) -> None:
    api.run(yaml.safe_load(RUN), folder=tmp_path / "run").check()
    curve = api.curve(yaml.safe_load(CURVE), folder=tmp_path / "curve").check()

    kept = yaml.safe_load((tmp_path / "run" / "case.yaml").read_text())
    assert kept["physical"] == yaml.safe_load(RUN)["physical"]
    assert (kept["beta"], kept["Ca_e"], kept["d0"], kept["time"]["end"]) == pytest.approx((0.4, 0.1, 0.09, 100))
    scales = json.loads((tmp_path / "run" / "run.json").read_text())["scales"]
    assert scales == {
        **{"length": pytest.approx(1e-3), "time": pytest.approx(0.2), "velocity": pytest.approx(5e-3)},
        **{"stress": pytest.approx(50), "units": "m, s, m/s, Pa"},
    }

    plain, converted = (header_and_rows(pairsim("table", "run", *more).stdout) for more in (["--dimensionless"], []))
    assert plain[0][:5] == ["t [D_c/U_av]", "d [D_c]", "U_L [U_av]", "U_T [U_av]", "dU [U_av]"]
    assert converted[0][:8] == ["t [s]", "d [um]", "U_L [um/s]", "U_T [um/s]", "dU [um/s]", "D_L", "D_T", "dp [Pa]"]
    assert converted[1][:, :8] == pytest.approx(plain[1][:, :8] * [0.2, 1e3, 5e3, 5e3, 5e3, 1, 1, 50])
    assert pairsim("table", "curve", "equilibria", "-o", "zeros.csv").returncode == 0
    assert (tmp_path / "zeros.csv").read_text().startswith("d [um],stable,slope [1/s],peak")

    way = pairsim("travel", "curve", "--from", "110um", "--to", "0.15")
    assert way.returncode == 0, way.stderr
    numbers = re.findall(r"([\d.]+) \+- [\d.]+ (?:D_c/U_av|D_c of|s and|mm of)", way.stdout)
    t, z, seconds, mm = map(float, numbers)
    assert (seconds, mm) == pytest.approx((0.2 * t, z), rel=1e-3)

    # The run passes the same distances after its transient; the meshes with N_p 20 differ by 2 %.
    series, quick = read_table(tmp_path / "run" / "series.csv"), curve.travel(0.11, 0.15)
    grows = slice(int(np.argmin(series["d"])), None)
    U = (series["U_L"] + series["U_T"]) / 2
    moved = np.concatenate([[0.0], np.cumsum(np.diff(series["t"]) * (U[1:] + U[:-1]) / 2)])
    for values, expected in ((series["t"], quick.time), (moved, quick.length)):
        start, stop = np.interp([0.11, 0.15], series["d"][grows], values[grows])
        assert expected == pytest.approx(stop - start, rel=0.02)
