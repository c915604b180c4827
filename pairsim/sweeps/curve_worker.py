"""Compute master curves one after another in one process: `python -P -m pairsim.sweeps.curve_worker CASE.yaml DIR ...`.

Each curve starts from the solutions of the previous one, which saves the continuation from undeformed spheres at small
De. A sweep starts such processes for neighbouring curves; the outcome of each curve is in its folder.
"""

from __future__ import annotations

import shlex
import sys
from contextlib import suppress
from pathlib import Path

from pairsim.runtime.fenicsx import MPI  # before everything else that loads MPI or makes threads

# isort: split
from pairsim.config.case_file import load_curve
from pairsim.drivers.curve import WarmStart, run_curve
from pairsim.drivers.outcome import Outcome
from pairsim.drivers.progress import Reporter
from pairsim.drivers.session import Options
from pairsim.plots.curves import draw_curve
from pairsim.plots.style import Page
from pairsim.runtime.errors import InputError, unexpected
from pairsim.runtime.signals import Signals


def solve(pairs: list[tuple[Path, Path]]) -> Outcome:
    """Compute curves one after another and write each to its folder, replacing earlier results.

    Args:
        pairs: Case file and folder of each curve.

    Returns:
        The outcome of the last curve.
    """
    comm, warm_start = MPI.COMM_WORLD, WarmStart()
    with Signals(final=True) as signals:
        for file, directory in pairs:
            case = load_curve(file)
            command = shlex.join(["pairsim", "curve", str(file), "-o", str(directory)])
            options = Options(comm, overwrite=True, reporter=Reporter(), command=command, signals=True)
            outcome = run_curve(case, directory, options, warm_start=warm_start)
            if outcome.status == "finished" and comm.rank == 0:
                with suppress(OSError, InputError):  # a picture can be drawn again
                    draw_curve(directory, directory, Page())
            if any(comm.allgather(signals.number)):
                break
    warm_start.close()
    return outcome


if __name__ == "__main__":
    paths = [Path(argument) for argument in sys.argv[1:]]
    try:
        code = solve(list(zip(paths[::2], paths[1::2], strict=True))).exit_code
    except Exception:
        code = unexpected()
    sys.exit(code)
