"""Computes and draws the figures of the paper that pairsim follows, and judges what the paper says of them.

usage: scripts/paper FIGURE... [-o DIR] [--quick] [--set KEY=VALUE] [--dry-run] [--table] [--page]

FIGURE is one or more of fig02 to fig17; of finer, periodic and transients, which solve cases again on finer meshes,
with periodic ends and in time, for statements that do not hold; or all. The same command goes on after any kind of end;
under mpirun the cases are distributed over the processes:

    .venv/bin/mpirun -n 2 .venv/bin/python scripts/paper.py all

configs/paper/FIGURE holds the computations of a figure, which are grid files of `pairsim sweep` (case files of `pairsim
mesh` for fig02), and figure.yaml, the description of its picture. A figure that shows results of another one computes
these, too. Results are in DIR/FIGURE/FILE (DIR is runs/paper, with --quick runs/paper-quick), pictures of 85 and 170 mm
as PDF and PNG in DIR/pictures, the statements of section 3 of the paper with their verdicts in DIR/statements.md.
--quick computes the same on coarse meshes with few points (configs/paper/quick.yaml). --dry-run lists the cases to do
with an estimate of the time, and computes nothing; neither does --table, which draws and judges the results that are
there. --page writes docs/paper.md and its pictures.

Exit code 0: all cases finished; 2: wrong input; 3: some cases failed, or a picture lacks results; 130: interrupted.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import yaml
from paper_results import CONFIGS, NotComputed, Results, computations, figures
from paper_statements import CHECKS, judged

from pairsim.errors import InputError, PairsimError

if TYPE_CHECKING:
    from mpi4py import MPI

    from pairsim.sweeps.grid import Grid

ALL = "all"
INTERRUPTED = 130


def chosen(words: list[str], quick: bool) -> list[str]:
    """The figures, and folders of checks, of these names; `all` has no checks on coarse meshes, which decide nothing.

    Raises:
        InputError: A name is unknown.
    """
    known = [*figures(), *CHECKS]
    for word in words:
        if word not in known and word != ALL:
            raise InputError("scripts/paper", "FIGURE", word, f"must be one or more of {', '.join(known)}, or {ALL}")
    every = (figures() if quick else known) if ALL in words else ()
    return [name for name in known if name in every or name in words]


def needed(names: list[str]) -> list[str]:
    """Computations of figures and those that their pictures show, each once; those of checks come last."""
    known, found = figures(), []
    for name in names:
        found += [*computations(name), *(known[name].needs if name in known else ())]
    return list(dict.fromkeys(found))


def quick_settings(name: str, command: str) -> tuple[str, ...]:
    """What `--quick` replaces in the cases of a computation, as `--set` does."""
    figure = figures().get(name.partition("/")[0])
    own = figure.quick.get(name) if figure else None
    settings: dict[str, Any] = yaml.safe_load((CONFIGS / "quick.yaml").read_text())[command] if own is None else own
    return tuple(f"{key}={json.dumps(value)}" for key, value in settings.items())


def of_meshes(name: str) -> bool:
    """Whether the file of a computation is the case file of a mesh, not a grid file."""
    from pairsim.config.yaml_file import read_yaml

    return "beta" in read_yaml(CONFIGS / f"{name}.yaml")


def grid_of(name: str, quick: bool, settings: tuple[str, ...]) -> tuple[Grid, tuple[str, ...]]:
    """The grid of a computation, and everything that was replaced in its cases.

    Args:
        name: The computation.
        quick: Whether on coarse meshes.
        settings: What `--set` replaces in all cases.
    """
    from pairsim.config.yaml_file import read_yaml
    from pairsim.sweeps.grid import read_grid

    path = CONFIGS / f"{name}.yaml"
    every = (*(quick_settings(name, read_yaml(path).get("command", "run")) if quick else ()), *settings)
    return read_grid(path, every), every


def plan(wanted: list[str], output: Path, quick: bool, settings: tuple[str, ...]) -> str:
    """A table of what is to do, with the estimates of `pairsim sweep --dry-run`."""
    lines, results, total = [f"{'':20} cases  to do   s of one core"], Results(output), 0.0
    for name in (name for name in needed(wanted) if not of_meshes(name)):
        grid, _ = grid_of(name, quick, settings)
        record = results.record(name)
        done = {case["key"] for case in record["cases"] if case["status"] == "finished"} if record else set()
        left = [case.estimate.seconds for case in grid.cases if case.key not in done]
        lines.append(f"{name:20} {len(grid.cases):5} {len(left):6} {sum(left):15.0f}")
        total += sum(left)
    return "\n".join([*lines, f"about {total / 60:.0f} min on one core"])


def compute(name: str, output: Path, quick: bool, settings: tuple[str, ...], comm: MPI.Comm | None) -> int:
    """Compute what is not there yet of a computation; returns the exit code of the sweep, on all processes.

    Args:
        name: The computation.
        output: The output folder.
        quick: Whether on coarse meshes.
        settings: What `--set` replaces in all cases.
        comm: All processes, None without mpirun.
    """
    from pairsim.drivers.progress import make_reporter
    from pairsim.sweeps.options import Options
    from pairsim.sweeps.sweep import run_sweep

    if of_meshes(name):
        return mesh(CONFIGS / f"{name}.yaml", output / f"{name}.vtu", comm)
    grid, settings = grid_of(name, quick, settings)
    reporter = make_reporter("auto", comm.rank if comm else 0)
    code, _ = run_sweep(grid, output / name, Options(settings=settings), comm, reporter)
    return code


def mesh(path: Path, target: Path, comm: MPI.Comm | None) -> int:
    """Write the mesh of a case file on the first process, unless it is there; returns 0."""
    import pairsim.runtime.fenicsx  # noqa: F401 - PETSc is loaded by all processes together
    from pairsim.commands import COMMANDS
    from pairsim.drivers.mesh import write_mesh
    from pairsim.inputs.case_files import read_case

    if (comm is None or comm.rank == 0) and not target.is_file():
        write_mesh(read_case(COMMANDS["run"], path), target, None)
    return 0


def compute_all(wanted: list[str], output: Path, quick: bool, settings: tuple[str, ...]) -> int:
    """Compute everything that figures show; returns the largest exit code, on all processes."""
    from pairsim.runtime.launcher import launcher_communicator
    from pairsim.runtime.signals import Signals

    comm = launcher_communicator()
    worst, names, begin = 0, needed(wanted), time.monotonic()
    with Signals(final=True):
        for place, name in enumerate(names, 1):
            if comm is None or comm.rank == 0:
                print(f"{name} ({place} of {len(names)}, {time.monotonic() - begin:.0f} s so far)", file=sys.stderr)
            code = compute(name, output, quick, settings, comm)
            worst = max(worst, code)
            if code not in (0, 3):
                break
        if comm is not None and comm.rank:
            sys.exit(worst)
    return worst


def present(wanted: list[str], output: Path) -> list[str]:
    """Draw figures and judge statements; returns the names of figures without results."""
    from paper_page import statement_table
    from paper_pictures import draw

    from pairsim.results.output import write_text

    results, missing = Results(output), []
    for name, figure in figures().items():
        if name not in wanted:
            continue
        try:
            for path in draw(name, figure, results, output / "pictures"):
                print(path)
        except NotComputed as lacking:
            missing.append(name)
            print(f"{name} has no picture yet: {lacking}", file=sys.stderr)
    rows = judged(results)
    write_text(output / "statements.md", statement_table(rows))
    print(statement_table([row for row in rows if row.statement.figure in wanted]))
    return missing


def main() -> int:
    """Compute, draw and judge."""
    form = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(prog="paper", description=__doc__, formatter_class=form)
    parser.add_argument("figures", nargs="+", metavar="FIGURE")
    parser.add_argument("-o", "--output", type=Path, help="folder of the results (default: runs/paper)")
    parser.add_argument("--quick", action="store_true", help="coarse meshes, few points")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help="replace a key in all cases")
    parser.add_argument("--dry-run", action="store_true", help="list the cases to do and estimate the time")
    parser.add_argument("--table", action="store_true", help="draw and judge the results that are there")
    parser.add_argument("--page", action="store_true", help="write docs/paper.md")
    arguments = parser.parse_args()
    output: Path = arguments.output or Path("runs") / ("paper-quick" if arguments.quick else "paper")
    try:
        wanted = chosen(arguments.figures, arguments.quick)
        if arguments.dry_run:
            print(plan(wanted, output, arguments.quick, tuple(arguments.set)))
            return 0
        output.mkdir(parents=True, exist_ok=True)
        code = 0 if arguments.table else compute_all(wanted, output, arguments.quick, tuple(arguments.set))
        if code not in (0, 3):
            return code
        missing = present(wanted, output)
        if arguments.page:
            from paper_page import write_page

            write_page(Results(output), arguments.quick)
    except PairsimError as error:
        print(error, file=sys.stderr)
        return 2 if isinstance(error, InputError) else 3
    return max(code, 3 if missing else 0)


if __name__ == "__main__":
    sys.exit(main())
