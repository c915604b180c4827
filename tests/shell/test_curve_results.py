"""A curve is the same object whether it was computed, read from a folder, answered by an atlas, or unpickled."""

from __future__ import annotations

import pickle
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pint
import pytest

import pairsim
from pairsim.analysis.curve_in_units import TravelInUnits
from pairsim.analysis.master_curve import Curve
from pairsim.analysis.travel import Travel
from pairsim.atlas.atlas import SHIPPED, Atlas
from pairsim.lab.atlas_curve import curve_of_atlas
from pairsim.record.folder import plain

QUANTITIES = {"tube": "50um", "particle": "20um", "flow_rate": "1ul/min", "viscosity": "1Pa.s", "modulus": "5kPa"}
COARSE = {"ends": "developed", "length": 3, "mesh": {"Np": 8, "max_size": 0.5}, "d": [0.1, 0.2, 0.4], "max_points": 3}
WAYS = ("computed", "opened", "asked", "computed, unpickled", "opened, unpickled", "asked, unpickled")


@pytest.fixture(scope="module")
def curves(tmp_path_factory: pytest.TempPathFactory) -> dict[str, pairsim.CurveResult]:
    """The result of a curve in each way."""
    folder = tmp_path_factory.mktemp("curves") / "curve"
    case = COARSE | {"physical": QUANTITIES}
    stored = pairsim.curve(case, folder=folder, sensitivities=True).check()
    found = {"computed": pairsim.curve(case, sensitivities=True), "opened": pairsim.open(folder)}
    assert stored.frame().equals(found["opened"].frame())
    found["asked"] = pairsim.ask(**QUANTITIES | {"modulus": "5 +- 1 kPa"})
    return found | {f"{way}, unpickled": pickle.loads(pickle.dumps(result)) for way, result in found.items()}


@pytest.fixture(params=WAYS)
def result(request: pytest.FixtureRequest, curves: dict[str, pairsim.CurveResult]) -> pairsim.CurveResult:
    return curves[request.param]


def test_it_is_its_interpolant_and_an_error_outside(result: pairsim.CurveResult) -> None:
    d, dU, error = (result.table[name].to_numpy() for name in ("d", "dU", "dU_error"))
    assert isinstance(result.curve, Curve)
    assert result.dU(d) == pytest.approx(dU)
    assert result.curve(d)[1] == pytest.approx(error)
    between = float(np.sqrt(d[0] * d[1]))
    value, half_width = result.curve(f"{50 * between:.15g}um")
    assert value.to("m/s").magnitude == pytest.approx(result.scales.velocity * result.dU(between), rel=1e-9)
    assert half_width.to("um/s").magnitude > 0
    assert result.dU([[d[0], between]]).shape == (1, 2)
    with pytest.raises(pairsim.InputError, match="the ends of the curve"):
        result.dU(d[0] / 2)
    with pytest.raises(pairsim.InputError, match="gap"):
        result.dU(between, gap=2)


def test_it_has_its_tables_in_both_units(result: pairsim.CurveResult) -> None:
    frame, physical = result.frame(), result.physical
    assert list(frame) == list(result.table)
    assert (frame.attrs["units"]["dU"], physical.attrs["units"]["dU"]) == ("U_av", "um/s")
    assert physical["dU"].to_numpy() == pytest.approx(1e6 * result.scales.velocity * frame["dU"].to_numpy())
    assert result.frame(at=["10um"], physical=True)["dU"][0] == pytest.approx(result.dU("10um").magnitude)
    assert list(result.zeros.columns[:3]) == ["d", "stable", "slope"]
    assert result.frame("equilibria")["d"].tolist() == result.zeros["d"].tolist()


def test_it_knows_its_peak_its_regions_its_motion_and_its_inputs(result: pairsim.CurveResult) -> None:
    curve, d = result.curve, result.columns["d"]
    assert abs(curve.peak.dU) == pytest.approx(np.abs(curve.of().samples[1]).max())
    assert [zero.d for zero in curve.zeros] == result.zeros["d"].tolist()
    assert curve.regions
    assert curve.motion is not None
    start = float(d[1])
    moved = curve.motion.path(start, np.array([0.0, 1.0]))
    assert moved[0] == pytest.approx(start)
    assert (moved[1] > start) == (curve(start)[0] > 0)
    inputs = {each.key: each for each in result.record.inputs}
    change = curve.change_by(inputs["modulus"])
    assert change is not None
    assert change.shape == d.shape
    assert curve.scales == result.scales


def test_asked_with_units_it_answers_with_units(result: pairsim.CurveResult) -> None:
    curve, scales = result.curve, result.scales
    own = pint.UnitRegistry()
    both = result.dU(own.Quantity([6.0, 9.0], "um")), result.dU(["6 um", "0.009 mm"])
    assert both[0].magnitude == pytest.approx(both[1].magnitude)
    assert str(result.dU("6um").units) == "micrometer / second"
    in_numbers, in_units = curve.peak, curve.in_units.peak
    assert in_units.dU.to("m/s").magnitude == pytest.approx(in_numbers.dU * scales.velocity)
    assert in_units.error.to("m/s").magnitude == pytest.approx(in_numbers.error * scales.velocity)
    assert (in_units.d.to("m").magnitude, in_units.d_error.to("m").magnitude) == pytest.approx(
        (in_numbers.d * scales.length, in_numbers.d_error * scales.length)
    )
    zeros = [(zero.d.to("m").magnitude, zero.kind) for zero in curve.in_units.zeros]
    assert zeros == [(pytest.approx(zero.d * scales.length), zero.kind) for zero in curve.zeros]
    inputs = curve.inputs_half_width("6um").to("m/s").magnitude
    assert inputs == pytest.approx(scales.velocity * curve.inputs_half_width(0.12))
    assert result.frame(at=[own.Quantity(6, "um")])["d"][0] == pytest.approx(curve.distance("6um"))
    with pytest.raises(pairsim.InputError, match="must be a length above 0"):
        result.dU("6 s")


def test_travels_in_units_are_quantities_with_half_widths(curves: dict[str, pairsim.CurveResult]) -> None:
    answer = curves["asked"]
    numbers, found = answer.travel(0.1, 0.2), answer.travel("5um", pint.UnitRegistry().Quantity(10, "um"))
    assert isinstance(numbers, Travel)
    assert isinstance(found, TravelInUnits)
    assert found.time.to("s").magnitude == pytest.approx(numbers.time * answer.scales.time)
    assert found.length_error.to("m").magnitude == pytest.approx(numbers.length_error * answer.scales.length)
    assert 0 < found.time_inputs < found.time
    assert str(found) == str(numbers)
    assert (found.start.magnitude, found.stop.magnitude) == pytest.approx((5.0, 10.0))
    assert found.start_error is None


def test_it_has_an_answer_a_case_and_a_picture(result: pairsim.CurveResult, tmp_path: Path) -> None:
    assert result.findings()[0].startswith("The pair ")
    assert result.answer.startswith("\n".join(result.findings()[:1]))
    assert (result.case.kind, result.case.beta) == ("curve", 0.4)
    assert (result.status, result.kind, result.reason in ("", "end")) == ("finished", "curve", True)
    assert result.advice.startswith("Next: ")
    assert repr(result).startswith(f"<pairsim curve: finished, {len(result.table)} rows")
    assert result.places.size == 0
    assert [path.name for path in result.plot(tmp_path)] == ["curve.png"]


@pytest.mark.parametrize("way", ["computed", "opened", "asked"])
def test_unpickled_it_says_the_same(way: str, curves: dict[str, pairsim.CurveResult]) -> None:
    first, again = curves[way], curves[f"{way}, unpickled"]
    pd.testing.assert_frame_equal(again.frame(), first.frame())
    pd.testing.assert_frame_equal(again.physical, first.physical)
    assert again.frame().attrs == first.frame().attrs
    assert again.case == first.case
    assert plain(again.record) == plain(first.record)
    assert (again.answer, again.advice, repr(again)) == (first.answer, first.advice, repr(first))


def test_a_result_keeps_its_data_where_its_folder_is_gone(tmp_path: Path) -> None:
    case = COARSE | {"beta": 0.4, "De": 0, "Ca_e": 0, "particles": 1, "length": 3}
    result = pairsim.curve({name: value for name, value in case.items() if name != "d"}, folder=tmp_path / "one")
    content, answer = pickle.dumps(result), result.answer
    shutil.rmtree(tmp_path / "one")
    again = pickle.loads(content)
    assert again.frame().equals(result.frame())
    assert again.answer == answer
    assert again.case.n == 1


def of_atlas(shipped: Atlas) -> Curve:
    return curve_of_atlas(shipped, beta=0.4, De=0.0, Ca_e=0.05)


def read(shipped: Atlas) -> Curve:
    """The same by way of its columns, as of a folder."""
    found = of_atlas(shipped)
    return Curve(dict(found.table), dict(found.equilibria))


def unpickled(shipped: Atlas) -> Curve:
    return pickle.loads(pickle.dumps(of_atlas(shipped)))  # type: ignore[no-any-return]


@pytest.mark.parametrize("made", [of_atlas, read, unpickled])
def test_a_curve_alone_is_the_same_object_too(made: Callable[[Atlas], Curve]) -> None:
    shipped = Atlas.load(next(path for path in SHIPPED if path.stem == "newtonian"))
    first, curve = of_atlas(shipped), made(shipped)
    d = np.geomspace(0.03, 1.5, 30)
    assert np.array_equal(curve(d), first(d))
    assert (curve.peak, curve.zeros, curve.regions) == (first.peak, first.zeros, first.regions)
    way = sorted((0.1, 0.5), reverse=curve(0.2)[0] < 0)
    assert str(curve.travel(*way)) == str(first.travel(*way))
    assert curve.forgotten(0.1) == first.forgotten(0.1)


def test_fields_are_asked_for_and_found_by_lengths(tmp_path: Path) -> None:
    case = COARSE | {"physical": QUANTITIES, "d": [0.2], "fields": ["0.01 mm"]}
    assert pairsim.load(case, kind="curve").fields == (0.2,)
    result = pairsim.curve(case, folder=tmp_path / "curve").check()
    for place in ("10um", 0.2, pint.UnitRegistry().Quantity(10, "um")):
        assert result.fields(place).field_data["t"] == pytest.approx([0.2])
    with pytest.raises(pairsim.InputError, match=r"fields: d: got '12um'; must be one of 0\.2"):
        result.fields("12um")
    with pytest.raises(pairsim.InputError, match="got '3 s'; has the unit s; must be a length above 0"):
        result.fields("3 s")


def test_lengths_of_fields_are_named_where_they_are_none() -> None:
    with pytest.raises(pairsim.InputError, match=r"fields\[1\]: got '3 s'; has the unit s; must be a length above 0"):
        pairsim.load(COARSE | {"physical": QUANTITIES, "fields": ["10 um", "3 s"]}, kind="curve")
    with pytest.raises(pairsim.InputError, match=r"fields\[0\]: got '10 um'; must be a number"):
        pairsim.load(COARSE | {"beta": 0.4, "De": 0, "Ca_e": 0.1, "fields": ["10 um"]}, kind="curve")
