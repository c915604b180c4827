"""Lines of critical distances are followed to every wanted value; scenes without cells, whose d_cr is a formula."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

from pairsim.physics.liquids import NEWTONIAN
from pairsim.physics.solids import soft
from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import NoSteadyState
from pairsim.solvers.curves import critical
from pairsim.solvers.curves.equilibrium_lines import Critical, EndOfLine, Followed, Follower, Region
from pairsim.solvers.parameters import Parameters

CA_E = Followed(lambda Ca_e: (NEWTONIAN, soft(Ca_e, Ca_e)))
"""The softness of both particles."""


class Scene(SimpleNamespace):
    """A scene whose solutions are their parameters."""

    @property
    def snapshot(self) -> Parameters:
        return self.parameters


class Formula:
    """A branch whose dU vanishes where log d = line(log Ca_e), and is log d less that elsewhere."""

    def __init__(self, line: Callable[[float], float], Ca_e: float) -> None:
        self.line = line
        d = float(np.exp(line(np.log(Ca_e))))
        nothing: Any = lambda *_: False  # noqa: E731
        self.solver: Any = Scene(
            parameters=CA_E.at(Ca_e, Parameters((d,), ())),
            y=np.zeros(1),
            iterations=0,
            linearise=lambda: SimpleNamespace(tangent=self.tangent),
            velocity_row=lambda: np.ones(1),
            folded=nothing,
            distorted=nothing,
            problem=SimpleNamespace(betas=(0.4, 0.4)),
            constraints=SimpleNamespace(fields={"h": np.zeros(0, dtype=int)}),
        )

    def dU(self, place: Parameters) -> float:
        return float(np.log(place.gaps[0])) - self.line(float(np.log(place.Ca_es[0])))

    def tangent(self, along: Callable[[float], Parameters]) -> Array:
        return np.array([(self.dU(along(1e-6)) - self.dU(along(-1e-6))) / 2e-6])

    def zero_on(self, along: Callable[[float], Parameters], tau: float, y: Array, *, settled: bool) -> Any:
        tried = np.linspace(-0.5, 0.5, 400)
        dU = np.array([self.dU(along(t)) for t in tried])
        signs = np.flatnonzero(dU[1:] * dU[:-1] <= 0)
        if not len(signs):
            return None
        nearest = signs[np.argmin(np.abs(tried[signs] - tau))]  # as Newton finds it
        self.solver.parameters = along(brentq(lambda t: self.dU(along(t)), tried[nearest], tried[nearest + 1]))
        return SimpleNamespace(parameters=self.solver.parameters, d=self.solver.parameters.gaps[0])

    def recall(self, snapshot: Any) -> None:
        self.solver.parameters = snapshot

    def return_to(self, zero: Any, snapshot: Any) -> None:
        self.expected = zero
        self.recall(snapshot)

    def improved(self, zero: Any) -> Any:
        return zero


class Folding(Formula):
    """A branch whose dU vanishes where log(Ca_e/.1) = -(log(d/.1)/width)^2: two distances below Ca_e .1, none above."""

    def __init__(self, width: float, Ca_e: float) -> None:
        self.width = width
        super().__init__(lambda q: float(np.log(0.1) + width * np.sqrt(np.log(0.1) - q)), Ca_e)

    def dU(self, place: Parameters) -> float:
        x, q = np.log(place.gaps[0] / 0.1), np.log(place.Ca_es[0] / 0.1)
        return float(q + (x / self.width) ** 2)


def followed(branch: Any, values: list[float]) -> tuple[list[Critical], EndOfLine]:
    point = SimpleNamespace(parameters=branch.solver.parameters, d=branch.solver.parameters.gaps[0])
    start: Any = SimpleNamespace(point=point, snapshot=branch.solver.snapshot)
    *found, end = Follower(branch, Region(CA_E, tuple(values), 0.02, 0.8)).follow(1, start, 1.0)
    assert isinstance(end, EndOfLine)
    assert all(isinstance(each, Critical) for each in found), "none is missed"
    return found, end


def test_a_line_begins_with_the_correction_of_its_own_zero() -> None:
    """That of the last zero of another line may be larger than dU is anywhere on this one."""
    branch = Formula(lambda q: float(np.log(0.2)), 0.01)
    (first, *_), _ = followed(branch, [0.01, 0.02])
    assert branch.expected is first.point


def test_a_line_that_was_lost_is_not_followed_twice(monkeypatch: pytest.MonkeyPatch) -> None:
    """A zero that cannot be followed from the first value is met by its own line from the last one."""

    def at(Ca_e: float) -> Any:
        return SimpleNamespace(parameters=CA_E.at(Ca_e, Parameters((0.73,), ())), d=0.73, slopes=np.ones(1))

    def search(branch: Any, least: float, most: float, others: Any) -> Any:
        yield from ()
        return [SimpleNamespace(point=at(branch.value))]

    def follow(_: Any, number: int, start: Any, forward: float) -> Any:
        yield Critical(start.point, number, "wanted")
        if forward > 0:
            yield EndOfLine(number, "lost", "")
            return
        yield from (Critical(at(Ca_e), number, "wanted") for Ca_e in (0.05, 0.02))
        yield EndOfLine(number, "range", "")

    branch: Any = SimpleNamespace(solver=SimpleNamespace(parameters=CA_E.at(0.02, Parameters((0.8,), ()))))
    branch.at = lambda parameters: setattr(branch, "value", parameters.Ca_es[0])
    monkeypatch.setattr(critical, "search", search)
    monkeypatch.setattr(Follower, "follow", follow)
    found = list(critical.follow_all(branch, Region(CA_E, (0.02, 0.05, 0.1), 0.02, 1.0)))
    assert [(c.branch, c.point.parameters.Ca_es[0]) for c in found if isinstance(c, Critical)] == [
        (1, 0.02),
        (2, 0.1),
        (2, 0.05),
    ]
    assert [(end.branch, end.reason) for end in found if isinstance(end, EndOfLine)] == [(1, "lost"), (2, "met")]


@pytest.mark.parametrize("values", [[0.005, 0.02, 0.04, 0.045, 0.05], [0.04, 0.0425, 0.045, 0.0475, 0.05]])
def test_wanted_values_are_met_where_distances_fall_steeply(values: list[float]) -> None:
    """As at De .125, whose line leaves d = .02 just above Ca_e .05."""

    def line(q: float) -> float:
        return float(np.log(0.28) - (np.exp(q) / 0.05) ** 14)

    found, end = followed(Formula(line, values[0]), values)
    met = [c.point.parameters.Ca_es[0] for c in found if c.kind == "wanted"]
    assert met == pytest.approx(values)
    assert end.reason == "range"
    assert all(c.point.d == pytest.approx(np.exp(line(np.log(c.point.parameters.Ca_es[0])))) for c in found)


@pytest.mark.parametrize("width", [0.3, 1.0, 1.4])
@pytest.mark.parametrize("values", [[0.05, 0.08, 0.099, 0.15], [0.095, 0.0999, 0.2], [0.03, 0.1]])
def test_values_before_a_fold_are_met_on_both_sides_of_it(width: float, values: list[float]) -> None:
    found, end = followed(Folding(width, values[0]), values)
    met = [v for v in values if v < 0.1]
    wanted = [c.point for c in found if c.kind == "wanted"]
    assert [point.parameters.Ca_es[0] for point in wanted] == [*met, *reversed(met)], "to the last digit"
    x = np.array([np.log(c.point.d / 0.1) for c in found])
    assert (np.diff(x) < 0).all(), "rows follow the line, so that a picture of them does not run to and fro"
    (meeting,) = [c for c in found if c.kind == "vanishes"]
    fold = meeting.point
    assert meeting.by_parameter == pytest.approx(1 / fold.parameters.Ca_es[0])
    assert all(c.by_parameter is None for c in found if c is not meeting)
    assert fold.parameters.Ca_es[0] == pytest.approx(0.1, rel=2e-3)
    assert end.reason == "range"
    exact = [width * np.sqrt(np.log(0.1 / v)) for v in met]
    assert [np.log(point.d / 0.1) for point in wanted] == pytest.approx([*exact, *(-v for v in reversed(exact))])


def test_zeros_that_meet_beyond_the_edge_are_told() -> None:
    """The line folds at Ca_e .1 and leaves d = .02 on its way back."""
    found, end = followed(Folding(6.0, 0.09), [0.01, 0.09, 0.0999, 0.2])
    assert [c.kind for c in found if c.kind != "added"] == ["wanted", "wanted", "vanishes", "wanted", "edge"]
    assert end.reason == "edge"
    assert found[-1].point.d == pytest.approx(0.02)


def test_end_of_a_line_tells_why() -> None:
    class Ending(Formula):
        def zero_on(self, along: Callable[[float], Parameters], tau: float, y: Array, *, settled: bool) -> Any:
            if along(tau).Ca_es[0] > 0.06:
                raise NoSteadyState("the shapes end", advice="nothing")
            return super().zero_on(along, tau, y, settled=settled)

    _, end = followed(Ending(lambda q: float(np.log(0.1) + 0.1 * q), 0.05), [0.05, 0.1])
    assert end.reason == "lost"
    assert "the shapes end" in str(end.message)
