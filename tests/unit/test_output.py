"""The run folder, the time series and the table of columns."""

from __future__ import annotations

import json
import os
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest
import yaml

from pairsim.commands import own_files
from pairsim.fem.diagnostics import Health
from pairsim.results.columns import COLUMNS, CURVE_HEALTH, HEALTH, POLYMER_HEALTH, column, named_row, series_columns
from pairsim.results.output import RunFolder, SeriesWriter, read_series, write_text
from pairsim.results.tables import headings, table_of
from pairsim.runtime.errors import InputError


def names(folder: Path) -> list[str]:
    return sorted(file.name for file in folder.iterdir())


def test_create_makes_parents_and_accepts_an_empty_folder(tmp_path: Path) -> None:
    path = tmp_path / "a" / "b"
    assert RunFolder.create(path).path == path
    RunFolder.create(path)


def test_create_refuses_a_folder_with_files_and_leaves_it_alone(tmp_path: Path) -> None:
    (tmp_path / "series.csv").write_text("old")
    with pytest.raises(InputError, match="--overwrite") as caught:
        RunFolder.create(tmp_path)
    assert (caught.value.key, caught.value.file) == ("-o", str(tmp_path))
    assert (tmp_path / "series.csv").read_text() == "old"


def test_overwrite_removes_own_files_and_no_others(tmp_path: Path) -> None:
    for name in (*own_files(), "notes.txt", "my.csv", ".series.csv.part"):
        (tmp_path / name).write_text("x")
    for name in ("fields", "sub"):
        (tmp_path / name).mkdir()
    for name in ("000000.h5", "000012.h5", ".000013.h5.part"):
        (tmp_path / "fields" / name).write_text("x")
    (tmp_path / "sub" / "series.csv").write_text("x")
    RunFolder.create(tmp_path, True, own_files())
    assert names(tmp_path) == ["my.csv", "notes.txt", "sub"]
    assert names(tmp_path / "sub") == ["series.csv"]


def test_overwrite_removes_frames_and_nothing_else_from_their_folder(tmp_path: Path) -> None:
    (tmp_path / "fields").mkdir()
    for name in ("000000.h5", "mine.h5"):
        (tmp_path / "fields" / name).write_text("x")
    RunFolder.create(tmp_path, overwrite=True)
    assert names(tmp_path / "fields") == ["mine.h5"]


def test_overwrite_removes_a_link_and_not_what_it_points_to(tmp_path: Path) -> None:
    (tmp_path / "kept.csv").write_text("x")
    run = tmp_path / "run"
    run.mkdir()
    (run / "series.csv").symlink_to(tmp_path / "kept.csv")
    RunFolder.create(run, True, own_files())
    assert names(run) == []
    assert (tmp_path / "kept.csv").read_text() == "x"


@pytest.mark.parametrize("overwrite", [False, True])
def test_create_refuses_a_file(tmp_path: Path, overwrite: bool) -> None:
    file = tmp_path / "run"
    file.write_text("mine")
    for path in (file, file / "below"):
        with pytest.raises(InputError):
            RunFolder.create(path, overwrite)
    assert file.read_text() == "mine"


def test_overwrite_removes_nothing_when_a_name_is_taken(tmp_path: Path) -> None:
    (tmp_path / "case.yaml").write_text("old")
    (tmp_path / "fields").write_text("mine")
    with pytest.raises(InputError, match="fields in it is a file"):
        RunFolder.create(tmp_path, overwrite=True)
    (tmp_path / "fields").unlink()
    (tmp_path / "fields.h5").mkdir()
    with pytest.raises(InputError, match=r"fields\.h5"):
        RunFolder.create(tmp_path, overwrite=True)
    assert names(tmp_path) == ["case.yaml", "fields.h5"]


def test_yaml_and_json_take_numpy_and_keep_the_order(tmp_path: Path) -> None:
    folder = RunFolder.create(tmp_path / "run")
    content = {"z": np.float64(0.1), "a": np.arange(3), "flag": np.bool_(True), "in": {"p": Path("x"), "t": (1, None)}}
    expected = {"z": 0.1, "a": [0, 1, 2], "flag": True, "in": {"p": "x", "t": [1, None]}}
    assert yaml.safe_load(folder.write_yaml("case.yaml", content).read_text()) == expected
    written = json.loads(folder.write_json("run.json", content).read_text())
    assert written == expected
    assert list(written) == list(content)
    assert names(folder.path) == ["case.yaml", "run.json"]


@pytest.mark.parametrize("value", [float("nan"), np.float64("nan"), np.array([1, np.nan])])
def test_nan_is_refused_by_key_and_the_old_file_stays(tmp_path: Path, value: object) -> None:
    folder = RunFolder.create(tmp_path / "run")
    folder.write_json("run.json", {"ok": 1})
    with pytest.raises(ValueError, match=r"wall\.jit"):
        folder.write_json("run.json", {"wall": {"jit": value}})
    with pytest.raises(ValueError, match="nan"):
        folder.write_yaml("case.yaml", {"x": value})
    assert json.loads((folder.path / "run.json").read_text()) == {"ok": 1}
    assert names(folder.path) == ["run.json"]


def test_infinity_is_yaml_and_not_json(tmp_path: Path) -> None:
    folder = RunFolder.create(tmp_path / "run")
    assert yaml.safe_load(folder.write_yaml("case.yaml", {"x": float("inf")}).read_text()) == {"x": float("inf")}
    with pytest.raises(ValueError, match="JSON"):
        folder.write_json("run.json", {"x": float("inf")})


def test_names_that_overwrite_would_miss_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="is not a file of pairsim"):
        RunFolder.create(tmp_path / "run").write_json("other.json", {})


def test_failed_write_leaves_the_old_file_and_no_other(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "run.json"
    write_text(file, "old")

    def fail(*_: object) -> None:
        raise OSError("disk full")

    monkeypatch.setattr(os, "replace", fail)
    with pytest.raises(OSError, match="disk full"):
        write_text(file, "new")
    assert file.read_text() == "old"
    assert names(tmp_path) == ["run.json"]


def test_series_round_trip_is_exact(tmp_path: Path) -> None:
    columns = ["t", "dU"]
    table = np.random.default_rng(1).normal(size=(20, 2)) * 10.0 ** np.arange(-10, 10)[:, None]
    with SeriesWriter(tmp_path / "series.csv", columns) as writer:
        for t, value in table:
            writer.row({"dU": value, "t": t})
    series = read_series(tmp_path / "series.csv")
    assert list(series) == columns
    assert np.array_equal(np.column_stack(list(series.values())), table)


def test_series_rows_can_be_read_before_the_file_is_closed(tmp_path: Path) -> None:
    writer = SeriesWriter(tmp_path / "series.csv", ["t"])
    assert read_series(tmp_path / "series.csv")["t"].shape == (0,)
    writer.row({"t": 1 / 3})
    assert read_series(tmp_path / "series.csv")["t"] == [1 / 3]
    writer.close()


@pytest.mark.parametrize(
    ("row", "message"),
    [
        ({"t": 1.0, "d": float("nan")}, "d is nan"),
        ({"t": float("inf"), "d": 1.0}, "t is inf"),
        ({"t": 1.0}, "no value for d"),
    ],
)
def test_series_refuses_a_bad_row_and_writes_nothing_of_it(tmp_path: Path, row: dict[str, float], message: str) -> None:
    with SeriesWriter(tmp_path / "series.csv", ["t", "d"]) as writer, pytest.raises(ValueError, match=message):
        writer.row(row)
    assert (tmp_path / "series.csv").read_text() == "t,d\n"


@pytest.mark.parametrize("torn", ["3.0", "3.0,", "3.0,4.", "3.0,4.25", "3.0,-"])
def test_torn_last_line_is_left_out(tmp_path: Path, torn: str) -> None:
    file = tmp_path / "series.csv"
    file.write_text("t,d\n1.0,2.0\n" + torn)
    assert read_series(file)["d"].tolist() == [2.0]


@pytest.mark.parametrize("text", ["", "t,d", "t,d\n1.0\n2.0,3.0\n", "t,d\nx,1.0\n"])
def test_broken_series_is_an_input_error(tmp_path: Path, text: str) -> None:
    file = tmp_path / "series.csv"
    file.write_text(text)
    with pytest.raises(InputError, match=r"series\.csv"):
        read_series(file)


def test_missing_series_is_an_input_error(tmp_path: Path) -> None:
    with pytest.raises(InputError):
        read_series(tmp_path / "series.csv")


@pytest.mark.parametrize(
    ("n", "header"),
    [
        (0, "t,dp,dp_plus"),
        (1, "t,U_1,D_1,dp,dp_plus"),
        (2, "t,d,U_L,U_T,dU,D_L,D_T,dp,dp_plus"),
        (3, "t,d_1,d_2,U_1,U_2,U_3,dU_1,dU_2,D_1,D_2,D_3,dp,dp_plus"),
    ],
)
def test_header_row_and_table_agree(n: int, header: str) -> None:
    assert ",".join(series_columns(n)) == header
    U = 1.0 + 0.1 * np.arange(n) ** 2
    row = named_row(0.5, np.full(max(n - 1, 0), 0.2), U, np.diff(U), 0.01 * np.arange(n), 640.0, 3.0)
    assert list(row) == series_columns(n)
    assert (row["t"], row["dp"], row["dp_plus"]) == (0.5, 640.0, 3.0)
    for name in row:
        assert column(name).meaning


def test_trailing_is_upstream_and_differences_point_downstream() -> None:
    pair = named_row(1.0, [0.3], [1.5, 1.75], [0.25], [0.01, 0.02], 1.0, 0.0)
    assert (pair["U_T"], pair["U_L"], pair["dU"], pair["D_T"], pair["D_L"], pair["d"]) == (
        1.5, 1.75, 0.25, 0.01, 0.02, 0.3,
    )  # fmt: skip
    train = named_row(1.0, [0.3, 0.4], [1.5, 1.75, 1.25], [0.25, -0.5], [0.01, 0.02, 0.03], 1.0, 0.0)
    assert (train["dU_1"], train["dU_2"], train["d_2"], train["D_3"]) == (0.25, -0.5, 0.4, 0.03)


def test_named_row_refuses_lengths_that_do_not_fit() -> None:
    with pytest.raises(ValueError, match=r"shorter|longer"):
        named_row(0.0, [], [1.0, 2.0], [1.0], [0.0, 0.0], 1.0, 0.0)


def test_table_of_columns() -> None:
    assert len({entry.name for entry in COLUMNS}) == len(COLUMNS)
    assert column("D_12").symbol == "D_{12}"
    assert column("dU_2").symbol == r"\Delta U_{2}"
    for unknown in ("D_i", "x", "dp_1"):
        with pytest.raises(KeyError):
            column(unknown)


def test_every_health_column_has_a_meaning() -> None:
    for name in (*HEALTH, *CURVE_HEALTH, *POLYMER_HEALTH):
        assert column(name).meaning


def test_conformation_is_watched_under_the_names_of_its_columns() -> None:
    assert tuple(field.name for field in fields(Health)) == POLYMER_HEALTH


def test_the_table_of_an_earlier_version_has_units(tmp_path: Path) -> None:
    """Curves of version 0.1.0 have dU at held distance, and what motion adds to it in a column of its own."""
    (tmp_path / "run.json").write_text('{"kind": "curve"}')
    (tmp_path / "curve.csv").write_text("d,dU,drift\n0.1,1e-3,1e-5\n")
    assert headings(table_of(tmp_path, "curve", False)) == ["d [D_c]", "dU [U_av]", "drift [U_av]"]
