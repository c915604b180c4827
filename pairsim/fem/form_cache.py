"""Compiles forms before several processes need them: `python -P -m pairsim.fem.form_cache newtonian:moving`.

FFCx gives a module to the first process that asks for it and lets the others wait ten seconds, after which they fail;
a compilation that was killed leaves the module taken for ever. So one process a machine compiles, under a lock, and
clears what a killed one has left. Stamps remember what was compiled, so that a sweep that starts again loses no time.
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

ABANDONED = 60.0  # seconds without any change after which a module that nobody has finished counts as left behind


def _cache() -> Path:
    return Path(str(JIT_OPTIONS["cache_dir"]))


def _stamp(form: str) -> Path:
    """File that exists once a kind of form has been compiled from these sources by these versions."""
    digest = hashlib.sha256(f"{form} {sys.executable} {platform.python_version()} {JIT_OPTIONS}".encode())
    for name in ("fenics-basix", "fenics-ffcx", "fenics-ufl"):
        try:
            digest.update(metadata.version(name).encode())
        except metadata.PackageNotFoundError:
            spec = importlib.util.find_spec(name.removeprefix("fenics-"))
            digest.update(str(spec and spec.origin).encode())
    physics = Path(__file__).parents[1] / "physics"
    sources = [physics / "kinematics.py", *physics.glob("forms/*.py"), *physics.glob("materials/*.py")]
    sources += [Path(__file__).with_name(name) for name in ("phases.py", "enriched_residual.py")]
    for file in sorted(sources):
        digest.update(file.read_bytes())
    return _cache() / f"compiled-{form.replace(':', '-')}-{digest.hexdigest()[:16]}"


def missing(forms: Iterable[str]) -> list[str]:
    """Kinds of forms that are not known to be compiled on this machine."""
    return [form for form in sorted(set(forms)) if not _stamp(form).exists()]


def compile_missing(forms: Iterable[str]) -> None:
    """Compile kinds of forms that are missing: `<law>:moving` or `<law>:fixed`, maybe with `:steady`; `neo-hookean`.

    With `:enriched` it is the residual that estimates of the error need, as well.
    """
    _cache().mkdir(parents=True, exist_ok=True)
    with (_cache() / "compile.lock").open("a+") as lock:
        with contextlib.suppress(OSError):  # a file system without locks: FFCx's own waiting has to do
            fcntl.flock(lock, fcntl.LOCK_EX)
        lock.seek(0)
        if lock.read():
            _clear(0.0)  # the holder before us was killed: what is unfinished is its work
        lock.truncate(0)
        lock.write("compiling")
        lock.flush()
        for form in missing(forms):
            _compile_patiently(form)
            _stamp(form).touch()
        lock.truncate(0)


def ensure_compiled(comm: MPI.Comm, forms: Iterable[str]) -> None:
    """Compile what is missing, on one process of each machine; every process calls this.

    Raises:
        Exception: What went wrong on any of them, on all.
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
    heed(comm)  # a signal from the terminal ends the compiler, too
    for each in errors:
        if each is not None:
            raise each


def _compile(form: str) -> None:
    from mpi4py import MPI

    from pairsim.fem.enriched_residual import enriched_form
    from pairsim.fem.phases import neo_hookean_solid, newtonian_liquid, viscoelastic_liquid

    law, *words = form.split(":")
    if law == "neo-hookean":
        phase = neo_hookean_solid(MPI.COMM_SELF)
    elif law == "newtonian":
        phase = newtonian_liquid(MPI.COMM_SELF, "moving" in words)
    else:
        phase = viscoelastic_liquid(MPI.COMM_SELF, law, "moving" in words, "steady" in words)  # type: ignore[arg-type]
    if "enriched" in words:
        enriched_form(MPI.COMM_SELF, phase)


def _compile_patiently(form: str) -> None:
    """Compile; while another process does so, wait, unless it has evidently died."""
    while True:
        try:
            return _compile(form)
        except (TimeoutError, RuntimeError) as error:
            if not re.search(r"JIT compilation timed out", str(error)):
                raise
            _clear(ABANDONED)


def _clear(age: float) -> None:
    """Give modules free that were begun and not finished, and have not changed for `age` seconds."""
    for source in _cache().glob("libffcx_forms_*.c"):
        if source.with_suffix(".c.cached").exists():
            continue
        parts = [part.stat().st_mtime for part in _cache().glob(f"{source.stem}.*") if part.exists()]
        if time.time() - max(parts, default=0.0) >= age:
            source.unlink(missing_ok=True)


if __name__ == "__main__":
    compile_missing(sys.argv[1:])
