"""Commands of pairsim as a user types them, one thread a process, and the machine that they run on."""

from __future__ import annotations

import argparse
import datetime
import os
import platform
import re
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
CONFIGS, DOCS = ROOT / "configs", ROOT / "docs"
FAILED = 3  # exit code of a sweep or study in which some cases failed


def pairsim(*words: object) -> int:
    """Run a command; returns its exit code, 0 or `FAILED`.

    Raises:
        SystemExit: With any other exit code; the command has said why.
    """
    command = [sys.executable, "-m", "pairsim", *map(str, words)]
    path = os.pathsep.join(filter(None, (str(ROOT), os.environ.get("PYTHONPATH"))))
    code = subprocess.run(command, env=os.environ | {"OMP_NUM_THREADS": "1", "PYTHONPATH": path}).returncode
    if code not in (0, FAILED):
        sys.exit(code)
    return code


def parser_of(name: str, usage: str | None, output: str) -> argparse.ArgumentParser:
    """The parser of a script, with the options that all of them have."""
    form = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(prog=name, description=usage, formatter_class=form)
    parser.add_argument("-o", "--output", type=Path, default=Path(output), help="folder of the results")
    parser.add_argument("--workers", type=int, default=1, help="cases at the same time")
    parser.add_argument("--table", action="store_true", help="compute nothing, judge the results that are there")
    return parser


def made(times: Iterable[float]) -> str:
    """When (seconds since 1970) and on what results were computed, as a sentence."""
    days = sorted({str(datetime.date.fromtimestamp(each)) for each in times})
    info = Path("/proc/cpuinfo").read_text() if Path("/proc/cpuinfo").is_file() else ""
    model = re.search(r"model name\s*:\s*(.*)", info)
    machine = f"{model[1] if model else platform.processor()}, {os.cpu_count()} cores"
    return f"Computed {' to '.join(dict.fromkeys(days[:: len(days) - 1 or 1]))} on {machine}, one thread a process."
