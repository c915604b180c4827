"""The study that judges dU of curves at random, without computing a curve."""

from __future__ import annotations

import sys

import pandas as pd
import pytest
from support.inputs import ROOT

import pairsim

sys.path.append(str(ROOT / "scripts"))

from book.timed import timed
from studies.curves import cases, judgement

INSIDE = "at least 95 % of dU are inside their half-widths"
BEYOND = "none is beyond 2 half-widths"
KEPT = "no error of a curve is above 1 % of its peak without a warning"
BY_LAW = "the largest error of each law is below 1 % of the peak"


def curve(number: int, errors: list[float], said: bool = False, law: str = "giesekus") -> pd.DataFrame:
    """A curve with a peak of 1 and half-widths of 0.01, whose dU are off by so much, and its reference."""
    same = {"curve": number, "law": law, "beta": 0.4, "De": 0.5, "Ca_e": 0.0, "peak": 1.0, "ended": None, "code": "a"}
    rows = []
    for kind, accuracy, off, half_width in (("case", "1%", errors, 0.01), ("reference", "0.2%", [0.0] * 9, 1e-3)):
        about = {**same, "part": f"{number:02d}-{law}+{accuracy}", "kind": kind, "accuracy": accuracy, "said": said}
        about |= {"seconds": 9.0, "computed": "2026-11-30"}
        rows += [
            {**about, "d": 0.1 * i, "dU": 0.5 + error, "dU_error": half_width}
            for i, error in zip(range(1, 1 + len(errors)), off, strict=False)
        ]
    return pd.DataFrame(rows)


def verdicts(*curves: pd.DataFrame) -> dict[str, str]:
    found = judgement.statements(pd.concat(curves, ignore_index=True), cases.parts(False))
    return {text: each.verdict for text, each in found.items()}


def test_curves_are_valid_cases_of_six_laws() -> None:
    drawn = [cases.case(number) for number in range(cases.CURVES)]
    assert {each["liquid"]["law"] for each in drawn} == cases.LAWS.keys()
    for each in drawn:
        case = pairsim.load({**each, "accuracy": "1%"}, kind="curve")
        assert (case.De == 0) == (each["liquid"]["law"] in cases.WITHOUT_MEMORY)
        assert case.De > 0 or min(case.Ca_es) > 0, "a rigid pair in a liquid without a memory keeps its distance"


def test_curves_are_those_that_were_drawn_first() -> None:
    assert cases.case(2) == {
        **{"beta": 0.3976, "De": 0.5729, "Ca_e": 0.0, "liquid": {"law": "oldroyd-b"}},
        **{"d": [0.1026, 0.1829, 0.5671, 0.604], "tol": 1},
    }


def test_errors_within_half_widths_hold() -> None:
    found = verdicts(curve(1, [0.005, -0.004]), curve(2, [0.0, 0.001]))
    assert found[INSIDE] == found[BEYOND] == found[KEPT] == found[BY_LAW] == "holds"
    assert found["all is computed"] == "does not hold"


def test_errors_beyond_half_widths_are_found() -> None:
    found = verdicts(curve(1, [0.025, 0.0]), curve(2, [0.0, 0.0]))
    assert found[INSIDE] == found[BEYOND] == found[KEPT] == found[BY_LAW] == "does not hold"


def test_an_accuracy_that_is_missed_may_be_said_to_be() -> None:
    assert verdicts(curve(1, [0.015]))[KEPT] == "does not hold"
    assert verdicts(curve(1, [0.015], said=True))[KEPT] == "holds"


def test_an_error_that_the_reference_does_not_know_well_decides_nothing() -> None:
    assert verdicts(curve(1, [0.0095]))[KEPT] == "within error"


def test_a_curve_without_an_answer_counts() -> None:
    ended = curve(1, [0.0]).iloc[:1].assign(ended="no_steady_state")
    found = judgement.statements(pd.concat([ended, curve(2, [0.0])]), cases.parts(False))
    assert found["every case has an answer"].verdict == "does not hold"
    assert "01-giesekus+1% (no_steady_state)" in found["every case has an answer"].numbers


def test_the_page_has_a_row_for_each_law_and_names_what_is_outside() -> None:
    results = pd.concat([curve(1, [0.015, 0.0]), curve(2, [0.001], law="ptt-exp")], ignore_index=True)
    blocks = judgement.blocks(results, cases.parts(False))
    assert "| giesekus | 1 | 2 | 1 | 1 of 2 | 1 | 0.75 | 1.5 | 1.50 | 0 | 9 | 9 |" in blocks["laws"]
    assert "| ptt-exp | 1 | 1 | 1 |" in blocks["laws"]
    assert "| 01-giesekus+1% | 0.1 | 1 | 1.5 | 1.5 |" in blocks["outside"]
    assert judgement.blocks(curve(2, [0.001]), [])["outside"] == "None.\n"


@pytest.mark.slow
def test_a_case_is_timed_in_a_process_of_its_own() -> None:
    case = {"beta": 0.4, "De": 0, "Ca_e": 0.1, "d": [0.2], "max_points": 1, "mesh": {"Np": 8}}
    result, seconds = timed("curve", case)
    assert result.status == "finished"
    assert len(result.table) == 1
    assert 0 < seconds < 60
