"""Runs command lines in forked children of one process that has imported pairsim; started by `support.fuzz.Runner`.

Reads a list of inputs a line from stdin, as JSON: [{"arguments": [...], "files": {name: text}}], and writes the list of
answers as a line. A command line has a folder of its own and limits of time and memory. Nothing is computed: `study`,
which has no --dry-run, ends where it would begin to.
"""

from __future__ import annotations

import contextlib
import gc
import json
import os
import resource
import signal
import sys
import tempfile
import types
from pathlib import Path
from typing import Any

import typer
import typer.rich_utils

import pairsim.cli.app
import pairsim.config.bench_report
import pairsim.results.physical_table
import pairsim.results.standing
import pairsim.results.travel
import pairsim.runtime.launcher
import pairsim.sweeps.ledger
import pairsim.sweeps.progress
import pairsim.sweeps.slurm
import pairsim.sweeps.study_file
import pairsim.sweeps.summary
from pairsim.config.quantities import LENGTH, si
from pairsim.inputs.case_files import FILES
from pairsim.inputs.schema import schema_rows

SECONDS, BYTES = 10, 4 << 30  # limits of a child
WALL = 60  # seconds; a child that sleeps uses no processor time
KEPT = 4000  # characters of an output that are returned


def import_all() -> None:
    """Make, once for all children, what the commands make when they are first used."""
    for command, model in FILES.items():
        schema_rows(command)
        with contextlib.suppress(ValueError):
            model.model_validate({})
    si("1 um", LENGTH)
    pairsim.cli.app.app = typer.main.get_command(pairsim.cli.app.app)  # type: ignore[assignment]
    study = types.ModuleType("pairsim.sweeps.study")
    study.run_study = lambda *_: (0, "read")  # type: ignore[attr-defined]
    sys.modules["pairsim.sweeps.study"] = study
    gc.freeze()


def write_files(files: dict[str, Any]) -> None:
    """Write the files of an input; a name without text is that of a pipe."""
    for name, text in files.items():
        if text is None:
            os.mkfifo(name)
        else:
            Path(name).parent.mkdir(exist_ok=True)
            Path(name).write_bytes(text.encode("utf-8", "surrogateescape"))


def carry_out(given: dict[str, Any], folder: Path) -> int:
    """Run a command line in a new folder; returns its exit code."""
    folder.mkdir()
    os.chdir(folder)
    write_files(given["files"])
    for number in (1, 2):
        file = os.open(f"{folder}.{number}", os.O_CREAT | os.O_WRONLY)
        os.dup2(file, number)
        os.close(file)
    used = resource.getrusage(resource.RUSAGE_SELF)
    resource.setrlimit(resource.RLIMIT_CPU, (int(used.ru_utime + used.ru_stime) + SECONDS, resource.RLIM_INFINITY))
    signal.alarm(WALL)
    sys.argv = ["pairsim", *given["arguments"]]
    try:
        pairsim.cli.app.main()
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else 0 if end.code is None else 98
    except BaseException as error:
        code = 99
        sys.stderr.write(f"Traceback: {error!r}")
    sys.stdout.flush()
    sys.stderr.flush()
    return code


def child(inputs: list[dict[str, Any]], scratch: Path) -> None:
    """Run command lines, and write the exit code of each into a file; ends the process."""
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    resource.setrlimit(resource.RLIMIT_AS, (BYTES, BYTES))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    for i, given in enumerate(inputs):
        code = carry_out(given, scratch / str(i))
        (scratch / f"{i}.code").write_text(str(code))
    os._exit(0)


def answer(given: dict[str, Any], folder: Path, status: int) -> dict[str, Any] | None:
    """How an input ended, None if it was not run; `status` is that of its process."""
    if not folder.exists():
        return None
    out, err = (Path(f"{folder}.{n}").read_bytes().decode("utf-8", "backslashreplace") for n in (1, 2))
    code = Path(f"{folder}.code")
    new = (str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file())
    return {
        "code": int(code.read_text()) if code.exists() else os.waitstatus_to_exitcode(status),
        "out": out[:KEPT],
        "err": err if len(err) <= 2 * KEPT else err[:KEPT] + "…" + err[-KEPT:],
        "length": len(err),
        "new": sorted(name for name in new if name not in given["files"]),
    }


def answers(inputs: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Run inputs one after another in a child, and those that are left when it has died in a new one."""
    found: list[dict[str, Any]] = []
    while left := inputs[len(found) :]:
        with tempfile.TemporaryDirectory(prefix="pairsim-fuzz-") as name:
            if (pid := os.fork()) == 0:
                child(left, Path(name))
            _, status = os.waitpid(pid, 0)
            each = (answer(given, Path(name, str(i)), status) for i, given in enumerate(left))
            found += [one for one in each if one is not None]
    return found


def main() -> None:
    """Answer batches of inputs until stdin ends."""
    import_all()
    out = os.fdopen(os.dup(1), "w")
    for line in sys.stdin:
        out.write(json.dumps(answers(json.loads(line))) + "\n")
        out.flush()


if __name__ == "__main__":
    main()
