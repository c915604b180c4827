"""Files of a run: whole or absent, never nan, readable while they grow."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pairsim.errors import InputError, NewtonFailure
from pairsim.output import RunFolder, SeriesWriter, named_row, read_series, series_columns
from pairsim.plots import plot_run
from pairsim.xdmf import FieldFrame, FieldsWriter, read_frame, read_times

TRIANGLE = np.array([[0, 0], [1, 0], [0, 1], [0.5, 0], [0.5, 0.5], [0, 0.5]], dtype=float)


def frame(t: float, mesh_id: int = 0, stretch: float = 1.0) -> FieldFrame:
    points = TRIANGLE * [stretch, 1.0]
    return FieldFrame(t, mesh_id, points, np.arange(6)[None], np.array([1]), {"pressure": points[:, 0] * t})


@pytest.mark.parametrize("n", [0, 1, 2, 3])
def test_rows_fit_their_header(n: int) -> None:
    row = named_row(0.5, np.arange(1, n), np.arange(n) + 1.0, np.zeros(n), 640.0, 0.5)
    assert list(row) == series_columns(n)


def test_differences_are_downstream_minus_upstream() -> None:
    pair = named_row(0.0, [0.1], [1.0, 1.5], [-0.2, 0.3], 1.0, 0.0)
    assert (pair["U_T"], pair["U_L"], pair["dU"], pair["D_T"], pair["D_L"]) == (1.0, 1.5, 0.5, -0.2, 0.3)
    three = named_row(0.0, [0.1, 0.2], [1.0, 1.5, 1.2], [0, 0, 0], 1.0, 0.0)
    assert three["dU_2"] == pytest.approx(-0.3)


def test_series_refuses_nan_and_survives_a_torn_line(tmp_path: Path) -> None:
    path = tmp_path / "series.csv"
    with SeriesWriter(path, ["t", "dU"]) as series:
        series.row({"t": 0.1, "dU": 1 / 3})
        with pytest.raises(ValueError, match="dU is nan"):
            series.row({"t": 0.2, "dU": float("nan")})
        with pytest.raises(ValueError, match="no value for dU"):
            series.row({"t": 0.2})
        assert read_series(path)["dU"][0] == 1 / 3  # on disk already, to the last bit
    path.write_text(path.read_text() + "0.2,0.")
    assert len(read_series(path)["t"]) == 1


def test_folder_replaces_only_its_own_files(tmp_path: Path) -> None:
    folder = RunFolder.create(tmp_path / "run")
    folder.write_json("run.json", {"steps": np.int64(3), "d": np.array([0.1])})
    (folder.path / "mine.txt").write_text("kept")
    with pytest.raises(InputError, match="--overwrite"):
        RunFolder.create(folder.path)
    RunFolder.create(folder.path, overwrite=True)
    assert [p.name for p in folder.path.iterdir()] == ["mine.txt"]
    with pytest.raises(ValueError, match="nan"):
        folder.write_json("run.json", {"dU": float("nan")})
    assert [p.name for p in folder.path.iterdir()] == ["mine.txt"]


def test_frames_read_back_across_a_remeshing(tmp_path: Path) -> None:
    writer = FieldsWriter(tmp_path)
    for k, (t, mesh_id) in enumerate([(0.1, 0), (0.2, 0), (0.3, 1)]):
        writer.write(frame(t, mesh_id, 1 + 0.1 * k))
    writer.close()
    assert read_times(tmp_path) == pytest.approx([0.1, 0.2, 0.3])
    for k in range(3):
        back = read_frame(tmp_path, k)
        assert back.points[:, 0].max() == pytest.approx(1 + 0.1 * k)
    assert not [p for p in tmp_path.iterdir() if p.name.startswith(".")]


def test_frames_with_nan_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="not finite"):
        FieldsWriter(tmp_path).write(frame(float("nan")))


def test_plot_needs_a_run(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="not the folder of a run"):
        plot_run(tmp_path)


def test_errors_travel_between_processes() -> None:
    import pickle

    for error in (InputError("f", "k", 1, "2"), NewtonFailure("diverged", t=1.5, step=3, advice="rest")):
        assert str(pickle.loads(pickle.dumps(error))) == str(error)
