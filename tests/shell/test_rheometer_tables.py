"""Tables of instruments: rows and their headings, several tables in a file, and columns that tell of each other."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pairsim.lab.rheometer.export_files import read_columns
from pairsim.runtime.errors import InputError

RATES = np.geomspace(0.1, 1000, 17)
ETA = 2.5 * (1 + (0.5 * RATES) ** 2) ** -0.25  # [Pa s]
STRESS = RATES * ETA
STORAGE, LOSS = 40 * RATES**1.2, 90 * RATES**0.9
COMPLEX_VISCOSITY = np.hypot(STORAGE, LOSS) / RATES
WARM = np.full(17, 25.0)
Rows = list[list[str]]


def rows(*columns: np.ndarray) -> Rows:
    return [[f"{value:.6g}" for value in row] for row in zip(*columns, strict=True)]


def text(heading: str, of_rows: Rows, by: str = ",") -> str:
    return "\n".join([heading.replace(",", by), *(by.join(row) for row in of_rows)]) + "\n"


def read(folder: Path, content: str, wanted: str = "", kind: str = "rheology") -> tuple[dict[str, np.ndarray], str]:
    (folder / "export.csv").write_text(content)
    values, said = read_columns(kind, folder / "export.csv", [wanted] if wanted else [])
    return values, "\n".join(said)


def refused(folder: Path, content: str, wanted: str = "", kind: str = "rheology") -> str:
    with pytest.raises(InputError) as error:
        read(folder, content, wanted, kind)
    return str(error.value)


def without(of_rows: Rows, row: int, cell: int) -> Rows:
    """The rows, one of which has lost a cell."""
    return [[c for k, c in enumerate(each) if (i, k) != (row, cell)] for i, each in enumerate(of_rows)]


THREE = rows(RATES, ETA, WARM)
FOUR = rows(RATES, STRESS, ETA, WARM)
UNITS = "rate [1/s],viscosity [Pa.s],temperature [C]"
FOUR_UNITS = "rate [1/s],stress [Pa],viscosity [Pa.s],temperature [C]"


@pytest.mark.parametrize("by", [",", ";", "\t", "   ", " "])
@pytest.mark.parametrize("cell", [0, 1, 2, 3])
def test_a_row_that_has_lost_a_cell_is_refused_with_its_line(by: str, cell: int, tmp_path: Path) -> None:
    heading = "rate(1/s),stress(Pa),viscosity(Pa.s),temperature(C)"
    assert len(read(tmp_path, text(heading, FOUR, by))[0]["rate"]) == 17
    said = refused(tmp_path, text(heading, without(FOUR, 5, cell), by))
    assert "must have a cell below each heading" in said
    assert "line 7 has 3 cells, the headings (line 1) 4" in said


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (text("rate,torque,viscosity,temperature\n1/s,uN.m,Pa.s,C", THREE),
         "line 3 has 3 cells, the headings (line 1) 4"),
        (text("rate [1/s],viscosity [Pa.s]", THREE), "line 2 has 3 cells, the headings (line 1) 2"),
        (text("viscosity [Pa.s],rate [1/s]", [["1", *row[:2]] for row in THREE]), "line 2 has 3 cells"),
        (text(UNITS, [*THREE[:3], [*THREE[3], "overload"], *THREE[4:]]), "line 5 has 4 cells, the headings (line 1) 3"),
        (text("rate [1/s],viscosity [mPa.s]", [["0.5", "2,500.0"], *rows(RATES, 1e3 * ETA)]), "line 2 has 3 cells"),
        (text(UNITS, [row if i < 9 else row[:2] for i, row in enumerate(THREE)]), "line 11 has 2 cells"),
    ],
)  # fmt: skip
def test_rows_that_do_not_fit_below_the_headings_are_refused(content: str, says: str, tmp_path: Path) -> None:
    assert says in refused(tmp_path, content)


@pytest.mark.parametrize(
    "content",
    [
        text(UNITS + ",,", [[*row, "", ""] for row in THREE]),
        text(UNITS, [[*row, "", ""] for row in THREE]),
        text(UNITS + ",,", THREE),
        text(UNITS + ",", [[*row, "7"] for row in THREE]),
        text(UNITS + ",status", [[*row, "ok"] if i % 3 else row for i, row in enumerate(THREE)]),
        text(UNITS, [[*row[:2], ""] if i == 4 else row for i, row in enumerate(THREE)]),
        text(UNITS, THREE) + "\nfound by the fit\nA,1,2,3,4\n",
        text(UNITS, THREE) + "\n0.1,2,3,4,5\n0.2,3,4,5,6\n",
        text(UNITS, THREE) + "\n\n3\n",
        text("rate [1/s];viscosity [Pa s];temperature [C]", THREE, ";").replace(".", ","),
        "sep=;\n" + text(UNITS, THREE, ";"),
        "sample: a gel, 2 %, of May\nrate\tviscosity\ttemperature\n1/s\tPa.s\tC\n"
        + "\n".join(("\t" if i == 5 else " \t ").join(row) for i, row in enumerate(THREE)),
    ],
)
def test_rows_that_fit_are_read_whatever_is_empty_or_stands_below(content: str, tmp_path: Path) -> None:
    values, _ = read(tmp_path, content)
    assert values["rate"] == pytest.approx(RATES, rel=1e-5)
    assert values["viscosity"] == pytest.approx(ETA, rel=1e-5)


def test_a_value_that_is_missing_in_its_cell_is_left_out(tmp_path: Path) -> None:
    gap = [[*row[:2], "", row[3]] if i == 5 else row for i, row in enumerate(FOUR)]
    values, said = read(tmp_path, text(FOUR_UNITS, gap))
    assert len(values["rate"]) == 16
    assert '1 of 17 rows left out; in the first one, line 7, column 3 "viscosity [Pa.s]" is empty' in said


def test_marks_of_thousands_are_read_where_decimal_marks_are_certain(tmp_path: Path) -> None:
    many = [[*(f'"{float(cell):,.6g}"' for cell in row)] for row in rows(RATES, 1e3 * ETA)]
    values, said = read(tmp_path, text("rate [1/s],viscosity [mPa.s]", many))
    assert any('"2,' in cell for row in many for cell in row)
    assert values["viscosity"] == pytest.approx(ETA, rel=1e-5)
    assert "left out" not in said


@pytest.mark.parametrize("thousands", ["24.000;23.100;21.000;19.000;15.000", "24.000;23.100;12.000;950;800"])
def test_a_mark_of_thousands_is_told_from_that_of_decimals_by_other_numbers(thousands: str, tmp_path: Path) -> None:
    """Most numbers have points, but commas in 0,5 cannot mark thousands."""
    rates, milli = ["0,5", "1", "2", "5", "10"], thousands.split(";")
    values, said = read(
        tmp_path, text("Scherrate [1/s];Viskosität [mPa.s]", [[*each] for each in zip(rates, milli, strict=True)], ";")
    )
    assert values["rate"] == pytest.approx([0.5, 1, 2, 5, 10])
    assert values["viscosity"] == pytest.approx([float(cell.replace(".", "")) / 1e3 for cell in milli])
    assert "left out" not in said


@pytest.mark.parametrize("names", [["Mean", "Std. dev."], ["Mittelwert", "Standardabweichung", "Min", "Max"]])
def test_a_summary_below_the_table_is_no_part_of_it(names: list[str], tmp_path: Path) -> None:
    points = [[str(i + 1), *row] for i, row in enumerate(rows(RATES, ETA))]
    summary = [[name, f"{30 * (i + 1)}", f"{4 * (i + 1)}"] for i, name in enumerate(names)]
    values, said = read(tmp_path, text("point,rate [1/s],viscosity [Pa.s]", points + summary))
    assert values["viscosity"] == pytest.approx(ETA, rel=1e-5)
    assert f"not read: {len(names)} rows from line 19 on, such as {names[0]}, of a summary" in said


@pytest.mark.parametrize(
    ("other", "measured"),
    [
        ("Shear rate setpoint [1/s]", "Shear rate [1/s]"),
        ("Shear rate set [1/s]", "Shear rate actual [1/s]"),
        ("Scherrate (Vorgabe) [1/s]", "Scherrate [1/s]"),
        ("Shear rate requested [1/s]", "Shear rate measured [1/s]"),
    ],
)
def test_what_was_measured_is_read_and_not_what_was_set(other: str, measured: str, tmp_path: Path) -> None:
    both = rows(1.5 * RATES, RATES, ETA)
    values, _ = read(tmp_path, text(f"{other};{measured};viscosity [Pa.s]", both, ";"))
    assert values["rate"] == pytest.approx(RATES, rel=1e-5)
    alone, _ = read(tmp_path, text(f"{other};viscosity [Pa.s]", rows(RATES, ETA), ";"))
    assert alone["rate"] == pytest.approx(RATES, rel=1e-5)


def test_a_fitted_viscosity_and_a_frequency_that_was_set_are_second_choices(tmp_path: Path) -> None:
    values, said = read(
        tmp_path, text("rate [1/s],viscosity (Cross fit) [Pa.s],viscosity [Pa.s]", rows(RATES, 1.3 * ETA, ETA))
    )
    assert values["viscosity"] == pytest.approx(ETA, rel=1e-5)
    assert 'column 2 "viscosity (Cross fit) [Pa.s]" is not read, although it may be viscosity, too' in said
    heading = "frequency setpoint [rad/s],frequency [rad/s],G' [Pa],G'' [Pa]"
    values, _ = read(tmp_path, text(heading, rows(1.5 * RATES, RATES, STORAGE, LOSS)), kind="spectrum")
    assert values["frequency"] == pytest.approx(RATES, rel=1e-5)


@pytest.mark.parametrize("log", ["ln", "lg", "log", "log10"])
def test_logarithms_are_not_taken_for_values(log: str, tmp_path: Path) -> None:
    of_rate = "must have a line of headings of shear rate"
    logarithms = rows(np.log(10 * RATES + 1), np.log(1e4 * ETA))
    assert of_rate in refused(tmp_path, text(f"{log} shear rate [1/s],{log} viscosity [Pa.s]", logarithms))


def test_phases_beyond_a_right_angle_are_left_out(tmp_path: Path) -> None:
    """There the inertia of the instrument is measured: the storage modulus would be negative."""
    phases = np.degrees(np.arctan2(LOSS, STORAGE))
    modulus = np.hypot(STORAGE, LOSS)
    for unit, size in (("deg", 1.0), ("rad", np.pi / 180)):
        turned = size * np.concatenate([phases[:-2], [95.5, 130.25]])
        heading = f"frequency [rad/s],|G*| [Pa],phase angle [{unit}]"
        values, said = read(tmp_path, text(heading, rows(RATES, modulus, turned)), kind="spectrum")
        assert values["storage"] == pytest.approx(STORAGE[:-2], rel=1e-4)
        assert f'2 of 17 rows left out; in the first one, line 17, column 3 "phase angle [{unit}]"' in said
        assert "is not below 90 degrees" in said


def test_rows_below_the_table_that_are_not_of_it_are_said(tmp_path: Path) -> None:
    assert (
        "not read: what is below line 19, with 5 cells instead of 3"
        in read(tmp_path, text(UNITS, THREE) + "\n0.1,2,3,4,5\n0.2,3,4,5,6\n")[1]
    )


OIL = text("rate [1/s],viscosity [Pa.s]", rows(np.geomspace(1e-2, 1e4, 9), np.full(9, 0.19)))
RAW = text("rate [1/s],viscosity [Pa.s]", rows(RATES, ETA))
OTHER = text("rate [1/s],viscosity [Pa.s]", rows(RATES, 0.6 * ETA))


@pytest.mark.parametrize(
    "name", ["-- Calibration Data --", "Kalibrierung", "Result:\tVerification of the oil", "[Calibrazione]", "Normalöl"]
)
@pytest.mark.parametrize("first", [True, False])
def test_a_calibration_is_not_fitted_unless_it_is_asked_for(name: str, first: bool, tmp_path: Path) -> None:
    both = f"{name}\nR = 0.99\n\n{OIL}", f"== Raw Data ==\n{RAW}"
    values, said = read(tmp_path, "\n".join(both if first else both[::-1]))
    assert values["viscosity"] == pytest.approx(ETA, rel=1e-5)
    assert "which is a calibration, by its name" in said
    title = name.strip("-[] ").rpartition("\t")[2]
    assert len(read(tmp_path, "\n".join(both), title)[0]["rate"]) == 9


def test_which_of_several_liquids_is_fitted_is_asked_for(tmp_path: Path) -> None:
    both = f"Test:\tgel 20 C\nResult:\tcurve 1\n{RAW}\nTest:\tgel 30 C\nResult:\tcurve 1\n{OTHER}"
    assert (
        "has 2 sections that are not alike, and `section` NAME chooses one: section 'gel 20 C, curve 1'; "
        "section 'gel 30 C, curve 1' (differs by 67 %)" in refused(tmp_path, both)
    )
    values, _ = read(tmp_path, both, "GEL 30")
    assert values["viscosity"] == pytest.approx(0.6 * ETA, rel=1e-5)


@pytest.mark.parametrize("key", ["Sample:\t", "Probe: ", "Sample name,"])
def test_samples_have_the_names_above_them(key: str, tmp_path: Path) -> None:
    both = f"{key}water\nResult:\tcurve\n{RAW}\n{key}glycerol\nResult:\tcurve\n{OTHER}"
    assert "section 'water, curve'; section 'glycerol, curve'" in refused(tmp_path, both)


def test_tables_without_names_have_their_lines(tmp_path: Path) -> None:
    said = refused(tmp_path, f"{RAW}\n{OTHER}")
    assert "the table below line 1; the table below line 20 (differs by 67 %)" in said
    assert read(tmp_path, f"{RAW}\n{OTHER}", "line 20")[0]["viscosity"] == pytest.approx(0.6 * ETA, rel=1e-5)
    alike = f"Result:\tup\n{RAW}\nResult:\tup\n{OTHER}"
    assert "section 'up' below line 2; section 'up' below line 22" in refused(tmp_path, alike)


def test_sections_of_one_liquid_need_no_choice(tmp_path: Path) -> None:
    down = text("rate [1/s],viscosity [Pa.s]", rows(RATES[9::-1], 1.04 * ETA[9::-1]))
    values, said = read(tmp_path, f"Result:\tdown\n{down}\nResult:\tup\n{RAW}")
    assert len(values["rate"]) == 17
    assert "not read: section 'down' (differs by 4 %); --section NAME reads another one" in said


def test_a_table_without_headings_for_its_cells_does_not_refuse_the_file(tmp_path: Path) -> None:
    summary = text("rate [1/s],viscosity [Pa.s],|fit", [[*row, "1", "2"] for row in rows(RATES, ETA)])
    values, said = read(tmp_path, f"{summary}\n{OTHER}")
    assert values["viscosity"] == pytest.approx(0.6 * ETA, rel=1e-5)
    assert "not read: the table below line 1, which must have a heading over each column" in said


def test_a_damaged_table_is_not_passed_over_for_another_one(tmp_path: Path) -> None:
    damaged = text(UNITS, without(THREE, 5, 1))
    said = refused(tmp_path, f"Result:\tone\n{damaged}\nResult:\tother\n{OTHER}")
    assert "line 8 has 2 cells, the headings (line 2) 3, in section 'one'; `section` NAME reads another one" in said
    assert len(read(tmp_path, f"Result:\tone\n{damaged}\nResult:\tother\n{OTHER}", "other")[0]["rate"]) == 17


TIME = np.linspace(1, 60, 60)
SETTLING = 0.01 + 5 / TIME


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (text("time [s],stress [Pa],rate [1/s],viscosity [Pa.s]", rows(TIME, 10 + 0 * TIME, SETTLING, 10 / SETTLING)),
         "shear rates that change by a factor of 2 or more at one stress, as in creep"),
        (text("time [s],rate [1/s],viscosity [Pa.s]", rows(TIME, SETTLING, 10 / SETTLING)), "as in creep"),
        (text("time [s],rate [1/s],stress [Pa]", rows(TIME, SETTLING, 10 + 0 * TIME)), "as in creep"),
        (text("time [s],rate [1/s],viscosity [Pa.s]", rows(TIME, 10 * (1 - np.exp(-TIME / 4)), 1 - np.exp(-TIME / 5))),
         "of its rows at about one shear rate, 10, as in a hold or a start-up"),
        (text("time [s],rate [1/s],viscosity [Pa.s]", rows(TIME, np.tile([1, 10, 100.0], 20), np.exp(-TIME / 20))),
         "viscosity that change by a factor of 2 or more at one shear rate"),
        (text(UNITS, rows(RATES, ETA, np.linspace(20, 60, 17))), "has temperatures that differ by 32 K"),
        (text("rate [1/s],viscosity [Pa.s],T (°F)", rows(RATES, ETA, np.linspace(68, 140, 17))), "differ by 32 K"),
    ],
)  # fmt: skip
def test_what_is_no_flow_curve_of_one_liquid_is_not_fitted(content: str, says: str, tmp_path: Path) -> None:
    assert says in refused(tmp_path, content)


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (text("f [Hz],G' [Pa],G'' [Pa],temperature [C]", rows(RATES, STORAGE, LOSS, np.linspace(20, 60, 17))),
         "has temperatures that differ by 32 K"),
        (text("time [s],f [Hz],G' [Pa],G'' [Pa]", rows(TIME, np.tile([1, 10, 100.0], 20), np.exp(TIME / 9), TIME)),
         "storage that change by a factor of 2 or more at one frequency"),
    ],
)  # fmt: skip
def test_what_is_no_spectrum_of_one_liquid_is_not_fitted(content: str, says: str, tmp_path: Path) -> None:
    assert says in refused(tmp_path, content, kind="spectrum")


def test_curves_of_liquids_that_yield_and_with_repeated_rates_are_fitted(tmp_path: Path) -> None:
    yields = text("rate [1/s],stress [Pa]", rows(RATES, 5 + 0.02 * RATES**0.5))
    assert len(read(tmp_path, yields)[0]["rate"]) == 17
    up, down = rows(RATES, 1.3 * ETA), rows(RATES[::-1], ETA[::-1])
    assert len(read(tmp_path, text("rate [1/s],viscosity [Pa.s]", up + down))[0]["rate"]) == 34


def test_a_start_up_of_reptate_is_no_spectrum(tmp_path: Path) -> None:
    points = "\n".join("  ".join(row) for row in rows(TIME, TIME**0.5, TIME**0.3))
    assert len(read(tmp_path, f"Mw=94;T=-35;\n{points}", kind="spectrum")[0]["frequency"]) == 60
    assert "must have a line of headings" in refused(tmp_path, f"Mw=94;gdot=0.3;\n{points}", kind="spectrum")


@pytest.mark.parametrize("factor", [1e-3, 1e3, 10.0, 60.0, 1.3])
def test_a_viscosity_that_stress_over_rate_contradicts_is_refused(factor: float, tmp_path: Path) -> None:
    columns = rows(RATES, STRESS, factor * ETA)
    for heading in ("rate,stress,viscosity", "rate [1/s],stress [Pa],viscosity [Pa.s]"):
        said = refused(tmp_path, text(heading, columns))
        assert f"shear rate times viscosity is {factor:.3g} times the stress" in said
    bare = refused(tmp_path, text("rate,stress,viscosity", columns))
    assert 'write the unit of column 2 "stress" and column 3 "viscosity" into the heading' in bare


@pytest.mark.parametrize(
    ("heading", "sizes", "follows"),
    [
        ("rate [1/s],stress [Pa],viscosity", (1, 1, 1e3), 'column 3 "viscosity" has no unit'),
        ("rate,stress [Pa],viscosity", (1, 1, 1e3), "is the stress with mPa.s"),
        ("rate [1/s],stress [dyn/cm^2],viscosity", (1, 10, 10), "is the stress with P"),
        ("rate,stress [Pa],viscosity [Pa.s]", (60, 1, 1), "is the stress with 1/min"),
        ("rate [1/s],stress,viscosity [mPa.s]", (1, 1e-3, 1e3), ""),
        ("rate [1/s],stress [Pa],viscosity [Pa.s]", (1.04, 1, 1), ""),
    ],
)  # fmt: skip
def test_a_unit_follows_from_the_other_columns(
    heading: str, sizes: tuple[float, ...], follows: str, tmp_path: Path
) -> None:
    columns = (size * column for size, column in zip(sizes, (RATES, STRESS, ETA), strict=True))
    values, said = read(tmp_path, text(heading, rows(*columns)))
    assert values["viscosity"] == pytest.approx(ETA, rel=1e-5)
    assert values["rate"] == pytest.approx(RATES, rel=0.05)
    assert follows in said
    assert "viscosity, taken as" not in said


def test_columns_that_do_not_belong_together_are_refused(tmp_path: Path) -> None:
    said = refused(tmp_path, text("rate [1/s],stress [Pa],viscosity [Pa.s]", rows(RATES, WARM, ETA)))
    assert "must have columns that belong together: shear rate times viscosity is" in said


SPECTRUM = "G' [Pa],G'' [Pa],complex viscosity [Pa.s]"


def test_a_complex_viscosity_tells_hertz_from_radians(tmp_path: Path) -> None:
    columns = rows(RATES / (2 * np.pi), STORAGE, LOSS, COMPLEX_VISCOSITY)
    values, said = read(tmp_path, text(f"frequency,{SPECTRUM}", columns), kind="spectrum")
    assert values["frequency"] == pytest.approx(RATES, rel=1e-5)
    assert "the modulus of G' and G'' with Hz" in said
    said = refused(tmp_path, text(f"frequency [rad/s],{SPECTRUM}", columns), kind="spectrum")
    assert "frequency times complex viscosity is 0.159 times the modulus of G' and G''" in said


def test_a_loss_factor_tells_that_moduli_have_two_units(tmp_path: Path) -> None:
    columns = rows(RATES, STORAGE / 1e3, LOSS, LOSS / STORAGE)
    said = refused(tmp_path, text("omega [rad/s],G' [Pa],G'' [Pa],tan delta", columns), kind="spectrum")
    assert "storage modulus times loss factor is 0.001 times the loss modulus" in said
    values, _ = read(tmp_path, text("omega [rad/s],G' [kPa],G'' [Pa],tan delta", columns), kind="spectrum")
    assert values["storage"] == pytest.approx(STORAGE, rel=1e-5)


def test_a_row_in_which_columns_contradict_each_other_is_refused_with_its_line(tmp_path: Path) -> None:
    torn = [[*FOUR[6][:2], *FOUR[7][2:]] if i == 6 else row for i, row in enumerate(FOUR) if i != 7]
    said = refused(tmp_path, text(FOUR_UNITS, torn))
    assert (
        "in line 8 shear rate times viscosity is 0.792 times what it is in other rows, relative to the stress" in said
    )
    rounded = [[row[0], f"{float(row[1]):.1g}", row[2], row[3]] for row in FOUR]
    assert len(read(tmp_path, text(FOUR_UNITS, rounded))[0]["rate"]) == 17


@pytest.mark.parametrize("overload", ["9.99999999e+37", "9.9E37", "999999", "99999.00", "1e31"])
def test_what_stands_for_an_overload_is_left_out(overload: str, tmp_path: Path) -> None:
    over = [[row[0], overload if i in (0, 3) else row[1], row[2]] for i, row in enumerate(THREE)]
    values, said = read(tmp_path, text(UNITS, over))
    assert values["viscosity"] == pytest.approx(np.delete(ETA, [0, 3]), rel=1e-5)
    assert f"in the first one, line 2, column 2 \"viscosity [Pa.s]\" '{overload}' is an overload" in said


def test_nines_that_are_values_are_read(tmp_path: Path) -> None:
    eta = [99990, 9999, 1200, 999.9, 99.99, 50]
    values, _ = read(tmp_path, text("rate [1/s],viscosity [mPa.s]", [[str(i), str(x)] for i, x in enumerate(eta, 1)]))
    assert values["viscosity"] == pytest.approx([each / 1e3 for each in eta])


@pytest.mark.parametrize(
    ("content", "names"),
    [
        (text("water,,gel,\nrate [1/s],viscosity [Pa.s],rate [1/s],viscosity [Pa.s]", rows(RATES, ETA, RATES, ETA / 3)),
         ("section 'water'", "section 'gel'")),
        (text(",water,gel\nrate [1/s],viscosity [Pa.s],viscosity [Pa.s]", rows(RATES, ETA, ETA / 3)),
         ("section 'water'", "section 'gel'")),
        (text("rate [1/s],viscosity [Pa.s],rate [1/s],viscosity [Pa.s]", rows(RATES, ETA, RATES, ETA / 3)),
         ("section 'columns 1 and 2'", "section 'columns 3 and 4'")),
        (text("shear,shear,shear\nrate [1/s],viscosity [Pa.s],viscosity [Pa.s]", rows(RATES, ETA, ETA / 3)),
         ("section 'shear' below line 2, columns 1 and 2", "section 'shear' below line 2, columns 1 and 3")),
    ],
)  # fmt: skip
def test_tables_side_by_side_are_sections(content: str, names: tuple[str, str], tmp_path: Path) -> None:
    assert f"{names[0]}; {names[1]} (differs by a factor of 3)" in refused(tmp_path, content)
    for name, size in zip(names, (1, 1 / 3), strict=True):
        wanted = name.split("'")[1] if "columns" not in name else name
        values, said = read(tmp_path, content, wanted)
        assert values["viscosity"] == pytest.approx(ETA * size, rel=1e-5)
        assert "may be viscosity, too" not in said


def test_a_heading_that_is_repeated_is_no_row(tmp_path: Path) -> None:
    part = f"rate,viscosity,temperature\n1/s,Pa.s,C\n{text('', THREE[:9])[1:]}"
    values, said = read(tmp_path, f"{part}rate,viscosity,temperature\n{text('', THREE[9:])[1:]}")
    assert values["viscosity"] == pytest.approx(ETA, rel=1e-5)
    assert "left out" not in said


@pytest.mark.parametrize("by", [",", "\t", " "])
@pytest.mark.parametrize("lost", [True, False])
@pytest.mark.parametrize("where", ["heading", "first row", "a row", "last row", "all rows"])
def test_no_cell_that_is_lost_or_added_shifts_the_others(where: str, lost: bool, by: str, tmp_path: Path) -> None:
    heading = ["point", "rate(1/s)", "torque(mN.m)", "viscosity(Pa.s)", "temperature(C)"]
    whole = rows(np.arange(1.0, 18.0), RATES, np.linspace(0.5, 5, 17), ETA, WARM)
    assert len(read(tmp_path, text(by.join(heading), whole, by))[0]["rate"]) == 17
    changed = {"heading": [0], "first row": [1], "a row": [8], "last row": [17], "all rows": range(1, 18)}[where]
    for cell in range(5):
        lines = [heading, *whole]
        for i in changed:
            lines[i] = lines[i][:cell] + (lines[i][cell + 1 :] if lost else ["7.5", *lines[i][cell:]])
        said = refused(tmp_path, "\n".join(map(by.join, lines)))
        assert "must have a" in said, f"cell {cell}"
