"""Runs the tests on a mutant until one fails: `python -m support.mutant MODULE FOLDER...`, by scripts/mutation.py.

The current folder is the changed copy of the checkout. Before the tests the cache of compiled forms is made anew from
that of the unchanged code: the name of a compiled form contains its signature, with constants and quadrature, so that
none can hide a mutant.
"""

from __future__ import annotations

import os
import resource
import shutil
import signal
import subprocess
import sys
from pathlib import Path

MEMORY = 8_000_000_000  # bytes of a process
OPTIONS = ("-x", "-q", "-p", "no:cacheprovider", "--tb=line", "-m", "not long")
NO_TESTS = 5  # exit code of pytest where all are deselected


def passed(files: list[Path]) -> bool:
    """Whether all tests of some files pass."""
    command = [sys.executable, "-P", "-m", "pytest", *OPTIONS, *map(str, files)]
    return not files or subprocess.run(command, check=False).returncode in (0, NO_TESTS)


def main(module: str, *folders: str) -> bool:
    """Whether all tests pass; those that name the module are first."""
    cache = Path(os.environ["XDG_CACHE_HOME"])
    shutil.rmtree(cache, ignore_errors=True)
    # FFCx does not change files that it has written: hard links suffice.
    without = shutil.ignore_patterns("*.lock")
    shutil.copytree(cache.with_name("compiled"), cache / "pairsim", copy_function=os.link, ignore=without)
    files = [file for folder in folders for file in sorted(Path("tests", folder).glob("test_*.py"))]
    files.sort(key=lambda file: Path(module).stem not in file.read_text(encoding="utf-8"))
    return passed(files)


if __name__ == "__main__":
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))  # which ends the tests, too
    resource.setrlimit(resource.RLIMIT_DATA, (MEMORY, MEMORY))
    sys.exit(not main(*sys.argv[1:]))
