"""Helpers of the tests: scenes solved in process, and commands run as a user runs them."""

from __future__ import annotations

import json
import re
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mpi4py import MPI

import pairsim.runtime.fenicsx
from pairsim.fem.form_cache import compile_missing
from pairsim.fem.geometry import Geometry, MeshSettings, Reference
from pairsim.fem.meshing import liquid_mesh, make_outlines
from pairsim.fem.scene import Scene, make_bodies
from pairsim.fem.scene_constraints import transient_constraints
from pairsim.runtime.child_process import module_command
from pairsim.solvers.newton import Newton
from pairsim.solvers.problems import Problem
from pairsim.solvers.step_size import StepControl
from pairsim.solvers.transient import Step, Transient

ROOT = Path(__file__).parent.parent
OTHERS = {"curve", "critical", "study", "sweep"}
CONFIGS = sorted(path for path in (ROOT / "configs").glob("*.yaml") if path.stem not in OTHERS)
"""The shipped cases of `pairsim run`; other commands' are named after them."""
TINY = "base: {beta: 0.4, De: 0, Ca_e: 0, ends: developed, length: 3, mesh: {Np: 8}, time: {end: 0.01}}\n"
"""The base of grids whose cases take a second."""


@dataclass(frozen=True)
class Rigid:
    """Force-free rigid spheres in a Newtonian liquid."""

    U: np.ndarray
    dp_plus: float
    m: float


def solve_rigid(betas: tuple[float, ...], gaps: tuple[float, ...] = (), **mesh: float) -> Rigid:
    """Velocities and extra pressure drop, periodic ends, L = 50 D_p."""
    geometry = Geometry(betas, gaps, 50 * max(betas))
    settings = MeshSettings(**mesh)
    outlines = make_outlines(geometry, settings)
    reference = Reference.spheres(geometry, outlines)
    n = len(betas)
    bodies = make_bodies(MPI.COMM_WORLD, [0.0] * n, outlines, [None] * n)
    scene = Scene(MPI.COMM_WORLD, reference, liquid_mesh(reference, settings), bodies, periodic=True)
    constraints = transient_constraints(scene)
    newton = Newton(scene, constraints)
    y, report = newton.solve(np.zeros(constraints.size), geometry.centres.copy(), 1e-3, 2 - 4 / 3 * betas[0] ** 2)
    assert report.converged, report
    _, x = newton.state(y)
    newton.destroy()
    return Rigid(y[constraints.fields["U_p"]], scene.pressure_drop(x) - 32 * geometry.length, float(x[scene.m]))


def soft_pair(beta: float, d: float, Ca_e: float, **changes: object) -> Problem:
    """Two equal soft spheres on the default mesh of a case in a Newtonian liquid."""
    problem = Problem(
        (beta, beta),
        (Ca_e, Ca_e),
        (d,),
        50 * beta,
        True,
        MeshSettings(),
        StepControl(3e-4, 1e-8, 2.0),
        5e-4,
        U_m=2 * (1 - 2 / 3 * beta**2),
    )
    return replace(problem, **changes)  # type: ignore[arg-type]


def march(problem: Problem, times: list[float], keep: Callable[[Step], object] | None = None) -> list[Step]:
    """Every accepted step up to the last of the times, all of which are landed on."""
    transient = Transient(MPI.COMM_WORLD, problem)
    try:
        return list(transient.steps(iter(times)))
    finally:
        transient.close()


def at(steps: list[Step], t: float) -> Step:
    """The step that ends at t."""
    return next(s for s in steps if abs(s.t - t) < 1e-9 * max(1.0, t))


def dU(step: Step) -> float:
    return float(step.observation.dU[0])


def pytest_sessionstart() -> None:
    """Compile what most tests need, under the lock that keeps two compilers apart, and outside their time limits."""
    steady = [f"{kind}:enriched" for kind in ("newtonian:moving", "neo-hookean", "giesekus:moving:steady")]
    compile_missing(["newtonian:moving", "neo-hookean", "giesekus:moving", "giesekus:moving:steady", *steady])


@pytest.fixture
def pairsim(tmp_path: Path) -> Callable[..., subprocess.CompletedProcess[str]]:
    """Runs the command in an empty folder; `ranks` puts mpirun in front."""

    def run(*arguments: str, ranks: int = 0, timeout: float = 600) -> subprocess.CompletedProcess[str]:
        mpirun = [str(Path(sys.executable).parent / "mpirun"), "-n", str(ranks)] if ranks else []
        command = [*mpirun, *module_command("pairsim", *arguments)]
        return subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=timeout, check=False)

    return run


@pytest.fixture
def decoys(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Makes the empty folder the current one, with a folder and modules in it that are named like those of a child.

    Returns:
        A file that exists once one of them has been executed.
    """
    executed = tmp_path / "executed"
    (tmp_path / "pairsim").mkdir()
    for name in ("yaml", "numpy", "pydantic"):
        (tmp_path / f"{name}.py").write_text(f"open({str(executed)!r}, 'w').close()\nraise ImportError('a decoy')\n")
    monkeypatch.chdir(tmp_path)
    return executed


def examples(page: str) -> list[str]:
    """The YAML blocks of a page of docs."""
    return re.findall(r"```yaml\n(.*?)```", (ROOT / "docs" / page).read_text(), re.DOTALL)


def interrupted(words: list[str], table: Path, number: int) -> dict[str, Any]:
    """run.json of a command that was sent a signal once its table had five lines or more; it ends in order."""
    command = module_command("pairsim", *words)
    process = subprocess.Popen(command, cwd=table.parents[1], stderr=subprocess.PIPE, text=True)
    try:
        while not table.exists() or table.read_text().count("\n") < 5:
            assert process.poll() is None
            time.sleep(0.1)
        process.send_signal(number)
        _, complaint = process.communicate(timeout=250)
    finally:
        process.kill()
    assert process.returncode == 130
    assert "Traceback" not in complaint
    told: dict[str, Any] = json.loads((table.parent / "run.json").read_text())
    assert told["status"] == "interrupted"
    return told


def words_of(pid: int) -> list[str]:
    """Command line of a process, [""] if there is none."""
    try:
        return Path(f"/proc/{pid}/cmdline").read_text().split("\0")
    except OSError:
        return [""]
