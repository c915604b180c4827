"""Compute cases one after another in one process: `python -P -m pairsim.sweeps.case_worker COMMAND CASE.yaml DIR ...`.

The libraries are loaded once, which takes longer than a short case. Each master curve starts from the solutions of the
previous one, which saves the continuation from undeformed spheres at small De. A sweep starts such processes for short
cases and for neighbouring curves; the outcome of each case is in its folder. A process that has become large ends after
a case, before it has computed all.
"""

from __future__ import annotations

import shlex
import sys
from contextlib import suppress
from pathlib import Path

import pairsim.runtime.fenicsx  # noqa: F401  # before everything else that loads MPI or makes threads

# isort: split
from pairsim.commands import COMMANDS
from pairsim.drivers.outcome import Outcome, memory
from pairsim.drivers.progress import Reporter
from pairsim.drivers.session import Options
from pairsim.drivers.warm_start import WarmStart
from pairsim.inputs.case_files import read_case
from pairsim.plots.style import Page
from pairsim.runtime.errors import InputError, RunFailure, unexpected
from pairsim.runtime.signals import Signals

# Memory of a process above which it computes no further case [bytes]. Chosen: a run of the default mesh at De 1 takes
# half of it.
MOST_MEMORY = 1_000_000_000


def solve(name: str, pairs: list[tuple[Path, Path]]) -> Outcome:
    """Compute cases one after another and write each to its folder, replacing earlier results.

    Args:
        name: The command: run, curve or critical.
        pairs: Case file and folder of each case.

    Returns:
        The outcome of the last case that was computed.
    """
    command, warm_start = COMMANDS[name], WarmStart()
    more = {"warm_start": warm_start} if command.in_sweeps.neighbours else {}
    with Signals(final=True) as signals:
        for file, directory in pairs:
            line = shlex.join(["pairsim", name, str(file), "-o", str(directory)])
            case = read_case(command, file)
            outcome = command.compute(case, directory, Options(True, Reporter(), line, signals=signals), **more)
            if outcome.status == "finished" and command.draws_from is not None:
                with suppress(OSError, InputError):  # a picture can be drawn again
                    command.draw(directory, directory, Page())
            if signals.number or memory() > MOST_MEMORY:
                break
    warm_start.close()
    return outcome


def main(arguments: list[str]) -> int:
    """Compute the cases that the command line names; returns the exit code."""
    name, *paths = arguments
    files, directories = map(Path, paths[::2]), map(Path, paths[1::2])
    try:
        return solve(name, list(zip(files, directories, strict=True))).exit_code
    except (InputError, RunFailure) as error:
        print(f"pairsim: {error}", file=sys.stderr)
        return 2 if isinstance(error, InputError) else 3
    except Exception:
        return unexpected()


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
