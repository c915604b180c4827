"""The answer of results in words; that of a run tells the start-up apart from the motion."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.result_folders import curve_of, curve_table

from pairsim.analysis.time_series import Series
from pairsim.analysis.zeros import Zero
from pairsim.computing.events import Outcome
from pairsim.computing.result_content import Content
from pairsim.quantities.text import with_error
from pairsim.questions.critical import answer_of_critical
from pairsim.questions.curve.answer import answer_of_curve
from pairsim.questions.registry import QUESTIONS
from pairsim.questions.run.answer import answer_of_run
from pairsim.record.folder import prepare_folder
from pairsim.record.record import Record
from pairsim.record.run_entries import SETTLED
from pairsim.runtime.errors import (
    BranchEnd,
    BudgetSpent,
    InputError,
    MeshFailure,
    NewtonFailure,
    NoSteadyState,
    RunFailure,
    TooManySteps,
    WallTime,
    WriteFailure,
)


def said_of_run(table: Mapping[str, np.ndarray], record: Mapping[str, Any]) -> list[str]:
    """The answer of a run by the columns of series.csv and the entries of run.json."""
    return answer_of_run(Series(table, Record(record)))


NUMBERS = {
    (1.567e-3, 4e-6): "(1.567 +- 0.004)e-3",
    (1.567e-3, 1.26e-5): "(1.567 +- 0.013)e-3",
    (0.25023, 0.0081): "0.250 +- 0.008",
    (-1.7e-3, 2e-3): "(-2 +- 2)e-3",
    (1e-5, 3e-4): "(0 +- 3)e-4",
    (-1e-5, 3e-4): "(0 +- 3)e-4",
    (12.3456, 0.0961): "12.35 +- 0.10",
    (20890.8, 0.4): "20890.8 +- 0.4",
    (20891.0, 300.0): "20900 +- 300",
    (0.25, None): "0.25",
    (0.25, 0.0): "0.25",
    (10584.0, None): "10580",
    (1.23456e7, None): "1.235e+07",
}


@pytest.mark.parametrize(("number", "text"), NUMBERS.items())
def test_a_number_has_the_digits_that_its_error_leaves(number: tuple[float, float | None], text: str) -> None:
    assert with_error(*number) == text


def logarithmic(zero: float, rate: float, error: float, count: int = 3) -> dict[str, np.ndarray]:
    """dU = rate ln(d/zero), which its interpolant meets exactly, from d .1 to .3."""
    d = np.geomspace(0.1, 0.3, count)
    return curve_table(d, rate * np.log(d / zero), rate / d, dU_error=np.full(count, error))


BEYOND = ", the end of this curve; beyond it |dU| may be larger."
ELSEWHERE = " or elsewhere, which the half-width leaves open."
CURVES = [
    (
        (logarithmic(0.2, 1e-3, 1e-5), [Zero(0.2, False, 0.002)]),
        "The pair comes closer between d = 0.1 and 0.2, separates between d = 0.2 and 0.3. "
        "It keeps its distance at d = 0.200 +- 0.002 (unstable).",
        "Largest |dU|: (-6.93 +- 0.10)e-4 at d = 0.100 +- 0.002" + BEYOND,
    ),
    (
        (logarithmic(0.2173, 1e-3, 1e-5), [Zero(0.2173, False, 0.04)]),  # no more digits than are known
        "The pair comes closer between d = 0.1 and 0.22, separates between d = 0.22 and 0.3. "
        "It keeps its distance at d = 0.22 +- 0.04 (unstable).",
        "Largest |dU|: (-7.76 +- 0.10)e-4 at d = 0.100 +- 0.002" + BEYOND,
    ),
    (
        (logarithmic(0.2, -1e-3, 1e-5), [Zero(0.2, True)]),
        "The pair separates between d = 0.1 and 0.2, comes closer between d = 0.2 and 0.3. "
        "It keeps its distance at d = 0.2 (stable).",
        "Largest |dU|: (+6.93 +- 0.10)e-4 at d = 0.100 +- 0.002" + BEYOND,
    ),
    (
        (logarithmic(0.05, 1e-3, 1e-5), []),
        "The pair separates between d = 0.1 and 0.3.",
        "Largest |dU|: (+1.792 +- 0.010)e-3 at d = 0.300 +- 0.005" + BEYOND,
    ),
    (
        (logarithmic(0.2, 1e-12, 1e-5), []),
        "The pair keeps its distance: dU vanishes at every d.",
        "Largest |dU|: (0.0 +- 1.0)e-5 at d = 0.1" + ELSEWHERE,
    ),
    (
        (logarithmic(0.2, 1e-12, 1e-12) | {"slope": np.array([-2e-8, 8e-9, 8e-9])}, []),  # as of rigid equal spheres
        "The pair keeps its distance: dU vanishes at every d.",
        "Largest |dU|: (-0.7 +- 1.0)e-12 at d = 0.1" + ELSEWHERE,
    ),
    (
        (logarithmic(0.2, 1e-3, 1e-2), [Zero(0.2, False, 2.0)]),
        "Not decided between d = 0.1 and 0.3: the interval of dU contains both signs.",
        "Largest |dU|: -0.001 +- 0.010 at d = 0.1" + ELSEWHERE,
    ),
    (
        (logarithmic(0.2, 1e-3, 1e-5, 1), []),
        "The pair comes closer at d = 0.1.",
        "Largest |dU|: (-6.93 +- 0.10)e-4 at d = 0.1.",
    ),
    (
        (logarithmic(0.2, 1e-3, 1e-5, 2), [Zero(0.2, False)]),
        "The pair comes closer at d = 0.1, separates at d = 0.3. "
        "Not decided between d = 0.1 and 0.3: the interval of dU contains both signs.",
        "Largest |dU| of two points: -0.0006931 at d = 0.1 +- 0.2; what lies between is not known.",
    ),
]


@pytest.mark.parametrize(("curve", "signs", "largest"), CURVES)
def test_a_curve_separates_comes_closer_or_is_not_decided(curve: Any, signs: str, largest: str) -> None:
    assert answer_of_curve(curve_of(*curve)) == [signs, largest]


def test_a_curve_of_moved_particles_tells_their_forces_and_not_that_they_keep_their_distance() -> None:
    d, zero = np.array([0.1, 0.2]), np.zeros(2)
    forces = {"F_L": np.array([5.0, 6.0]), "F_T": np.array([7.0, 6.5])}
    table = curve_table(d, zero, zero, **forces, F_error_L=zero + 0.1, F_error_T=zero + 0.2)
    assert answer_of_curve(curve_of(table)) == [
        "F_L from 5.00 +- 0.10 at d = 0.1 to 6.00 +- 0.10 at d = 0.2.",
        "F_T from 6.5 +- 0.2 at d = 0.2 to 7.0 +- 0.2 at d = 0.1.",
    ]
    one = {name: values[:1] for name, values in table.items()}
    assert answer_of_curve(curve_of(one)) == ["F_L = 5.00 +- 0.10 at d = 0.1.", "F_T = 7.0 +- 0.2 at d = 0.1."]


@pytest.mark.parametrize(("count", "next_command"), [(3, "travel(start, stop)"), (2, "plot(folder)")])
def test_what_comes_next_is_a_travel_where_there_is_one(count: int, next_command: str) -> None:
    """Between two points alone nothing is known."""
    question, record = QUESTIONS["curve"], Record({"status": "finished", "points": 1})
    content = Content({"curve": logarithmic(0.05, 1e-3, 1e-5, count)}, record, None)
    curve = question.result(question, content=content)
    assert curve.advice.startswith(f"Next: {next_command}")


@pytest.mark.parametrize("name", ["focus", "run", "curve"])
def test_a_command_that_comes_next_can_be_pasted(name: str, tmp_path: Path) -> None:
    """Of folders with spaces in their names."""
    question, folder = QUESTIONS[name], tmp_path / "my beads" / "d 0.1"
    table = {"curve": curve_table(np.array([0.1]), np.array([1e-3]), np.zeros(1))} if name == "curve" else {}
    folder.mkdir(parents=True)
    content = Content(table, Record({"status": "finished"}), None)
    assert f"'{folder}'" in question.result(question, content=content, folder=folder).advice


def test_shapes_of_one_point_are_no_range() -> None:
    table = curve_table(np.array([0.1]), np.array([1e-3]), np.zeros(1), dU_error=np.full(1, 1e-5), D_L=np.array([0.02]))
    assert answer_of_curve(curve_of(table))[-1] == "Taylor parameters: D_L = 0.02."


def test_a_sign_that_is_lost_far_away_is_not_told() -> None:
    """As of dU that decays with the distance: from where it is smaller than its error on nothing is said."""
    d = np.geomspace(0.1, 1.6, 9)
    table = curve_table(d, np.exp(-3 * d), -3 * np.exp(-3 * d), dU_error=np.full(9, 0.05))
    words = answer_of_curve(curve_of(table))[0]
    found = re.fullmatch(
        r"The pair separates between d = 0.1 and ([\d.]+). Not decided between d = ([\d.]+) and 1.6: .*", words
    )
    assert found is not None, words
    assert found[1] == found[2]
    assert float(found[1]) == pytest.approx(-np.log(0.05) / 3, rel=0.02)


def test_the_peak_between_two_points_has_an_interval_of_height_and_place() -> None:
    d = np.array([0.2, 0.35, 0.6])
    x = np.log(d / 0.4)
    table = curve_table(d, 1 / np.cosh(x), -np.tanh(x) / np.cosh(x) / d, dU_error=np.full(3, 1e-4))
    lines = answer_of_curve(curve_of(table))
    found = re.fullmatch(r"Largest \|dU\|: \+([\d.]+) \+- ([\d.]+) at d = ([\d.]+) \+- ([\d.]+)\.", lines[1])
    assert found is not None, lines[1]
    height, error, place, place_error = map(float, found.groups())
    assert abs(height - 1) < error < 0.05
    assert abs(place - 0.4) < place_error < 0.2


def test_regions_in_python_meet_at_the_zeros_of_the_answer() -> None:
    zero = 0.2 * (1 + 1e-4)  # not quite that of the interpolant
    below, above = curve_of(logarithmic(0.2, 1e-3 / np.log(2), 1e-6), [Zero(zero, False)]).regions
    assert below.stop == above.start == zero


def test_a_case_in_units_has_its_answer_in_units() -> None:
    """D_c 50 um and U_av 10 mm/s: 5 ms, and 10 um/s for dU = 1e-3."""
    record = {"scales": {"length": 50e-6, "velocity": 10e-3, "time": 5e-3, "stress": 170.0}}
    run = series(1.0, [0.1, 0.12], [1e-3, 1.5e-3], dU_error=[1e-5, 1e-5])
    assert said_of_run(run, record) == [
        "The pair separates: from d = 5 um at t = 0 s to d = 6 um at t = 0.005 s, dU = +15.00 +- 0.10 um/s at the end."
    ]
    starting = said_of_run(series(2.0, [0.1, 0.09], [-1e-2, -1e-2]), record | settled(-4e-3, 5e-5))[0]
    assert "Without any memory of its start it would have dU = -40.0 +- 0.5 um/s there" in starting
    assert starting.endswith("(physical.end = 0.034 s is enough).")
    curve = logarithmic(0.2, 1e-3 / np.log(2), 1e-6)
    assert answer_of_curve(curve_of(curve, [Zero(0.2, False, 0.01)], record)) == [
        "The pair comes closer between d = 5 um and 10 um, separates between d = 10 um and 15 um. "
        "It keeps its distance at d = 10.0 +- 0.5 um (unstable).",
        "Largest |dU|: -10.000 +- 0.010 um/s at d = 5 um" + BEYOND,
    ]
    assert answer_of_critical([Zero(0.1, False), Zero(0.2, False)], Record(record)) == [
        "2 unstable critical distances, d = 5 um to 10 um: closer pairs come together, wider ones separate."
    ]


def test_critical_distances_by_kind() -> None:
    zeros = [Zero(0.2, False, 0.02), Zero(0.1, False, 0.003), Zero(0.3, True)]
    ends = [{"reason": "range", "message": "the last value is reached"}, {"reason": "edge", "message": "edge"}]
    assert answer_of_critical(zeros, Record({"ends": ends})) == [
        "2 unstable critical distances, d = 0.100 +- 0.003 to 0.20 +- 0.02: "
        "closer pairs come together, wider ones separate.",
        "1 stable critical distance, d = 0.3: pairs settle there.",
        "A line of critical distances ends: edge.",
    ]


def advice(kind: str, status: str, reason: str, message: str = "", folder: Path = Path("out")) -> str:
    question = QUESTIONS[kind]
    result = question.result(question, folder, Outcome(status, reason, message))
    return str(result.advice)


@pytest.mark.parametrize(("kind", "again"), [("run", "--resume out"), ("curve", "--overwrite")])
def test_nobody_is_told_to_repeat_what_fails_in_the_same_way(kind: str, again: str, tmp_path: Path) -> None:
    """Only a case that is not at fault may succeed when it is repeated."""
    for failure in (
        NoSteadyState("no solution was found", advice="a larger mesh.Np"),
        MeshFailure("a cell of the new mesh is inverted", advice="a larger mesh.Np"),
        NewtonFailure("no convergence", at="t = 0.1 (step 3)", advice="a larger mesh.Np"),
    ):
        told = advice(kind, "failed", failure.reason, str(failure))
        assert "try a larger mesh.Np; unchanged, the case fails in the same way" in told
        assert not re.search("--overwrite|--resume", told)
        (tmp_path / "run.json").write_text(json.dumps({"kind": kind, "status": "failed", "message": str(failure)}))
        answer = QUESTIONS[kind].result(QUESTIONS[kind], tmp_path).answer
        assert answer.count("a larger mesh.Np") == 1, "what to try is said once, in the last line"
        assert answer.splitlines()[0] == f"Failed: {str(failure).partition('; try')[0]}"
    ended = kind, "finished", BranchEnd.reason, "steady states end at Ca_e = 0.15", tmp_path
    assert advice(*ended) == "Next: a smaller Ca_e or De."
    (tmp_path / "way.csv").touch()
    assert advice(*ended) == f"Next: a smaller Ca_e or De; {tmp_path}/way.csv has the steady states on the way."
    (tmp_path / "checkpoint.npz").touch()
    again = again.replace("out", str(tmp_path))
    full = WriteFailure("No space left on device", advice="freeing disk space, then the same command")
    for reason, message in (
        (full.reason, str(full)),
        ("environment", "no C compiler"),
        ("interrupted", "stopped by Ctrl-C"),
        (BudgetSpent.reason, "the budget of 1 s is spent; try a larger --budget"),
    ):
        told = advice(kind, "failed", reason, message, tmp_path)
        assert again in told
        assert "fails in the same way" not in told
        assert "--resume" not in advice(kind, "failed", reason, message), "there is no checkpoint"


def test_what_comes_next_works_for_the_run_that_it_is_printed_for(tmp_path: Path) -> None:
    for reason in ("end", "contact", "max_gap"):  # without a checkpoint nothing goes on
        assert advice("run", "finished", reason) == "Next: pairsim plot out draws it."
    (tmp_path / "checkpoint.npz").touch()
    on = f"pairsim run --resume {tmp_path} --set time.end=... continues."
    assert advice("run", "finished", "end", folder=tmp_path).endswith(on)
    assert advice("run", "finished", "contact", folder=tmp_path) == f"Next: pairsim plot {tmp_path} draws it."
    assert "--set limits.max_gap=..." in advice("run", "finished", "max_gap", folder=tmp_path)
    scales = {"length": 50e-6, "velocity": 10e-3, "time": 5e-3, "stress": 170.0}
    (tmp_path / "run.json").write_text(json.dumps({"scales": scales}))
    assert "--set physical.end=..." in advice("run", "finished", "end", folder=tmp_path)
    with pytest.raises(InputError, match=f"pairsim run --resume {tmp_path} continues"):
        prepare_folder(tmp_path)


@pytest.mark.parametrize("limit", [WallTime, TooManySteps])
def test_run_that_meets_a_limit_goes_on_with_a_larger_one(limit: type[RunFailure]) -> None:
    """With the same limit it would end at once."""
    told = advice("run", "failed", limit.reason, str(limit("reached")))
    assert f"--resume out --set limits.{limit.reason}=..." in told


def series(t: float, d: list[float], dU: list[float], **more: list[float]) -> dict[str, np.ndarray]:
    times = np.linspace(0.0, t, len(d))
    return {"t": times, **{name: np.array(values) for name, values in {"d": d, "dU": dU, **more}.items()}}


def settled(dU: float, error: float, **more: Any) -> dict[str, Any]:
    """run.json of a run in which a disturbance decays in a time of 1."""
    entry = {"d": [0.1], "dU": [dU], "dU_error": [error], "t_relax": 1.0, "start": "rest", "accuracy": 0.01}
    return {"reason": "end", SETTLED.name: entry | more}


WITHOUT_START = "Without any memory of its start it would have dU = {} there (a quasi-steady solution)"
UNDECIDED = "may separate or come closer (not decided: the interval of dU contains both signs)"


@pytest.mark.parametrize(
    ("dU", "steady", "answer"),
    [
        (
            1.5e-2,
            (1.5e-2, 1e-4),
            "separates: {}, dU = +0.01500 +- 0.00015 at the end. "
            + WITHOUT_START.format("+0.01500 +- 0.00010")
            + ". During start-up it came closer.",
        ),
        (
            -1.5e-2,
            (-1.5e-2, 1e-4),
            "comes closer: {}, dU = -0.01500 +- 0.00015 at the end. "
            + WITHOUT_START.format("-0.01500 +- 0.00010")
            + ".",
        ),
        (
            -5e-6,  # contradicts the curve within the errors of both
            (2e-5, 1.5e-5),
            UNDECIDED + ": {}, dU = (0 +- 2)e-5 at the end. " + WITHOUT_START.format("(+2 +- 2)e-5") + ".",
        ),
        (1e-12, (2e-12, 1e-14), "keeps its distance: {}, dU = +1e-12 at the end."),
    ],
)
def test_a_decayed_start_up_leaves_three_answers(dU: float, steady: tuple[float, float], answer: str) -> None:
    (line,) = said_of_run(series(10.0, [0.1, 0.08, 0.09], [-1e-2, 1e-3, dU]), settled(*steady))
    assert line == f"The pair {answer.format('from d = 0.1 at t = 0 to d = 0.09 at t = 10')}"


@pytest.mark.parametrize(
    ("dU", "heading", "end"),
    [
        (-4e-3, f"{WITHOUT_START.format('(-4.00 +- 0.05)e-3')}: it then comes closer", 6.8),
        (2e-5, f"{WITHOUT_START.format('(+2 +- 5)e-5')}: it then {UNDECIDED}", 7.4),
    ],
)
def test_a_run_cut_short_says_where_it_is_heading(dU: float, heading: str, end: float) -> None:
    (line,) = said_of_run(series(2.0, [0.1, 0.09], [-1e-2, -1e-2]), settled(dU, 5e-5))
    start = "The pair is still starting up: from d = 0.1 at t = 0 to d = 0.09 at t = 2, dU = -0.01 at the end. "
    assert line == f"{start}{heading} (time.end = {end} is enough)."


def test_three_decay_times_are_waited_for_after_rest() -> None:
    """dU may pass the value of quasi-steady motion on its way; from a quasi-steady state nothing is waited for."""
    passing = series(1.0, [0.1, 0.11], [1e-2, 1.5e-2])
    record = settled(1.5e-2, 1e-4)
    assert "is still starting up" in said_of_run(passing, record)[0]
    assert Series(passing, Record(record)).start_up == 3.0
    steady = settled(1.5e-2, 1e-4, start="steady")
    assert "separates" in said_of_run(passing, steady)[0]
    assert Series(passing, Record(steady)).start_up == 0.0


def test_advised_end_leaves_the_difference_within_the_errors() -> None:
    """Of 1e-3 at t = 4 that decay like exp(-t), 2e-4 are left at t = 5.6."""
    line = said_of_run(series(4.0, [0.1, 0.11], [1e-2, 1.1e-2]), settled(1e-2, 1e-4))[0]
    end = float(line.partition("time.end = ")[2].split()[0])
    assert 4 + np.log(5) < end < 4 + np.log(5) + 1


def test_the_runs_own_error_counts_where_it_is_estimated() -> None:
    off = {"d": [0.1, 0.11], "dU": [1e-2, 1.1e-2]}
    record = settled(1e-2, 1e-4)
    assert "is still starting up" in said_of_run(series(10.0, **off), record)[0]
    lines = said_of_run(series(10.0, **off, dU_error=[2e-3, 2e-3]), record)
    assert "separates" in lines[0]
    assert "dU = +0.011 +- 0.002 at the end" in lines[0]


@pytest.mark.parametrize(
    ("d", "dU", "words"),
    [
        ([0.12, 0.1], [-1e-2, -2e-2], "comes closer"),
        ([0.1, 0.09], [-1e-2, 2e-2], "separates in the end, after moving the other way"),
        ([0.1, 0.12], [1e-2, 1e-12], "keeps its distance"),
    ],
)
def test_without_a_quasi_steady_solution_the_run_speaks_for_itself(d: list[float], dU: list[float], words: str) -> None:
    lines = said_of_run(series(1.0, d, dU), {"reason": "end", SETTLED.name: {"message": "there is a fold"}})
    assert lines == [
        f"The pair {words}: from d = {d[0]} at t = 0 to d = {d[1]} at t = 1, dU = {dU[1]:+g} at the end.",
        "Whether the start is forgotten is not known: there is a fold.",
    ]
    assert said_of_run(series(1.0, d, dU), {"reason": "end"}) == lines[:1]


def test_a_run_that_ends_in_contact_collides_and_one_whose_dU_is_below_its_error_has_no_sign() -> None:
    (line,) = said_of_run(series(1.0, [0.1, 0.004], [-1e-2, -1e-2]), {"reason": "contact"})
    assert line.startswith("The pair collides: from d = 0.1 at t = 0 to d = 0.004 at t = 1")
    positions = {"z_L": np.array([0.5, 2.4]), "z_T": np.array([0.0, 2.0])}
    (line,) = said_of_run(series(1.0, [0.1, 0.004], [-1e-2, -1e-2]) | positions, {"reason": "contact"})
    assert line.startswith("The pair collides: from d = 0.1 at t = 0 to d = 0.004 at t = 1, 1.95 D_c of tube later, dU")
    (line,) = said_of_run(series(1.0, [0.1, 0.1], [1e-4, 1e-4], dU_error=[2e-4, 2e-4]), {})
    assert line.startswith(f"The pair {UNDECIDED}: ")
    assert line.endswith("dU = (+1 +- 2)e-4 at the end.")


@pytest.mark.parametrize("status", ["running", "interrupted", "failed"])
def test_a_run_that_has_not_come_to_its_end_has_no_sign_that_its_start_up_makes(status: str) -> None:
    run, record = series(0.1, [0.1, 0.09], [-1e-2, -1e-2]), {"status": status, "start": "rest"}
    assert said_of_run(run, record) == [
        "The pair moved from d = 0.1 at t = 0 to d = 0.09 at t = 0.1, dU = -0.01 at the end; "
        "what it does once its start is forgotten is not known yet."
    ]
    assert said_of_run(run, record | {"start": "steady"})[0].startswith("The pair comes closer: ")


def test_every_gap_of_three_particles_has_its_line() -> None:
    table = {"t": np.array([10.0]), "d_1": np.array([0.1]), "d_2": np.array([0.2])}
    table |= {"dU_1": np.array([1e-2]), "dU_2": np.array([-1e-2]), "D_1": np.array([0.01])}
    record = settled(1e-2, 1e-4)
    record[SETTLED.name] |= {"dU": [1e-2, 1e-2], "dU_error": [1e-4, 1e-4]}
    first, second, deformation = said_of_run(table, record)
    assert first.startswith("Gap 1 separates: from d = 0.1")
    assert second.startswith("Gap 2 is still starting up: from d = 0.2")
    assert deformation == "Taylor parameters at the end: D_1 = 0.01."
    *_, deformation = said_of_run(table | {"D_error_1": np.array([2e-4])}, record)
    assert deformation == "Taylor parameters at the end: D_1 = 0.0100 +- 0.0002."
    first, second, _ = said_of_run(table, {"reason": "contact"})
    assert first.startswith("Gap 1 collides: ")
    assert second.startswith("Gap 2 comes closer: "), "it is not the one that has closed"


def test_many_gaps_are_counted_and_their_mean_is_told() -> None:
    d, dU = [0.1, 0.2, 0.2, 0.3, 0.2], [-1e-2, 1e-2, 1e-2, 0.0, 1e-2]
    table = {"t": np.array([0.0, 10.0])}
    table |= {f"d_{i}": np.array([0.2, end]) for i, end in enumerate(d, 1)}
    table |= {f"dU_{i}": np.array([0.0, value]) for i, value in enumerate(dU, 1)}
    counted, spread = said_of_run(table, {"reason": "contact"})[1:]
    assert said_of_run(table, {"reason": "contact"})[0] == "Gap 1 collides at t = 10."
    places = {f"z_{i}": np.array([0.5 * i, 0.5 * i + 20]) for i in range(6)}
    assert said_of_run(table | places, {"reason": "contact"})[0] == "Gap 1 collides at t = 10, 20 D_c of tube later."
    assert counted.startswith("Of 5 gaps at t = 10: 3 separating, 1 coming closer, 1 not decided")
    later = settled(1e-2, 1e-4)
    later[SETTLED.name] |= {"dU": 5 * [1e-2], "dU_error": 5 * [1e-4]}
    assert "Of 5 gaps at the distances of t = 10, once the start is forgotten: 5 separating." in said_of_run(
        table, later
    )
    assert spread.startswith(f"Their mean went from 0.2 to 0.2, their standard deviation from 0 to {np.std(d):.5g};")
    assert spread.endswith("the smallest is gap 1, 0.1, the largest gap 4, 0.3.")
