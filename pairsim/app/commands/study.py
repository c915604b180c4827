"""Compute one case with several meshes and time steps, and compare errors and wall times.

Writes study.csv and study.png. As for a sweep, the same command continues an
interrupted study, and mpirun distributes the cases over the processes.

Exit codes: 0 no case failed, 2 wrong input, 3 some cases failed, 4
installation or system at fault (pairsim doctor), 130 interrupted.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pairsim.app.exit_codes import end
from pairsim.app.options import CaseTimeout, OutputOfMany, Quiet, Settings
from pairsim.runtime.signals import Signals

EXAMPLES = "Examples: pairsim study configs/study.yaml | mpirun -n 2 pairsim study configs/study.yaml -o mesh-study"


def study(
    file: Annotated[Path, typer.Argument(help="Study file (YAML): base, at, discretisations, reference.")],
    folder: OutputOfMany = None,
    case_timeout: CaseTimeout = None,
    quiet: Quiet = False,
    set_: Settings = None,
) -> None:
    from pairsim.sweeps.study import compute_study
    from pairsim.sweeps.sweep import Options

    with Signals(final=True) as signals:
        options = Options(case_timeout, not quiet, signals)
        ending, made = compute_study(file, folder, options, set_ or ())
    after = f"{made}/study.csv has errors and times, {made}/study.png draws them"
    end(*ending, made, "" if quiet else after)
