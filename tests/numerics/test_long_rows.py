"""The model of long rows and their motion, without solutions of the flow."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
import pytest

from pairsim.runtime.monitor import Monitor
from pairsim.solvers.rows.interaction import RATES, Part, RowModel
from pairsim.solvers.rows.model import places_of
from pairsim.solvers.rows.motion import move
from pairsim.solvers.rows.short_rows import ShortRow


def made_model(rate: float = float(RATES[6])) -> RowModel:
    """Parts of two to four particles with coefficients at random, each smaller than the one before."""
    random, parts = np.random.default_rng(1), []
    for count in (2, 3, 4):
        powers = np.array([p for p in product((1, 2), repeat=count - 1) if sum(p) <= max(count, 3)])
        U, lengths = random.normal(size=(2, len(powers), count)) * 0.2 ** (count - 1)
        parts.append(Part(rate, powers, U, lengths[:, 1:]))
    return RowModel(1.7, 0.4, tuple(parts), 0.01)


def short_row(model: RowModel, gaps: tuple[float, ...]) -> ShortRow:
    d = np.array(gaps)
    lengths = model.lengths(d) if len(d) else np.array([model.length])
    return ShortRow(d, model.velocities(d), model.slopes(d), lengths, model.length_slopes(d), 0.0)


def test_a_row_of_any_length_follows_from_rows_of_up_to_four() -> None:
    """Exactly, where no more than four neighbours act on each other; with three alone it does not."""
    true, gaps = made_model(), np.random.default_rng(2).uniform(0.03, 0.5, 29)
    model = RowModel(true.U, true.length, (), np.inf)
    off = []
    for count in (2, 3, 4):
        model = model.with_part_of([short_row(true, place) for place in places_of(count, 0.02)])
        off.append(np.abs(model.velocities(gaps) - true.velocities(gaps)).max())
    assert off[0] > 3 * off[1] > 9 * off[2], off
    assert off[2] < 5e-4
    assert model.lengths(gaps) == pytest.approx(true.lengths(gaps), abs=5e-4)
    right = true.slopes(gaps)
    assert model.slopes(gaps) == pytest.approx(right, abs=0.02 * np.abs(right).max())


def test_slopes_are_differences_of_velocities_and_lengths() -> None:
    model, gaps, step = made_model(), np.linspace(0.05, 0.3, 6), 1e-5
    for i in range(len(gaps)):
        change = step * np.eye(len(gaps))[i]
        for value, slopes in ((model.velocities, model.slopes), (model.lengths, model.length_slopes)):
            difference = (value(gaps + change) - value(gaps - change)) / (2 * step)
            assert slopes(gaps)[:, i] == pytest.approx(difference, abs=1e-7)


@dataclass(frozen=True)
class Prescribed:
    """Velocities that are given, of particles without deformation."""

    U: float = 1.0
    dU: tuple[float, ...] = (-0.1, 0.05, 0.0)

    def velocities(self, gaps: np.ndarray) -> np.ndarray:
        return np.concatenate([[self.U], self.U + np.cumsum(self.rates(gaps))])

    def lengths(self, gaps: np.ndarray) -> np.ndarray:
        return np.full(len(gaps), 0.4)

    def rates(self, gaps: np.ndarray) -> np.ndarray:
        """The first gap closes until the last one is wider than 0.4."""
        sign = 1 if gaps[-1] < 0.4 else -1
        return np.array([sign * self.dU[0], *self.dU[1:-1], 0.02])


def test_particles_that_touch_travel_on_as_a_doublet_until_they_would_have_to_be_pulled() -> None:
    motion = move(Prescribed(), np.array([0.11, 0.2, 0.3]), 0.01, 20.0, Monitor())  # type: ignore[arg-type]
    first, last = motion.contacts
    assert (first.gap, first.begins, last.gap, last.begins) == (0, True, 0, False)
    assert first.t == pytest.approx(1.0, abs=1e-5)
    assert last.t == pytest.approx(5.0, abs=1e-2), "when the last distance has become 0.4"
    assert motion.gaps(3.0) == pytest.approx([0.01, 0.2 + 0.05 * 3 - 0.05 * 2, 0.36], abs=1e-5)
    before, after = motion.positions(2.0), motion.positions(4.0)
    assert (after - before)[:2] == pytest.approx(2 * 0.95, abs=1e-5), "the mean of both velocities"
    assert motion.gaps(6.0)[0] == pytest.approx(0.01 + 0.1, abs=1e-3)
    assert min(motion.positions(motion.t[-1]) - motion.positions(0.0)) == pytest.approx(20.0, abs=1e-6)


def test_every_distance_has_moved_by_a_length_at_a_time_of_its_own() -> None:
    motion = move(Prescribed(dU=(0.0, 0.1, 0.0)), np.full(3, 0.1), 0.01, 5.0, Monitor())  # type: ignore[arg-type]
    assert motion.times_after(3.0) == pytest.approx([3.0, 3 / 1.05, 3 / 1.11], rel=1e-6)
