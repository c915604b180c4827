"""Messages have their quantities in units of the experiment, whatever the words around them."""

from __future__ import annotations

import json
import pickle
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from pairsim.computing import events
from pairsim.computing.case_files import parse_case
from pairsim.computing.problems import problem_of
from pairsim.computing.progress import Reporter
from pairsim.computing.session import Options, carry_out
from pairsim.computing.warnings import ErrorAt, large_errors, moves_on, near_ends
from pairsim.physics.liquids import Liquid
from pairsim.physics.liquids.bingham import Bingham
from pairsim.physics.solids import soft
from pairsim.quantities.kinds import FORCE, LENGTH, PURE, RATE, TIME, VELOCITY
from pairsim.quantities.scales import Scales
from pairsim.questions.critical import ENDS
from pairsim.questions.registry import QUESTIONS
from pairsim.questions.run.ends import end_of
from pairsim.questions.run.warnings import narrow_gap, unknown_run_error
from pairsim.runtime.errors import BudgetSpent, MeshFailure, NewtonFailure, NoSteadyState
from pairsim.runtime.message import Message, Text, in_units
from pairsim.runtime.monitor import Monitor
from pairsim.solvers import meshed_scene
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.steady.continuation import each_of, ended, place, where
from pairsim.solvers.stepping.step import at_step
from pairsim.solvers.trains import train

SCALES = Scales(50e-6, 10e-3, 0.85)
BENCH = {"tube": "50 um", "velocity": "10 mm/s", "viscosity": "0.85 Pa.s", "particle": "20 um", "modulus": "1.7 kPa"}
PAIR = parse_case(QUESTIONS["run"], {"physical": BENCH | {"distance": "5 um"}}, "test")
AT = Parameters((0.19039, 0.19039), soft(0.1, 0.1), Liquid(Bingham(Bn=1.0, m=100.0)))


def running_into_contact() -> Text:
    """What is said of particles that overlap."""
    scene: Any = SimpleNamespace(bodies=())
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(meshed_scene.diagnostics, "gaps", lambda *_: np.array([0.1, -0.001]))
        with pytest.raises(MeshFailure) as found:
            meshed_scene.MeshedScene.geometry_at(scene, np.empty(0))
    return found.value.message


def clustering_at_both_ends() -> Text:
    """What is said of a train that does not change between two distances."""
    growing: Any = SimpleNamespace(spectrum=SimpleNamespace(least_stable=SimpleNamespace(scaled=1.0)))
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(train, "train_of", lambda *_: growing)
        with pytest.raises(NoSteadyState) as found:
            train.transition(growing, growing, 4, (0.1, 0.2))
    return found.value.message


def out_of_tube() -> Text:
    outcome = end_of(PAIR, problem_of(PAIR), 1.0, [PAIR.tube_length - 0.8 - 0.9])
    assert outcome is not None
    return outcome.message


SENTENCES: dict[str, tuple[Callable[[], Text], str, str]] = {
    "of one distance, although there are two": (
        lambda: where(AT),
        "Ca_e = 0.1, d = 0.19039",
        "Ca_e = 0.1, d = 9.5195 um",
    ),
    "m of a law, which is a column of another meaning": (
        lambda: "stopped" + place(AT),
        "stopped at Bn = 1, m = 100, Ca_e = 0.1, d = 0.19039",
        "stopped at Bn = 1, m = 100, Ca_e = 0.1, d = 9.5195 um",
    ),
    "of a failure in a run": (
        lambda: NewtonFailure("the steps grow", at=at_step(0.002, 5), advice="a larger mesh.Np").sentence,
        "newton_diverged at t = 0.002 (step 5): the steps grow; try a larger mesh.Np",
        "newton_diverged at t = 1e-05 s (step 5): the steps grow; try a larger mesh.Np",
    ),
    "of the end of a branch, with its half-width": (
        lambda: ended("fold", {"d": (0.05, 0.001)}, Parameters((0.02,), soft(0.1, 0.1)), 0.0).failure.message,
        "steady states end at d = 0.05 +- 0.001, in a fold, and do not reach Ca_e = 0.1, d = 0.02",
        "steady states end at d = 2.5 +- 0.05 um, in a fold, and do not reach Ca_e = 0.1, d = 1 um",
    ),
    "of an error at a place": (
        lambda: large_errors(PAIR, "dU_error", "itself", [ErrorAt(0.03, each_of(AT), 0.0, 0.0)])[0],
        "dU_error is 3 % of itself at Ca_e = 0.1, d = 0.19039, more than accuracy: 1%; use a finer mesh (--set "
        "mesh.Np=60 --set mesh.max_size=0.13)",
        "dU_error is 3 % of itself at Ca_e = 0.1, d = 9.5195 um, more than accuracy: 1%; use a finer mesh (--set "
        "mesh.Np=60 --set mesh.max_size=0.13)",
    ),
    "of an error from a time on": (
        lambda: Message("{}", unknown_run_error(PAIR, 0.3)[0]),
        "the estimate of the error diverged at t = 0.3: dU_error is not known from there on; use a finer mesh (--set "
        "mesh.Np=60 --set mesh.max_size=0.13)",
        "the estimate of the error diverged at t = 0.0015 s: dU_error is not known from there on; use a finer mesh "
        "(--set mesh.Np=60 --set mesh.max_size=0.13)",
    ),
    "a gap without a name": (
        lambda: narrow_gap(PAIR, 0.005, 0.0118)[0],
        "cell sides on the particles beside a gap of 0.005 are 2.4 times as long as the gap (d0 sets their "
        "length): dU there is accurate to a few per cent only; use shorter ones (--set mesh.Np=60), or pairsim curve "
        "at that d",
        "cell sides on the particles beside a gap of 0.25 um are 2.4 times as long as the gap (d0 sets their "
        "length): dU there is accurate to a few per cent only; use shorter ones (--set mesh.Np=60), or pairsim curve "
        "at that d",
    ),
    "a length of tube without a name": (
        lambda: near_ends(PAIR, PAIR.tube_length - 1.8, "dU")[0],
        "there are 0.9 D_c of tube on each side of the particles, less than 1: the ends affect dU; use a longer tube "
        "(--set length=7.35), or limits.max_gap in a run",
        "there are 45 um of tube on each side of the particles, less than 50 um: the ends affect dU; use a longer tube "
        "(--set length=7.35), or limits.max_gap in a run",
    ),
    "room in a tube": (
        out_of_tube,
        "the particles are only 0.45 D_c from the ends of the tube at t = 1; try a longer tube (--set length=12, "
        "enough until the end at the present pace), or limits.max_gap",
        "the particles are only 22.5 um from the ends of the tube at t = 0.005 s; try a longer tube (--set length=12, "
        "enough until the end at the present pace), or limits.max_gap",
    ),
    "a distance without a name": (
        running_into_contact,
        "two particles are in contact: their distance is -0.001",
        "two particles are in contact: their distance is -0.05 um",
    ),
    "of two distances": (
        clustering_at_both_ends,
        "the train clusters at both d = 0.1 and d = 0.2",
        "the train clusters at both d = 5 um and d = 10 um",
    ),
    "a rate that is a fraction": (
        lambda: Message("stopped at dc/dt = {}", RATE(0.2, ".2g")),
        "stopped at dc/dt = 0.2",
        "stopped at dc/dt = 40 1/s",
    ),
}


@pytest.mark.parametrize("sentence", SENTENCES)
def test_a_sentence_is_dimensionless_or_in_units_of_the_experiment(sentence: str) -> None:
    message, plain, physical = SENTENCES[sentence]
    text = message()
    assert str(text) == in_units(text, None) == plain
    assert in_units(text, SCALES) == physical


def test_places_at_which_particles_move_on_are_in_units() -> None:
    first, last = (Message("d = {}", LENGTH(d)) for d in (0.03, 0.04))
    (warning,) = moves_on(PAIR, [first, last], 0.2)
    assert in_units(warning, SCALES).startswith("at 2 places from d = 1.5 um to d = 2 um the particles move on")


@pytest.mark.parametrize(
    ("message", "said"),
    [
        (
            Message("d = {}  dU = {}", LENGTH([0.1, 0.2]), VELOCITY([-1e-3, 2e-3], "+.4g")),
            "d = 5, 10 um  dU = -10, +20 um/s",
        ),
        (Message("F = {}", FORCE(1.0)), "F = 425 nN"),
        (Message("De = {}, Ca_e = {}", PURE(1.5), PURE(0.1)), "De = 1.5, Ca_e = 0.1"),
        (Message("starting at t = {}", TIME(0.0, "g")), "starting at t = 0"),
        (Message("dU = 0: unstable at d = {}", "11.4 +- 0.07 um"), "dU = 0: unstable at d = 11.4 +- 0.07 um"),
        (Message("d = {}", LENGTH(1 / 3, ".2g")), "d = 16.5 um"),
    ],
)
def test_numbers_have_the_digits_that_are_known(message: Message, said: str) -> None:
    assert message.in_units(SCALES) == said


def test_messages_are_composed_and_keep_their_quantities() -> None:
    d = Message("d = {}", LENGTH(0.1))
    for composed in (
        "at " + d + ", 1 step",
        Message("at {}, {} step", d, 1),
        "at " + Message.joined(", ", [d, "1 step"]),
    ):
        assert (str(composed), composed.in_units(SCALES)) == ("at d = 0.1, 1 step", "at d = 5 um, 1 step")
    assert Message("at {}", d) == "at " + d
    assert not Message.joined(", ", [])
    with pytest.raises(TypeError, match=r"d = 0\.1.* would lose its quantities"):
        f"at {d}"
    with pytest.raises(ValueError, match="1 values for 2 places"):
        Message("d = {} to {}", LENGTH(0.1))


def test_a_limit_names_the_place_in_units() -> None:
    monitor = Monitor(budget=-1.0)
    monitor.at(where(AT))
    with pytest.raises(BudgetSpent) as spent:
        monitor.check()
    assert in_units(spent.value.sentence, SCALES).endswith(
        "is spent, while solving at Ca_e = 0.1, d = 9.5195 um; try a larger --budget"
    )


def test_a_failure_travels_between_processes_with_its_quantities() -> None:
    failure = NewtonFailure(Message("lost at d = {}", LENGTH(0.1)), at=at_step(0.002, 5))
    again = pickle.loads(pickle.dumps(failure))
    assert str(again) == str(failure) == "newton_diverged at t = 0.002 (step 5): lost at d = 0.1"
    assert again.sentence.in_units(SCALES) == "newton_diverged at t = 1e-05 s (step 5): lost at d = 5 um"


def test_all_that_a_computation_says_is_put_into_units(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    d = Message("d = {}", LENGTH(0.1))

    def solve(*_: Any, **__: Any) -> events.Events:
        yield events.Begin("goal at " + d, 2.0)
        yield events.Note("note at " + d)
        yield events.Progress(1.0, "step at " + d, 1)
        yield events.Summary({ENDS: [{"message": "end at " + d}]}, ["warning at " + d])
        return events.Outcome("finished", "end", "outcome at " + d)

    options = Options(False, Reporter(shown=True), "pairsim run", ())
    outcome = carry_out(replace(QUESTIONS["run"], solve=solve), PAIR, tmp_path / "out", options)
    assert outcome.message == "outcome at d = 5 um"
    shown, record = capsys.readouterr().err, json.loads((tmp_path / "out" / "run.json").read_text())
    assert all(f"{each} at d = 5 um" in shown for each in ("goal", "note", "step", "outcome"))
    assert record["message"] == "outcome at d = 5 um"
    assert (record["ends"], record["warnings"]) == ([{"message": "end at d = 5 um"}], ["warning at d = 5 um"])
