"""Compilation of forms before several processes need them: `python -P -m pairsim.fem.form_cache newtonian:moving`.

In FFCx the first process that requests a module compiles it, while the others wait and fail after ten seconds, and a
killed compilation blocks its module permanently. Forms are therefore compiled by one process on each machine, under a
lock, and the remains of killed compilations are deleted. Stamp files record which forms are compiled, so that a sweep
that is restarted need not check them, and the checksums of their modules: loading a torn one would crash the process.
"""

from __future__ import annotations

import contextlib
import ctypes
import fcntl
import hashlib
import importlib.util
import json
import os
import platform
import re
import shutil
import sys
import time
from collections.abc import Callable, Iterable
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING

from pairsim.fem.jit import JIT_OPTIONS, adopt_cache, cache, compiler, use_temporary_cache
from pairsim.runtime.child_process import FULL, Child, module_command
from pairsim.runtime.errors import EnvironmentFailure
from pairsim.runtime.signals import heed, received

if TYPE_CHECKING:
    from mpi4py import MPI

POLL = 0.02  # interval at which the compiling process is polled [s]
ABANDONED = 60.0  # seconds without changes after which the compilation of a module counts as killed; chosen


def _stamp(form: str) -> Path:
    """Stamp file of a kind of form; its name contains a hash of the sources and of the versions of the compilers."""
    options = {name: value for name, value in JIT_OPTIONS.items() if name != "cache_dir"}
    digest = hashlib.sha256(f"{form} {sys.executable} {platform.python_version()} {options}".encode())
    for name in ("fenics-basix", "fenics-ffcx", "fenics-ufl"):
        try:
            digest.update(metadata.version(name).encode())
        except metadata.PackageNotFoundError:
            spec = importlib.util.find_spec(name.removeprefix("fenics-"))
            digest.update(str(spec and spec.origin).encode())
    physics = Path(__file__).parents[1] / "physics"
    sources = [physics / f"{name}.py" for name in ("kinematics", "log_conformation", "material", "operations")]
    sources += [file for folder in ("forms", "liquids", "solids") for file in physics.glob(f"{folder}/*.py")]
    ours = (
        "compiled_phase.py",
        "phases.py",
        "enriched_residual.py",
        "recovered_residual.py",
        "cell_loop.c",
        "patch_recovery.c",
        "point_location.c",
        "cell_loop.py",
    )
    sources += [Path(__file__).with_name(name) for name in ours]
    for file in sorted(sources):
        digest.update(file.read_bytes())
    return cache() / f"compiled-{re.sub('[:/]', '-', form)}-{digest.hexdigest()[:16]}"


def _modules(stamp: Path) -> dict[str, str] | None:
    """Checksums in a stamp file by the names of the modules; None if there is no valid stamp."""
    try:
        content = json.loads(stamp.read_text(encoding="ascii"))
    except (OSError, ValueError):
        return None
    return content if isinstance(content, dict) else None


def _checksum(module: Path) -> str:
    """Checksum of a module, empty if it cannot be read."""
    try:
        return hashlib.sha256(module.read_bytes()).hexdigest()
    except OSError:
        return ""


def _whole(form: str) -> bool:
    """Whether a kind of form is compiled, and its modules are as they were then."""
    modules = _modules(_stamp(form))
    return modules is not None and all(_checksum(cache() / name) == known for name, known in modules.items())


def missing(forms: Iterable[str]) -> list[str]:
    """Kinds of forms that are not in the cache of this machine, or whose modules are damaged, sorted."""
    return [form for form in sorted(set(forms)) if not _whole(form)]


def compile_missing(forms: Iterable[str]) -> None:
    """Compile the kinds of forms that are missing.

    Args:
        forms: Names `<liquid>:moving` or `<liquid>:fixed`, with `:steady` for quasi-steady scenes of liquids with
            modes, where <liquid> is `Liquid.structure`, or the name of a solid. With `:enriched` appended, the residual
            of the error estimate is compiled, too, with `:recovered` that of the error of runs.
    """
    cache().mkdir(parents=True, exist_ok=True)
    with (cache() / "compile.lock").open("a+") as lock:
        with contextlib.suppress(OSError):  # on a file system without locks, FFCx's own waiting is relied on
            fcntl.flock(lock, fcntl.LOCK_EX)
        lock.seek(0)
        if lock.read():  # the previous owner of the lock was killed, perhaps by a torn module, or failed
            _clear(0.0)
            _discard_unverified()
        lock.truncate(0)
        lock.write("compiling")
        lock.flush()
        for form in missing(forms):
            for name, known in (_modules(_stamp(form)) or {}).items():
                if _checksum(cache() / name) != known:
                    _discard(name.partition(".")[0])
            modules = _compile_patiently(form)
            stamp = _stamp(form)
            part = stamp.with_name(f".{stamp.name}.part")
            part.write_text(json.dumps({path.name: _checksum(path) for path in modules}), encoding="ascii")
            part.replace(stamp)
        lock.truncate(0)


def compile_apart(forms: Iterable[str], note: Callable[[str], None]) -> None:
    """Compile the missing kinds of forms in a child process, which a signal to this process ends within a moment.

    A cache that cannot be written to, or that is on a full disk, is replaced by a temporary one (for this process and
    its children).

    Args:
        forms: As for `compile_missing`.
        note: Shows a note to the user.

    Raises:
        EnvironmentFailure: They cannot be compiled.
    """
    temporary = repeated = False
    while (wanted := missing(forms)) and not received():
        why = "" if temporary else why_not_writable()
        stderr = ""
        if not why:
            child = Child(module_command("pairsim.fem.form_cache", *wanted))
            while (code := child.poll()) is None:
                if received():
                    child.kill()
                time.sleep(POLL)
            if code == 0 or received():
                return
            stderr = child.stderr
            if not temporary and FULL.search(stderr):
                why = "No space left on device"
        if why:
            note(f"{cache()} cannot be written ({why}): forms are compiled into a temporary folder, each time anew")
            use_temporary_cache()
            temporary = True
        elif shutil.which(compiler()) is None:
            advice = "apt install gcc libc6-dev, or the environment variable CC (docs/how-to/install.md)"
            raise EnvironmentFailure(f"there is no C compiler ({compiler()}), which compiles the forms", advice=advice)
        elif repeated or FULL.search(stderr):
            lines = [line for line in stderr.splitlines() if line.strip()] or [f"exit code {code}"]
            said = next((line for line in lines if "error:" in line or FULL.search(line)), lines[-1])
            raise EnvironmentFailure(f"the forms cannot be compiled: {said.strip()}", advice="pairsim doctor")
        else:
            repeated = True  # what a killed process left, such as a torn module, is removed the second time


def why_not_writable() -> str:
    """Why the cache cannot be written to, an empty string if it can."""
    try:
        cache().mkdir(parents=True, exist_ok=True)
        with (cache() / "compile.lock").open("a"):
            pass
    except OSError as error:
        return error.strerror or str(error)
    return "" if os.access(cache(), os.W_OK | os.X_OK) else "Permission denied"


def ensure_compiled(forms: Iterable[str], note: Callable[[str], None]) -> None:
    """Compile the missing kinds of forms.

    Args:
        forms: As for `compile_missing`.
        note: Shows a note to the user.

    Raises:
        EnvironmentFailure: A compilation failed.
        Stopped: The compilation was interrupted by a signal.
    """
    compile_apart(forms, note)
    heed()


def share_cache(node: MPI.Comm) -> None:
    """Use the cache of the first process on all processes of a machine; collective."""
    base = node.bcast(os.environ.get("XDG_CACHE_HOME"))
    if base is not None and node.rank > 0:
        adopt_cache(base)


def _compile(form: str) -> list[Path]:
    """Compile a kind of form, or load it if it is there; returns the paths of its modules."""
    from pairsim.fem.cell_loop import compile_loops
    from pairsim.fem.compiled_phase import liquid_phase, solid_phase
    from pairsim.fem.enriched_residual import enriched_form
    from pairsim.fem.recovered_residual import recovered_form
    from pairsim.physics import liquids, solids

    material, *words = form.split(":")
    if material in solids.LAWS:
        phase = solid_phase(solids.LAWS[material].anyhow())
    else:
        liquid = liquids.of_structure(material)
        phase = liquid_phase(liquid, "moving" in words, "steady" in words)
    compiled = [phase.residual, phase.jacobian]
    if "enriched" in words:
        compiled.append(enriched_form(phase).residual)
    if "recovered" in words:
        compiled.append(recovered_form(phase).residual)
    loops = compile_loops()
    ctypes.CDLL(str(loops))  # like the forms: a torn library ends this process, and not that of a case
    return [*(Path(each.module.__file__) for each in compiled), loops]


def _compile_patiently(form: str) -> list[Path]:
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
    for source in cache().glob("libffcx_forms_*.c"):
        if source.with_suffix(".c.cached").exists():
            continue
        parts = [part.stat().st_mtime for part in cache().glob(f"{source.stem}.*") if part.exists()]
        if time.time() - max(parts, default=0.0) >= age:
            source.unlink(missing_ok=True)


def _discard(module: str) -> None:
    """Delete all files of a module."""
    for path in cache().glob(f"{module}.*"):
        path.unlink(missing_ok=True)


def _discard_unverified() -> None:
    """Delete the modules whose checksum is in no stamp file: they may be torn."""
    verified = {entry for stamp in cache().glob("compiled-*") for entry in (_modules(stamp) or {}).items()}
    for path in cache().glob("*.so"):
        if (path.name, _checksum(path)) not in verified:
            _discard(path.name.partition(".")[0])


if __name__ == "__main__":
    compile_missing(sys.argv[1:])
