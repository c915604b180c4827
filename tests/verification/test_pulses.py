"""Flow that varies in time: exact solutions, reversibility, mirror symmetry, and the limit of slow pulses."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial import KDTree
from support.pulses import case_of, pulses

from pairsim.computing.problems import problem_of
from pairsim.physics.pulsating_pipe import PulsatingPipe
from pairsim.physics.waveform import Sine, Waveform, square
from pairsim.runtime.arrays import Array
from pairsim.solvers.transient.end import settled
from pairsim.solvers.transient.transient import Transient

TUBE = {"particles": 0, "length": 0.5}
RIGID = {"beta": 0.4, "Ca_e": 0, "d0": 0.2, "length": 3, "mesh": {"Np": 8, "max_size": 0.3}}
SOFT = {**RIGID, "Ca_e": 0.05, "time": {"tol": 1e-3}}
FORMS = {
    "sine": {"shape": "sine", "period": 2, "amplitude": 1},
    "square": {"shape": "square", "period": 2, "mean": 0.3, "amplitude": 1},
    "triangle": {"shape": "triangle", "period": 1, "amplitude": 1},
}


def exact(t: float, De: float, omega: float, mean: float) -> float:
    """q of De dq/dt + q = Q from q = 0, where Q = mean + sin(omega t)."""
    k = De * omega
    periodic = (np.sin(omega * t) - k * np.cos(omega * t)) / (1 + k**2)
    return float(mean * (1 - np.exp(-t / De)) + periodic + k / (1 + k**2) * np.exp(-t / De))


@pytest.mark.parametrize("xi", [0.09, 1e-4])
@pytest.mark.parametrize("De", [0.1, 1.0])
def test_oldroyd_b_in_a_sine_without_particles_is_exact(De: float, xi: float) -> None:
    liquid = case_of(particles=0, De=De, xi=xi, liquid="oldroyd-b").liquid_model
    waveform = Sine(2.0, 0.2, 1.0)
    pipe = PulsatingPipe(liquid, waveform)
    for t in (0.02, 0.7, 1.5, 8.3):
        flow, found = waveform.at(t), pipe(t)
        gradient = 32 * (xi * flow + (1 - xi) * exact(t, De, np.pi, 0.2))
        assert found.gradient == pytest.approx(gradient, abs=1e-7)
        assert found.u == pytest.approx(2 * flow * (1 - 4 * found.r**2), abs=1e-6)


def test_its_stress_goes_on_over_the_jumps_of_a_square_wave() -> None:
    liquid = case_of(particles=0, De=1.0, liquid="oldroyd-b").liquid_model
    pipe, q, worst = PulsatingPipe(liquid, square(2.0, 0.0, 1.0)), 0.0, 0.0
    for half in range(5):
        flow = (-1.0) ** half
        for t in (0.1, 0.5, 1.0):
            expected = 32 * (0.09 * flow + 0.91 * (flow + (q - flow) * np.exp(-t)))
            worst = max(worst, abs(pipe(half + t).gradient - expected))
        q = flow + (q - flow) * np.exp(-1)
    assert worst < 1e-7


@pytest.mark.slow
@pytest.mark.parametrize("ends", ["developed", "periodic"])
def test_a_run_in_oldroyd_b_has_the_exact_pressure_drop_and_the_parabola(ends: str) -> None:
    off = []
    for size in (0.1, 0.05):
        steps, _, waveform = pulses(
            {"period": 2, "mean": 0.2, "amplitude": 1},
            0.8,
            **{**TUBE, "ends": ends, "De": 1.0, "liquid": "oldroyd-b", "time": {"tol": 2e-4}},
            mesh={"max_size": size},
        )
        found = np.array([step.observation.dp / 0.5 for step in steps])
        gradient = [32 * (0.09 * waveform.at(s.t) + 0.91 * exact(s.t, 1.0, np.pi, 0.2)) for s in steps]
        assert abs(found - gradient).max() < 1e-4 * np.abs(gradient).max()
        last = steps[-1]
        r = last.scene.liquid.six_node_mesh.points[:, 1]
        u = last.scene.liquid.nodal("u", last.x)[:, 0]
        off.append(abs(u - 2 * waveform.at(last.t) * (1 - 4 * r**2)).max())
    assert 2.5 < np.log2(off[0] / off[1]) < 4, "the parabola is approached with the third power of the cells"


def own_giesekus(waveform: Waveform, De: float, alpha: float, times: Array, cells: int = 200) -> Array:
    """Pressure gradients of a Giesekus liquid in a tube, by finite volumes in r of its own."""
    edges = np.linspace(0, 0.5, cells + 1)
    r, weight, xi = (edges[1:] + edges[:-1]) / 2, np.diff(edges**3) / 3, 0.09

    def gradient(t: float, c: Array) -> float:
        tau = (1 - xi) / De * c[1]
        return float((xi * waveform.at(t) / 4 - weight @ tau) / (weight @ (r / 2)))

    def rate(t: float, flat: Array) -> Array:
        zz, zr, rr, _ = c = flat.reshape(4, -1)
        shear = -(gradient(t, c) * r / 2 + (1 - xi) / De * zr) / xi
        a = zz - 1, zr, rr - 1
        square = np.array([a[0] ** 2 + a[1] ** 2, a[1] * (a[0] + a[2]), a[1] ** 2 + a[2] ** 2, (c[3] - 1) ** 2])
        relaxed = np.array([a[0], zr, a[2], c[3] - 1]) + alpha * square
        stretch = np.array([2 * shear * zr, shear * rr, 0 * r, 0 * r])
        return np.ravel(stretch - relaxed / De)

    start = np.repeat([1.0, 0.0, 1.0, 1.0], cells)
    done = solve_ivp(rate, (0, times[-1]), start, "BDF", times, rtol=1e-7, atol=1e-9)
    return np.array([gradient(t, y.reshape(4, -1)) for t, y in zip(times, done.y.T, strict=True)])


@pytest.mark.slow
def test_giesekus_in_a_sine_agrees_with_finite_volumes_in_the_radius() -> None:
    waveform, times = Sine(2.0, 0.0, 1.0), np.linspace(0.2, 4.0, 20)
    pipe = PulsatingPipe(case_of(particles=0, De=1.0).liquid_model, waveform)
    own = own_giesekus(waveform, 1.0, 0.2, times)
    found = np.array([pipe(t).gradient for t in times])
    assert abs(found - own).max() < 1e-4 * np.abs(own).max()


@pytest.mark.parametrize("name", FORMS)
def test_equal_rigid_particles_keep_their_distance_in_any_waveform(name: str) -> None:
    steps, cycles, _ = pulses(FORMS[name], FORMS[name]["period"], **RIGID)
    assert max(abs(step.dU[0]) for step in steps) < 1e-10
    assert cycles is not None
    assert abs(cycles.drift[0]) < 1e-10  # type: ignore[index]


@pytest.mark.slow
def test_unequal_rigid_particles_come_back_and_the_rest_falls_with_the_tolerance() -> None:
    drifts, errors = [], []
    for tol in (2e-3, 2e-4):
        _, cycles, _ = pulses({"period": 1, "amplitude": 1}, 1.0, **{**RIGID, "beta": [0.4, 0.35]}, time={"tol": tol})
        assert cycles is not None
        drifts.append(abs(float(np.max(cycles.drift))))
        errors.append(float(np.max(cycles.error)))
        assert drifts[-1] <= errors[-1]
    assert errors[1] < errors[0] / 4
    assert drifts[1] < drifts[0]


@pytest.mark.slow
def test_rigid_particles_depend_on_the_displaced_volume_alone() -> None:
    keys = {**RIGID, "beta": [0.35, 0.4], "time": {"tol": 2e-4}}
    steps, _, waveform = pulses({"period": 1, "mean": 0.4, "amplitude": 1}, 1.0, **keys)
    steady = Transient(problem_of(case_of(**keys)))
    last = list(steady.steps(iter([0.4])))[-1]
    steady.close()
    assert waveform.mean == pytest.approx(0.4)
    moved, expected = steps[-1].observation.d[0] - 0.2, last.observation.d[0] - 0.2
    assert moved == pytest.approx(expected, rel=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("mean", [0.5, -1.0])
def test_a_run_begins_with_the_steady_state_of_its_first_flow(mean: float) -> None:
    """In a Newtonian liquid it is that of stiffer particles at unit flow; of a pair it is the same both ways."""
    keys: dict[str, Any] = {**SOFT, "start": "steady"}
    steps, _, _ = pulses({"shape": "triangle", "period": 50, "mean": mean, "amplitude": 0.1}, 0.01, **keys)
    stiffer = {**keys, "Ca_e": 0.05 * abs(mean)}
    point = settled(problem_of(case_of(**stiffer)), (0.2,))[0]
    assert steps[0].observation.dU[0] == pytest.approx(abs(mean) * point.discrete.dU[0], rel=0.01)
    assert np.sign(steps[0].observation.U).tolist() == [np.sign(mean)] * 2


def test_a_run_begins_at_rest_where_nothing_flows_yet() -> None:
    case = case_of(**SOFT, start="steady", waveform={"period": 2, "amplitude": 1})
    assert not problem_of(case).from_steady


@pytest.mark.slow
def test_the_second_half_of_a_square_wave_is_a_forward_run_from_the_mirrored_state() -> None:
    keys = {**SOFT, "time": {"tol": 3e-4}}
    wave = {"shape": "square", "period": 1.0, "amplitude": 1}
    transient = Transient(problem_of(case_of(**keys, waveform=wave)))
    first = list(transient.steps(iter([0.5])))[-1]
    second = list(transient.steps(iter([1.0])))
    transient.close()
    forward = Transient(problem_of(case_of(**keys)))
    bodies, h = forward.bodies, forward.history.h[0].copy()
    places = [body.positions(first.h) for body in transient.bodies]
    for body, other, at in zip(bodies, transient.bodies[::-1], places[::-1], strict=True):
        own = body.phase.six_node_mesh.points  # type: ignore[union-attr]
        mirrored = other.phase.six_node_mesh.points * [-1, 1]  # type: ignore[union-attr]
        distance, nodes = KDTree(mirrored).query(own)
        assert distance.max() < 1e-9
        moved = at[nodes] * [-1, 1]
        h[body.start : body.start + body.size] = (moved - own).ravel()
    forward.history.h = [h]
    again = list(forward.steps(iter([0.5])))
    forward.close()
    late = [step for step in second if step.t > 0.55]
    times = [step.t - 0.5 for step in late]
    expected = np.interp(times, [step.t for step in again], [step.dU[0] for step in again])
    assert np.array([step.dU[0] for step in late]) == pytest.approx(expected, abs=2e-5)
    d = second[-1].observation.d[0], again[-1].observation.d[0]
    assert d[0] - first.observation.d[0] == pytest.approx(d[1] - first.observation.d[0], abs=2e-6)


@pytest.mark.slow
def test_slow_pulses_move_a_soft_pair_as_a_steady_flow_and_the_departure_falls_as_one_over_the_period() -> None:
    keys = {**SOFT, "hold": True, "time": {"tol": 1e-3}}
    steady = Transient(problem_of(case_of(**keys)))
    limit = float(list(steady.steps(iter([4.0])))[-1].dU[0])
    steady.close()
    departures = []
    for period in (4.0, 32.0):
        _, cycles, _ = pulses({"shape": "square", "period": period, "amplitude": 1}, 2 * period, **keys)
        assert cycles is not None
        departures.append(float(np.max(cycles.drift)) - period * limit)
    assert departures[1] == pytest.approx(departures[0], rel=0.03)
    assert 0 > departures[1] / 32.0 > -0.05 * limit
