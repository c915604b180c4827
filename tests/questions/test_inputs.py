"""The part of the inputs in what a curve says, against a curve whose dependence on them is known."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from support.result_folders import curve_of, curve_table, make_curve
from typer.testing import CliRunner

import pairsim
from pairsim.analysis.master_curve import Curve
from pairsim.analysis.zeros import Zero
from pairsim.app.command_line import app
from pairsim.cases.inputs import Input
from pairsim.physics.sphere_in_tube import velocity
from pairsim.plots.chart import notes
from pairsim.plots.lines import curve_lines
from pairsim.plots.parameters import NO_PARAMETERS, Parameters
from pairsim.questions.curve.answer import answer_of_curve
from pairsim.questions.registry import QUESTIONS

D, De, Ca_e = np.geomspace(0.05, 1, 24), 0.5, 0.1
STILL = {"De": 0.0, "Ca_e": 0.0, "beta": 0.0, "length": 0.0, "velocity": 0.0}
INPUTS = [
    Input("relaxation", 2.5, 0.5, "ms", STILL | {"De": De}),
    Input("modulus", 2.0, 0.2, "kPa", STILL | {"Ca_e": -Ca_e}),
    Input("tube", 50.0, 0.0, "um", STILL | {"length": 1.0}),
]
"""De and Ca_e follow from a time and a modulus; a wider tube changes lengths alone."""
RECORD = {
    "scales": {"length": 50e-6, "velocity": 0.01, "time": 5e-3, "stress": 200.0},
    "inputs": [each._asdict() for each in INPUTS],
}
dU = Ca_e * D - 0.1 * De  # vanishes at d = .5
TABLE = curve_table(D, dU, np.full_like(D, Ca_e), dU_error=np.full_like(D, 1e-4))
TABLE |= {"by_De": np.full_like(D, -0.1), "by_Ca_e": D, "by_beta": np.zeros_like(D)}
CURVE = curve_of(TABLE, [], RECORD)


def of_inputs(inputs: list[Input], table: dict[str, np.ndarray] = TABLE) -> Curve:
    """A curve with other inputs."""
    return curve_of(table, [], {**RECORD, "inputs": [each._asdict() for each in inputs]})


def test_parts_and_changes_are_at_constant_distances_in_units() -> None:
    parts = CURVE.by_inputs.dU
    assert parts["relaxation"] == pytest.approx(-0.1 * De * 0.2)  # 20 % of lambda
    assert parts["modulus"] == pytest.approx(-D * Ca_e * 0.1)  # 10 % of G
    assert CURVE.change_by(INPUTS[2]) == pytest.approx(-D * Ca_e * 1e4)  # a wider tube: smaller d


def test_a_zero_moves_with_its_inputs_whose_parts_add_up_as_squares() -> None:
    said = " ".join(answer_of_curve(curve_of(TABLE, [Zero(0.5, False, 1e-3)], RECORD)))
    assert "to the largest |dU|, +- 5.6 um (relaxation 5, modulus 2.5) to the zero at d = 25 um" in said  # De/Ca_e/10
    assert "per ms of relaxation" in said


def test_numbers_that_dU_is_not_differentiated_by_leave_its_interval_open() -> None:
    thinning = [Input("viscosity", 1.0, 0.1, "Pa·s", STILL | {"liquid.Cu": 0.3})]
    assert np.isinf(of_inputs(thinning).by_inputs.half_widths(D)).all()


def test_exact_inputs_have_no_part() -> None:
    exact = {**RECORD, "inputs": [{**each, "half_width": 0.0} for each in RECORD["inputs"]]}
    assert "half-widths of the inputs" not in " ".join(answer_of_curve(curve_of(TABLE, [], exact)))


def test_a_difference_of_the_diameters_is_said_and_has_its_part_where_it_is_given() -> None:
    unequal = TABLE | {"by_difference": np.full_like(D, -0.4)}
    said = " ".join(answer_of_curve(curve_of(unequal, [], RECORD)))
    assert "for each per cent by which the leading one is larger, dU at d = 50 um changes by -40 um/s" in said
    fading = curve_table(D, 0.01 * np.exp(-4 * D), np.zeros_like(D), dU_error=np.full_like(D, 1e-6))
    fading |= {"by_difference": np.full_like(D, -0.4)}
    answer = " ".join(answer_of_curve(curve_of(fading, [], RECORD)))
    assert "From d = 43.89 um on a difference of 0.1 % decides" in answer, "exp(-4 d) is .04 at d = 40.2 um"
    given = Input("particle_difference", 0.0, 0.5, "%", STILL | {"difference": 0.01})
    parts = of_inputs([given], unequal).by_inputs.dU
    assert parts["particle_difference"] == pytest.approx(-0.5 * 0.01 * 0.4)
    said = " ".join(answer_of_curve(curve_of(unequal, [], {**RECORD, "inputs": [given._asdict()]})))
    assert "-40 per % of particle_difference" in said
    assert "of equal size" not in said


def test_where_the_inputs_leave_the_sign_open_is_said_but_around_zeros() -> None:
    """dU = Ca_e d - 0.1 De is -0.045 to 0.05; 100 % of the modulus is Ca_e d, more than |dU| from d = 0.25 on."""
    unsure = of_inputs([Input("modulus", 2.0, 2.0, "kPa", STILL | {"Ca_e": -Ca_e})])
    (said,) = (line for line in answer_of_curve(unsure) if "leaves open" in line)
    assert re.search(r"separates or comes closer between d = 12\.[45]\d* um and (50|49\.\d) um\.$", said), said
    around = curve_of(TABLE, [Zero(0.5, False, 1e-3)], unsure.record)
    assert not any("leaves open" in line for line in answer_of_curve(around))


def test_half_widths_at_any_distance_add_up_as_squares_and_are_open_where_one_is_not_known() -> None:
    between = float(np.sqrt(D[3] * D[4]))
    expected = np.hypot(0.1 * De * 0.2, np.interp(np.log(between), np.log(D), D) * Ca_e * 0.1)
    found = CURVE.at([between])
    assert found["dU_inputs"] == pytest.approx(expected)
    assert list(found) == ["d", "dU", "dU_error", "dU_inputs"]
    assert CURVE.converted(CURVE.scales).by_inputs.half_widths(50 * between) == pytest.approx(1e4 * expected)
    thinning = Input("viscosity", 1.0, 0.1, "Pa·s", STILL | {"liquid.Cu": 0.3})
    assert "dU_inputs" not in of_inputs([*INPUTS, thinning]).at([between])
    assert "dU_inputs" not in of_inputs([each._replace(half_width=0.0) for each in INPUTS]).at([between])


PROPORTIONAL = TABLE | curve_table(D, Ca_e * D, np.full_like(D, Ca_e)) | {"U_L": 1.8 + Ca_e * D / 2}
PROPORTIONAL |= {"U_T": 1.8 - Ca_e * D / 2, "by_De": np.zeros_like(D)}


def test_a_travel_has_the_parts_of_the_inputs_in_time_and_length() -> None:
    """dU = Ca_e d: a modulus 10 % larger makes it, and time and length with U = 1.8, so much longer."""
    way = of_inputs([INPUTS[1]], PROPORTIONAL).travel(0.1, 0.5)
    assert (way.time_inputs, way.length_inputs) == pytest.approx((0.1 * way.time, 0.1 * way.length), rel=5e-3)
    assert "the half-widths of the inputs add, to first order, +- 0.0081 s (modulus 0.0081) and +-" in str(way)
    assert "of tube" in str(way).splitlines()[-1]


def test_a_faster_flow_takes_less_time_over_the_same_length() -> None:
    faster = Input("flow_rate", 1.0, 0.1, "ul/min", STILL | {"velocity": 1.0})
    way = of_inputs([faster], PROPORTIONAL).travel(0.1, 0.5)
    assert way.time_inputs == pytest.approx(0.1 * way.time, rel=5e-3)
    assert way.length_inputs == pytest.approx(0.0, abs=1e-3 * way.length)


def test_larger_particles_are_slower_in_the_tube() -> None:
    """By Haberman and Sayre a sphere with beta = .4 has 1.796 U_av, and one with .404 .48 % less."""
    larger = Input("particle", 20.0, 0.2, "um", STILL | {"beta": 0.4})
    way = of_inputs([larger], PROPORTIONAL | {"U_L": np.full_like(D, 1.796), "U_T": np.full_like(D, 1.796)})
    assert velocity(0.4) == pytest.approx(1.796, abs=1e-3)
    slower = 1 - velocity(0.404) / velocity(0.4)
    travel = way.travel(0.1, 0.5)
    assert (travel.time_inputs, travel.length_inputs) == pytest.approx((0.0, slower * travel.length), rel=0.01)


def test_a_travel_says_which_input_it_does_not_know() -> None:
    thinning = Input("viscosity", 1.0, 0.1, "Pa·s", STILL | {"liquid.Cu": 0.3})
    way = of_inputs([thinning, INPUTS[1]], PROPORTIONAL).travel(0.1, 0.5)
    assert way.time_inputs is None
    assert "modulus" in way.by_inputs
    said = "how much the half-width of viscosity adds is not known: the curve has no derivatives for it"
    assert str(way).splitlines()[-1] == said


def test_the_part_of_the_inputs_is_a_band_of_its_own() -> None:
    (line, *_) = curve_lines(CURVE, NO_PARAMETERS)
    assert line.inputs == pytest.approx(CURVE.by_inputs.half_widths(line.x))
    assert [each.get_label() for each in notes([line])] == [r"error of $\Delta U$", "half-width due to the inputs"]
    assert curve_lines(CURVE, Parameters({"De": 0.5}))[0].inputs is None, "one of many curves in a picture"


COMPUTED = {"ends": "developed", "length": 3, "mesh": {"Np": 8, "max_size": 0.5}, "max_points": 5}
QUANTITIES = {"tube": "50um", "flow_rate": "1 +- 0.05 ul/min", "viscosity": "1Pa.s", "modulus": "5 kPa"}
QUANTITIES |= {"distance": ["4um", "6um", "9um", "14um", "20um"]}


def test_what_a_diameter_changes_is_the_difference_of_two_computed_curves(tmp_path: Path) -> None:
    """On a mesh on which dU is known to 5 %, its differences are to some 12 %."""

    def curve(particle: str, folder: Path | None = None) -> pairsim.CurveResult:
        return pairsim.curve(COMPUTED | {"physical": QUANTITIES | {"particle": particle}}, folder=folder).check()

    middle, smaller, larger = curve("20 +- 1 um", tmp_path / "case"), curve("19.5 um"), curve("20.5 um")
    d = np.array([0.1, 0.2, 0.3])
    changes = middle.curve.by_inputs.dU_at(d)
    assert changes["particle"] == pytest.approx(larger.dU(d) - smaller.dU(d), rel=0.15)
    assert changes["flow_rate"] == pytest.approx(2 * 0.05 * middle.dU(d), rel=0.1), "U_av and Ca_e grow"
    travels = [each.travel(0.1, 0.3) for each in (smaller, middle, larger)]
    time, length = travels[1].by_inputs["particle"]
    assert time == pytest.approx(travels[0].time - travels[2].time, rel=0.15)
    assert length == pytest.approx(travels[0].length - travels[2].length, rel=0.15)

    swept = QUESTIONS["curve"].values(tmp_path / "case")
    assert swept["dU_inputs"] == pytest.approx(float(middle.curve.by_inputs.half_widths(middle.curve.peak.d)))
    assert QUESTIONS["curve"].in_sweeps.columns(middle.case)[-1] == "dU_inputs"
    exact = pairsim.load({"physical": QUANTITIES | {"particle": "20 um", "flow_rate": "1 ul/min"}}, kind="curve")
    assert "dU_inputs" not in QUESTIONS["curve"].in_sweeps.columns(exact)
    table = CliRunner().invoke(app, ["table", str(tmp_path / "case"), "--at", "10um"])
    assert table.stdout.splitlines()[0] == "d [um],dU [um/s],dU_error [um/s],dU_inputs [um/s]"


def test_a_table_at_a_distance_says_what_it_does_not_know(tmp_path: Path) -> None:
    folder = make_curve(tmp_path / "curve", 0.1)
    (folder / "run.json").write_text(json.dumps(RECORD | {"kind": "curve", "inputs": [INPUTS[0]._asdict()]}))
    table = CliRunner().invoke(app, ["table", str(folder), "--at", "10um"])
    assert table.stdout.splitlines()[0] == "d [um],dU [um/s],dU_error [um/s]"
    assert "note: how much the half-width of relaxation adds is not known" in table.stderr
