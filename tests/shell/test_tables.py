"""Tables as files, as frames and as text: columns, units, one row a gap, and what a screen shows."""

from __future__ import annotations

import json
from dataclasses import fields
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from support.commands import Pairsim
from support.pictures import drawn_figures
from support.result_folders import make_curve, make_sweep

from pairsim.app.open_and_plot import open as open_folder
from pairsim.app.open_and_plot import plot
from pairsim.app.sweep_results import SweepResult
from pairsim.fem.diagnostics import Health
from pairsim.plots.parameters import measured
from pairsim.quantities.scales import Scales
from pairsim.questions.registry import QUESTIONS
from pairsim.record.column import names_of, suffixes_in, table_row
from pairsim.record.columns import (
    DISTANCE,
    DP,
    DP_PLUS,
    DU,
    EQUILIBRIA_COLUMNS,
    POLYMER_HEALTH,
    SERIES_COLUMNS,
    SHARED,
    STATE_COLUMNS,
    SWEEP_COLUMNS,
    TAYLOR,
    T,
    U,
    Z,
)
from pairsim.record.table_files import TableWriter, read_table, table_text
from pairsim.record.tables import brief, csv_text, frame_of, in_units, readable, screen_text, with_numbers, with_units
from pairsim.runtime.errors import EnvironmentFailure, InputError

TRAIN = "t,d_1,d_2,U_1,U_2,U_3,dU_1,dU_2,m,newton,dU_error_1,dU_error_2\n" + "\n".join(
    ["0.5,0.1,0.2,1.8,1.9,1.7,0.1,-0.2,1e-15,3,0.01,0.02", "1,0.15,0.1,1.8,1.9,1.7,0.123456789,-0.2,1e-15,2,0.01,nan"]
)
SCALES = Scales(50e-6, 10e-3, 0.85)


@pytest.mark.parametrize("ascending", [True, False])
def test_each_row_is_in_the_file_at_once_with_every_digit(tmp_path: Path, ascending: bool) -> None:
    file = tmp_path / "series.csv"
    values = np.random.default_rng(1).normal(size=(20, 2)) * 10.0 ** np.arange(-10, 10)[:, None]
    writer = TableWriter(file, ["t", "dU"], ascending=ascending)
    assert read_table(file)["t"].shape == (0,)
    for count, (t, dU) in enumerate(values, 1):
        writer.row({"dU": dU, "t": t, "d": 1.0})
        there = values[:count][values[:count, 0].argsort()] if ascending else values[:count]
        assert np.array_equal(np.column_stack(list(read_table(file).values())), there)
    assert list(read_table(file)) == ["t", "dU"]


@pytest.mark.parametrize(
    ("row", "message"), [({"t_relax": float("inf"), "d": 1.0}, "t_relax is inf"), ({"t_relax": 1.0}, "no value for d")]
)
def test_a_bad_row_is_refused_and_nothing_of_it_written(tmp_path: Path, row: dict[str, float], message: str) -> None:
    writer = TableWriter(tmp_path / "a.csv", ["t_relax", "d"], declared=SHARED)
    with pytest.raises(ValueError, match=message):
        writer.row(row)
    writer.row({"t_relax": np.float64("nan"), "d": 1.0})
    assert (tmp_path / "a.csv").read_text() == "t_relax,d\nnan,1.0\n"


def test_numbers_flags_words_and_what_is_not_known_are_read_back(tmp_path: Path) -> None:
    rows = [["a, b", True, 0.5, [0.1, 0.2], None], ["c", False, 2, [], 1 / 3]]
    (tmp_path / "results.csv").write_text(table_text(["name", "stable", "d", "zeros", "dU"], rows))
    table = read_table(tmp_path / "results.csv")
    words, flags, numbers, lists = (values.tolist() for values in list(table.values())[:4])
    assert (words, flags, numbers, lists) == (["a, b", "c"], [True, False], [0.5, 2], ["0.1 0.2", ""])
    assert np.isnan(table["dU"][0])
    assert table["dU"][1] == 1 / 3


def test_a_table_that_a_spreadsheet_has_saved_is_read_as_before(tmp_path: Path) -> None:
    (tmp_path / "equilibria.csv").write_bytes(b"\xef\xbb\xbfd,stable\r\n0.2,FALSE\r\n0.4,TRUE\r\n")
    table = {name: values.tolist() for name, values in read_table(tmp_path / "equilibria.csv").items()}
    assert table == {"d": [0.2, 0.4], "stable": [False, True]}


def test_a_curve_has_values_at_any_distance_in_a_table_of_the_experiment(tmp_path: Path) -> None:
    folder = make_curve(tmp_path / "curve", Ca_e=0.1)
    scales = {"length": 50e-6, "velocity": 1e-3, "time": 0.05, "stress": 1.0}
    (folder / "run.json").write_text(json.dumps({"kind": "curve", "scales": scales}))
    curve = open_folder(folder)
    found = curve.frame("curve", physical=None, at=["10um", "0.3", "30 um"])
    assert csv_text(found).splitlines()[0] == "d [um],dU [um/s],dU_error [um/s]"
    assert found["d"].to_numpy() == pytest.approx([10, 15, 30])
    assert found["dU"].to_numpy() == pytest.approx([0, 1e3 * 0.1 * np.log(1.5), 1e3 * 0.1 * np.log(3)], rel=0.02, abs=1)
    assert (found["dU_error"] >= 1).all()
    for wrong, message in (("31um", "ends of the curve"), ("3 s", "a length")):
        with pytest.raises(InputError, match=message):
            curve.frame("curve", physical=None, at=[wrong])
    with pytest.raises(InputError, match="goes with a curve"):
        curve.frame("equilibria", physical=None, at=["10um"])


@pytest.mark.parametrize("torn", ["3.0", "3.0,4.25"])
def test_torn_last_line_is_left_out(tmp_path: Path, torn: str) -> None:
    (tmp_path / "series.csv").write_text("t,d\n1.0,2.0\n" + torn)
    assert read_table(tmp_path / "series.csv")["d"].tolist() == [2.0]


@pytest.mark.parametrize("text", [None, "", "t,d", "t,d\n1.0\n2.0,3.0\n", "t,,d\n1,2,3\n"])
def test_what_is_no_table_is_an_input_error(tmp_path: Path, text: str | None) -> None:
    if text is not None:
        (tmp_path / "series.csv").write_text(text)
    with pytest.raises(InputError, match=r"series\.csv"):
        read_table(tmp_path / "series.csv")


@pytest.mark.parametrize(
    ("n", "header"),
    [
        (0, "t,dp,dp_plus"),
        (1, "t,U_1,D_1,dp,dp_plus,z_1"),
        (2, "t,d,U_L,U_T,dU,D_L,D_T,dp,dp_plus,z_L,z_T"),
        (3, "t,d_1,d_2,U_1,U_2,U_3,dU_1,dU_2,D_1,D_2,D_3,dp,dp_plus,z_1,z_2,z_3"),
    ],
)
def test_header_row_and_descriptions_agree(n: int, header: str) -> None:
    assert ",".join(names_of(n, *STATE_COLUMNS)) == header
    u = 1.0 + 0.1 * np.arange(n) ** 2
    values = {T: 0.5, DISTANCE: np.full(max(n - 1, 0), 0.2), U: u, DU: np.diff(u), TAYLOR: 0.01 * u}
    row = table_row(n, values | {DP: 640.0, DP_PLUS: 3.0, Z: u})
    assert row.keys() == set(names_of(n, *STATE_COLUMNS))
    assert [row[f"U{each}"] for each in sorted(suffixes_in(row, U), reverse=n == 2)] == u.tolist()
    assert all(SERIES_COLUMNS.column(name).meaning for name in row)


def test_trailing_is_upstream_and_a_row_has_a_value_for_each_gap() -> None:
    assert table_row(2, {U: [1.5, 1.75], DISTANCE: [0.3]}) == {"U_T": 1.5, "U_L": 1.75, "d": 0.3}
    assert table_row(3, {DISTANCE: [0.3, 0.4]}) == {"d_1": 0.3, "d_2": 0.4}
    with pytest.raises(ValueError, match=r"shorter|longer"):
        table_row(2, {U: [1.0, 2.0], DISTANCE: []})


def test_every_column_has_one_description() -> None:
    column = SERIES_COLUMNS.column
    assert [column(name).symbol for name in ("D_12", "dU_2", "D_L")] == ["D_{12}", r"\Delta U_{2}", "D_L"]
    assert "particles i and i+1" in column("d_2").meaning
    for unknown in ("D_i", "x", "dp_1"):
        with pytest.raises(KeyError):
            column(unknown)
    for question in QUESTIONS.values():
        for declared in question.tables.values():
            entries = [declared.column(name) for name in declared.named(3)]
            assert all(entry.meaning for entry in entries)
            assert not any(mark in entry.symbol for entry in entries for mark in ("{_}", "{,}"))
    assert [field.name for field in fields(Health)] == [entry.name for entry in POLYMER_HEALTH]


@pytest.fixture
def train(tmp_path: Path) -> Path:
    (tmp_path / "series.csv").write_text(TRAIN + "\n1.5,0.2")  # a run at work has half a last line
    return tmp_path


def test_csv_has_every_digit_and_the_words_of_the_file(tmp_path: Path) -> None:
    (tmp_path / "equilibria.csv").write_text(
        "d,stable,slope,peak,d_error,certain\n0.12345678901234568,true,-0.1,1.0,,false\n"
    )
    text = csv_text(frame_of(read_table(tmp_path / "equilibria.csv", EQUILIBRIA_COLUMNS)))
    head = "d [D_c],stable,slope [U_av/D_c],peak,d_error [D_c],certain"
    assert text.splitlines() == [head, "0.12345678901234568,true,-0.1,1.0,,false"]


def test_a_screen_has_five_digits_and_no_numerics_unless_asked(train: Path) -> None:
    table = frame_of(read_table(train / "series.csv", SERIES_COLUMNS))
    names = ["t", "d_1", "d_2", "dU_1", "dU_error_1", "dU_2", "dU_error_2", "U_1", "U_2", "U_3"]
    assert list(readable(table).columns) == names
    assert list(readable(table, whole=True).columns) == [*names, "m", "newton"]
    text = screen_text(table, 200)
    assert "0.12346" in text
    assert "newton" not in text
    assert "newton" in screen_text(table, 200, whole=True)
    assert max(map(len, screen_text(table, 60).splitlines())) <= 60


def test_a_row_has_its_positions_along_the_tube() -> None:
    names = ["position", "t", "d", "dU", "dU_error"]
    row = with_units(pd.DataFrame([[0.0, 0.0, 0.1, 1e-3, 1e-5]], columns=names), QUESTIONS["train"].tables["row"])
    assert list(readable(row)) == names


def test_lists_are_shown_as_numbers_with_five_digits() -> None:
    lists = pd.DataFrame({"zeros": [[17.066208, 0.5], None], "stable": [[False, True], None]})
    table = brief(with_units(lists, SWEEP_COLUMNS))
    assert list(table) == ["zeros [D_c]", "stable"]
    assert table.iloc[0].tolist() == ["17.066 0.5", "false true"]
    assert table.iloc[1].tolist() == ["", ""]


def test_forces_have_a_unit_of_the_laboratory(tmp_path: Path) -> None:
    (tmp_path / "curve.csv").write_text("U_1,F_1\n1.0,2.0\n")
    declared = QUESTIONS["curve"].tables["curve"]
    table = in_units(frame_of(read_table(tmp_path / "curve.csv", declared)), declared, [SCALES])
    assert table.attrs["units"] == {"U_1": "um/s", "F_1": "nN"}
    assert table["F_1"][0] == pytest.approx(2 * 0.85 * 10e-3 * 50e-6 * 1e9)


def a_sweep(folder: Path, times: dict[str, float]) -> Path:
    """A sweep of curves over the relaxation time, with De that follows from it, in a tube of 50 um."""
    parameters = {}
    for i, (time, De) in enumerate(times.items()):
        curve = make_curve(folder / f"curve-{i}", 0.1, De)
        scales = {"length": 50e-6, "time": 5e-3, "velocity": 10e-3, "stress": 170.0}
        (curve / "run.json").write_text(json.dumps({"kind": "curve", "status": "finished", "scales": scales}))
        parameters[curve.name] = {"physical.relaxation": time, "De": De, "beta": 0.4}
    return make_sweep(folder, "curve", parameters, ["physical.relaxation", "De"])


def test_the_tables_of_a_sweep_are_one_below_the_other(tmp_path: Path) -> None:
    sweep = a_sweep(tmp_path, {"1 ms": 0.2, "2 ms": 0.4})
    zeros = SweepResult(sweep).frame("equilibria", physical=True)
    assert list(zeros.columns[:3]) == ["physical.relaxation", "De", "d"]
    assert zeros[["physical.relaxation", "De", "d"]].to_numpy().tolist() == [[1, 0.2, 10.0], [2, 0.4, 10.0]]
    assert (zeros.attrs["units"]["d"], zeros.attrs["units"]["physical.relaxation"]) == ("um", "ms")
    curves = SweepResult(sweep).frame()
    assert curves["physical.relaxation"].tolist() == 5 * [1] + 5 * [2]
    table = SweepResult(sweep).table
    assert (table["physical.relaxation"].tolist(), table.attrs["units"]["physical.relaxation"]) == ([1, 2], "ms")
    with pytest.raises(InputError, match="must be curve or equilibria"):
        SweepResult(sweep).frame("series")


def test_quantities_of_a_sweep_are_numbers_in_the_unit_of_the_first_one(tmp_path: Path) -> None:
    sweep = a_sweep(tmp_path / "times", {"1 +- 0.1 ms": 0.2, "2000 us": 0.4})
    assert SweepResult(sweep).table["physical.relaxation"].tolist() == [1, 2]
    data = SweepResult(sweep).to_xarray()
    assert (data["physical.relaxation"].values.tolist(), data["physical.relaxation"].attrs["units"]) == ([1, 2], "ms")
    assert measured(["1 +- 0.1 kPa", "500 Pa"]) == ([1.0, 0.5], "kPa"), "and so they are drawn"
    assert measured(["0.5 %", "1 +- 0.2 %"]) == ([0.5, 1.0], "%")
    frame = pd.DataFrame({"physical.particle": [["20 um", "0.022 mm"], "18 um"], "physical.note": ["a", "b"]})
    frame.attrs["units"] = {}
    found = with_numbers(frame, list(frame))
    assert found["physical.particle"].tolist() == [[20.0, 22.0], 18.0]
    assert (found["physical.note"].tolist(), found.attrs["units"]) == (["a", "b"], {"physical.particle": "um"})


def test_a_sweep_is_a_data_set(tmp_path: Path, pairsim: Pairsim, monkeypatch: pytest.MonkeyPatch) -> None:
    import xarray

    parameters = {}
    for Ca_e, De in [(0.1, 0.2), (0.1, 0.4), (0.3, 0.2), (0.3, 0.4)]:
        folder = make_curve(tmp_path / "sweep" / f"curve-{Ca_e}-{De}", Ca_e * (1 + De), De)
        parameters[folder.name] = {"Ca_e": Ca_e, "De": De}
    sweep = SweepResult(make_sweep(tmp_path / "sweep", "curve", parameters, ["Ca_e", "De"], versions={"pairsim": "1"}))
    found = sweep.to_xarray()
    assert dict(found.sizes) == {"Ca_e": 2, "De": 2, "d": 5}
    expected = 0.3 * 1.2 * np.log(0.4 / 0.2)
    assert float(found["dU"].sel(Ca_e=0.3, De=0.2, d=0.4)) == pytest.approx(expected)
    assert (found["dU"].attrs["units"], found["dU_error"].attrs["units"]) == ("U_av", "U_av")
    assert found["dU"].attrs["long_name"].startswith("velocity of the downstream particle")
    assert found.attrs == {"name": "sweep", "command": "curve", "pairsim": "1"}
    some = dict(list(parameters.items())[:3])
    found = SweepResult(make_sweep(tmp_path / "sweep", "curve", some, ["Ca_e", "De"], versions={})).to_xarray()
    assert dict(found.sizes) == {"case": 3, "d": 5}
    assert found["De"].values.tolist() == [0.2, 0.4, 0.2]
    done = pairsim("table", "sweep", "--netcdf", "a.nc")
    assert done.returncode == 0, done.stderr
    assert xarray.load_dataset(tmp_path / "a.nc").equals(found)
    monkeypatch.setattr("pairsim.app.sweep_results.find_spec", lambda name: None)
    with pytest.raises(EnvironmentFailure, match=r"there is no xarray.*pairsim\[netcdf\]"):
        sweep.to_xarray()


def test_a_sweep_over_a_quantity_is_drawn_over_it_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """De, which follows from the relaxation time, has no place in the legend, and no map."""
    sweep = a_sweep(tmp_path / "sweep", {"1 ms": 0.2, "2 ms": 0.4, "4 ms": 0.8})
    with drawn_figures(monkeypatch) as figures:
        files = plot(sweep, out=tmp_path / "out")
    assert [file.stem for file in files] == ["sweep_curves", "sweep_zeros"]
    curves, zeros = figures
    labels = [text.get_text() for text in curves.legends[0].get_texts()]
    assert labels[:3] == [rf"$\lambda$ = {time} ms" for time in (1, 2, 4)]
    assert not any(r"\mathrm{De}" in label for label in labels)
    assert zeros.axes[0].get_xlabel() == r"$\lambda$  [ms]"
    assert zeros.axes[0].get_ylabel() == "$d_{cr}$  [µm]"
