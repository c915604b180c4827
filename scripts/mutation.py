"""Mutation test: finds small changes of the physics, the constraints and the time scheme that the tests miss.

usage: scripts/mutation [-n 150] [--seed 1] [-o runs/mutation] [--limit 3600] [--only WORD] [--folders physics numerics]

Draws random positions in the modules of TARGETS, changes one at a time with an operator of cosmic-ray (a number by one,
+ to -, < to <=, ...) and runs the tests of `scripts/test` until one fails. This happens in a copy of the checkout in
OUTPUT, with its own cache of compiled forms, so that results belong to the code of the first command with this output.
The same command goes on after any kind of end, and a larger -n extends the sample; several commands with other outputs
and seeds may run at once. Results are a session of cosmic-ray: `cr-report --surviving-only --show-diff
OUTPUT/session.sqlite`.

Exit code 0: no mutant survived; 1: some survived; 2: the tests fail without any change.
"""

from __future__ import annotations

import argparse
import linecache
import os
import random
import re
import shlex
import shutil
import subprocess
import sys
from collections import Counter
from itertools import groupby
from pathlib import Path
from typing import Any

from book.computing import ROOT
from cosmic_ray.commands import init
from cosmic_ray.modules import find_modules
from cosmic_ray.mutating import mutate_and_test
from cosmic_ray.testing import run_tests
from cosmic_ray.work_db import use_db
from cosmic_ray.work_item import TestOutcome

from pairsim.fem.compilation.jit import JIT_OPTIONS

TARGETS = (
    "pairsim/physics",
    "pairsim/fem/algebra/constraints.py",
    "pairsim/fem/algebra/scene_constraints.py",
    "pairsim/fem/algebra/condensed_matrix.py",
    "pairsim/fem/phases",
    "pairsim/solvers/stepping/history.py",
    "pairsim/solvers/stepping/step_size.py",
    "pairsim/solvers/transient/scene.py",
    "pairsim/solvers/transient/transient.py",
    "pairsim/solvers/errors/time_error.py",
)
# Operators whose mutants fail at once on floats, or mean the same: most `|` are in annotations.
TRIVIAL = re.compile(r"BitOr|_(BitAnd|BitXor|LShift|RShift|FloorDiv|Mod)$|RemoveDecorator")
FOLDERS = ("physics", "numerics", "verification", "questions", "shell")


def copied(output: Path) -> Path:
    """A fresh copy of the checkout, to be changed; its original, and a copy of the compiled forms, are made once."""
    original, tree = output / "original", output / "tree"
    if not original.exists():
        shutil.copytree(Path(str(JIT_OPTIONS["cache_dir"])).parent, output / "compiled", dirs_exist_ok=True)
        index = os.environ | {"GIT_INDEX_FILE": str(output / "index")}  # of tracked and new files as they are
        for words in ("add --all", f"checkout-index --all --force --prefix={output / 'copy'}/"):
            subprocess.run(["git", *words.split()], cwd=ROOT, env=index, check=True)
        (output / "copy").rename(original)
    shutil.rmtree(tree, ignore_errors=True)
    shutil.copytree(original, tree, symlinks=True)
    return tree


def sample(items: list[Any], count: int, seed: int, only: str) -> list[Any]:
    """Draw mutants at random, at most one a position; a larger count with the same seed extends the sample."""

    def position(item: Any) -> tuple[str, tuple[int, int]]:
        return str(item.mutations[0].module_path), item.mutations[0].start_pos

    def changes_results(item: Any) -> bool:
        module, (line, _) = position(item)
        decorates = linecache.getline(module, line).lstrip().startswith("@")  # such as `frozen=True` of a dataclass
        return only in module and not decorates and TRIVIAL.search(item.mutations[0].operator_name) is None

    def order(item: Any) -> tuple[Any, ...]:
        return position(item), item.mutations[0].operator_name, item.mutations[0].occurrence

    mutants = sorted(filter(changes_results, items), key=order)
    everywhere = [list(group) for _, group in groupby(mutants, position)]
    chance = random.Random(seed)
    chance.shuffle(everywhere)
    return [chance.choice(group) for group in everywhere][:count]


def outcome_of(item: Any, result: Any) -> str:
    """Print how the tests of a mutant ended, `survived`, `killed` or `timeout`, with the test that failed or a diff."""
    mutation, said = item.mutations[0], result.output or ""
    outcome = "survived" if not result.is_killed else "timeout" if said == "timeout" else "killed"
    failed = [line for line in said.splitlines() if line.startswith(("FAILED", "ERROR"))]
    print(f"{outcome:8} {mutation.module_path}:{mutation.start_pos[0]} {mutation.operator_name}", *failed[:1], sep="  ")
    if outcome == "survived":
        print(result.diff)
    sys.stdout.flush()
    return outcome


def main() -> int:
    form = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(prog="mutation", description=__doc__, formatter_class=form)
    parser.add_argument("-n", type=int, default=150, help="number of mutants")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("-o", "--output", type=Path, default=Path("runs/mutation"))
    parser.add_argument("--limit", type=float, default=3600.0, help="time limit of the tests of a mutant [s]")
    parser.add_argument("--only", default="", metavar="WORD", help="only modules whose path contains WORD")
    parser.add_argument("--folders", nargs="+", default=FOLDERS, choices=FOLDERS, help="folders of tests")
    arguments = parser.parse_args()
    output = arguments.output.resolve()
    tree = copied(output)
    os.chdir(tree)
    os.environ |= {"PYTHONPATH": f"{tree}:{tree}/tests", "XDG_CACHE_HOME": f"{output}/cache", "OMP_NUM_THREADS": "1"}
    # The tests end with this process, however that ends.
    tests = shlex.join(["setpriv", "--pdeathsig", "TERM", sys.executable, "-P", "-m", "support.mutant"])
    folders, outcomes = " ".join(arguments.folders), Counter[str]()
    with use_db(output / "session.sqlite") as session:
        if not session.num_work_items:
            init(find_modules(map(Path, TARGETS)), session, {})
        if not session.num_results:
            found, said = run_tests(f"{tests} none {folders}", None)
            if found != TestOutcome.SURVIVED:
                print(f"the tests fail without any change:\n{said[-4000:]}", file=sys.stderr)
                return 2
        results = dict(session.results)
        for item in sample(session.work_items, arguments.n, arguments.seed, arguments.only):
            if item.job_id not in results:
                command = f"{tests} {item.mutations[0].module_path} {folders}"
                results[item.job_id] = mutate_and_test(item.mutations, command, arguments.limit)
                session.set_result(item.job_id, results[item.job_id])
            outcomes[outcome_of(item, results[item.job_id])] += 1
    print(f"{outcomes.total()} mutants:", ", ".join(f"{number} {outcome}" for outcome, number in outcomes.items()))
    return int(outcomes["survived"] > 0)


if __name__ == "__main__":
    sys.exit(main())
