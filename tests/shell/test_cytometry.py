"""Look-up tables and moduli of a cytometer's events, on files made here.

The shapes are those of a law that has an exact inverse: the deformation is C area^2/modulus^2.
"""

from __future__ import annotations

import fcntl
import json
import re
from pathlib import Path
from typing import Any

import h5py
import hdf5plugin
import numpy as np
import pandas as pd
import pytest
import yaml
from support.commands import Pairsim

import pairsim as api
from pairsim.errors import InputError
from pairsim.lab.cytometer.look_up_table import in_square, look_up_table, read_look_up_table
from pairsim.lab.cytometer.moduli import DECAYS, OFFSET
from pairsim.lab.cytometer.suspending_media import gradient_in_square, methyl_cellulose, wall_rate

POWER_LAW = {"law": "power-law", "n": 0.6}
SCALES = {"length": 21.88e-6, "velocity": 0.10638, "time": 21.88e-6 / 0.10638, "stress": 68.3}
MEDIUM = {"setup:medium": "CellCarrierB", "setup:temperature": 23.0}
SETUP = {"setup:channel width": 20.0, "setup:flow rate": 0.04, "imaging:pixel size": 0.34, **MEDIUM}


def shapes(folder: Path, liquid: Any = POWER_LAW, De: float = 0.0) -> Path:
    """A folder of a sweep of shapes of spheres in a tube of 21.88 um."""
    for beta in (0.4, 0.5, 0.6, 0.7):
        (case := folder / f"beta{beta}").mkdir(parents=True)
        (case / "case.yaml").write_text(yaml.safe_dump({"liquid": liquid, "De": De, "xi": 0.1}))
        (case / "run.json").write_text(json.dumps({"kind": "shape", "status": "finished", "scales": SCALES}))
        lines = ["Ca_e,area_hull,deformation_hull,deformation_error"]
        for Ca_e in (0.03, 0.05, 0.1, 0.2):
            area = np.pi / 4 * beta**2
            lines.append(f"{Ca_e},{area!r},{6 * area**2 * Ca_e**2!r},{1e-4 * Ca_e**2!r}")
        (case / "shape.csv").write_text("\n".join([*lines, ""]))
    return folder


def modulus(area: Any, deformation: Any) -> Any:
    """Young's modulus [kPa] by the law of the shapes, of an area [um^2]."""
    return 3e-3 * SCALES["stress"] * np.sqrt(6 / deformation) * area * 1e-12 / SCALES["length"] ** 2


@pytest.fixture(scope="module")
def table(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("cytometry")
    (folder / "lut.txt").write_text(look_up_table(shapes(folder / "beads"))[0])
    return folder / "lut.txt"


def cytometer_file(path: Path, events: dict[str, Any], **setup: Any) -> Path:
    with h5py.File(path, "w") as file:
        file.attrs.update({key: value for key, value in {**SETUP, **setup}.items() if value is not None})
        for name, values in events.items():
            file.create_dataset(f"events/{name}", data=values, compression="gzip")
    return path


def seen(area: Any, deformation: Any, pixel: float = 0.34) -> dict[str, Any]:
    """Events as pixels show them."""
    added = sum(a * np.exp(-area * (0.34 / pixel) ** 2 / decay) for a, decay in DECAYS)
    return {"area_um": area, "deform": deformation + OFFSET + added}


AREA, DEFORMATION = np.array([70.0, 100.0, 150.0, 100.0]), np.array([0.004, 0.006, 0.02, 0.5])


def test_moduli_are_those_of_the_table(table: Path, tmp_path: Path, pairsim: Pairsim) -> None:
    cytometer_file(tmp_path / "a.rtdc", seen(AREA, DEFORMATION))
    done = pairsim("moduli", "a.rtdc", "--table", str(table), "--carrier", "table")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "a-moduli.png").is_file()
    area, deformation, E, error = np.genfromtxt(tmp_path / "a-moduli.csv", delimiter=",", skip_header=1).T
    assert deformation == pytest.approx(DEFORMATION, rel=1e-5)
    assert E[:3] == pytest.approx(modulus(area, deformation)[:3], rel=2e-3)
    assert (abs(E - modulus(area, deformation)) < error)[:3].all()
    assert np.isnan(E[3])
    assert "3 of 4 events" in done.stdout
    assert "1.094 times as wide" in done.stdout


def test_moduli_at_another_flow_rate_and_in_another_channel_follow_the_stress(table: Path, tmp_path: Path) -> None:
    """E goes as K (Q/w^3)^n at the same shape; the table holds for areas that are (w/20 um)^2 as large."""
    other = {"setup:channel width": 30.0, "setup:flow rate": 0.16, "imaging:pixel size": 0.3}
    file = cytometer_file(tmp_path / "b.rtdc", seen(AREA[:3] * 2.25, DEFORMATION[:3], 0.3), **other)
    found = api.moduli(file, table, carrier="table").table
    expected = modulus(AREA, DEFORMATION)[:3] * (4 / 1.5**3) ** 0.6
    assert found["emodulus"].to_numpy() == pytest.approx(expected, rel=2e-3)
    K, n = methyl_cellulose("CellCarrier B", 23)
    named = api.moduli(file, table)
    rate, of_table = wall_rate(0.16e-9, 30e-6, n), wall_rate(0.04e-9, 20e-6, 0.6)
    meta, _ = read_look_up_table(table)
    stress = K * rate**n / (meta["fluid_consistency_coefficient"] * of_table**0.6)
    assert named.table["emodulus"].to_numpy() == pytest.approx(modulus(AREA, DEFORMATION)[:3] * stress, rel=2e-3)
    assert (named.table["emodulus_error"] > found["emodulus_error"]).all()
    warm = cytometer_file(tmp_path / "t.rtdc", {**seen(AREA, DEFORMATION), "temp": [27.0, np.nan, 27, 27]})
    pd.testing.assert_frame_equal(api.moduli(warm, table).table, api.moduli(warm, table, celsius=27).table)
    assert (api.moduli(warm, table).table["emodulus"] < api.moduli(warm, table, celsius=23).table["emodulus"])[:3].all()


def test_the_head_has_the_viscosity_at_the_walls_and_an_identifier_that_is_no_folder(table: Path) -> None:
    meta, _ = read_look_up_table(table)
    assert meta["identifier"] == "pairsim:beads"
    assert meta["channel_width"] == pytest.approx(20, rel=1e-5)
    K, n = meta["fluid_consistency_coefficient"], meta["fluid_flow_behaviour_index"]
    assert n == pytest.approx(0.6, abs=1e-6)
    unit = SCALES["stress"] * SCALES["time"]
    assert pytest.approx(unit * SCALES["time"] ** (n - 1), rel=1e-6) == K
    assert meta["fluid_viscosity"] == pytest.approx(1e3 * K * wall_rate(0.04e-9, 20e-6, n) ** (n - 1), rel=1e-3)


@pytest.mark.parametrize(
    ("name", "viscosity"), [("0.49% MC-PBS", 5.379), ("0.6% MC-PBS", 6.335), ("0.8% mc pbs", 8.430)]
)
def test_carriers_have_the_viscosities_of_dclab(name: str, viscosity: float) -> None:
    """dclab 0.73, 'buyukurganci-2022', 20 um, 0.04 ul/s, 23 degC; its 0.6671 for 0.6771 is 0.3 to 0.5 %."""
    K, n = methyl_cellulose(name, 23)
    assert 1e3 * K * wall_rate(0.04e-9, 20e-6, n) ** (n - 1) == pytest.approx(viscosity, rel=5e-3)


def test_a_square_channel_raises_moduli_as_tables_in_three_dimensions_do(table: Path) -> None:
    """Quotients of dclab's HE-3D-FEM-22 over HE-2D-FEM-22, and the exact Newtonian pressure gradients."""
    assert gradient_in_square(1.0, 1.094) == pytest.approx(28.4541 * np.pi * 1.094**4 / 128, rel=1e-3)
    area, deformation = np.array([[59.71, 93.65, 135.35, 187.03], [0.0133, 0.0109, 0.0182, 0.0303]])
    size = np.sqrt(4 / np.pi * area) / 20
    factor, error = in_square(0.6039, size, deformation, elastic=False)
    assert factor == pytest.approx([1.0385, 1.0487, 1.0638, 1.1023], abs=0.004)
    assert (error > 0.01).all()
    assert (in_square(0.6039, size, deformation, elastic=True)[1] > error).all()
    text, notes = look_up_table(table.parent / "beads", "square")
    (table.parent / "square.txt").write_text(text)
    (_, of_tube), (_, of_square) = (read_look_up_table(table.parent / f"{name}.txt") for name in ("lut", "square"))
    assert (of_square[:, 2] / of_tube[:, 2]).min() > 1.03
    assert (of_square[:, 3] > of_tube[:, 3] + 0.01).all()
    assert notes[0].startswith("square channel: moduli are raised by 3.9 to 10.2 %")


@pytest.mark.parametrize(
    ("setup", "events", "said"),
    [
        ({"setup:flow rate": None}, {}, "setup:flow rate"),
        ({"setup:chip region": "reservoir"}, {}, "must be channel"),
        ({"setup:medium": "honey"}, {}, "0.83% MC-PBS"),
        ({"setup:temperature": None}, {}, "celsius: must be given"),
        ({}, {"deform": None}, "deform"),
        ({}, {"deform": np.full(4, 0.9)}, "must have events in the table"),
        ({"setup:medium": "0.52% MC-PBS"}, {}, "0.83% MC-PBS"),
        ({"setup:medium": None}, {}, "setup:medium: must be"),
        ({}, {"area_um": AREA[:3]}, "same number of values each"),
        ({}, {"area_um": AREA[:0], "deform": AREA[:0]}, "at least one event"),
        ({}, {"area_um": np.ones((4, 2))}, "events/area_um: must have one number for each event"),
        ({}, {"deform": np.full(4, b"0.02")}, "events/deform: must have one number for each event"),
        ({}, {"area_um": np.full(4, np.nan)}, "those of the file are not numbers"),
        ({"setup:temperature": None}, {"temp": np.full(4, 296.15)}, "temp: got 296.15; must be above 0 and below 100"),
    ],
)
def test_files_that_say_too_little_are_refused(
    setup: dict[str, Any], events: dict[str, Any], said: str, table: Path, tmp_path: Path
) -> None:
    given = {key: each for key, each in {**seen(AREA, DEFORMATION), **events}.items() if each is not None}
    with pytest.raises(InputError, match=said):
        api.moduli(cytometer_file(tmp_path / "c.rtdc", given, **setup), table)


FLOW, WIDTH, PIXEL, CELSIUS = "setup:flow rate", "setup:channel width", "imaging:pixel size", "setup:temperature"


@pytest.mark.parametrize(
    ("key", "value", "allowed"),
    [
        *((FLOW, value, "from 0.0001 to 100 uL/s") for value in (0.0, -0.04, np.nan, 4e-11, "0.04 um", "fast", True)),
        *((WIDTH, value, "from 1 to 1000 um") for value in (0.0, np.inf, 2e-5, "20 Pa", "", h5py.Empty("f"))),
        (WIDTH, np.array([20.0, 20.0]), "must be one number from 1 to 1000 um"),
        *((PIXEL, value, "from 0.01 to 5 um") for value in (0.0, -0.34, 3.4e-7, 340.0)),
        *((CELSIUS, value, "above 0 and below 100 degC; give `celsius`") for value in (0.0, 296.15, np.nan, -5.0)),
    ],
)
def test_attributes_that_are_not_physical_are_refused(
    key: str, value: Any, allowed: str, table: Path, tmp_path: Path
) -> None:
    file = cytometer_file(tmp_path / "n.rtdc", seen(AREA, DEFORMATION), **{key: value})
    with pytest.raises(InputError) as caught:
        api.moduli(file, table)
    assert (caught.value.key, caught.value.file) == (key, str(file))
    assert allowed in str(caught.value)


@pytest.mark.parametrize(
    "setup",
    [
        {FLOW: "0.04 uL/s"},
        {FLOW: np.bytes_(b"2.4 ul/min")},
        {WIDTH: np.array([20.0]), PIXEL: "340 nm"},
        {WIDTH: "20 \N{MICRO SIGN}m", CELSIUS: "296.15 K"},
        {"imaging:frame rate": 0.0, "setup:medium": np.array([b"0.6% MC-PBS"])},
    ],
)
def test_attributes_are_read_as_numbers_and_as_texts_with_units(
    setup: dict[str, Any], table: Path, tmp_path: Path
) -> None:
    events = seen(AREA, DEFORMATION)
    expected = api.moduli(cytometer_file(tmp_path / "a.rtdc", events), table).table
    pd.testing.assert_frame_equal(
        api.moduli(cytometer_file(tmp_path / "b.rtdc", events, **setup), table).table, expected
    )


def test_area_and_deformation_follow_from_pixels_and_circularity(table: Path, tmp_path: Path) -> None:
    events = seen(AREA, DEFORMATION)
    others = {"area_cvx": events["area_um"] / 0.34**2, "circ": 1 - events["deform"]}
    expected = api.moduli(cytometer_file(tmp_path / "a.rtdc", events), table).table
    pd.testing.assert_frame_equal(api.moduli(cytometer_file(tmp_path / "b.rtdc", others), table).table, expected)


@pytest.mark.parametrize(
    ("temperatures", "said"),
    [
        (np.zeros(4), "temp of 4 of 4 events cannot be that of a liquid in degC (0): setup:temperature was taken"),
        (np.full(4, 296.15), "(296.1): setup:temperature was taken"),
        (
            [0.0, 23.0, 23.0, np.nan],
            "temp of 1 of 4 events cannot be that of a liquid in degC (0): that of",
        ),
    ],
)
def test_temperatures_of_a_sensor_that_is_off_or_in_kelvin_are_not_taken(
    temperatures: Any, said: str, table: Path, tmp_path: Path
) -> None:
    events = seen(AREA, DEFORMATION)
    expected = api.moduli(cytometer_file(tmp_path / "a.rtdc", events), table).table
    found = api.moduli(cytometer_file(tmp_path / "b.rtdc", {**events, "temp": temperatures}), table)
    pd.testing.assert_frame_equal(found.table, expected)
    assert said in "\n".join(found.sentences)


@pytest.mark.parametrize(
    ("setup", "events", "said"),
    [
        ({}, {"temp": np.full(4, 37.0)}, "setup:temperature is 14 K from the median of the events"),
        ({FLOW: 2.4}, {}, "measured from 5,000 to 150,000 1/s: it is extrapolated to"),
        ({"setup:flow rate sample": 0.01, "setup:flow rate sheath": 0.05}, {}, "is not the sum of its parts"),
        ({PIXEL: 0.68}, {"area_cvx": AREA / 0.34**2}, "by area_um over area_cvx it is 0.34 um"),
        ({"calculation:emodulus viscosity": 5.0}, {}, "calculation:emodulus viscosity, 5.0, was not used"),
    ],
)
def test_contradictions_in_a_file_are_said(
    setup: dict[str, Any], events: dict[str, Any], said: str, table: Path, tmp_path: Path
) -> None:
    plain = api.moduli(cytometer_file(tmp_path / "a.rtdc", seen(AREA, DEFORMATION)), table)
    assert "warning" not in "\n".join(plain.sentences)
    file = cytometer_file(tmp_path / "b.rtdc", {**seen(AREA, DEFORMATION), **events}, **setup)
    assert any(said in each and each.startswith("warning: ") for each in api.moduli(file, table).sentences)


def test_one_event_is_drawn(table: Path, tmp_path: Path, pairsim: Pairsim) -> None:
    cytometer_file(tmp_path / "a.rtdc", seen(AREA[:1], DEFORMATION[:1]))
    done = pairsim("moduli", "a.rtdc", "--table", str(table))
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "a-moduli.png").is_file()
    refused = pairsim("moduli", "a.rtdc", "--table", str(table), "-o", "moduli.png")
    assert "must be a CSV file: the picture is moduli.png" in refused.stderr


@pytest.mark.parametrize("celsius", [0, -5, 296.15, float("nan")])
def test_carriers_are_liquids(celsius: float, table: Path, tmp_path: Path, pairsim: Pairsim) -> None:
    file = cytometer_file(tmp_path / "a.rtdc", seen(AREA, DEFORMATION))
    with pytest.raises(InputError, match=r"celsius: got .*; must be above 0 and below 100, in degrees Celsius"):
        api.moduli(file, table, celsius=celsius)
    flow = ("--tube", "21.88um", "--particle", "12um", "--flow", "0.04ul/s", "--young", "2kPa", "--carrier", "0.5%")
    done = pairsim("units", *flow, "--celsius", str(celsius), "--set", "particles=1")
    assert (done.returncode, "--celsius: got" in done.stderr) == (2, True)


def test_carriers_are_those_whose_viscosity_is_known(table: Path, tmp_path: Path) -> None:
    """A concentration beside those of the law has another viscosity; no name of the nearest one is taken for it."""
    file = cytometer_file(tmp_path / "a.rtdc", seen(AREA, DEFORMATION))
    for name in ("0.52% MC-PBS", "0.61%", "water", "", "mc"):
        with pytest.raises(InputError, match=r"carrier: got .*; must be 0\.49% MC-PBS"):
            api.moduli(file, table, carrier=name)
    assert "carrier: 0.5% (0.49% MC-PBS) at 23 degC" in api.moduli(file, table, carrier="0.5%").sentences[1]
    with pytest.raises(InputError, match="celsius: got 30; must be left out"):
        api.moduli(file, table, carrier="table", celsius=30)


def test_files_that_are_in_use_or_refer_to_others_are_told_apart(table: Path, tmp_path: Path) -> None:
    file = cytometer_file(tmp_path / "a.rtdc", seen(AREA, DEFORMATION))
    with file.open("rb") as other:
        fcntl.flock(other, fcntl.LOCK_EX)
        with pytest.raises(InputError, match="another program has the file open for writing"):
            api.moduli(file, table)
    basin = json.dumps({"type": "file", "features": ["area_um"], "paths": ["M001_raw.rtdc"]}, indent=1).splitlines()
    file = cytometer_file(tmp_path / "b.rtdc", {"deform": DEFORMATION})
    with h5py.File(file, "a") as opened:
        opened.create_dataset("basins/0", data=[line.encode() for line in basin])
    with pytest.raises(
        InputError, match=r"area_um: is missing in the file, whose events are in other files.*M001_raw.rtdc"
    ):
        api.moduli(file, table)
    with h5py.File(tmp_path / "c.rtdc", "w") as opened:
        opened["other"] = 1
    with pytest.raises(InputError, match="events: must be a group"):
        api.moduli(tmp_path / "c.rtdc", table)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('"channel_width": 20.0', '"channel_width": 0.0', "channel_width must be from 1 to 1000 um, not 0.0"),
        ('"channel_width_unit": "um"', '"channel_width_unit": "m"', "channel_width must be in um, not m"),
        ('"fluid_viscosity_unit": "mPa s"', '"fluid_viscosity_unit": "Pa s"', "fluid_viscosity must be in mPa s"),
        ("emodulus [kPa]", "emodulus [Pa]", "no column emodulus [kPa]"),
        ("\n1", "\n-1", "must have areas, deformations and moduli above 0 in all rows"),
    ],
)
def test_tables_with_numbers_that_are_not_physical_are_refused(
    old: str, new: str, said: str, table: Path, tmp_path: Path
) -> None:
    text = table.read_text()
    assert old in text
    (wrong := tmp_path / "lut.txt").write_text(text.replace(old, new))
    with pytest.raises(InputError, match=re.escape(said)):
        api.moduli(cytometer_file(tmp_path / "a.rtdc", seen(AREA, DEFORMATION)), wrong)


def test_compressed_files_are_read(table: Path, tmp_path: Path) -> None:
    """With the filter that cytometers' files have."""
    file = cytometer_file(tmp_path / "z.rtdc", {"deform": seen(AREA, DEFORMATION)["deform"]})
    with h5py.File(file, "a") as opened:
        opened.create_dataset("events/area_um", data=AREA, **hdf5plugin.Zstd(clevel=5))
    assert api.moduli(file, table).table["emodulus"].notna().sum() == 3


def test_units_takes_a_carrier_by_name(tmp_path: Path, pairsim: Pairsim) -> None:
    flow = ("units", "--tube", "21.88um", "--particle", "12um", "--flow", "0.04ul/s", "--young", "2kPa")
    done = pairsim(*flow, "--carrier", "CellCarrier B", "--celsius", "24", "--set", "particles=1", "-o", "c.yaml")
    assert done.returncode == 0, done.stderr
    case = api.load(tmp_path / "c.yaml")
    K, n = methyl_cellulose("0.59% MC-PBS", 24)
    assert case.liquid_model.solvent.numbers == {"n": pytest.approx(n, abs=1e-6)}
    assert case.scales.viscosity == pytest.approx(K * (case.scales.velocity / case.scales.length) ** (n - 1), rel=1e-4)
    assert "extrapolated" not in done.stdout
    hot = pairsim(*flow, "--carrier", "CellCarrier", "--celsius", "50", "--set", "particles=1")
    assert "measured from 22 to 37 degC: it is extrapolated to 50 degC" in hot.stdout
    assert "honey" in pairsim(*flow, "--carrier", "honey").stderr


def test_other_files_are_refused(table: Path, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="No such file"):
        api.moduli(tmp_path / "none.rtdc", table)
    (other := tmp_path / "d.rtdc").write_text("text")
    with pytest.raises(InputError, match="must be a cytometer file"):
        api.moduli(other, table)
    with pytest.raises(InputError, match="must be a table of pairsim table --cytometry"):
        api.moduli(other, other)


def test_a_table_of_a_viscoelastic_carrier_holds_for_its_own_flow_alone(tmp_path: Path) -> None:
    text = look_up_table(shapes(tmp_path / "elastic", {"law": "giesekus", "alpha": 0.2}, De=2.0))[0]
    (table := tmp_path / "lut.txt").write_text(text)
    assert '"fluid_law": "giesekus"' in text
    assert "fluid_flow_behaviour_index" not in text
    found = api.moduli(cytometer_file(tmp_path / "e.rtdc", seen(AREA, DEFORMATION)), table).table
    assert found["emodulus"][:3].to_numpy() == pytest.approx(modulus(AREA, DEFORMATION)[:3], rel=2e-3)
    fast = cytometer_file(tmp_path / "f.rtdc", seen(AREA, DEFORMATION), **{"setup:flow rate": 0.08})
    with pytest.raises(InputError, match="another flow needs another table"):
        api.moduli(fast, table)
