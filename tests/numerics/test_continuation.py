"""A continuation that does not reach its end fails; scenes without a mesh test the continuation alone."""

from __future__ import annotations

import re
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from pairsim.physics.drive import DEVELOPED
from pairsim.physics.liquids import single
from pairsim.physics.liquids.oldroyd_b import OldroydB
from pairsim.runtime.arrays import Array
from pairsim.runtime.monitor import Monitor
from pairsim.solvers.nonlinear.convergence import Report
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.steady import continuation
from pairsim.solvers.steady.continuation import follow
from pairsim.solvers.steady.pseudo_time import relax
from pairsim.solvers.steady.scene import SteadySolver


def report(converged: bool) -> Report:
    return Report(converged, 1, 1, "converged" if converged else "the steps grow", {}, 0.0)


def at(De: float) -> Parameters:
    return Parameters((), (None,), single(OldroydB(), De=De))


class Limited:
    """A scene that Newton's method solves up to De = .4 and pseudo-time wherever it is asked to."""

    def __init__(self) -> None:
        self.parameters, self.y, self.relaxations = at(0.1), np.zeros(1), 0
        self.problem = SimpleNamespace(betas=(0.4,), monitor=Monitor(), drive=DEVELOPED)
        self.constraints = SimpleNamespace(fields={"s": np.zeros(0, dtype=int)})

    @property
    def snapshot(self) -> SimpleNamespace:
        return SimpleNamespace(parameters=self.parameters)

    def solve(self, parameters: Parameters, guess: Array) -> Report:
        if parameters.De <= 0.4:
            self.parameters = parameters
        return report(parameters.De <= 0.4)

    def folded(self, parameters: Parameters, y: Array) -> bool:
        return False

    def distorted(self, parameters: Parameters, y: Array) -> bool:
        return False

    def linearise(self) -> SimpleNamespace:
        return SimpleNamespace(tangent=lambda _: np.zeros(1))

    def forget(self) -> None: ...

    def recall(self, snapshot: object) -> None: ...


def relaxed(scene: Limited, parameters: Parameters) -> Report:
    scene.parameters, scene.relaxations = parameters, scene.relaxations + 1
    return report(True)


def test_a_limit_is_not_crept_up_to_through_pseudo_time(monkeypatch: pytest.MonkeyPatch) -> None:
    scene: Any = Limited()
    monkeypatch.setattr(continuation, "relax", relaxed)
    monkeypatch.setattr(continuation.Passed, "of", lambda scene: scene.snapshot)
    end = follow(scene, at(1.0))
    assert end is not None
    assert not end.proven
    assert re.search(r"continuation to De = 1 stopped at De = 0\.4\d*: the steps grow", str(end.failure))
    assert end.last is scene
    assert end.way
    assert 0 < scene.relaxations < 10


def test_pseudo_time_in_which_stress_keeps_growing_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    rate = SimpleNamespace(value=0.0)
    scene: Any = SteadySolver.__new__(SteadySolver)
    scene.meshed = SimpleNamespace(
        scene=SimpleNamespace(liquid=SimpleNamespace(constants={"rate": rate}, size=0, set_star=lambda s: None)),
        constraints=SimpleNamespace(state=lambda y, _: (y, y)),
        newton=SimpleNamespace(forget=lambda: None, solve=lambda y, *_: (y, report(rate.value > 0.5))),
    )
    scene.y, scene.parameters, scene.problem = np.zeros(1), None, SimpleNamespace(monitor=Monitor())
    scene.iterations = scene.factorisations = 0
    monkeypatch.setattr(SteadySolver, "apply", lambda *_: np.zeros(0))
    monkeypatch.setattr(SteadySolver, "distortion_of", lambda *_: 1.0)
    assert not relax(scene, at(1.0)).converged
