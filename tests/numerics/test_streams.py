"""The motion of streams, beside that of rows, and what particles change that differ."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from pairsim.runtime.arrays import Array
from pairsim.runtime.monitor import Monitor
from pairsim.solvers.rows.contact import TOUCHING
from pairsim.solvers.rows.deviations import Deviations, deviations
from pairsim.solvers.rows.model import Row, RowModel
from pairsim.solvers.rows.row_motion import _velocities, move
from pairsim.solvers.rows.stream_motion import _Velocities, follow

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


def test_lengths_of_beads_that_differ_change_the_rates_of_their_distances() -> None:
    """Those of a single bead do not depend on distances, and by its front and its rear it has half of them each."""
    pair = np.array([[0.3, -0.2], [0.05, 0.0]])

    def row(gaps: Array, parts: Array) -> Row:
        n, sizes = len(gaps) + 1, 1 + parts[:, 0]
        front, rear = 0.22 * sizes, 0.18 * sizes
        values = np.zeros((n, 3))
        values[:, 1] = front + np.append(rear[1:], 0.0)
        if n == 2:
            values[:, 1] += np.exp(-2 * gaps[0]) * pair @ parts[:, 0]
        return Row(gaps, values, np.zeros((n, n - 1, 2)), by_particle=np.zeros((n, n, 2)), parts=parts, rear=rear[0])

    found, rows = from_unequal(row), replace(pair_model(0.01), deviations=None)
    parts, gaps = np.array([[0.03, 0.0], [-0.02, 0.0], [0.01, 0.0]]), np.array([0.2, 0.3])
    slopes = [-2 * np.exp(-2 * d) * pair @ parts[i : i + 2, 0] for i, d in enumerate(gaps)]
    changes = np.array([[slopes[0][0], 0.0], [slopes[0][1], slopes[1][0]]])
    rates = np.diff(_Velocities(replace(rows, deviations=found), parts, CONTACT)(np.array([0.0, 0.2, 0.5])))
    free = rows.row(gaps).dU
    assert rates == pytest.approx(np.linalg.solve(np.eye(2) + changes, free), rel=5e-4)  # its squares are left out
    assert np.abs(rates / free - 1).max() > 0.01
    far_apart = 30 * parts, np.cumsum([0.0, 0.06, 0.06])
    assert np.diff(_Velocities(replace(rows, deviations=found), far_apart[0], CONTACT)(far_apart[1])).min() > 0


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
