"""A chain of master curves in one process: `python -P -m pairsim.chain CASE.yaml DIR CASE.yaml DIR ...`.

Each curve starts from the solutions of the one before, which saves the way from undeformed spheres at small De. A sweep
starts chains; how every curve ended is in its own folder.
"""

from __future__ import annotations

import shlex
import sys
from contextlib import suppress
from pathlib import Path

from pairsim.case_file import load_curve
from pairsim.errors import unexpected
from pairsim.record import Outcome
from pairsim.signals import Signals


def solve(pairs: list[tuple[Path, Path]]) -> Outcome:
    """Solve curves one after another into their folders, whatever was there before.

    Args:
        pairs: Case files and folders.

    Returns:
        How the last one ended.
    """
    from pairsim.fenicsx import MPI  # before everything else that loads MPI or is compiled

    # isort: split
    from pairsim.curve_plots import plot_curve
    from pairsim.curve_run import Chain, run_curve
    from pairsim.progress import make_reporter

    comm, chain = MPI.COMM_WORLD, Chain()
    with Signals() as signals:
        for file, directory in pairs:
            case = load_curve(file)
            command = shlex.join(["pairsim", "curve", str(file), "-o", str(directory)])
            outcome = run_curve(
                case,
                directory,
                comm=comm,
                overwrite=True,
                reporter=make_reporter(True, comm.rank),
                command=command,
                chain=chain,
            )
            if outcome.status == "finished" and comm.rank == 0:
                with suppress(OSError):  # a picture can be drawn again
                    plot_curve(directory, directory)
            if any(comm.allgather(signals.number)):
                break
    chain.close()
    return outcome


if __name__ == "__main__":
    words = [Path(word) for word in sys.argv[1:]]
    try:
        code = solve(list(zip(words[::2], words[1::2], strict=True))).exit_code
    except Exception:
        code = unexpected()
    sys.exit(code)
