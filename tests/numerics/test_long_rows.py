"""The model of long rows and their motion, without solutions of the flow."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product

import numpy as np
import pytest

from pairsim.runtime.monitor import Monitor
from pairsim.solvers.rows.model import RATES, Row, RowModel, fitted
from pairsim.solvers.rows.row_motion import TOLERANCE, move, propagator
from pairsim.solvers.rows.short_rows import places_of


def made_model(rate: float = float(RATES[6])) -> RowModel:
    """Parts of two to four particles with coefficients at random, each smaller than the one before."""
    random, rates, parts = np.random.default_rng(1), [], []
    for count in (2, 3, 4):
        powers = np.array([p for p in product((1, 2), repeat=count - 1) if sum(p) <= max(count, 3)])
        coefficients = random.normal(size=(len(powers), count, 3)) * 0.2 ** (count - 1)
        rates.append(rate * powers)
        parts.append(coefficients.reshape(-1, 3))
    return RowModel(np.array([1.7, 0.4, 0.0]), rates, np.concatenate(parts), 0.01)


def solution_of(true: RowModel, gaps: tuple[float, ...]) -> Row:
    """A short row; derivatives of what moving adds are not known, nor those of the front of the last particle."""
    row, rear = true.row(np.array(gaps)), 0.15
    slopes = row.slopes[..., :2].copy()
    slopes[-1, :, 1] = np.nan
    return replace(row.followed(-rear), slopes=slopes, rear=rear)


@pytest.mark.slow
def test_a_row_of_any_length_follows_from_rows_of_up_to_four() -> None:
    """Exactly, where no more than four neighbours act on each other; with three alone it does not."""
    true, gaps = made_model(), np.random.default_rng(2).uniform(0.03, 0.5, 29)
    right, rows, off = true.row(gaps), [solution_of(true, ())], []
    for count in (2, 3, 4):
        rows += [solution_of(true, place) for place in places_of(count, 0.02)]
        model = fitted(rows)
        off.append(np.abs(model.row(gaps).values - right.values).max(axis=0))
    assert off[0][0] > 3 * off[1][0] > 9 * off[2][0], off
    assert (off[2] < 5e-4).all()
    slopes = model.row(gaps).slopes
    assert slopes == pytest.approx(right.slopes, abs=0.02 * np.abs(right.slopes).max())


@pytest.mark.slow
def test_trains_tell_the_slopes_of_what_moving_adds() -> None:
    true, k = made_model(), np.pi * np.array([0.25, 0.5, 0.75, 1.0])
    rows = [solution_of(true, place) for count in (1, 2, 3, 4) for place in places_of(count, 0.04)]
    trains = [(d, k, true.growth(d, k)) for d in (0.06, 0.12, 0.24, 0.48)]
    without, with_trains = (
        [np.abs(model.growth(d, k) - true.growth(d, k)).max() for d in (0.09, 0.12, 0.17)]
        for model in (fitted(rows), fitted(rows, trains))
    )
    assert with_trains[1] < 0.2 * without[1]
    assert max(with_trains) < 0.5 * max(without), "between the trains, too"


def test_half_widths_hold_what_the_model_misses() -> None:
    """Where short rows are off at random, and parts are no sums of its exponentials."""
    true, random, error = made_model(80.0), np.random.default_rng(5), 1e-4
    rows = [solution_of(true, place) for count in (1, 2, 3) for place in places_of(count, 0.04)]
    for i, row in enumerate(rows[1:], 1):
        off = error / 2 * random.uniform(-1, 1, len(row.values))
        rows[i] = replace(row, values=row.values + off[:, None] * [1, 0, 0], dU_error=error)
    model, found = fitted(rows), []
    for count in (1, 2):
        places = np.exp(random.uniform(np.log(0.05), np.log(0.8), (40, count)))
        off = np.array([model.row(gaps).dU - true.row(gaps).dU for gaps in places])
        half = np.array([model.dU_errors(gaps) for gaps in places])
        assert (np.abs(off) < half).all()
        found.append((np.abs(off).max(), half.max()))
    assert found[0][1] < 2 * error, "pairs are as good as solved ones"
    assert found[1][0] > 2 * error, "triplets have steeper parts than the model can follow"


def test_slopes_are_differences_of_velocities_and_lengths() -> None:
    model, gaps, step = made_model(), np.linspace(0.05, 0.3, 6), 1e-5
    for i in range(len(gaps)):
        change = step * np.eye(len(gaps))[i]
        difference = (model.row(gaps + change).values - model.row(gaps - change).values) / (2 * step)
        assert model.row(gaps).slopes[:, i] == pytest.approx(difference, abs=1e-7)


def test_the_propagator_has_what_becomes_of_small_changes_of_the_first_distances() -> None:
    model, gaps, step = made_model(), np.array([0.1, 0.2, 0.15, 0.3]), 1e-3
    t, places = move(model, gaps, 0.002, 0.3, Monitor())
    changes = propagator(model, places, t[-1])
    assert np.abs(changes - np.eye(4)).max() > 0.1
    for i, change in enumerate(step * np.eye(4)):
        ends = [np.diff(move(model, gaps + sign * change, 0.002, 0.5, Monitor())[1](t[-1])) for sign in (1, -1)]
        assert changes[:, i] == pytest.approx((ends[0] - ends[1]) / (2 * step), abs=2e-3)


@dataclass(frozen=True)
class Prescribed:
    """Velocities that are given, of particles without deformation."""

    dU: tuple[float, ...] = (-0.1, 0.05, 0.0)

    alone, least, film, closing = np.array([1.0, 0.4]), 0.01, 0.07, None

    def row(self, gaps: np.ndarray) -> Row:
        """The first gap closes until the last one is wider than 0.4."""
        dU = np.array([self.dU[0] if gaps[-1] < 0.4 else -self.dU[0], *self.dU[1:-1], 0.02])
        values = np.column_stack([1 + np.concatenate([[0.0], np.cumsum(dU)]), np.full(4, 0.4), np.zeros(4)])
        return Row(gaps, values, np.zeros((4, 3, 2)))


def test_particles_that_touch_travel_on_as_a_doublet_until_they_would_have_to_be_pulled() -> None:
    t, places = move(Prescribed(), np.array([0.11, 0.2, 0.3]), 0.01, 20.0, Monitor())  # type: ignore[arg-type]
    touching = np.diff(places(t), axis=0) <= 0.01 + TOLERANCE
    assert t[touching[0]][[0, -1]] == pytest.approx([1.0, 5.0], abs=1e-4), "until the last distance has become 0.4"
    assert not touching[1:].any()
    assert np.diff(places(3.0)) == pytest.approx([0.01, 0.2 + 0.05 * 3 - 0.05 * 2, 0.36], abs=1e-5)
    assert (places(4.0) - places(2.0))[:2] == pytest.approx(2 * 0.95, abs=1e-5), "the mean of both velocities"
    assert np.diff(places(6.0))[0] == pytest.approx(0.01 + 0.1, abs=1e-3)
    assert min(places(t[-1]) - places(0.0)) == pytest.approx(20.0, abs=1e-6)


def test_a_film_slows_particles_that_come_closer_where_no_rows_were_solved() -> None:
    closing, gaps, c = replace(made_model(), least=0.1), np.array([0.1, 0.3, 0.3]), 0.07 * 0.4
    opening = replace(closing, coefficients=-closing.coefficients)
    for part in (0.9, 0.28, 0.028):
        first = gaps * [part, 1, 1]
        for model, slowed in ((closing, part * (0.1 + c) / (part * 0.1 + c)), (opening, 1.0)):
            t, places = move(model, first, 1e-6, 1e-4, Monitor())
            rate = np.diff(places(t[-1]) - places(0.0))[0] / t[-1]
            assert rate == pytest.approx(model.row(first).rates[0] * slowed, rel=1e-2)
