"""Measures wall time against error: the tables and the figure of docs/explanation/accuracy.md.

usage: scripts/accuracy [-o runs/accuracy] [--only WORD] [--hard DIR] [--peers CSV] [--table]

Runs every study of configs/accuracy in one process after the other, so that wall times are comparable (about an hour
and a half); some steps of the discretisation of the paper (fixed steps of 7.5e-4 on 1e4 triangles) with a new matrix in
every Newton iteration; and factorisations of increasing size. After an interruption the same command continues. With
--table nothing is computed. --hard and --peers insert the results of scripts/hard and scripts/peers into the page.
"""

from __future__ import annotations

import argparse
import json
import math
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from accuracy_page import SCENES, STUDIES, write_page
from measuring import every_matrix, with_one_thread

from pairsim.config.accuracy import SETTINGS
from pairsim.results.output import write_text
from pairsim.runtime.child_process import module_command

# Steps with a new matrix in every iteration, and how many of them, the last ones, are evaluated; chosen.
PLAIN_STEPS, PLAIN_COUNTED = 20, 5

# Factors of the default cell sizes; chosen such that the number of unknowns varies by a factor of 16 or more.
GROWTH = (2.2, 1.5, 1.0, 0.67, 0.45)


def python(*words: str) -> int:
    """Run a module with this Python interpreter; returns the exit code."""
    return subprocess.run(module_command(*words), check=False).returncode


def compute(output: Path, only: str) -> None:
    """Run the studies and measurements that have no results yet."""
    for study in sorted(STUDIES.glob("*.yaml")):
        if only in study.stem and python("pairsim", "study", str(study), "-o", str(output / study.stem)) not in (0, 3):
            sys.exit(f"{study} failed; its messages are above")
    for scene in SCENES:
        if only in f"plain-{scene}" and not (output / f"plain-{scene}.json").is_file():
            write_text(output / f"plain-{scene}.json", json.dumps(plain(STUDIES / f"run-{scene}.yaml")))
    if not (output / "growth.json").is_file() and only in "growth":
        write_text(output / "growth.json", json.dumps(growth(), indent=1))


def plain(study: Path) -> list[float]:
    """Wall time per Newton iteration with a new matrix [s], in PLAIN_COUNTED steps of the paper's discretisation."""

    import pairsim.runtime.fenicsx  # noqa: F401 - orders MPI ahead of everything compiled
    from pairsim.commands import COMMANDS
    from pairsim.config.yaml_file import apply_settings, read_yaml
    from pairsim.drivers.problems import problem_of
    from pairsim.inputs.case_files import parse_case
    from pairsim.solvers.transient.transient import Transient

    content = read_yaml(study)
    case = content["base"]
    paper = next(row for row in content["discretisations"] if "time.fixed_step" in row)
    end = PLAIN_STEPS * paper["time.fixed_step"]
    settings = paper | {"time.end": end}
    apply_settings(case, tuple(f"{key}={value!r}" for key, value in settings.items() if key != "repeat"))
    seconds, begin = [], time.perf_counter()
    transient = Transient(every_matrix(problem_of(parse_case(COMMANDS["run"], case, study.stem))))
    for step in transient.steps(iter([end])):
        now = time.perf_counter()
        seconds.append((now - begin) / step.report.iterations)
        begin = now
    transient.close()
    return seconds[-PLAIN_COUNTED:]


def growth() -> dict[str, dict[str, Any]]:
    """Cost of the parts of a Newton iteration against the number of unknowns, with all cell sizes scaled equally."""

    import pairsim.runtime.fenicsx  # noqa: F401 - orders MPI ahead of everything compiled
    from pairsim.commands import COMMANDS
    from pairsim.drivers.problems import steady_problem
    from pairsim.inputs.case_files import parse_case
    from pairsim.solvers.curves.branch import Branch
    from pairsim.solvers.parameters import Parameters

    def seconds(work: Callable[[], object]) -> float:
        times = []
        for _ in range(7):
            begin = time.perf_counter()
            work()
            times.append(time.perf_counter() - begin)
        return statistics.median(times)

    found: dict[str, dict[str, Any]] = {}
    for title, De in (("Newtonian", 0.0), ("De 1", 1.0)):
        rows = []
        for scale in GROWTH:
            cells = SETTINGS["1%"].mesh("thinning" if De else "newtonian", [0.4])
            mesh = {"Np": round(cells["Np"] / scale), "max_size": cells["max_size"] * scale, "growth": 0.15 * scale}
            keys = {"beta": 0.4, "De": De, "Ca_e": 0.1, "ends": "developed", "length": "auto", "d": (0.1,)}
            case = parse_case(COMMANDS["curve"], {**keys, "mesh": mesh}, "growth")
            start = Parameters((0.1,), case.solid_models, case.liquid_model)
            branch = Branch(steady_problem(case, 0.1), start, mesh_error=False)
            scene, newton = branch.fine, branch.fine.newton
            newton.factor_at(scene.y)
            before = dict(scene.clock.seconds)
            both = seconds(partial(newton.factor_at, scene.y))
            inside = [scene.clock.seconds[name] - before[name] for name in ("assembly", "factorisation")]
            factorisation = both * inside[1] / sum(inside)
            r = newton.residual_at(scene.y)
            row = {"unknowns": scene.constraints.size, "factorisation": factorisation, "assembly": both - factorisation}
            row["solve"] = seconds(partial(newton.linear_solve, r))
            row["iteration"] = row["assembly"] + factorisation + row["solve"]
            row["memory"] = newton.factor_megabytes
            rows.append(row)
            branch.close()
        n = [math.log(row["unknowns"]) for row in rows]
        names = ("assembly", "factorisation", "solve", "memory")
        slopes = {k: statistics.linear_regression(n, [math.log(row[k]) for row in rows]).slope for k in names}
        found[title] = {"rows": rows, "exponents": slopes}
    return found


def main() -> int:
    """Compute, and write the page."""
    with_one_thread()
    form = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(prog="accuracy", description=__doc__, formatter_class=form)
    parser.add_argument("-o", "--output", type=Path, default=Path("runs/accuracy"))
    parser.add_argument("--only", default="", metavar="WORD", help="only studies whose name contains WORD; no page")
    parser.add_argument("--hard", type=Path, help="output folder of scripts/hard")
    parser.add_argument("--peers", type=Path, help="table written by a script in scripts/peers")
    parser.add_argument("--table", action="store_true", help="write the page from existing results without computing")
    arguments = parser.parse_args()
    arguments.output.mkdir(parents=True, exist_ok=True)
    if not arguments.table:
        compute(arguments.output, arguments.only)
        if arguments.only:
            return 0
    write_page(arguments.output, arguments.peers, arguments.hard)
    return 0


if __name__ == "__main__":
    sys.exit(main())
