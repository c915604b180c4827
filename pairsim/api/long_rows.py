"""Rows of hundreds of equal particles on their way along a tube: `long_row`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from pairsim.api.cases import AnyCase, load
from pairsim.cases.quantities import LENGTH as A_LENGTH
from pairsim.cases.quantities import si
from pairsim.computing.problems import steady_problem
from pairsim.physics.scales import Scales
from pairsim.results.units import LENGTH, POSITION, in_unit
from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import InputError
from pairsim.runtime.monitor import Monitor
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.rows.interaction import RowModel
from pairsim.solvers.rows.model import Audit, EqualRow, audit, models, windows_of
from pairsim.solvers.rows.motion import RowMotion, move, random_gaps

LEAST = 0.04  # smallest distance at which short rows are solved [D_c]; chosen
ASSUMED = "assumed to travel on as doublets, held by equal and opposite forces until these would have to pull"


def long_row(
    case: AnyCase, *, least: float = LEAST, most: int = 4, progress: Callable[[str], None] = lambda _: None, **keys: Any
) -> LongRow:
    """Make the model of rows of equal particles from solutions of up to four of them (some minutes).

    Args:
        case: One particle, its liquid and tube, without distances: a case file, a dict of keys, or a case.
        least: Smallest distance that is solved [D_c]; velocities at smaller ones are those at it.
        most: Number of particles of the longest short rows, 2 to 4.
        progress: Takes a line of progress for each solution.
        keys: Keys of the case to replace.

    Raises:
        InputError: A key or value is not allowed.
        RunFailure: A short row has no quasi-steady state, or it was not found.
    """
    one = load(case, kind="curve", **{"particles": 1, **keys})
    if one.n != 1:
        raise InputError("pairsim.long_row", "particles", one.n, "must be 1 or left out: all particles are equal")
    problem = replace(steady_problem(one, np.inf), volume_modulus=False)
    row = EqualRow(problem, Parameters((), one.solid_models, one.liquid_model), least)
    known: RowModel | None = None
    for done, total, model in models(row, most):
        progress(f"{done} of {total} short rows")
        known = model
    assert known is not None
    return LongRow(row, known, one.scales)


@dataclass(frozen=True)
class LongRow:
    """The model of rows of any number of equal particles.

    Attributes:
        equal: What is solved.
        model: Velocities of N particles and their slopes at N-1 distances, counted from upstream.
        scales: The units of the case, None without a `physical` block.
    """

    equal: EqualRow
    model: RowModel
    scales: Scales | None

    def move(
        self,
        d0: Sequence[float] | dict[str, float],
        length: float | str,
        particles: int | None = None,
        min_gap: float = 0.002,
        audited: int = 0,
    ) -> MovedRow:
        """Let a row move along a tube.

        Args:
            d0: First distances from upstream [D_c], or {"mean": ..., "spread": ..., "seed": ...}: a gamma distribution
                with this mean [D_c] and this standard deviation relative to it.
            length: Length of tube [D_c], or with its unit such as "40cm".
            particles: How many particles, if distances are at random.
            min_gap: Distance of contact [D_c].
            audited: How many rows of six neighbours on the way are solved in full, which tells the error of the model.

        Raises:
            InputError: A length has a wrong unit, or distances are not above `min_gap`.
            RunFailure: A row that is solved in full has no quasi-steady state.
        """
        if isinstance(d0, dict):
            gaps = random_gaps((particles or 2) - 1, d0["mean"], d0["spread"], int(d0.get("seed", 0)), min_gap)
        else:
            gaps = np.array(d0, dtype=float)
        if gaps.size == 0 or gaps.min() <= min_gap:
            raise InputError("pairsim.long_row", "d0", d0, f"must be distances above min_gap = {min_gap:g}")
        far = self._in_diameters(length)
        motion = move(self.model, gaps, min_gap, far, Monitor())
        states = [motion.gaps(t) for t in np.linspace(0.0, motion.t[-1], 5)]
        places = windows_of(states, 6, audited, self.model.least) if audited else []
        return MovedRow(far, motion, self.scales, audit(self.equal, self.model, places) if places else None)

    def _in_diameters(self, length: float | str) -> float:
        try:
            return float(length)
        except ValueError:
            pass
        if self.scales is None:
            raise InputError("pairsim.long_row", "length", length, "must be in D_c: the case has no physical block")
        try:
            return si(length, A_LENGTH) / self.scales.length
        except ValueError as error:
            raise InputError("pairsim.long_row", "length", length, str(error)) from None


@dataclass(frozen=True)
class MovedRow:
    """A row that has moved along a tube.

    Attributes:
        length: Length of tube by which its particles have moved [D_c].
        motion: The motion; `motion.gaps(t)` and `motion.positions(t)` at any time.
        scales: The units of the case, None without a `physical` block.
        audit: How far the model is from solutions of rows on the way; None if none were solved.
    """

    length: float
    motion: RowMotion
    scales: Scales | None
    audit: Audit | None

    @property
    def distances(self) -> pd.DataFrame:
        """The distance of every pair of neighbours from upstream, at the inlet and one length of tube later.

        Columns d_inlet, d_outlet [D_c], and t_outlet [D_c/U_av].
        """
        times = self.motion.times_after(self.length)
        outlet = [self.motion.gaps(t)[gap] for gap, t in enumerate(times)]
        return pd.DataFrame({"d_inlet": self.motion.gaps(0.0), "d_outlet": outlet, "t_outlet": times})

    def way(self, count: int) -> tuple[Array, Array]:
        """The mean way of the row, shape (count,), and its distances, (count, N-1), at some times [D_c]."""
        times = np.linspace(0.0, self.motion.t[-1], count)
        places = np.array([self.motion.positions(t).mean() for t in times])
        return places - places[0], np.array([self.motion.gaps(t) for t in times])

    def plot(self, file: Path | str, width: str | float = 170.0) -> list[Path]:
        """Draw the distances over the position, and at inlet and outlet, as `pairsim.plot` does.

        Args:
            file: The picture: .png, .pdf or .svg.
            width: Its width, mm as a number, or text such as "85mm".

        Raises:
            InputError: The file cannot be written, or its kind or the width are not allowed.
        """
        from pairsim.plots.long_rows import draw_long_row
        from pairsim.plots.style import Page
        from pairsim.plots.units import Units

        path, units, (position, distances) = Path(file), Units(self.scales), self.way(200)
        page = Page.parse(path.suffix.removeprefix("."), width)
        drawn = position * units.factor(POSITION), distances * units.factor(LENGTH)
        return draw_long_row(*drawn, units, path.with_suffix(""), page)

    def __str__(self) -> str:
        """What has become of the distances."""
        found, contacts = self.distances, self.motion.contacts
        where = in_unit(self.scales, POSITION, self.length) + ("" if self.scales else " D_c")
        means, spreads = (
            [in_unit(self.scales, LENGTH, float(found[name].mean())) for name in ("d_inlet", "d_outlet")],
            [f"{100 * found[name].std(ddof=0) / found[name].mean():.3g} %" for name in ("d_inlet", "d_outlet")],
        )
        lines = [
            f"Spread of {len(found)} distances within {where} of tube: from {spreads[0]} to {spreads[1]} of their "
            f"mean, which goes from {means[0]} to {means[1]}."
        ]
        first = next((each for each in contacts if each.begins), None)
        if first is not None:
            z = in_unit(self.scales, POSITION, first.z) + ("" if self.scales else " D_c")
            held = sum(1 if each.begins else -1 for each in contacts)
            closed = len({each.gap for each in contacts})
            lines.append(
                f"Gap {first.gap + 1} closes first, after {z}. In all {closed} close, and {held} stay closed; beads "
                f"that touch are {ASSUMED}."
            )
        if self.audit is not None:
            lines.append(
                f"Model against {len(self.audit.dU)} solved rows: dU within {100 * self.audit.dU.max():.2g} % of the "
                f"largest |dU| of each, slopes within {100 * self.audit.slopes.max():.2g} %."
            )
        return "\n".join(lines)
