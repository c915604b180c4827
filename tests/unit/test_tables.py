"""Tables as frames and as text: units, one row a gap, and what a screen shows."""

from __future__ import annotations

from pathlib import Path

import pytest

from pairsim.physics.scales import Scales
from pairsim.results.tables import csv_text, in_units, read_table, readable, screen_text, table_of
from pairsim.runtime.errors import InputError

TRAIN = "t,d_1,d_2,U_1,U_2,U_3,dU_1,dU_2,m,newton,dU_error_1,dU_error_2\n" + "\n".join(
    ["0.5,0.1,0.2,1.8,1.9,1.7,0.1,-0.2,1e-15,3,0.01,0.02", "1,0.15,0.1,1.8,1.9,1.7,0.123456789,-0.2,1e-15,2,0.01,nan"]
)
SCALES = Scales(50e-6, 10e-3, 0.85)


@pytest.fixture
def train(tmp_path: Path) -> Path:
    (tmp_path / "series.csv").write_text(TRAIN + "\n1.5,0.2")  # a run at work has half a last line
    return tmp_path


def test_a_tidy_table_has_a_row_for_each_gap(train: Path) -> None:
    table = table_of(train, "series", physical=False, by_gap=True)
    assert list(table.columns) == ["t", "gap", "d", "dU", "dU_error"]
    assert table[["t", "gap", "d"]].to_numpy().tolist() == [[0.5, 1, 0.1], [0.5, 2, 0.2], [1, 1, 0.15], [1, 2, 0.1]]
    assert table.attrs["units"] == {"t": "D_c/U_av", "gap": "", "d": "D_c", "dU": "U_av", "dU_error": "U_av"}
    assert in_units(table, SCALES)["d"].tolist() == pytest.approx([5, 10, 7.5, 5])


def test_a_table_without_gaps_is_not_made_tidy(tmp_path: Path) -> None:
    (tmp_path / "series.csv").write_text("t,U_1\n0.1,1.8\n")
    with pytest.raises(InputError, match="two or more particles"):
        table_of(tmp_path, "series", physical=False, by_gap=True)


def test_csv_has_every_digit_and_the_words_of_the_file(tmp_path: Path) -> None:
    (tmp_path / "equilibria.csv").write_text(
        "d,stable,slope,peak,d_error,certain\n0.12345678901234568,true,-0.1,1,,false\n"
    )
    text = csv_text(table_of(tmp_path, "equilibria", physical=False))
    head = "d [D_c],stable,slope [U_av/D_c],peak,d_error [D_c],certain"
    assert text.splitlines() == [head, "0.12345678901234568,true,-0.1,1,,false"]


def test_a_screen_has_five_digits_and_no_numerics_unless_asked(train: Path) -> None:
    table = read_table(train / "series.csv")
    names = ["t", "d_1", "d_2", "U_1", "U_2", "U_3", "dU_1", "dU_error_1", "dU_2", "dU_error_2"]
    assert list(readable(table).columns) == names
    assert list(readable(table, whole=True).columns) == [*names, "m", "newton"]
    text = screen_text(table, 200)
    assert "0.12346" in text
    assert "newton" not in text
    assert "newton" in screen_text(table, 200, whole=True)
    assert max(map(len, screen_text(table, 60).splitlines())) <= 60


def test_forces_have_a_unit_of_the_laboratory(tmp_path: Path) -> None:
    (tmp_path / "curve.csv").write_text("U_1,F_1\n1.0,2.0\n")
    table = in_units(read_table(tmp_path / "curve.csv"), SCALES)
    assert table.attrs["units"] == {"U_1": "um/s", "F_1": "nN"}
    assert table["F_1"][0] == pytest.approx(2 * 0.85 * 10e-3 * 50e-6 * 1e9)
