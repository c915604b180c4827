"""Lines of critical distances are followed to every wanted value; scenes without cells, whose d_cr is a formula."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

from pairsim.critical import Critical, End, Follower
from pairsim.parameters import Parameters
from pairsim.quadratic import Array


class Formula:
    """A branch whose dU vanishes where log d = line(log Ca_e), and is log d less that elsewhere."""

    def __init__(self, line: Callable[[float], float], Ca_e: float) -> None:
        self.line = line
        d = float(np.exp(line(np.log(Ca_e))))
        nothing: Any = lambda *_: False  # noqa: E731
        self.fine: Any = SimpleNamespace(
            parameters=Parameters((d,), (Ca_e, Ca_e)),
            y=np.zeros(1),
            iterations=0,
            factor=lambda: None,
            tangent=self.tangent,
            velocity_row=lambda: np.ones(1),
            folded=nothing,
            distorted=nothing,
            comm=SimpleNamespace(bcast=lambda value: value),
            problem=SimpleNamespace(betas=(0.4, 0.4)),
            tie=SimpleNamespace(fields={"h": np.zeros(0, dtype=int)}),
        )

    def dU(self, place: Parameters) -> float:
        return float(np.log(place.gaps[0])) - self.line(float(np.log(place.Ca_es[0])))

    def tangent(self, along: Callable[[float], Parameters]) -> Array:
        return np.array([(self.dU(along(1e-6)) - self.dU(along(-1e-6))) / 2e-6])

    def zero_on(self, along: Callable[[float], Parameters], tau: float, y: Array, *, settled: bool) -> Any:
        if self.dU(along(-0.5)) * self.dU(along(0.5)) > 0:
            return None
        self.fine.parameters = along(brentq(lambda t: self.dU(along(t)), -0.5, 0.5))
        return SimpleNamespace(parameters=self.fine.parameters, d=self.fine.parameters.gaps[0])

    @property
    def snapshots(self) -> Any:
        return self.fine.parameters

    def recall(self, snapshots: Any) -> None:
        self.fine.parameters = snapshots


def followed(line: Callable[[float], float], values: list[float]) -> tuple[list[Critical], End]:
    branch: Any = Formula(line, values[0])
    found: list[Critical] = []
    start: Any = SimpleNamespace(point=branch.zero_on(lambda tau: branch.fine.parameters, 0, np.zeros(1), settled=True))
    start.snapshots = branch.snapshots
    end = Follower(branch, "Ca_e", values, 0.02, 0.8, found.append).follow(1, start, 1.0)
    return found, end


@pytest.mark.parametrize("values", [[0.005, 0.02, 0.04, 0.045, 0.05], [0.04, 0.0425, 0.045, 0.0475, 0.05]])
def test_wanted_values_are_met_where_distances_fall_steeply(values: list[float]) -> None:
    """As at De .125, whose line leaves d = .02 just above Ca_e .05."""

    def line(q: float) -> float:
        return float(np.log(0.28) - (np.exp(q) / 0.05) ** 14)

    found, end = followed(line, values)
    met = [c.point.parameters.Ca_es[0] for c in found if c.kind == "wanted"]
    assert met == pytest.approx(values)
    assert end.reason == "range"
    assert all(c.point.d == pytest.approx(np.exp(line(np.log(c.point.parameters.Ca_es[0])))) for c in found)
