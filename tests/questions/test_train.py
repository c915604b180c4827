"""Trains: cells of several particles, growth rates and their errors, and the answer in words."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.special import ive
from support.inputs import ROOT

import pairsim
from pairsim.computing import events
from pairsim.computing.case_files import parse_case
from pairsim.computing.problems import steady_problem
from pairsim.computing.workers import ALONE
from pairsim.questions.registry import QUESTIONS
from pairsim.runtime.monitor import Monitor
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.problems import SteadyProblem
from pairsim.solvers.steady.scene import SteadySolver
from pairsim.solvers.trains.cell import distance, one_particle, repeated
from pairsim.solvers.trains.response import growth_rates, response
from pairsim.solvers.trains.spectrum import Spectrum
from pairsim.solvers.trains.train import Train

SOFT = {"beta": 0.4, "De": 0, "Ca_e": 0.1, "d": 0.1}
RIGID = {"beta": 0.4, "De": 1, "Ca_e": 0, "d": 0.4}


def problem_of(**keys: Any) -> tuple[SteadyProblem, Parameters]:
    case = parse_case(QUESTIONS["train"], keys, "test")
    return steady_problem(case, np.inf), Parameters((), case.solid_models, case.liquid_model)


def one(**keys: Any) -> SteadySolver:
    found = one_particle(*problem_of(**keys), keys["d"])
    found.linearise()
    return found


def test_a_cell_of_three_is_three_cells_of_one_and_its_beads_are_equal_to_rounding() -> None:
    alone = one(**SOFT, mesh={"Np": 10})
    row = repeated(alone, 3)
    row.linearise()
    U = row.y[row.constraints.fields["U_p"]]
    assert distance(alone) == pytest.approx(0.1, rel=1e-6)
    assert pytest.approx(float(alone.y[alone.constraints.fields["U_p"]][0]), rel=1e-10) == U
    (_, x), (_, x_one) = row.state(), alone.state()
    assert x[row.scene.dp] == pytest.approx(3 * x_one[alone.scene.dp], rel=1e-10)


@pytest.mark.slow
def test_beads_far_apart_move_as_one_on_its_own() -> None:
    keys = {"beta": 0.4, "De": 0, "Ca_e": 0.1}
    far = one(**keys, d=2.0, mesh={"Np": 16})
    alone = pairsim.curve(keys | {"particles": 1, "length": 8, "mesh": {"Np": 16}}).frame()
    assert float(far.y[far.constraints.fields["U_p"]][0]) == pytest.approx(float(alone["U_1"][0]), rel=1e-4)
    far.close()


def test_velocities_beside_a_bead_that_moves_are_those_of_runs_with_beads_there() -> None:
    """The response at held distances is the slope of the velocities in a cell with other distances."""
    row = repeated(one(**SOFT, mesh={"Np": 10}), 4)
    (held, *_), here, step = response(row)[0], row.parameters, 1e-4
    U = []
    for change in (step, -step):
        assert row.solve(here.with_longer_gap(0, change), row.y).converged
        row.linearise()
        U.append(row.y[row.constraints.fields["U_p"]])
    row.close()
    slopes = (U[0] - U[1]) / (2 * step)
    # Of the others, whose cells have all moved by the same.
    assert np.diff(held)[1:] == pytest.approx(np.diff(slopes)[1:], abs=1e-2 * abs(slopes).max())


@pytest.mark.parametrize("keys", [SOFT, pytest.param(RIGID, marks=pytest.mark.slow)])
def test_growth_rates_are_within_their_errors_of_those_on_finer_meshes(keys: dict[str, Any]) -> None:
    found = pairsim.train(keys | {"mesh": {"Np": 20}, "train": {"cell": 4}})
    table = found.frame("spectrum")
    # With Np: 80.
    growth, frequency = {0: ([-0.042129, -0.054481], 0.064821), 1: ([0.000307, 0.004257], 0.015670)}[keys["De"]]
    assert (abs(table["growth"] - growth) <= table["growth_error"]).all()
    assert abs(table["frequency"][0] - frequency) <= table["frequency_error"][0]
    assert (table["growth_error"] < 0.2 * abs(table["frequency"][0])).all()


def test_nothing_grows_between_rigid_beads_in_a_newtonian_liquid() -> None:
    found = pairsim.train({"beta": 0.3, "De": 0, "Ca_e": 0, "train": {"spacing": 0.5, "cell": 6}, "mesh": {"Np": 10}})
    table = found.frame("spectrum")
    assert abs(table["growth"]).max() < 1e-9 * abs(table["frequency"]).max()
    assert found.table["verdict"][0] == "neither"
    assert "keep their size" in found.answer


def test_a_train_is_a_result_that_ends_the_wait_for_one() -> None:
    """A long row that is followed afterwards may take its time."""
    keys = {"beta": 0.3, "De": 0, "Ca_e": 0, "train": {"spacing": 0.5, "cell": 4}, "mesh": {"Np": 8}}
    found = QUESTIONS["train"].solve(parse_case(QUESTIONS["train"], keys, "test"), monitor=Monitor(), workers=ALONE)
    assert [each.table for each in found if isinstance(each, events.Row)] == ["train"]


def test_growth_rates_are_the_roots_that_go_on_from_those_of_the_first_term() -> None:
    """Of waves whose positions do not change with the rate, U = -0.06 + rate (1 + rate/2) of the first bead alone."""
    U, places = np.zeros((3, 4)), np.zeros((3, 4))
    U[:, 0], places[0, 0] = [0.06, -1.0, -0.5], 1.0
    # 0.06 - (1 + 1) rate - rate^2/2 = 0 for all waves.
    assert growth_rates(U, places, 1)[1:] == pytest.approx(0.03)
    assert growth_rates(U, places, 2)[1:] == pytest.approx(-2 + np.sqrt(4.12))


def spectrum(row: dict[int, float], n: int, change: float = 0.0) -> Spectrum:
    """That of a train whose velocities b_j are known."""
    k = 2 * np.pi * np.arange(n) / n
    rates = np.array(sum(b * (np.exp(-1j * k * j) - 1) for j, b in row.items()))
    return Spectrum(rates, np.array([(1 + change) * rates]))


def test_a_spectrum_goes_on_between_the_waves_of_its_cell() -> None:
    row = {-2: 0.01, -1: 0.06, 1: 0.04, 2: -0.02}
    found, k = spectrum(row, 8, change=0.1), np.array([0.1, 1.0, 2.9])
    exact: Any = sum(b * (np.exp(-1j * k * j) - 1) for j, b in row.items())
    waves = found.at(k)
    assert waves.growth == pytest.approx(np.real(exact))
    assert waves.frequency == pytest.approx(np.imag(exact))
    assert (waves.growth_error >= 0.1 * abs(np.real(exact))).all()
    assert found.everywhere.scaled[0] == pytest.approx(-sum(b * j**2 / 2 for j, b in row.items()))


@pytest.mark.parametrize("fall", [0.2, 0.5])
def test_errors_of_long_waves_and_between_waves_have_the_rest_of_the_row(fall: float) -> None:
    row = {j: 0.05 * fall ** abs(j) for j in range(-30, 31) if j}
    waves, exact = spectrum(row, 8).everywhere, -sum(b * j**2 / 2 for j, b in row.items())
    assert 1e-7 < abs(waves.scaled[0] - exact) <= waves.scaled_error[0] < -exact
    k, scaled, errors = (each[1:] for each in (waves.k, waves.scaled, waves.scaled_error))
    off = abs(scaled - sum(b * (np.cos(k * j) - 1) for j, b in row.items()) / (2 * (1 - np.cos(k))))
    assert (off <= errors + 1e-12).all()
    assert float(off.max()) > 1e-5


def test_verdicts_are_certain_beyond_the_errors_of_long_waves_too() -> None:
    orders = {-1: 0.05, 1: 0.03}
    assert spectrum(orders, 8).verdict == "orders"
    assert spectrum({j: -b for j, b in orders.items()}, 8).verdict == "clusters"
    assert spectrum({**orders, 2: -0.01, -2: -0.01}, 8, change=0.2).verdict == "undecided"


def test_errors_have_what_the_refinement_before_changed_too() -> None:
    """A last refinement that changes nothing by chance is no proof."""
    known = (spectrum({-1: 0.05 * each, 1: 0.03 * each}, 8) for each in (1.0, 1.0, 1.2))
    train, coarse, coarsest = (Train(1.2, 0.3, 0.7, 0.1, each, 100) for each in known)
    waves = train.beside(coarse, coarsest).spectrum.of_cell
    assert (waves.growth_error >= 0.2 * abs(waves.growth)).all()


def test_a_transition_is_where_the_first_wave_begins_to_grow(monkeypatch: pytest.MonkeyPatch) -> None:
    """By trains in which it is known: waves of two beads grow up to d = 0.5, long ones decay."""

    def known(_: Any, __: Any, cell: int, d: float | None = None) -> Train:
        assert d is not None
        growth = 0.5 - d
        row = {-1: 0.02 - growth / 2, 1: -growth / 2, 2: 0.01 * growth, -2: 0.01 * growth}
        return Train(1.2, d, d + 0.4, 0.1, spectrum(row, cell), 100)

    monkeypatch.setattr("pairsim.solvers.trains.train.train_of", known)
    monkeypatch.setattr("pairsim.questions.train.computation.steady_problem", lambda case, *_: problem_of(**RIGID)[0])
    keys = {"beta": 0.4, "De": 1, "Ca_e": 0}
    found = pairsim.train(keys | {"train": {"cell": 4, "transition": [0.3, 0.8]}}).check()
    d, d_error = (found.table[name][0] for name in ("d", "d_error"))
    assert known(None, None, 4, d).spectrum.least_stable.scaled == pytest.approx(0, abs=1e-3)
    assert d_error < 1e-2
    assert f"less than {d:.2g}" in found.answer
    assert "cluster, and those with more order" in found.answer
    with pytest.raises(pairsim.errors.NoSteadyState, match="clusters at both"):
        pairsim.train(keys | {"train": {"transition": [0.1, 0.2]}}).check()
    with pytest.raises(pairsim.InputError, match="left out if d is given"):
        pairsim.load(keys | {"d": 0.3, "train": {"transition": [0.1, 0.2]}}, kind="train")


def test_the_spread_of_distances_falls_as_that_of_a_chain_that_diffuses() -> None:
    found = spectrum({-1: 0.05, 1: 0.05}, 8)
    time, least, most = found.time_to(0.5)
    # The mean of exp(-2 a t (1 - cos k)) over k is exp(-2 a t) I_0(2 a t), with a = 0.1.
    assert ive(0, 2 * 0.1 * time) == pytest.approx(0.25, rel=1e-2)
    assert least <= time <= most
    uncertain = spectrum({-1: 0.05, 1: 0.05}, 8, change=-0.1).time_to(0.5)
    assert uncertain == pytest.approx((time, time / 1.1, time / 0.9), rel=1e-6)
    assert spectrum({-1: -0.05, 1: -0.05}, 8).time_to(0.5)[0] == np.inf


def test_the_answer_says_within_which_length_of_tube_beads_order(tmp_path: Path) -> None:
    case = pairsim.load(ROOT / "configs" / "train.yaml", kind="train", train={"cell": 4}, mesh={"Np": 10})
    found = pairsim.train(case, folder=tmp_path / "train")
    assert "6 um from surface to surface" in found.answer
    assert re.search(r"The train orders: .*, by a factor e within [.\d]+ \+- [.\d]+ mm\.", found.answer)
    assert "A spread of the distances of 20 % becomes one of 2 % within" in found.answer
    assert found.plot(tmp_path)
    path = tmp_path / "train" / "run.json"
    killed = {key: value for key, value in json.loads(path.read_text()).items() if key != "sentences"}
    path.write_text(json.dumps(killed | {"status": "running"}))
    answer = pairsim.open(tmp_path / "train").answer
    assert answer.startswith("Interrupted: the command was killed")
    assert "What was found is in train.csv" in answer


TWELVE = [0.12, 0.35, 0.2, 0.6, 0.15, 0.28, 0.1, 0.45, 0.22, 0.3, 0.17]


@pytest.mark.parametrize(
    ("keys", "seconds"),
    [
        ({"De": 0, "Ca_e": 0.1, "d": 0.3}, 1.7),
        ({"De": 0, "Ca_e": 0.05, "d": 0.1, "train": {"cell": 16}}, 2.9),
        ({"De": 0, "Ca_e": 0.1, "d": 0.3, "accuracy": "0.1%"}, 14.2),
        ({"De": 1, "Ca_e": 0, "d": 0.3}, 12.3),
        ({"De": 0.5, "Ca_e": 0.05, "d": 0.2}, 20.5),
        ({"De": 2, "Ca_e": 0.02, "d": 0.4}, 21.6),
        ({"De": 1, "Ca_e": 0, "d": 0.3, "accuracy": "5%", "beta": 0.2}, 2.7),
        ({"De": 1, "Ca_e": 0, "train": {"transition": [0.3, 0.9]}, "accuracy": "5%"}, 30.8),
        ({"De": 1, "Ca_e": 0.05, "d": TWELVE, "row": {"tube": 50}}, 193),
    ],
)
def test_duration_is_what_was_measured(keys: dict[str, Any], seconds: float) -> None:
    """On one core of an Intel Xeon beside other work; between the times that `--dry-run` prints."""
    case = pairsim.load({"beta": 0.4} | keys, kind="train")
    found = QUESTIONS["train"].estimate(case)
    assert found.seconds / found.within < seconds < found.seconds * found.within


@pytest.mark.slow
def test_a_run_of_a_period_decays_as_waves_of_the_train_do() -> None:
    """A wave of two beads in a period of four; its mean over both signs is free of terms of second order."""
    spacing, amplitude = 0.52, 0.0052
    case = {"beta": 0.4, "De": 0, "Ca_e": 0.1, "particles": 4, "ends": "repeated", "length": 4 * spacing}
    case |= {"time": {"end": 3}, "mesh": {"Np": 16}, "output": {"fields": False}}
    waves = []
    for sign in (1, -1):
        gaps = spacing - 0.4 + 2 * amplitude * sign * np.array([1, -1, 1])
        result = pairsim.run(case, d0=gaps.tolist()).check()
        assert max(result.record["settled"]["dU_error"]) < 3e-4, "a period has no ends that would affect it"
        places = result.table[["z_1", "z_2", "z_3", "z_4"]].to_numpy() @ [1, -1, 1, -1] + 2 * spacing
        waves.append((result.table["t"].to_numpy(), places))
    (t, wave), other = waves
    wave = wave - np.interp(t, *other)
    since = int(np.searchsorted(t, 1.0))
    rate = np.log(wave[-1] / wave[since]) / (t[-1] - t[since])
    train = {"beta": 0.4, "De": 0, "Ca_e": 0.1, "train": {"spacing": spacing, "cell": 4}, "accuracy": "5%"}
    assert rate == pytest.approx(pairsim.train(train).frame("spectrum")["growth"].iloc[-1], rel=0.02)


def test_a_period_of_a_row_is_as_long_as_its_distances() -> None:
    case = {"beta": 0.4, "De": 0, "Ca_e": 0.1, "particles": 4, "ends": "repeated", "d0": [0.1, 0.2, 0.3]}
    assert pairsim.load(case).tube_length == pytest.approx(4 * 0.4 + 0.6 + 0.2)
    assert pairsim.load(case, length=2.21).closed
    for keys, said in (
        ({"length": 2.2}, "length: got 2.2; must be above 2.202: 2.2 for the particles, and the distance to the next"),
        ({"particles": 0, "d0": None, "beta": None, "Ca_e": None}, "ends: got 'repeated'; must be periodic or"),
        ({"length": "auto"}, "auto requires ends: developed"),
    ):
        with pytest.raises(pairsim.InputError, match=re.escape(said)):
            pairsim.load(case | keys)
    with pytest.raises(pairsim.InputError, match="ends: got 'repeated'; must be"):
        pairsim.load({"beta": 0.4, "De": 0, "Ca_e": 0.1, "d": [0.1], "ends": "repeated"}, kind="curve")
