"""Signals as flags, and where a computation heeds them: between Newton iterations and in a mesh."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from support.scenes import soft_pair

from pairsim.fem.algebra.constraints import PositionUpdate
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


def test_newtons_method_stops_before_the_next_factorisation() -> None:
    transient = Transient(soft_pair(0.4, 0.1, 0.1, mesh=MeshSettings(Np=6), length=2.0))
    newton = transient.newton
    arguments = np.zeros(transient.constraints.size), PositionUpdate(transient.history.h[0], 0.01, 1.7)
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
        transient.newton.solve(np.zeros(transient.constraints.size), PositionUpdate(transient.history.h[0], 0.01, 1.7))
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


ORDERINGS = """
import os, signal, subprocess, sys
from pairsim.runtime.fenicsx import MPI
from pairsim.questions.registry import QUESTIONS
from pairsim.computing.case_files import parse_case
from pairsim.computing.problems import problem_of
from pairsim.solvers.transient.transient import Transient

keys = {"beta": 0.4, "De": 0, "Ca_e": 0.1, "d0": 0.1, "ends": "developed", "length": "auto", "mesh": {"Np": 8}}
transient = Transient(problem_of(parse_case(QUESTIONS["run"], keys, "test")))
next(transient.steps(iter([0.01])))
caught = []
signal.signal(signal.SIGTERM, lambda *_: caught.append(1))
script = "import os, time\\nwhile os.getppid() == PID:\\n    os.kill(PID, 15)\\n    time.sleep(5e-4)"
storm = subprocess.Popen([sys.executable, "-c", script.replace("PID", str(os.getpid()))])
orderings = 0
while orderings < 60 or len(caught) < 20:
    transient.newton.use_double()  # forces a new ordering
    assert transient.newton.factor_at(transient.history.y[0], transient._update(0.01, 0.0))
    orderings += 1
storm.kill()
print(len(caught))
"""


@pytest.mark.slow
def test_sigterm_during_the_ordering_of_a_matrix_does_no_harm() -> None:
    """METIS installs its own handler of SIGTERM while it runs, after which MUMPS would crash."""
    done = subprocess.run([sys.executable, "-c", ORDERINGS], capture_output=True, text=True, timeout=600, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    assert int(done.stdout) >= 20


@pytest.mark.slow
def test_no_other_thread_takes_sigterm() -> None:
    """SIGTERM is blocked while MPI, numpy and scipy start their threads."""
    script = "import glob, os, pairsim\npairsim.run({'particles': 0, 'De': 0, 'length': 2})\n" + (
        "for task in glob.glob('/proc/self/task/*'):\n"
        "    if int(task.rpartition('/')[2]) != os.getpid():\n"
        "        print(next(line.split()[1] for line in open(task + '/status') if line.startswith('SigBlk')))"
    )
    environment = os.environ | {"OPENBLAS_NUM_THREADS": "2"}
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, timeout=60, check=True, env=environment
    )
    masks = [int(mask, 16) for mask in done.stdout.split()]
    assert masks
    assert all(mask >> (signal.SIGTERM - 1) & 1 for mask in masks)


INTERRUPTED = """
import os, signal, sys

def interrupt():
    signal.raise_signal(signal.SIGINT)

class Lost:
    def __del__(self):
        interrupt()

class Finder:
    def find_spec(self, name, *_):
        if name == module:
            sys.meta_path.remove(self)
            if how == "lost":  # in a destructor, as in a callback
                Lost()
            elif how == "raised":
                interrupt()
            else:
                try:
                    interrupt()
                except KeyboardInterrupt:
                    raise ImportError(name)  # as compiled modules do

module, how, *sys.argv[1:] = sys.argv[1:]
sys.meta_path.insert(0, Finder())
from pairsim.__main__ import main
main()
"""
"""Runs a command that is interrupted when a module is loaded."""


@pytest.mark.parametrize("how", ["raised", "turned into another exception", "lost"])
@pytest.mark.parametrize("module", ["typer", "pairsim.app.commands.moduli", "numpy", "pandas"])
def test_an_interrupt_while_libraries_are_loaded_ends_the_command_without_a_traceback(module: str, how: str) -> None:
    command = [sys.executable, "-c", INTERRUPTED, module, how, "moduli", "none.rtdc", "--table", "none.txt"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "")


def test_nothing_slow_is_loaded_before_an_interrupt_can_be_answered() -> None:
    program = "import sys; before = {*sys.modules}; import pairsim.runtime.interrupts; print(*{*sys.modules} - before)"
    done = subprocess.run([sys.executable, "-S", "-c", program], capture_output=True, text=True, check=False)
    loaded = {*done.stdout.split()}
    assert "pairsim.runtime.interrupts" in loaded
    assert not {"typing", "pathlib", "re", "numpy"} & loaded
