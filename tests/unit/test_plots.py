"""Pictures of a run: they exist, are not blank, and show the deformed particles."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import yaml
from matplotlib import image
from support.field_samples import scene
from support.pictures import colours

from pairsim.results.columns import named_row, series_columns
from pairsim.results.meridional_section import outlines, tessellate
from pairsim.results.output import SeriesWriter
from pairsim.results.run_plots import GREY, plot_run
from pairsim.results.xdmf import FieldFrame, FieldsWriter
from pairsim.runtime.errors import InputError

PAIR = [(-0.3, 0.22, 0.19), (0.3, 0.21, 0.2)]


def make_run(folder: Path, n: int, frames: list[FieldFrame], rows: int = 12) -> Path:
    folder.mkdir()
    case = {"name": "sample", "beta": 0.4, "De": 0, "Ca_e": [0.1] * n, "d0": 0.1}
    (folder / "case.yaml").write_text(yaml.safe_dump(case))
    with SeriesWriter(folder / "series.csv", [*series_columns(n), "dt"]) as series:
        for t in np.linspace(0.1, 1, rows):
            gaps, order = np.full(max(n - 1, 0), 0.1 + 0.1 * t), np.arange(n)
            U = 1.5 + 0.01 * order * t
            row = named_row(t, gaps, U, np.diff(U), 0.01 * t * (order + 1), 640.0, 2.0)
            series.row(row | {"dt": 0.1})
    writer = FieldsWriter(folder)
    for frame in frames:
        writer.write(frame)
    return folder


CASES = {
    "pipe": (0, [scene(0.5, [])]),
    "single": (1, [scene(0.1, [(0.0, 0.2, 0.2)]), scene(0.5, [(0.2, 0.23, 0.19)], mesh_id=1)]),
    "pair": (2, [scene(0.1, PAIR), scene(0.5, PAIR, mesh_id=1)]),
    "pair of quadrilaterals": (2, [scene(0.1, PAIR, kind=9)]),
    "rigid pair": (2, [scene(0.1, PAIR, rigid=True)]),
    "three": (3, [scene(0.1, [(-0.6, 0.2, 0.2), (0.0, 0.2, 0.2), (0.6, 0.2, 0.2)])]),
}


@pytest.mark.parametrize("name", CASES)
def test_pictures_are_drawn_and_not_blank(tmp_path: Path, name: str) -> None:
    n, frames = CASES[name]
    folder = make_run(tmp_path / "run", n, frames)
    files = plot_run(folder, tmp_path / "pictures")
    assert [file.relative_to(tmp_path) for file in files] == [
        Path("pictures/series.png"), Path("pictures/fields.png"),
    ]  # fmt: skip
    assert colours(files[0]) > 50
    assert colours(files[1]) > 500


def test_rigid_particles_are_drawn_to_scale(tmp_path: Path) -> None:
    """The grey pixels of two ellipses reach as far along the tube as across it as the ellipses do."""
    folder = make_run(tmp_path / "run", *CASES["rigid pair"])
    grey = np.all(np.abs(image.imread(plot_run(folder)[1])[..., :3] - float(GREY)) < 0.003, axis=2)
    along, across = (np.ptp(np.flatnonzero(grey.sum(axis=i) > 10)) for i in (0, 1))
    (z_0, a_0, b_0), (z_1, a_1, b_1) = PAIR
    assert along / across == pytest.approx((z_1 + a_1 - z_0 + a_0) / (2 * max(b_0, b_1)), rel=0.02)


def test_run_without_fields_has_a_series_and_one_row_is_enough(tmp_path: Path) -> None:
    folder = make_run(tmp_path / "run", 2, [], rows=1)
    assert plot_run(folder) == [folder / "series.png"]


def test_folder_that_is_not_a_run_is_an_input_error(tmp_path: Path) -> None:
    for folder in (tmp_path, tmp_path / "missing"):
        with pytest.raises(InputError, match="not the folder of a run that has begun"):
            plot_run(folder)
    (tmp_path / "series.csv").write_text("t,dp,dp_plus\n")
    with pytest.raises(InputError, match="no rows"):
        plot_run(tmp_path)
    folder = make_run(tmp_path / "run", 2, [])
    with pytest.raises(InputError, match="-o"):
        plot_run(folder, folder / "case.yaml")


@pytest.mark.parametrize("kind", [6, 9])
@pytest.mark.parametrize("rigid", [False, True])
def test_outlines_are_the_curved_surfaces_from_upstream(kind: int, rigid: bool) -> None:
    found = outlines(scene(0.1, PAIR, kind=kind, rigid=rigid))
    assert len(found) == 2
    for line, (z, a, b) in zip(found, PAIR, strict=True):
        assert line[0] == pytest.approx([z - a, 0], abs=1e-12)
        assert line[-1] == pytest.approx([z + a, 0], abs=1e-12)
        assert np.abs(((line - [z, 0]) / [a, b]) ** 2 @ [1, 1] - 1).max() < 1e-3
        assert np.all(np.diff(line[:, 0]) > 0)


@pytest.mark.parametrize("kind", [6, 9])
def test_tessellation_follows_the_curves_and_keeps_quadratic_values(kind: int) -> None:
    frame = scene(0.1, PAIR, kind=kind)
    surface = tessellate(frame, frame.region == 1, frame.points[:, 0], level=4)
    assert surface.values == pytest.approx(surface.points[:, 0], abs=1e-12)
    a, b, c = (surface.points[surface.triangles[:, i]] for i in range(3))
    (x, y), (u, v) = (b - a).T, (c - a).T
    assert np.abs(x * v - y * u).sum() / 2 == pytest.approx(np.pi * 0.22 * 0.19 / 2, rel=2e-3)
