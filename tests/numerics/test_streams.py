"""The motion of streams, beside that of rows, and what particles change that differ."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from pairsim.runtime.arrays import Array
from pairsim.runtime.monitor import Monitor
from pairsim.solvers.rows.closing import Closing
from pairsim.solvers.rows.contact import TOUCHING
from pairsim.solvers.rows.deviations import Deviations, deviations
from pairsim.solvers.rows.lag import Lag
from pairsim.solvers.rows.model import Row, RowModel
from pairsim.solvers.rows.row_motion import _velocities, move
from pairsim.solvers.rows.stream_motion import _Velocities, follow
from pairsim.solvers.rows.stretch import Stretch

CONTACT = 2e-3
RANDOM = np.random.default_rng(3)
RATES = [np.array([[2.0], [4.0]]), np.array([[2.0, 2.0], [2.0, 4.0], [4.0, 2.0]])]


def model(size: float = 0.01) -> RowModel:
    """Rows of up to three that act on each other, by random numbers of a size."""
    count = sum(each.size + len(each) for each in RATES)
    coefficients = size * RANDOM.standard_normal((count, 3)) * [1, 5, 0.2]
    return RowModel(np.array([1.7, 0.4, 0.01]), RATES, coefficients, 0.04)


def pair_model(coefficient: float) -> RowModel:
    """Only neighbours act on each other: dU = 2 coefficient exp(-2 d)."""
    coefficients = np.zeros((4, 3))
    coefficients[:2, 0] = -coefficient, coefficient
    return RowModel(np.array([1.7, 0.4, 0.0]), [RATES[0]], coefficients, 0.04)


def moved(of: RowModel, gaps: Array, parts: Array | None, tube: float, places: int = 2) -> list[Array]:
    return [each.gaps for each in follow(of, gaps, parts, CONTACT, np.linspace(0, tube, places), Monitor())]


@pytest.mark.parametrize("beads", [2, 3, 9])
def test_equal_beads_have_the_velocities_of_a_row(beads: int) -> None:
    rows, gaps = model(), RANDOM.uniform(0.005, 0.2, beads - 1)
    found = _Velocities(rows, None, CONTACT)(np.cumsum(np.append(0.0, gaps)))
    assert found == pytest.approx(_velocities(rows, gaps, CONTACT), abs=1e-12)


def test_equal_beads_move_as_a_row_does() -> None:
    rows, gaps = model(), RANDOM.uniform(0.2, 1.0, 12)
    _, places = move(rows, gaps, CONTACT, 20.0, Monitor())
    *_, last = follow(rows, gaps, None, CONTACT, [0.0, 20.0], Monitor())
    assert np.abs(last.gaps - gaps).max() > 0.02
    assert last.gaps == pytest.approx(np.diff(places(last.time)), abs=1e-4)


@pytest.mark.parametrize("row", [True, False])
def test_a_film_slows_two_beads_and_moves_no_other_one(row: bool) -> None:
    rows, gaps = pair_model(-0.01), np.array([0.5, 0.01, 0.5])
    in_stream = _Velocities(rows, None, CONTACT)
    with_film = _velocities(rows, gaps, CONTACT) if row else in_stream(np.cumsum(np.append(0.0, gaps)))
    slowed = 0.01 / (0.01 + 0.028) * (0.04 + 0.028) / 0.04  # d/(d + c), as a part of that where rows are solved
    assert np.diff(with_film)[1] == pytest.approx(rows.row(gaps).rates[1] * slowed, rel=1e-9)
    free = rows.row(gaps).U
    assert with_film[[0, 3]] == pytest.approx(free[[0, 3]], rel=1e-12)
    assert with_film.sum() == pytest.approx(free.sum(), rel=1e-12)


def test_beads_that_touch_go_on_as_one_and_none_passes_another() -> None:
    differ = Deviations(np.array([-0.4, 0.0]), [], 0.04)
    rows, parts = replace(pair_model(0.0), deviations=differ), np.zeros((4, 2))
    parts[0, 0] = -0.05  # the smallest one comes from behind at a velocity of 0.02 more
    paths = np.array(moved(rows, np.array([0.1, 0.2, 5.0]), parts, 150.0, 31))
    assert paths.min() >= CONTACT - 1e-12
    together = paths[:, 0] <= CONTACT + TOUCHING
    assert together.any()
    first = int(np.argmax(together))
    assert together[first:].all()
    # Two of them are faster than the third one by half of that, until they touch it as well.
    before = (paths[first + 1, 1] - paths[first + 2, 1]) * 1.7 / 5.0
    assert before == pytest.approx(0.01, rel=0.02)


def test_beads_that_touch_part_where_they_repel() -> None:
    rows, parts = replace(pair_model(0.01), deviations=Deviations(np.array([-0.4, 0.0]), [], 0.04)), np.zeros((2, 2))
    assert moved(rows, np.array([CONTACT]), parts, 20.0)[-1][0] > 0.1
    parts[0, 0] = -0.08  # a velocity of 0.032 more than the 0.02 at which they part
    assert moved(rows, np.array([CONTACT]), parts, 20.0)[-1][0] == pytest.approx(CONTACT, abs=TOUCHING)


def test_derivatives_of_short_rows_are_found_again_in_long_ones() -> None:
    """By each bead those of a single one, of pairs and of triplets add up."""

    def derivatives(gaps: Array) -> Array:
        n = len(gaps) + 1
        found = np.zeros((n, n, 2))
        found[range(n), range(n)] = -0.4, 0.1
        for i, d in enumerate(gaps):
            found[i : i + 2, i : i + 2] += np.exp(-2 * d) * np.arange(8).reshape(2, 2, 2)
        return found

    def row(gaps: Array) -> Row:
        n = len(gaps) + 1
        return Row(gaps, np.zeros((n, 3)), np.zeros((n, n - 1, 2)), by_particle=derivatives(gaps))

    places = RANDOM.uniform(0.1, 1.0, (20, 2))
    short = [row(gaps[:1]) for gaps in places] + [row(gaps) for gaps in places]
    found = deviations(row(np.zeros(0)), short, [], RATES, 0.0)
    gaps = RANDOM.uniform(0.1, 1.0, 7)
    assert found.matrix(gaps) == pytest.approx(derivatives(gaps), abs=1e-9)


def test_what_beads_change_that_differ_is_known_to_second_order() -> None:
    """Of a single bead by its size and its softness, of pairs by both sizes, and by one size and one softness."""
    alone, pairs = np.array([[-0.5, 0.2], [0.2, -0.3]]), RANDOM.standard_normal((2, 2, 2, 2, 2))
    pairs = pairs + np.transpose(pairs, (0, 3, 4, 1, 2))
    pairs[..., 1, :, 1] = 0.0  # by both softnesses is not known

    def second(gaps: Array) -> Array:
        n = len(gaps) + 1
        found = np.zeros((n, n, 2, n, 2))
        found[range(n), range(n), :, range(n)] = alone
        return found + np.exp(-2 * gaps[0]) * pairs if n == 2 else found

    def row(gaps: Array, parts: Array) -> Row:
        n = len(gaps) + 1
        by = np.einsum("ijkml,ml->ijk", second(gaps), parts)
        return Row(gaps, np.zeros((n, 3)), np.zeros((n, n - 1, 2)), by_particle=by, parts=parts)

    found = from_unequal(row)
    parts, gaps = RANDOM.uniform(-0.05, 0.05, (3, 2)), RANDOM.uniform(0.1, 1.0, 2)
    expected = np.einsum("nk,kl,nl->n", parts, alone, parts) / 2
    for i, d in enumerate(gaps):
        added = np.einsum("ijkml,jk,ml->i", pairs, parts[i : i + 2], parts[i : i + 2]) / 2
        expected[i : i + 2] += np.exp(-2 * d) * added
    assert found.velocities(gaps, parts) == pytest.approx(expected, abs=1e-9)


def from_unequal(row: Callable[[Array, Array], Row]) -> Deviations:
    """What follows from single beads and pairs in which one bead differs."""
    places = [np.zeros(0), *RANDOM.uniform(0.1, 1.0, (8, 1))]
    equal = [replace(row(gaps, np.zeros((len(gaps) + 1, 2))), parts=None) for gaps in places]
    unequal = [row(places[0], sign * each[None]) for each in 0.02 * np.eye(2) for sign in (1, -1)]
    for gaps in places[1:]:
        unequal += [row(gaps, sign * np.outer(each, [0.02, 0.0])) for each in np.eye(2) for sign in (1, -1)]
    return deviations(equal[0], equal[1:], unequal, RATES, 0.0)


def soft_pair(d: float, sizes: Array, coefficients: Array) -> Row:
    """A pair with dU = .01 exp(-2 d) + .4 of what its sizes differ, and lengths that change as `Stretch` has it.

    Coefficients are those of the ratio of the rates of distances by dU and mean size, at a distance of 1.
    """
    front, rear = 0.22 * np.exp(sizes), 0.18 * np.exp(sizes)
    values, slopes = np.zeros((2, 3)), np.zeros((2, 1, 2))
    values[:, 0] = 1.7 - 0.4 * sizes + [0.0, 0.02 * np.exp(-2 * d)]
    values[:, 1] = front + [rear[1], 0.05 * np.exp(-2 * d) * sizes[1]]
    ratio = 1.0 + coefficients @ [np.diff(values[:, 0])[0], sizes.mean()] / d**2
    slopes[0, 0, 1] = 1 / ratio - 1
    parts = np.column_stack([sizes, np.zeros(2)]) if sizes.any() else None
    rear_of_first = rear[0] - 0.03 * np.exp(-2 * d) * sizes[0]
    return Row(np.array([d]), values, slopes, 1e-5, np.zeros((2, 2, 2)), float(rear_of_first), parts)


def soft_alone(size: float) -> Row:
    return Row(
        np.zeros(0),
        np.array([[1.7 - 0.4 * size, 0.22 * np.exp(size), 0.0]]),
        np.zeros((1, 0, 2)),
        by_particle=np.array([[[-0.4, 0.0]]]),
        rear=float(0.18 * np.exp(size)),
        parts=np.array([[size, 0.0]]) if size else None,
    )


def stretch_of_pairs(places: Array, coefficients: Array) -> Stretch:
    """Of pairs at distances of which one is 2 % larger or smaller."""
    sizes = [sign * each for each in 0.02 * np.eye(2) for sign in (1, -1)]
    unequal = [soft_pair(d, each, coefficients) for d in places for each in sizes]
    unequal += [soft_alone(size) for size in (0.02, -0.02)]
    equal = [soft_pair(d, np.zeros(2), coefficients) for d in places]
    found = Stretch.fitted(equal, unequal, RATES[0])
    assert found is not None
    return found


def test_lengths_of_soft_beads_follow_their_relative_velocities() -> None:
    """Those of single beads do not depend on distances, and what a pair adds at its ends is in the next distance."""
    coefficients, gaps, sizes = np.array([0.05, 0.002]), np.array([0.1, 0.15]), np.array([0.03, -0.02, 0.04])
    found = stretch_of_pairs(np.array([0.04, 0.08, 0.1, 0.15, 0.3, 0.6]), coefficients)
    assert found.slopes == pytest.approx(np.tile(coefficients, (6, 1)), rel=1e-6)
    assert found.scatter == pytest.approx(0.0, abs=1e-9)
    of_equals, faster = np.array([[0.0, 0.01], [0.9, 0.95], [0.02, 0.0]]), np.array([-0.01, 0.02])
    changed = found.changed(of_equals, gaps, sizes, faster)
    means = [0.005, 0.01]
    ratios = 1 / of_equals[1] + (coefficients[0] * faster + coefficients[1] * np.array(means)) / gaps**2
    assert changed[1] == pytest.approx(1 / ratios, rel=1e-6)
    rear, front = (-2 * each * np.exp(-2 * gaps) for each in (-0.03, 0.05))
    assert changed[0, 1] == pytest.approx(0.01 + rear[1] * sizes[1], rel=1e-4)
    assert changed[2, 0] == pytest.approx(0.02 + front[0] * sizes[1], rel=1e-4)


def test_beads_that_run_into_each_other_do_not_part_by_it() -> None:
    found = stretch_of_pairs(np.array([0.04, 0.08, 0.16]), np.array([0.05, 0.0]))
    gaps, of_equals = np.full(60, 0.05), np.vstack([np.zeros(60), np.full(60, 0.8), np.zeros(60)])
    stretch = found.changed(of_equals, gaps, np.zeros(61), np.linspace(0.0, -0.3, 60))[1]
    assert (np.diff(stretch) > 0).all()
    assert np.abs(np.diff(stretch, 2)).max() < 0.25 * np.diff(stretch).max(), "without a jump of the slope"


def test_rigid_beads_have_the_lengths_of_equal_ones() -> None:
    rigid = [Row(np.array([0.1]), np.ones((2, 3)), np.zeros((2, 1, 2)), parts=np.array([[0.02, 0.0], [0.0, 0.0]]))]
    assert Stretch.fitted([], rigid, RATES[0]) is None


def closing_pair(d: float, rate: float) -> Row:
    values = np.array([[1.7, 0.4, 0.0], [1.7 + rate, 0.4, 0.0]])
    return Row(np.array([d]), values, np.zeros((2, 1, 2)), 0.1 * abs(rate), parts=np.array([[-0.05, 0.0], [0.05, 0.0]]))


def test_soft_beads_come_closer_as_a_pair_does_that_was_solved() -> None:
    solved = [closing_pair(d, -0.01 * (d / 0.04) ** 2) for d in (0.08, 0.04, 0.02, 0.01)]
    closing = Closing.of(solved, 0.04)
    assert closing is not None
    assert closing.factor(np.array([0.2, 0.06, 0.04, 0.03, 0.01, 0.005])) == pytest.approx(
        [1.0, 1.0, 1.0, 0.75**2, 0.25**2, 0.125**2]
    )
    assert closing.faster.factor(np.array([0.06, 0.02])) == pytest.approx([1.1, 1.1 * 0.25])
    rows, gaps = replace(pair_model(-0.01), closing=closing), np.array([0.5, 0.02, 0.5])
    slowed = _Velocities(rows, None, CONTACT)(np.cumsum(np.append(0.0, gaps)))
    assert np.diff(slowed)[1] == pytest.approx(rows.row(gaps).rates[1] * 0.25, rel=1e-9)


def test_errors_of_films_make_beads_faster_at_the_distances_of_the_model_too() -> None:
    closing = Closing.of([closing_pair(d, -0.01 * (d / 0.04) ** 2) for d in (0.08, 0.04, 0.02, 0.01)], 0.04)
    assert closing is not None
    U, gaps = np.array([1.7, 1.69, 1.7]), np.array([0.06, 0.06])  # the first two come closer, the others part
    assert closing.changed(U, gaps) == pytest.approx(0.0)
    changed = np.diff(closing.faster.changed(U, gaps))
    assert changed[0] == pytest.approx(0.1 * (U[1] - U[0]))


def test_a_film_slows_down_the_bead_that_it_did_in_the_pair_that_was_solved() -> None:
    def pair(d: float) -> Row:  # the downstream bead takes no part of it
        row = closing_pair(d, -0.01 * min(d / 0.04, 1.0))
        return replace(row, values=row.values + (1.7 - row.values[1, 0]) * np.array([1.0, 0.0, 0.0]))

    closing = Closing.of([pair(d) for d in (0.08, 0.04, 0.02, 0.01)], 0.04)
    assert closing is not None
    assert closing.shares == pytest.approx(1.0)
    U, gaps = np.array([1.7, 1.71, 1.69, 1.72]), np.array([0.3, 0.02, 0.3])
    assert closing.changed(U, gaps) == pytest.approx([0.0, -0.01, 0.0, 0.0])
    equally = replace(closing, shares=0 * closing.shares + 0.5)
    assert equally.changed(U, gaps) == pytest.approx([0.0, -0.005, 0.005, 0.0])


def test_neighbouring_films_are_solved_together() -> None:
    closing = Closing.of([closing_pair(d, -0.01 * min(d / 0.04, 1.0)) for d in (0.08, 0.04, 0.02, 0.01)], 0.04)
    assert closing is not None
    closing = replace(closing, shares=0 * closing.shares + 0.5)
    U, gaps = np.array([1.72, 1.71, 1.69]), np.array([0.02, 0.01])
    slowed, q = U + closing.changed(U, gaps), np.array([1.0, 3.0])
    forces = -q * np.diff(slowed) / 2  # which are equal and opposite
    assert slowed - U == pytest.approx([-forces[0], forces[0] - forces[1], forces[1]])


def test_a_film_resists_beads_that_another_film_pushes_together() -> None:
    closing = Closing.of([closing_pair(d, -0.01 * min(d / 0.04, 1.0)) for d in (0.08, 0.04, 0.02, 0.01)], 0.04)
    assert closing is not None
    closing = replace(closing, shares=0 * closing.shares + 1.0)
    U, gaps = np.array([1.70, 1.701, 1.69]), np.array([0.01, 0.02])  # the first two would part
    assert U + closing.changed(U, gaps) == pytest.approx([1.70 - 0.0045 * 0.75, 1.6955, 1.69], abs=1e-12)


def lagging_pair(d: float, dU: float, rate: float, lag: float) -> Row:
    values, slopes = np.array([[1.7, 0.4, 0.0], [1.7 + dU, 0.4, 0.0]]), np.zeros((2, 1, 2))
    slopes[0, 0, 1] = dU / rate - 1
    return Row(np.array([d]), values, slopes, lag=np.array([lag]))


def test_the_relaxation_time_of_lengths_is_that_of_pairs() -> None:
    def time(d: float, dU: float) -> float:
        return 0.2 / d**0.5 * float(np.exp(-20 * dU))

    places = [(d, dU) for d in (0.04, 0.06, 0.1, 0.2) for dU in (-0.02, 0.005, 0.01)]
    pairs = [lagging_pair(d, dU, 0.8 * dU, -0.2 * dU * time(d, dU)) for d, dU in places]
    pairs.append(lagging_pair(0.02, -0.01, -0.001, 1.0))  # nearer than it is looked at
    found = Lag.fitted(pairs, 0.04)
    assert found is not None
    d, dU = np.array([0.05, 0.15, 0.02, 0.9]), np.array([0.007, -0.01, 0.005, 0.5])
    within = [(0.05, 0.007), (0.15, -0.01), (0.04, 0.005), (0.2, 0.01)]
    assert found.time(d, dU) == pytest.approx([time(*each) for each in within])
    assert found.at(d, dU, dU + 0.01) == pytest.approx(0.01 * found.time(d, dU))


def test_rigid_beads_do_not_lag_behind() -> None:
    assert Lag.fitted([closing_pair(d, -0.01) for d in (0.04, 0.06, 0.1, 0.2)], 0.04) is None


def lagging(time: float, size: float) -> RowModel:
    """Two beads whose lengths change by the exponential of 2 d, with a lag of one time."""
    of = pair_model(size)
    of.coefficients[0, 1] = -0.1
    lag = Lag(np.array([np.log(time), 0.0, 0.0, 0.0]), (0.01, 1.0), (-1.0, 1.0))
    return replace(of, deviations=Deviations(np.zeros(2), [], 0.04), lag=lag)


@pytest.mark.parametrize("size", [0.01, -0.01])
def test_beads_that_were_held_move_as_their_centres_do_and_then_as_without_a_memory(size: float) -> None:
    of, start, alike = lagging(0.5, size), np.array([0.0, 0.4]), np.zeros((2, 2))
    moving = _Velocities(of, alike, CONTACT)
    dU, without = of.row(start[1:]).dU[0], of.row(start[1:]).rates[0]
    assert abs(without - dU) > 0.05 * abs(dU)
    state = moving.held(start)
    assert np.diff(moving(state)[:2])[0] == pytest.approx(dU)
    assert moving(np.append(start, 0.5 * (without - dU)))[2] == pytest.approx(0.0, abs=1e-15)
    assert np.diff(moving(np.append(start, 0.5 * (without - dU)))[:2])[0] == pytest.approx(without)


@pytest.mark.parametrize("size", [0.01, -0.01])
def test_distances_between_centres_change_by_what_dU_adds_up_to(size: float) -> None:
    """Also where shapes lag behind: their lengths and lags are in it."""
    of, alike, state, step = lagging(0.5, size), np.zeros((2, 2)), np.array([0.0, 0.3, 0.0]), 2e-3
    moving, moved = _Velocities(of, alike, CONTACT), 0.0

    def centres(state: Array) -> float:
        d = state[1] - state[0]
        return float(d + of.row(np.array([d])).values[0, 1] + state[2])

    before = centres(state)
    for _ in range(500):
        half = state + step / 2 * moving(state)
        moved += step * of.row(np.diff(half[:2])).dU[0]
        state = state + step * moving(half)
    assert abs(state[2]) > 1e-4
    assert centres(state) - before == pytest.approx(moved, rel=1e-5)


def test_a_pair_that_does_not_come_closer_says_nothing_of_films() -> None:
    assert Closing.of([closing_pair(0.08, -0.01), closing_pair(0.04, 0.01), closing_pair(0.02, 0.01)], 0.04) is None
    ends = Closing.of([closing_pair(d, -0.01 if d > 0.01 else 0.01) for d in (0.04, 0.02, 0.01)], 0.04)
    assert ends is not None
    assert ends.distances.tolist() == [0.02, 0.04]


def test_a_thousand_beads_take_no_memory_of_their_square() -> None:
    U, stretch = model().along(RANDOM.uniform(0.1, 1.0, 100_000))
    assert U.shape == (100_001,)
    assert stretch.shape == (5, 100_000)


def test_half_widths_contain_what_is_known_of_two_neighbours_alone() -> None:
    rows, gaps = model(), np.array([0.1, 0.2])
    (pairs,) = (other for other in rows.variants if other.film)
    of_two, of_three = pairs.row(gaps[:1]).U, pairs.row(gaps).U
    assert of_two == pytest.approx(rows.row(gaps[:1]).U, abs=1e-15)
    first, second = (rows.row(gap[None]).U - rows.alone[0] - rows.alone[2] for gap in gaps)
    summed = rows.alone[0] + rows.alone[2] + np.append(first, 0.0) + np.append(0.0, second)
    assert of_three == pytest.approx(summed, abs=1e-15)
    assert np.abs(rows.row(gaps).U - summed).max() > 1e-4


def test_half_widths_of_beads_that_may_differ_have_no_terms_that_cancel_by_chance() -> None:
    """Triplets add .002 exp(-2 (d_1 + d_2)) to their first bead and take it from their last one.

    In a row of even distances these cancel each other in the middle, beside what four beads add.
    """
    coefficients = np.zeros((13, 3))
    coefficients[:2, 0] = 0.004  # of pairs
    coefficients[4:7, 0] = 0.002, 0.0, -0.002
    rows = RowModel(np.array([1.7, 0.4, 0.0]), RATES, coefficients, 0.04, deviations=Deviations(np.zeros(2), [], 0.04))
    gaps = np.full(8, 0.1)
    changes = np.array([np.diff(other.along(gaps)[0] - rows.along(gaps)[0]) for other in rows.variants if other.film])
    part = 0.5 * np.exp(-0.2)  # of what pairs add is what triplets add, and what is left out of a geometric series
    term = 0.002 * np.exp(-0.4) * part / (1 - part)
    assert np.abs(changes.sum(axis=0))[3:5] == pytest.approx(0.0, abs=1e-12)
    assert np.linalg.norm(changes, axis=0)[3:5] == pytest.approx(2 * term, rel=1e-3)
