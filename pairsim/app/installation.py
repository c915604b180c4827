"""The checks of the installation by `pairsim doctor`: versions, places, and a small case that is computed."""

from __future__ import annotations

import platform
import shutil
import sys
from collections.abc import Iterator
from importlib import metadata
from pathlib import Path

from pairsim.computing.result import Result
from pairsim.fem.compilation import jit
from pairsim.questions.compute import Computation
from pairsim.questions.registry import QUESTIONS
from pairsim.record.columns import DP
from pairsim.runtime.errors import EnvironmentFailure
from pairsim.runtime.version import __version__

INSTALL = "pip install 'pairsim[fenicsx]'; see docs/how-to/install.md"
LENGTH = 1.0
SMALL = {"particles": 0, "De": 0, "length": LENGTH, "ends": "developed", "time": {"end": 1e-3}}
"""The case that is computed: the tube alone."""


def findings() -> Iterator[tuple[str, str]]:
    """Yield each thing that is checked and what was found, as soon as it is known; the last is a small case.

    Raises:
        EnvironmentFailure: Something that every case needs is missing.
        RunFailure: The small case cannot be computed.
    """
    yield "pairsim", f"{__version__} in {Path(__file__).parents[1]}"
    yield "Python", f"{platform.python_version()}, {sys.executable}"
    compiler = shutil.which(name := jit.compiler())
    if compiler is None:
        remedy = "apt install gcc libc6-dev, or setting the environment variable CC"
        raise EnvironmentFailure(f"there is no C compiler ({name})", advice=remedy)
    yield "C compiler", compiler
    yield "cache of compiled forms", str(jit.cache())
    beside = Path(sys.executable).parent / "mpirun"
    yield "mpirun", str(beside) if beside.exists() else shutil.which("mpirun") or "none: a sweep then uses --workers"

    from pairsim.runtime.fenicsx import MPI, dolfinx, petsc_version

    if not dolfinx.__version__.startswith("0.11."):
        raise EnvironmentFailure(f"DOLFINx is {dolfinx.__version__}, 0.11 is needed", advice=INSTALL)
    yield "FEniCSx", f"DOLFINx {dolfinx.__version__}, PETSc {petsc_version()}"
    yield "MPI", MPI.Get_library_version().splitlines()[0].strip("\0 ")
    for package in ("gmsh", "numpy", "scipy", "matplotlib"):
        yield package, metadata.version(package)

    result = Computation[Result](QUESTIONS["run"])(SMALL).check()
    drop, exact = result.columns[DP][-1], 32 * LENGTH
    if abs(drop - exact) > 1e-6 * exact:
        raise EnvironmentFailure(f"the pressure drop of the tube is {drop:g} instead of {exact:g}", advice=INSTALL)
    yield "a small case", f"dp = {drop:g}, exact {exact:g}, in {result.record.wall_time:.1f} s"
