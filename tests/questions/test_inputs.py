"""The part of the inputs in what a curve says, against a curve whose dependence on them is known."""

from __future__ import annotations

import numpy as np
import pytest
from support.result_folders import curve_of, curve_table

from pairsim.analysis.master_curve import Curve, Zero
from pairsim.cases.inputs import Input
from pairsim.questions.curve.answer import answer_of_curve

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
    assert "equally large" not in said
