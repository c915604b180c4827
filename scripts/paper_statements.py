"""What section 3 of the paper says, statement by statement, judged by the results of scripts/paper.

A statement is a function of the results that returns checks: by how much something is as stated, and the error of that
number. Quantities that are called nearly the same may differ by `NEARLY`, and so on: the words that need a number are
the constants below.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import Any, Literal

import numpy as np
from paper_results import Curve, Extremum, NotComputed, Results, Transient, figures

from pairsim.plots.meridional_section import outlines
from pairsim.results.xdmf import FieldFrame
from pairsim.runtime.arrays import Array

NEARLY = 0.1
""""almost", "substantially the same", "nearly superimposed": a difference of this part."""
VANISHED = 0.05
""""decreases to zero": below this part of the peak."""
DRAWN = 3e-3
"""Values of dU below this part of the peak cannot be told from zero in a drawing, such as those of the paper."""
RUN_ERROR = 0.01
"""Error of dU in a run, relative to its largest |dU|: `accuracy: 1%`."""
SOFT = (0.01, 0.05, 0.1, 0.15)
"""The paper's Ca_e of soft particles."""

type Verdict = Literal["holds", "within error", "does not hold", "not computed"]
type Check = tuple[float, float]
"""By how much something is as stated (negative: it is not), and the error of this number."""


@dataclass(frozen=True)
class Finding:
    """What the results say of a statement.

    Attributes:
        checks: All must be positive for the statement to hold.
        figures: The numbers that were looked at.
    """

    checks: tuple[Check, ...]
    figures: str

    @property
    def verdict(self) -> Verdict:
        """Of all checks."""
        if any(margin < -error for margin, error in self.checks):
            return "does not hold"
        return "within error" if any(margin <= error for margin, error in self.checks) else "holds"


@dataclass(frozen=True)
class Statement:
    """A statement of the paper.

    Attributes:
        figure: The figure that it is about, such as fig07.
        text: The statement.
        find: What results say of it.
    """

    figure: str
    text: str
    find: Callable[[Results], Finding]

    def judge(self, results: Results) -> tuple[Verdict, str]:
        """Verdict and figures."""
        try:
            found = self.find(results)
        except NotComputed as lacking:
            return "not computed", str(lacking)
        return found.verdict, found.figures


@dataclass(frozen=True)
class Row:
    """A statement with its verdict.

    Attributes:
        statement: The statement.
        verdict, figures: By the results of the figures.
        others: The same by finer meshes and by periodic ends, where these were computed.
    """

    statement: Statement
    verdict: Verdict
    figures: str
    others: dict[str, tuple[Verdict, str]]


MODULES = ("paper_newtonian", "paper_viscoelastic", "paper_confined")
"""The modules with the statements, which register them when they are imported."""
STATEMENTS: list[Statement] = []
"""All statements in the order of the paper."""
CHECKS = {"finer": "finer meshes", "periodic": "periodic ends", "transients": "in time"}
"""Folders of configs/paper with computations that check what does not hold, and what these are."""
IN_TIME: dict[str, Callable[[Results], Finding]] = {}
"""What runs in time say of a statement, by its text."""


def statement(figure: str, text: str) -> Callable[[Callable[[Results], Finding]], Callable[[Results], Finding]]:
    """Decorator of a function that judges a statement."""

    def add(find: Callable[[Results], Finding]) -> Callable[[Results], Finding]:
        STATEMENTS.append(Statement(figure, text, find))
        return find

    return add


def statements[F: Callable[..., Finding]](figure: str, texts: Mapping[str, Any]) -> Callable[[F], F]:
    """Decorator of a function that judges several statements, each with the value that stands beside its text."""

    def add(find: F) -> F:
        def with_value(value: Any) -> Callable[[Results], Finding]:
            return lambda results: find(results, value)

        STATEMENTS.extend(Statement(figure, text, with_value(value)) for text, value in texts.items())
        return find

    return add


def in_time(text: str) -> Callable[[Callable[[Results], Finding]], Callable[[Results], Finding]]:
    """Decorator of a function that judges a statement by runs in time."""

    def add(find: Callable[[Results], Finding]) -> Callable[[Results], Finding]:
        IN_TIME[text] = find
        return find

    return add


def not_opposite(results: Results, d0: float, **where: Any) -> Finding:
    """Check of statements by which the stiff and the softest pair do not go opposite ways from one distance.

    Args:
        results: Results of the transients.
        d0: The distance.
        where: Parameters of both.
    """
    runs = [results.run(d0=d0, Ca_e=Ca_e, **where) for Ca_e in (SOFT[0], SOFT[-1])]
    dU = [run.last("dU") for run in runs]
    text = "; ".join(f"Ca_e {a:g}: dU {v:.2e}" for a, v in zip((SOFT[0], SOFT[-1]), dU, strict=True))
    opposite = -float(np.sign(dU[0] * dU[1])) * min(map(abs, dU))
    return Finding(((-opposite, 0.0),), f"from d = {d0:g}, at t = {runs[0].last('t'):g}, {runs[1].last('t'):g}: {text}")


def judged(results: Results) -> list[Row]:
    """All statements with their verdicts."""
    for name in MODULES:
        import_module(name)
    rows = []
    for each in STATEMENTS:
        others = {name: each.judge(Results(results.output, (name,))) for name in CHECKS if name != "transients"}
        if each.text in IN_TIME:
            transient = Statement(each.figure, each.text, IN_TIME[each.text])
            others["transients"] = transient.judge(Results(results.output, ("transients", *figures())))
        found = {name: other for name, other in others.items() if other[0] != "not computed"}
        rows.append(Row(each, *each.judge(results), found))
    return rows


def rising(values: Sequence[float], errors: Sequence[float]) -> list[Check]:
    """Checks that each value is above the one before."""
    pairs = itertools.pairwise(zip(values, errors, strict=True))
    return [(b - a, e + f) for (a, e), (b, f) in pairs]


def falling(values: Sequence[float], errors: Sequence[float]) -> list[Check]:
    """Checks that each value is below the one before."""
    return rising([-value for value in values], errors)


def falls_along(values: Sequence[float], errors: Sequence[float]) -> list[Check]:
    """Checks that values fall along a branch whose neighbours have nearly the same error.

    The first and the last value must differ by more than their errors; between neighbours the sign is enough.
    """
    steps = [(-step, 0.0 if step < 0 else error) for (step, error) in rising(values, errors)]
    return [(values[0] - values[-1], errors[0] + errors[-1]), *steps]


def rising_dU(found: Sequence[Extremum]) -> list[Check]:
    """Checks that each dU is above the one before."""
    return rising([each.dU for each in found], [each.error for each in found])


def speeds(found: Iterable[Extremum]) -> str:
    """dU of points of curves."""
    return numbers(each.dU for each in found)


def smallest(curve: Curve) -> str:
    """The least dU of a curve, with its error, place and part of the peak."""
    d, dU, error = curve.extreme(-1)
    return f"{dU:.1e} ± {error:.0e} at d = {d:.3f}, {abs(dU) / curve.peak:.2%} of the peak"


def nearly(values: Iterable[float], scale: float, error: float = 0.0, part: float = NEARLY) -> Check:
    """Check that values differ by less than a part of a scale."""
    known = list(values)
    return part * scale - (max(known) - min(known)), error


def drawn(curve: Curve, error: float) -> float:
    """The error of a dU of a curve, no less than what a drawing shows."""
    return max(error, DRAWN * curve.peak)


def by_softness(results: Results, **where: Any) -> list[Curve]:
    """The curves of the paper's four Ca_e."""
    return [results.curve(Ca_e=Ca_e, **where) for Ca_e in SOFT]


def common_distances(curves: Sequence[Curve]) -> Array:
    """Distances that all curves cover, shape (60,)."""
    return np.geomspace(max(c.d[0] for c in curves), min(c.d[-1] for c in curves), 60)


def numbers(values: Iterable[float], form: str = ".3g") -> str:
    """Numbers with commas between."""
    return ", ".join("none" if np.isnan(value) else f"{value:{form}}" for value in values)


def deviations(frame: FieldFrame) -> list[float]:
    """Root mean square of the distance between each particle's outline and the sphere of its volume, over its radius.

    Spheres are centred where the particle has its centre of volume; from upstream.
    """
    found = []
    for line in outlines(frame, pieces=12):
        z, r = line.T
        slices = np.pi * ((r[1:] + r[:-1]) / 2) ** 2 * np.diff(z)
        centre = float(np.sum(slices * (z[1:] + z[:-1]) / 2) / np.sum(slices))
        radius = float((0.75 * np.sum(slices) / np.pi) ** (1 / 3))
        lengths = np.hypot(np.diff(z), np.diff(r))
        off = np.hypot(z - centre, r) - radius
        squares = (off[1:] ** 2 + off[:-1] ** 2) / 2
        found.append(float(np.sqrt(np.sum(squares * lengths) / np.sum(lengths))) / radius)
    return found


def run_error(run: Transient) -> float:
    """Error of dU of a run."""
    return RUN_ERROR * float(np.abs(run.table["dU"]).max())
