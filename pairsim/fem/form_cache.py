"""Compilation of forms before several processes need them: `python -P -m pairsim.fem.form_cache newtonian:moving`.

In FFCx the first process that requests a module compiles it, while the others wait and fail after ten seconds, and a
killed compilation blocks its module permanently. Forms are therefore compiled by one process on each machine, under a
lock, and the remains of killed compilations are deleted. Stamp files record which forms are compiled, so that a sweep
that is restarted need not check them.
"""

from __future__ import annotations

import contextlib
import fcntl
import hashlib
import importlib.util
import platform
import re
import sys
import time
from collections.abc import Iterable
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING

from pairsim.fem.jit import JIT_OPTIONS
from pairsim.runtime.signals import heed

if TYPE_CHECKING:
    from mpi4py import MPI

ABANDONED = 60.0  # seconds without changes after which the compilation of a module counts as killed; chosen


def _cache() -> Path:
    return Path(str(JIT_OPTIONS["cache_dir"]))


def _stamp(form: str) -> Path:
    """Stamp file of a kind of form; its name contains a hash of the sources and of the versions of the compilers."""
    digest = hashlib.sha256(f"{form} {sys.executable} {platform.python_version()} {JIT_OPTIONS}".encode())
    for name in ("fenics-basix", "fenics-ffcx", "fenics-ufl"):
        try:
            digest.update(metadata.version(name).encode())
        except metadata.PackageNotFoundError:
            spec = importlib.util.find_spec(name.removeprefix("fenics-"))
            digest.update(str(spec and spec.origin).encode())
    physics = Path(__file__).parents[1] / "physics"
    sources = [physics / "kinematics.py", *physics.glob("forms/*.py"), *physics.glob("materials/*.py")]
    sources += [
        Path(__file__).with_name(name) for name in ("phases.py", "enriched_residual.py", "recovered_residual.py")
    ]
    for file in sorted(sources):
        digest.update(file.read_bytes())
    return _cache() / f"compiled-{form.replace(':', '-')}-{digest.hexdigest()[:16]}"


def missing(forms: Iterable[str]) -> list[str]:
    """Kinds of forms without a stamp on this machine, sorted."""
    return [form for form in sorted(set(forms)) if not _stamp(form).exists()]


def compile_missing(forms: Iterable[str]) -> None:
    """Compile the kinds of forms that are missing.

    Args:
        forms: Names `<law>:moving`, `<law>:fixed`, `<law>:moving:steady`, `<law>:fixed:steady` or `neo-hookean`; with
            `:enriched` appended, the residual of the error estimate is compiled, too, with `:recovered` that of the
            error of runs.
    """
    _cache().mkdir(parents=True, exist_ok=True)
    with (_cache() / "compile.lock").open("a+") as lock:
        with contextlib.suppress(OSError):  # on a file system without locks, FFCx's own waiting is relied on
            fcntl.flock(lock, fcntl.LOCK_EX)
        lock.seek(0)
        if lock.read():
            _clear(0.0)  # the previous owner of the lock was killed and left unfinished modules
        lock.truncate(0)
        lock.write("compiling")
        lock.flush()
        for form in missing(forms):
            _compile_patiently(form)
            _stamp(form).touch()
        lock.truncate(0)


def ensure_compiled(comm: MPI.Comm, forms: Iterable[str]) -> None:
    """Compile the missing kinds of forms on one process of each machine; collective.

    Raises:
        Exception: A compilation failed on some process; raised on all of them.
        KeyboardInterrupt: The compilation was interrupted by a signal.
    """
    from mpi4py import MPI

    node = comm.Split_type(MPI.COMM_TYPE_SHARED)
    error: Exception | None = None
    if node.rank == 0 and missing(forms):
        try:
            compile_missing(forms)
        except Exception as caught:
            error = caught
    node.Free()
    errors = comm.allgather(error)
    heed(comm)  # before errors are raised: SIGINT from a terminal also ends the compiler, which then reports an error
    for each in errors:
        if each is not None:
            raise each


def _compile(form: str) -> None:
    from mpi4py import MPI

    from pairsim.fem.enriched_residual import enriched_form
    from pairsim.fem.phases import neo_hookean_solid, newtonian_liquid, viscoelastic_liquid
    from pairsim.fem.recovered_residual import recovered_form

    law, *words = form.split(":")
    if law == "neo-hookean":
        phase = neo_hookean_solid(MPI.COMM_SELF)
    elif law == "newtonian":
        phase = newtonian_liquid(MPI.COMM_SELF, "moving" in words)
    else:
        phase = viscoelastic_liquid(MPI.COMM_SELF, law, "moving" in words, "steady" in words)  # type: ignore[arg-type]
    if "enriched" in words:
        enriched_form(MPI.COMM_SELF, phase)
    if "recovered" in words:
        recovered_form(MPI.COMM_SELF, phase)


def _compile_patiently(form: str) -> None:
    """Compile a kind of form. If another process is compiling it, wait, and take over if that process was killed."""
    while True:
        try:
            return _compile(form)
        except (TimeoutError, RuntimeError) as error:
            if not re.search(r"JIT compilation timed out", str(error)):
                raise
            _clear(ABANDONED)


def _clear(age: float) -> None:
    """Delete modules whose compilation is incomplete and has not changed any file for `age` seconds."""
    for source in _cache().glob("libffcx_forms_*.c"):
        if source.with_suffix(".c.cached").exists():
            continue
        parts = [part.stat().st_mtime for part in _cache().glob(f"{source.stem}.*") if part.exists()]
        if time.time() - max(parts, default=0.0) >= age:
            source.unlink(missing_ok=True)


if __name__ == "__main__":
    compile_missing(sys.argv[1:])
