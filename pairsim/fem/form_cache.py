"""Compilation of forms before several processes need them: `python -P -m pairsim.fem.form_cache newtonian:moving`.

Modules enter the cache whole or not at all (`pairsim.fem.compilation.jit.in_cache`). One process on each machine
compiles them, so that others do not do the same work at the same time. Stamp files record which forms are compiled, so
that a sweep need not load FEniCSx in order to know.
"""

from __future__ import annotations

import contextlib
import fcntl
import functools
import hashlib
import importlib.util
import os
import platform
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable
from importlib import metadata
from pathlib import Path

from pairsim.fem.compilation.jit import JIT_OPTIONS, UNFINISHED, cache, compiler, use_temporary_cache
from pairsim.physics.declared import LAWS
from pairsim.physics.own_laws import file_of
from pairsim.runtime.child_process import clean_environment, end_with_parent, module_command
from pairsim.runtime.errors import EnvironmentFailure
from pairsim.runtime.monitor import Monitor

POLL = 0.02  # interval at which the compiling process is polled [s]
ABANDONED = 3600.0  # age at which what a killed compilation has left is deleted [s]; chosen, far above any compilation


@functools.cache
def _digest() -> str:
    """Hash of all that forms are made of: the sources, the options, and the versions of the compilers."""
    options = {name: value for name, value in JIT_OPTIONS.items() if name != "cache_dir"}
    digest = hashlib.sha256(f"{sys.executable} {platform.python_version()} {options}".encode())
    for name in ("basix", "ffcx", "ufl"):
        try:
            digest.update(metadata.version(f"fenics-{name}").encode())
        except metadata.PackageNotFoundError:
            spec = importlib.util.find_spec(name)
            digest.update(str(spec and spec.origin).encode())
    fem = Path(__file__).parent
    own = {file for law in LAWS.values() if (file := file_of(law)) is not None}
    for file in sorted([*fem.rglob("*.py"), *fem.rglob("*.c"), *fem.with_name("physics").rglob("*.py"), *own]):
        digest.update(file.read_bytes())
    return digest.hexdigest()[:16]


def _stamp(form: str) -> Path:
    """Stamp file of a kind of form."""
    return cache() / f"compiled-{re.sub('[:/]', '-', form)}-{_digest()}"


def missing(forms: Iterable[str]) -> list[str]:
    """Kinds of forms that are not in the cache of this machine, sorted."""
    return [form for form in sorted(set(forms)) if not _stamp(form).exists()]


def compile_missing(forms: Iterable[str]) -> None:
    """Compile the kinds of forms that are missing.

    Args:
        forms: Names `<liquid>:moving` or `<liquid>:fixed`, with `:steady` for quasi-steady scenes of liquids with
            modes, where <liquid> is `Liquid.structure`, or the name of a solid. With `:enriched` appended, the residual
            of the error estimate is compiled, too, with `:recovered` that of the error of runs.
    """
    cache().mkdir(parents=True, exist_ok=True)
    with (cache() / "compile.lock").open("a") as lock:
        with contextlib.suppress(OSError):  # without locks, several processes may compile the same, and no harm is done
            fcntl.flock(lock, fcntl.LOCK_EX)
        for left in cache().glob(f"{UNFINISHED}*"):
            with contextlib.suppress(FileNotFoundError):  # it has just been completed
                if time.time() - left.stat().st_mtime > ABANDONED:
                    shutil.rmtree(left, ignore_errors=True)
        for form in missing(forms):
            _compile(form)
            _stamp(form).touch()


def compile_apart(forms: Iterable[str], note: Callable[[str], None], monitor: Monitor | None = None) -> None:
    """Compile the missing kinds of forms in a child process, which a signal to this process ends within a moment.

    A cache that cannot be written to is replaced by a temporary one (for this process and its children).

    Args:
        forms: As for `compile_missing`.
        note: Shows a note to the user.
        monitor: Ends the compilation.

    Raises:
        EnvironmentFailure: They cannot be compiled.
        Stopped: A signal was received.
    """
    wanted, monitor = missing(forms), monitor or Monitor()
    if not wanted:
        return
    if why := why_not_writable():
        note(f"{cache()} cannot be written ({why}): forms are compiled into a temporary folder, each time anew")
        use_temporary_cache()
    failure = _failure_in_child(wanted, monitor)
    if failure and shutil.which(compiler()) is None:
        advice = "apt install gcc libc6-dev, or the environment variable CC (docs/how-to/install.md)"
        raise EnvironmentFailure(f"there is no C compiler ({compiler()}), which compiles the forms", advice=advice)
    if failure:
        raise EnvironmentFailure(f"the forms cannot be compiled: {failure}", advice="pairsim doctor")


def _failure_in_child(wanted: list[str], monitor: Monitor) -> str:
    """Compile forms in a child process; why that failed, empty if it did not."""
    with tempfile.TemporaryFile() as errors:
        child = subprocess.Popen(
            module_command("pairsim.fem.form_cache", *wanted),
            env=clean_environment(),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=errors,
            process_group=0,
        )
        try:
            while (code := child.poll()) is None:
                monitor.check_signals()
                time.sleep(POLL)
        except KeyboardInterrupt:
            os.killpg(child.pid, signal.SIGKILL)  # with the compiler
            child.wait()
            raise
        if code == 0:
            return ""
        errors.seek(0)
        text = errors.read().decode(errors="replace")
    lines = [line.strip() for line in text.splitlines() if line.strip()] or [f"exit code {code}"]
    return next((line for line in lines if "error:" in line), lines[-1])


def why_not_writable() -> str:
    """Why the cache cannot be written to, an empty string if it can."""
    try:
        cache().mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=cache()):
            pass
    except OSError as error:
        return error.strerror or str(error)
    return ""


def _compile(form: str) -> None:
    """Compile a kind of form, or load it if it is there."""
    from pairsim.fem.compilation.loops import compile_loops
    from pairsim.fem.phases.compiled_phase import liquid_phase, solid_phase
    from pairsim.fem.recovery.enriched_residual import enriched_form
    from pairsim.physics import liquids, solids

    material, *words = form.split(":")
    if material in solids.LAWS:
        phase = solid_phase(solids.LAWS[material].anyhow())
    else:
        liquid = liquids.of_structure(material)
        phase = liquid_phase(liquid, "moving" in words, "steady" in words)
    if "enriched" in words:
        enriched_form(phase, "tests")
    if "recovered" in words:
        enriched_form(phase, "unknowns")
    compile_loops()


if __name__ == "__main__":
    end_with_parent()
    compile_missing(sys.argv[1:])
