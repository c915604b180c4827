"""Mutation test: finds small changes of the physics, the constraints and the time scheme that the tests miss.

usage: scripts/mutation [-n 150] [--seed 1] [-o runs/mutation] [--limit 3600] [--only WORD] [--tiers unit verification]

Draws random positions in the modules of TARGETS, changes one at a time with an operator of cosmic-ray (a number by one,
+ to -, < to <=, ...) and runs the tests of `scripts/test` until one fails. This happens in a copy of the checkout in
OUTPUT, with its own cache of compiled forms, so that results belong to the code of the first command with this output.
The same command goes on after any kind of end, and a larger -n extends the sample; several commands with other outputs
and seeds may run at once. Appends to results.jsonl, whose survivors have their diff.

Exit code 0: no mutant survived; 1: some survived; 2: the tests fail without any change.
"""

from __future__ import annotations

import argparse
import ast
import difflib
import json
import os
import random
import re
import shutil
import subprocess
import sys
from collections import Counter, defaultdict
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from cosmic_ray.ast import ast_nodes, get_ast
from cosmic_ray.mutating import mutate_code
from cosmic_ray.plugins import get_operator, operator_names

from pairsim.fem.compilation.jit import JIT_OPTIONS

ROOT = Path(__file__).resolve().parent.parent
TARGETS = (
    "pairsim/physics/**/*.py",
    "pairsim/fem/algebra/constraints.py",
    "pairsim/fem/algebra/scene_constraints.py",
    "pairsim/fem/algebra/reduced_matrix.py",
    "pairsim/fem/phases/*.py",
    "pairsim/solvers/stepping/history.py",
    "pairsim/solvers/stepping/step_size.py",
    "pairsim/solvers/transient/scene.py",
    "pairsim/solvers/transient/transient.py",
    "pairsim/solvers/errors/time_error.py",
)
TRIVIAL = re.compile(r"_(BitOr|BitAnd|BitXor|LShift|RShift|FloorDiv|Mod)$")  # these fail at once on floats
TIERS = ("unit", "verification", "commands")
MEMORY = 8_000_000_000  # bytes of a process
# Marks all forms as compiled, so that tests compile those that they need. The name of a compiled form contains its
# signature, with constants and quadrature, so that none can hide a mutant.
STAMPS = """
import sys
sys.path.insert(0, "tests")
from conftest import FORMS
from pairsim.fem import form_cache
for form in form_cache.missing(FORMS):
    form_cache._stamp(form).touch()
"""


@dataclass(frozen=True)
class Mutant:
    """One change at one position in the source.

    Attributes:
        file: Path of the module, relative to the root of the repository.
        operator: Name of the operator of cosmic-ray.
        occurrence: Number of the position among those to which the operator applies in the module.
        line: Line number of the position.
    """

    file: str
    operator: str
    occurrence: int
    line: int

    def applied(self, root: Path) -> str | None:
        """Source of the changed module, None if its meaning is unchanged or it is not valid Python."""
        source = (root / self.file).read_text(encoding="utf-8")
        changed = mutate_code(source, get_operator(self.operator)(), self.occurrence)
        try:
            return changed if changed and meaning(changed) != meaning(source) else None
        except SyntaxError:
            return None


def meaning(source: str) -> str:
    """Syntax tree of a module without annotations, docstrings and class decorators, which do not affect results."""
    tree = ast.parse(source)
    for node in ast.walk(tree):
        if isinstance(node, ast.arg | ast.AnnAssign):
            node.annotation = ast.Constant(None)
        if isinstance(node, ast.FunctionDef):
            node.returns = None
        if isinstance(node, ast.ClassDef):
            node.decorator_list = []
        body = getattr(node, "body", None)
        if isinstance(body, list):
            node.body = [  # type: ignore[attr-defined]
                part for part in body if not (isinstance(part, ast.Expr) and isinstance(part.value, ast.Constant))
            ]
    return ast.dump(tree)


def places(root: Path, file: str) -> list[list[Mutant]]:
    """All mutants of a module, grouped by position."""
    tree = get_ast((root / file).read_text(encoding="utf-8"))
    found: defaultdict[tuple[Any, Any], list[Mutant]] = defaultdict(list)
    for name in sorted(operator_names()):
        if get_operator(name).arguments() or TRIVIAL.search(name):
            continue
        operator = get_operator(name)()
        positions = (position for node in ast_nodes(tree) for position in operator.mutation_positions(node))
        for occurrence, (start, end) in enumerate(positions):
            found[start, end].append(Mutant(file, name, occurrence, start[0]))
    return [found[key] for key in sorted(found)]


def sample(root: Path, count: int, seed: int, only: str) -> list[Mutant]:
    """Draw mutants at random, at most one a position; a larger count with the same seed extends the sample."""
    files = sorted({str(path.relative_to(root)) for pattern in TARGETS for path in root.glob(pattern)})
    everywhere = [place for file in files if only in file for place in places(root, file)]
    chance = random.Random(seed)
    chance.shuffle(everywhere)
    drawn = (chance.choice(place) for place in everywhere)
    changing = (mutant for mutant in drawn if mutant.applied(root) is not None)
    return [mutant for mutant, _ in zip(changing, range(count), strict=False)]


def copied(output: Path) -> tuple[Path, Path]:
    """Copies of the checkout in the output: one that is made once and stays, and one of it to change."""
    original, tree = output / "original", output / "tree"
    if not original.exists():
        words = ["git", "-C", str(ROOT), "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
        for name in subprocess.run(words, check=True, capture_output=True, text=True).stdout.split("\0"):
            if name and os.path.lexists(ROOT / name):
                (output / "copy" / name).parent.mkdir(parents=True, exist_ok=True)
                shutil.copy2(ROOT / name, output / "copy" / name, follow_symlinks=False)
        shutil.copytree(Path(str(JIT_OPTIONS["cache_dir"])).parent, output / "warm", dirs_exist_ok=True)
        (output / "copy").rename(original)
    shutil.rmtree(tree, ignore_errors=True)
    shutil.copytree(original, tree, symlinks=True)
    return original, tree


def python(tree: Path, *words: str, limit: float) -> tuple[int, str]:
    """Run Python in the copy; returns its exit code, 124 after the time limit [s], and its output."""
    environment = os.environ | {
        "PYTHONPATH": str(tree),
        "PYTHONDONTWRITEBYTECODE": "1",  # a stale .pyc of the same size and second would hide a mutant
        "XDG_CACHE_HOME": str(tree.parent / "cache"),
        "OMP_NUM_THREADS": "1",
    }
    bounds = ["prlimit", f"--data={MEMORY}", "timeout", "--kill-after=10", f"{limit:g}"]
    done = subprocess.run(
        [*bounds, sys.executable, "-P", *words], cwd=tree, env=environment, capture_output=True, text=True, check=False
    )
    return done.returncode, done.stdout + done.stderr


def ordered(tree: Path, module: str, tiers: list[str]) -> list[str]:
    """Test files: those that import a module first, then from quick to slow tiers."""
    package, _, name = module.removesuffix(".py").replace("/", ".").rpartition(".")
    files = [path for tier in tiers for path in sorted((tree / "tests" / tier).glob("test_*.py"))]
    imports = re.compile(rf"from {re.escape(package)}(\.{name} import| import .*\b{name}\b)")
    files.sort(key=lambda path: imports.search(path.read_text(encoding="utf-8")) is None)
    return [str(path.relative_to(tree)) for path in files]


def outcome(tree: Path, module: str, tiers: list[str], limit: float) -> tuple[str, str]:
    """How the tests of a copy end: `survived`, `killed` or `timeout`; and what they printed at the end."""
    cache = tree.parent / "cache"
    shutil.rmtree(cache, ignore_errors=True)  # FFCx does not change files that it has written: hard links suffice
    without = shutil.ignore_patterns("*.lock")
    shutil.copytree(tree.parent / "warm", cache / "pairsim", copy_function=os.link, ignore=without)
    python(tree, "-c", STAMPS, limit=limit)
    files, output = ordered(tree, module, tiers), ""
    for commands in (False, True):  # those last, with all forms compiled: their ranks cannot wait for the compiler
        if commands:
            for stamp in cache.glob("pairsim/*/compiled-*"):
                if stamp.stat().st_nlink == 1:
                    stamp.unlink()
        now = [file for file in files if file.startswith("tests/commands/") == commands]
        options = ["-x", "-q", "-p", "no:cacheprovider", "--tb=line", "-m", "not long"]
        code, output = python(tree, "-m", "pytest", *options, *now, limit=limit) if now else (0, output)
        if code not in (0, 5):  # 5: no tests were selected
            return ("timeout" if code in (124, 137) else "killed"), output
    return "survived", output


def main() -> int:
    form = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(prog="mutation", description=__doc__, formatter_class=form)
    parser.add_argument("-n", type=int, default=150, help="number of mutants")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("-o", "--output", type=Path, default=Path("runs/mutation"))
    parser.add_argument("--limit", type=float, default=3600.0, help="time limit of the tests of a mutant [s]")
    parser.add_argument("--only", default="", metavar="WORD", help="only modules whose path contains WORD")
    parser.add_argument("--tiers", nargs="+", default=TIERS, choices=TIERS, help="folders of tests")
    arguments = parser.parse_args()
    (original, tree), results = copied(arguments.output.resolve()), arguments.output.resolve() / "results.jsonl"
    lines = results.read_text(encoding="utf-8").splitlines() if results.exists() else []
    done = {Mutant(**entry["mutant"]): entry["outcome"] for entry in map(json.loads, lines)}
    if not done:
        found, output = outcome(tree, "", arguments.tiers, 3600.0)
        if found != "survived":
            print(f"the tests fail without any change:\n{output[-4000:]}", file=sys.stderr)
            return 2
    mutants = sample(original, arguments.n, arguments.seed, arguments.only)
    for mutant in mutants:
        if mutant in done:
            continue
        source, changed = (original / mutant.file).read_text(encoding="utf-8"), mutant.applied(original)
        assert changed is not None
        (tree / mutant.file).write_text(changed, encoding="utf-8")
        found, output = outcome(tree, mutant.file, arguments.tiers, arguments.limit)
        (tree / mutant.file).write_text(source, encoding="utf-8")
        by = re.search(r"^(?:FAILED|ERROR) (.+?)(?: - |$)", output, re.MULTILINE)
        said = by[1] if by else "" if found == "survived" else output.strip()[-200:]
        diff = list(difflib.unified_diff(source.splitlines(), changed.splitlines(), lineterm="", n=1))
        entry = {"mutant": asdict(mutant), "outcome": found, "by": said, "diff": diff if found == "survived" else []}
        with results.open("a", encoding="utf-8") as file:
            file.write(json.dumps(entry) + "\n")
        print(f"{found:8} {mutant.file}:{mutant.line} {mutant.operator}  {said}", *entry["diff"], sep="\n", flush=True)
        done[mutant] = found
    count = Counter(done[mutant] for mutant in mutants)
    print(
        f"{len(mutants)} mutants: {count['killed']} killed, {count['timeout']} timeouts, {count['survived']} survived"
    )
    return int(count["survived"] > 0)


if __name__ == "__main__":
    sys.exit(main())
