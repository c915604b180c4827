"""Signals as flags, and where a computation heeds them: between Newton iterations and in a mesh."""

from __future__ import annotations

import signal
import subprocess
import sys
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from support.scenes import soft_pair

from pairsim.fem.meshes import meshing
from pairsim.fem.meshes.geometry import MeshSettings
from pairsim.runtime.monitor import Monitor
from pairsim.runtime.signals import Signals, Stopped
from pairsim.solvers.transient.transient import Transient

ALL = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


@pytest.fixture(autouse=True)
def handlers() -> Iterator[None]:
    """The handlers of pytest come back."""
    before = {number: signal.getsignal(number) for number in ALL}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.mark.parametrize("number", ALL)
def test_a_signal_is_a_flag_which_further_sigterms_leave(number: int) -> None:
    signal.signal(signal.SIGHUP, signal.SIG_DFL)
    with Signals() as signals:
        Monitor(signals).check()
        signal.raise_signal(number)
        for _ in range(3):
            signal.raise_signal(signal.SIGTERM)
        with pytest.raises(Stopped):
            Monitor(signals).check()


def test_second_interrupt_raises_at_once() -> None:
    with Signals() as signals:
        signal.raise_signal(signal.SIGTERM)
        signal.raise_signal(signal.SIGINT)
        assert signals.number == signal.SIGINT
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)


def test_under_nohup_a_hangup_changes_nothing() -> None:
    signal.signal(signal.SIGHUP, signal.SIG_IGN)
    with Signals() as signals:
        signal.raise_signal(signal.SIGHUP)
        assert signals.number == 0


def test_newtons_method_stops_before_the_next_factorisation() -> None:
    transient = Transient(soft_pair(0.4, 0.1, 0.1, mesh=MeshSettings(Np=6), length=2.0))
    newton = transient.newton
    arguments = (np.zeros(transient.constraints.size), transient.history.h[0], 0.01, 1.7)
    with Signals() as signals:
        newton.monitor = Monitor(signals)
        signal.raise_signal(signal.SIGTERM)
        with pytest.raises(Stopped, match="SIGTERM"):
            newton.solve(*arguments)
        assert newton.factorisations == 0
    newton.monitor = Monitor()
    solution, report = newton.solve(*arguments)
    assert report.converged
    assert np.isfinite(solution).all()
    transient.close()


def test_an_interrupt_within_an_iteration_is_raised(monkeypatch: pytest.MonkeyPatch) -> None:
    """PETSc's compiled code, which calls back, does not lose it."""

    def interrupted(*_: Any) -> None:
        raise KeyboardInterrupt

    transient = Transient(soft_pair(0.4, 0.1, 0.1, mesh=MeshSettings(Np=6), length=2.0))
    monkeypatch.setattr(transient.scene, "load", interrupted)
    with pytest.raises(KeyboardInterrupt):
        transient.newton.solve(np.zeros(transient.constraints.size), transient.history.h[0], 0.01, 1.7)
    transient.close()


def test_an_interrupt_within_the_generation_of_a_mesh_is_raised() -> None:
    """Gmsh's compiled code, which asks for sizes, would lose it and take a size of zero."""
    corners, asked = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)], []

    def build() -> None:
        geo = meshing.gmsh.model.geo
        points = [geo.addPoint(z, r, 0) for z, r in corners]
        lines = [geo.addLine(a, b) for a, b in zip(points, [*points[1:], points[0]], strict=True)]
        geo.addPlaneSurface([geo.addCurveLoop(lines)])

    def size(z: float, r: float) -> float:
        asked.append((z, r))
        if len(asked) == 3:
            raise KeyboardInterrupt
        return 0.5

    with pytest.raises(KeyboardInterrupt):
        meshing._run_gmsh(build, size, [])
    assert 3 < len(asked) < 1000


def test_signal_after_the_last_file_changes_nothing() -> None:
    """Python resets handlers when it ends, and libraries need a while for their own end."""
    program = (
        "import atexit, os, signal, sys, time\n"
        "from pairsim.runtime.signals import Signals\n"
        "atexit.register(lambda: (os.kill(os.getpid(), 15), time.sleep(0.05)))\n"
        "with Signals(final=True):\n"
        "    os.kill(os.getpid(), 15)\n"
        "sys.exit(130)\n"
    )
    assert subprocess.run([sys.executable, "-c", program], check=False).returncode == 130
