"""Runs in a flow that varies in time: keys, units, tables of pumps, the answer of a cycle, resuming."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.pulses import case_of

import pairsim
from pairsim.errors import InputError
from pairsim.physics.waveform import Polyline
from pairsim.quantities.scales import mean_velocity
from pairsim.record.checkpoint import load
from pairsim.record.folder import write_yaml

SQUARE = {"shape": "square", "period": 1, "amplitude": 1}
UNEQUAL: dict[str, Any] = {"beta": [0.4, 0.35], "Ca_e": 0, "d0": 0.2, "length": 3, "mesh": {"Np": 8, "max_size": 0.3}}
UNEQUAL |= {"waveform": SQUARE, "output": {"fields": False}}
BENCH = {"tube": "60 um", "viscosity": "1 Pa.s", "particle": "24 um", "modulus": "5 kPa", "distance": "10 um"}
SLOW = {"shape": "sine", "period": "100 ms", "mean": "2 ul/min", "amplitude": "0.06 ul/min"}


def test_a_run_ends_once_cycles_are_periodic_and_tells_the_drift_of_the_last_one(tmp_path: Path) -> None:
    result = pairsim.run(UNEQUAL, folder=tmp_path / "run").check()
    assert (result.reason, result.table["t"].iloc[-1]) == ("periodic", 2.0)
    cycles = result.record["cycles"]
    assert abs(cycles["drift"][0]) <= cycles["drift_error"][0]
    assert cycles["periodic"]
    assert result.table["drift"].isna().sum() > 10
    assert result.table["drift"].iloc[-1] == pytest.approx(cycles["drift"][0])
    assert result.table["Q"].to_numpy()[[0, -1]].tolist() == [1.0, -1.0]
    first, second, third = result.findings()
    assert first.startswith("The pair may separate or come closer: its distance changes by ")
    assert "per cycle of 1 (cycle 2, " in first
    assert "Cycles have become periodic" in second
    last = result.table[result.table["t"] >= 1.0]
    least, most = last["d"].min(), last["d"].max()
    assert f"d goes from {least:.5g} to {most:.5g} and dU from" in third
    pairsim.plot(tmp_path / "run", out=tmp_path)
    assert (tmp_path / "series.png").stat().st_size > 10_000


def test_limits_drift_goes_on_to_the_end() -> None:
    result = pairsim.run({**UNEQUAL, "limits": {"drift": False}, "time": {"end": 2.3}}).check()
    assert (result.reason, result.record["cycles"]["whole"]) == ("end", 2)


def test_the_drift_at_a_held_distance_is_that_which_dU_would_cause() -> None:
    wave = {**SQUARE, "mean": 0.5}
    result = pairsim.run({**UNEQUAL, "waveform": wave, "hold": True}).check()
    series = result.table
    last = series[series["t"] > 1.0]
    assert np.ptp(series["d"]) < 1e-4
    per_flow = series["dU"] / series["Q"]
    assert per_flow.max() - per_flow.min() < 1e-3 * per_flow.mean()
    assert last["drift"].iloc[-1] == pytest.approx(0.5 * per_flow.iloc[-1], rel=1e-3)
    assert "at d = 0.2 held" in result.findings()[0]


@pytest.mark.slow
def test_resumed_within_a_cycle_it_has_the_same_cycles(tmp_path: Path) -> None:
    case = {**UNEQUAL, "waveform": {**SQUARE, "mean": 0.2}, "output": {"fields": False, "times": [0.6]}}
    whole = pairsim.run(case, folder=tmp_path / "whole").check()
    part = pairsim.run({**case, "time": {"end": 0.6}}, folder=tmp_path / "part").check()
    assert part.record["cycles"]["whole"] == 0
    assert "was complete" in part.findings()[0]
    resumed = pairsim.run(case, folder=tmp_path / "part", resume=True).check()
    for key in ("drift", "drift_error"):
        assert resumed.record["cycles"][key][0] == pytest.approx(whole.record["cycles"][key][0], rel=1e-3, abs=1e-9)
    assert resumed.table["t"].iloc[-1] == whole.table["t"].iloc[-1]
    checkpoint = load(tmp_path / "part")
    assert checkpoint is not None
    assert checkpoint.state.cycles is not None
    assert checkpoint.state.cycles.count == whole.record["cycles"]["whole"]


def test_with_units_the_unit_of_velocity_is_the_mean_flow_unless_one_is_given() -> None:
    case = case_of(physical=BENCH, waveform=SLOW)
    U_av = mean_velocity(2e-9 / 60, 60e-6)
    assert case.scales is not None
    assert case.scales.velocity == pytest.approx(U_av)
    assert case.Ca_es[0] == pytest.approx(1.0 * U_av / 60e-6 / 5e3)
    assert case.unit_of_flow == "mean"
    other = case_of(physical={**BENCH, "flow_rate": "4 ul/min"}, waveform=SLOW)
    assert other.scales is not None
    assert other.scales.velocity == pytest.approx(2 * U_av)
    assert other.drive.flow_at(0.0) == pytest.approx(0.5)
    assert other.unit_of_flow == "flow_rate"
    to_and_fro = case_of(physical=BENCH, waveform={**SLOW, "shape": "square", "mean": 0, "amplitude": "3 ul/min"})
    assert to_and_fro.drive.flow_at(0.0) == pytest.approx(1.0)
    again = case_of(**case.resolved())
    assert (again.resolved(), again.drive) == (case.resolved(), case.drive)


LOG = """Pump 3;ACME
Zeit [s];Flussrate [µl/min];Status
0;1,8;ok
1;2,2;ok
2;2,0;ok
"""
OTHERS = {
    "commas": "time (s),flow rate (ul/min)\n0,1.8\n1,2.2\n2,2.0\n",
    "quoted decimal commas": '"Zeit [s]","Flussrate [µl/min]"\n"0,0","1,8"\n"1,0","2,2"\n"2,0","2,0"\n',
    "dates": "timestamp,Q [ul/min]\n2026-01-01 12:00:05,1.8\n2026-01-01 12:00:06,2.2\n2026-01-01 12:00:07,2\n",
    "the day first": "time;Q [ul/min]\n31.10.2026 23:59:59;1,8\n01.11.2026 00:00:00;2,2\n01.11.2026 00:00:01;2,0\n",
    "a month that cannot be": "time,Q [ul/min]\n12/11/2026 23:59:59,1.8\n13/11/2026 00:00:00,2.2\n"
    "13/11/2026 00:00:01,2.0\n",
    "minutes and seconds": "time [mm:ss],Q [ul/min]\n00:59,1.8\n01:00,2.2\n01:01.0,2\n",
    "what was measured": "time [s],set flow rate [ul/min],measured flow rate [ul/min]\n0,1,1.8\n1,2,2.2\n2,3,2\n",
    "other units": "t / ms\tflow / nl/min\n0\t1800\n1000\t2200\n2000\t2000\n",
}


@pytest.mark.parametrize(
    ("text", "encoding"),
    [
        *(pytest.param(text, "utf-8", id=name) for name, text in {"decimal commas": LOG, **OTHERS}.items()),
        *(pytest.param(OTHERS["quoted decimal commas"], each, id=each) for each in ("cp1252", "utf-16")),
    ],
)
def test_a_pumps_log_is_read_beside_the_case_file(text: str, encoding: str, tmp_path: Path) -> None:
    (tmp_path / "pump.csv").write_text(text, encoding=encoding)
    write_yaml(tmp_path / "case.yaml", {"physical": BENCH, "waveform": {"table": "pump.csv"}})
    case = pairsim.load(tmp_path / "case.yaml")
    flow, scales = case.drive.waveform, case.scales
    assert scales is not None
    assert isinstance(flow, Polyline)
    mean = 2.05e-9 / 60  # [m^3/s]
    assert scales.velocity == pytest.approx(mean_velocity(mean, 60e-6))
    assert flow.flows == pytest.approx([1.8 / 2.05, 2.2 / 2.05, 2 / 2.05])
    assert flow.times == pytest.approx([0, 1 / scales.time, 2 / scales.time])
    assert case.time.end == flow.cycle
    (tmp_path / "pump.csv").unlink()
    assert pairsim.load(case.resolved()).drive == case.drive  # results need the file no more


WRONG: dict[str, tuple[dict[str, Any], str]] = {
    "no amplitude": ({"period": 1}, "waveform.amplitude"),
    "units without scales": ({"period": "1 s", "amplitude": 1}, "need the block `physical`"),
    "nothing flows": ({"period": 1, "amplitude": 0}, "always be at rest"),
    "a period of a table": ({"shape": "table", "times": [0, 1], "flows": [1, 2], "period": 1}, "left out"),
    "times that do not ascend": ({"shape": "table", "times": [0, 2, 1], "flows": [1, 2, 3]}, "ascend"),
    "a flow too few": ({"shape": "table", "times": [0, 1], "flows": [1]}, "a flow rate for each"),
    "no such file": ({"table": "none.csv"}, "must be a readable file"),
    "another shape": ({"shape": "saw", "period": 1, "amplitude": 1}, "'sine', 'square'"),
}


@pytest.mark.parametrize(("wave", "said"), WRONG.values(), ids=WRONG)
def test_a_wrong_waveform_is_refused(wave: dict[str, Any], said: str) -> None:
    with pytest.raises(InputError, match=said):
        pairsim.load({**UNEQUAL, "waveform": wave})


@pytest.mark.parametrize(
    ("wave", "said"),
    [
        ({**SLOW, "amplitude": 1}, r"waveform\.amplitude.* with its unit"),
        ({**SLOW, "period": "1 um"}, r"waveform\.period.*must be a time"),
        ({"period": "1 s", "amplitude": 1}, r"physical\.flow_rate: is missing"),
    ],
)
def test_units_of_a_waveform_are_those_of_flows_and_times(wave: dict[str, Any], said: str) -> None:
    with pytest.raises(InputError, match=said):
        pairsim.load({"physical": BENCH, "waveform": wave})


@pytest.mark.parametrize("text", ["a,b\n1,2\n", "time,flow [ul/min]\n1,2\n2,3\n", "t [s],Q [ul/min]\n1,x\n"])
def test_a_table_that_is_no_log_of_a_pump_is_refused(text: str, tmp_path: Path) -> None:
    (tmp_path / "pump.csv").write_text(text)
    write_yaml(tmp_path / "case.yaml", {"physical": BENCH, "waveform": {"table": "pump.csv"}})
    with pytest.raises(InputError, match=r"waveform\.table"):
        pairsim.load(tmp_path / "case.yaml")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        pytest.param("0;1\n\n2;2\n1;3\n", r"steps back from 2 to 1 in line 5", id="a clock that was set"),
        pytest.param("0;1,000\n1;950\n", r"'1,000' in line 2", id="thousands, or three decimals"),
        pytest.param("0;950,5\n1;1.234\n", r"'1.234' in line 3", id="thousands beside decimal commas"),
        pytest.param("0;950\n1;1.000\n2;1.050\n", r"'1.000' in line 3", id="thousands with points"),
        pytest.param("0;1\n\n1;x\n", r"not 'x', in line 4", id="a word"),
        pytest.param("0;1\n1;nan\n", r"not 'nan', in line 3", id="no value"),
        pytest.param("0;1;2\n", r"more cells than headings in line 2", id="a cell too many"),
        pytest.param("0\n", r"fewer cells than headings in line 2", id="a cell too few"),
    ],
)
def test_a_wrong_line_of_a_pumps_log_is_named(text: str, said: str, tmp_path: Path) -> None:
    (tmp_path / "pump.csv").write_text(f"time [s];flow [ul/min]\n{text}")
    write_yaml(tmp_path / "case.yaml", {"physical": BENCH, "waveform": {"table": "pump.csv"}})
    with pytest.raises(InputError, match=said):
        pairsim.load(tmp_path / "case.yaml")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("time,Q [ul/min]\n00:00,1\n00:30,2\n", r"has times such as 00:00, of hours and minutes or minutes and sec"),
        ("time,Q [ul/min]\n10/11/2026 23:59:59,1\n11/11/2026 00:00:01,2\n", "may begin with day or month"),
        ("time [mm:ss],Q [ul/min]\n00:00,1\n30,2\n", "must have times such as mm:ss, not '30', in line 3"),
        ("t [s],flow [ul/min],flow [ul/min]\n0,1,9\n1,2,8\n", r"must have one flow rate, but has the columns \"flow"),
        ("t [s],flow [mbar]\n0,1\n1,2\n", "must have a unit of flow rates in their heading, .* not mbar"),
    ],
)
def test_a_pumps_log_that_can_be_read_in_two_ways_is_refused(text: str, said: str, tmp_path: Path) -> None:
    (tmp_path / "pump.csv").write_text(text)
    write_yaml(tmp_path / "case.yaml", {"physical": BENCH, "waveform": {"table": "pump.csv"}})
    with pytest.raises(InputError, match=said):
        pairsim.load(tmp_path / "case.yaml")


def test_decimal_commas_between_commas_are_no_further_cells(tmp_path: Path) -> None:
    (tmp_path / "pump.csv").write_text("time [s],flow [ul/min]\n0,0,0,5\n0,5,1,0\n")
    write_yaml(tmp_path / "case.yaml", {"physical": BENCH, "waveform": {"table": "pump.csv"}})
    with pytest.raises(InputError, match="more cells than headings in line 2"):
        pairsim.load(tmp_path / "case.yaml")


def test_rates_off_the_axis_are_refused_as_they_are_of_steady_flow() -> None:
    with pytest.raises(InputError, match=r"focus.*rates off the axis are those of a steady flow"):
        pairsim.load({**UNEQUAL, "focus": True})


def test_curves_have_no_waveform() -> None:
    for more in ({}, {"velocity": 1, "flow": 0}, {"after": 1}):
        with pytest.raises(InputError, match="waveform"):
            pairsim.load({"beta": 0.4, "Ca_e": 0, "d": [0.1, 0.2], "waveform": SQUARE, **more}, kind="curve")


@pytest.mark.slow
@pytest.mark.parametrize(
    "more",
    [
        pytest.param({"De": 0.5, "Ca_e": 0.05}, id="soft, Giesekus"),
        pytest.param({"Ca_e": 0.05, "solid": {"law": "kelvin-voigt", "eta": 1.0}}, id="Kelvin-Voigt"),
        pytest.param({"liquid": {"law": "bingham", "Bn": 0.5}}, id="Bingham"),
        pytest.param(
            {"De": 0.5, "liquid": {"law": "oldroyd-b", "yielding": {"law": "saramito-2007", "Bn": 0.5}}}, id="Saramito"
        ),
        pytest.param({"liquid": {"law": "carreau", "n": 0.6, "Cu": 2.0}}, id="Carreau"),
    ],
)
def test_all_liquids_and_solids_go_over_a_jump_and_turn_round(more: dict[str, Any]) -> None:
    case = {**UNEQUAL, "beta": 0.4, **more, "time": {"end": 0.3, "tol": 3e-3}, "accuracy": "5%"}
    result = pairsim.run({**case, "waveform": {**SQUARE, "period": 0.3}}).check()
    series = result.table
    assert result.record["cycles"]["whole"] == 1
    before, after = series[series["t"] <= 0.15], series[series["t"] > 0.15]
    assert (before["U_L"] > 0).all()
    assert (after["U_L"] < 0).all()
    assert after["dp"].iloc[-1] < 0 < before["dp"].iloc[-1]
    assert after["dt"].iloc[0] < before["dt"].iloc[-1]


@pytest.mark.slow
def test_the_error_of_the_cells_is_part_of_the_drift() -> None:
    soft = {**UNEQUAL, "beta": 0.4, "Ca_e": 0.05, "dU_error": True, "time": {"end": 1.0, "tol": 2e-3}}
    series = pairsim.run(soft).check().table
    inside = series["dU_error"].to_numpy() @ series["dt"].to_numpy()
    assert series["drift_error"].iloc[-1] == pytest.approx(inside, rel=0.02)
    assert np.isfinite(series["dU_error"]).all()
