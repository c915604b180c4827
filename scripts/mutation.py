"""Mutation test: finds small changes of the physics, the constraints and the time scheme that the quick tests miss.

usage: scripts/mutation [-n 150] [--seed 1] [-o runs/mutation] [--jobs 1] [--limit 900] [--memory 8] [--only WORD]
                        [--tests EXPRESSION] [--tiers unit verification commands] [--list]

Draws random positions in the modules listed in `mutants.py: TARGETS`, changes one at a time with an operator of
cosmic-ray (a number by one, + to -, < to <=, ...) and runs the tests until the first one fails. Each of these mutants
is tested in a separate process, with its own copy of the source and its own cache of compiled forms; the checkout is
not changed. After an interruption the same command continues, and a larger -n extends the sample. Writes mutants.jsonl
and survivors.md, with the diff of each mutant that no test has detected.

Compiled forms cannot hide a mutant: the name of a module of FFCx contains the signature of its form, including
constants and quadrature. The initial cache is a copy of the user's cache; a changed form is compiled when a test first
needs it.

Exit code 0: no mutant survived; 1: some survived; 2: the input is invalid, or the tests fail without any change.
"""

from __future__ import annotations

import argparse
import contextlib
import difflib
import hashlib
import json
import os
import queue
import re
import resource
import shutil
import signal
import subprocess
import sys
import time
import xml.etree.ElementTree as ElementTree
from collections import defaultdict
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from mutants import ROOT, Mutant, applied, sample

from pairsim.fem.compilation.jit import JIT_OPTIONS
from pairsim.results.output import write_text

QUICK = "not slow and not long"  # the tests of `scripts/test --quick`
TIERS = ["unit", "verification", "commands"]
STAMPS = """
import sys
sys.path.insert(0, "tests")
from conftest import FORMS
from pairsim.fem import form_cache
for form in form_cache.missing(FORMS):
    form_cache._stamp(form).touch()
"""
"""Program that marks all forms as compiled, so that the tests compile those that they need."""
KEPT = 4000  # last characters of the output of failing tests that are shown


@dataclass(frozen=True)
class Result:
    """Result of the tests of one mutant.

    Attributes:
        mutant: The change.
        outcome: `killed`, `timeout` (counted as killed) or `survived`.
        by: The first test that failed.
        seconds: Wall time [s].
        diff: The change as a unified diff.
    """

    mutant: Mutant
    outcome: str
    by: str
    seconds: float
    diff: str


def tracked_files() -> list[str]:
    """Files of the checkout, including new files that are not committed."""
    words = ["git", "-C", str(ROOT), "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    names = subprocess.run(words, check=True, capture_output=True, text=True).stdout.split("\0")
    return sorted({name for name in names if name and (ROOT / name).is_file()})


def digest() -> str:
    """Hash of package and tests, to which the results belong."""
    found = hashlib.sha256()
    for name in tracked_files():
        if name.startswith(("pairsim/", "tests/")):
            found.update(name.encode() + (ROOT / name).read_bytes())
    return found.hexdigest()[:16]


class Stopped(Exception):
    """The command was interrupted."""


class Tree:
    """Copy of the checkout with its own cache of compiled forms, in which mutants are tested one after the other.

    Args:
        folder: Folder of the copy.
        warm: Copy of the user's cache of compiled forms.
        memory: Memory limit of a process [GB].
        tests: Expression that selects tests by marks, as of pytest -m.
    """

    def __init__(self, folder: Path, warm: Path, memory: float, tests: str) -> None:
        self.folder, self.warm, self.memory, self.tests = folder, warm, memory, tests
        self._process: subprocess.Popen[bytes] | None = None
        self._stopped = False
        shutil.rmtree(folder, ignore_errors=True)
        for name in tracked_files():
            (folder / "tree" / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, folder / "tree" / name)

    def fresh_cache(self) -> None:
        """Reset the cache to the initial one, without forms of the previous mutant."""
        shutil.rmtree(self.folder / "cache", ignore_errors=True)
        # FFCx does not change files that it has written, so that hard links suffice.
        without = shutil.ignore_patterns("*.lock")
        shutil.copytree(self.warm, self.folder / "cache" / "pairsim", copy_function=os.link, ignore=without)

    def _stamps(self) -> set[Path]:
        """Stamp files, which record the kinds of forms that are compiled."""
        return set((self.folder / "cache").glob("pairsim/*/compiled-*"))

    def stop(self) -> None:
        """Kill the running process; called from another thread. The thread that waits for it raises `Stopped`."""
        self._stopped = True
        if self._process is not None:
            self._end(self._process)

    def _end(self, process: subprocess.Popen[bytes]) -> None:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()

    def python(self, *words: str, limit: float) -> tuple[int | None, str]:
        """Run Python in the copy; returns the exit code, None after the time limit [s], and the output."""
        environment = os.environ | {
            "PYTHONPATH": str(self.folder / "tree"),
            "PYTHONDONTWRITEBYTECODE": "1",  # a stale .pyc of the same size and second would hide a mutant
            "XDG_CACHE_HOME": str(self.folder / "cache"),
            "MPLCONFIGDIR": str(self.folder / "matplotlib"),
            "OMP_NUM_THREADS": "1",
        }
        with (self.folder / "output").open("w+") as output:
            self._process = process = subprocess.Popen(
                [sys.executable, *words],
                cwd=self.folder / "tree",
                env=environment,
                stdout=output,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )
            size = int(self.memory * 1e9)
            code: int | None = None
            try:
                resource.prlimit(process.pid, resource.RLIMIT_DATA, (size, size))
                code = process.wait(limit)
            except (subprocess.TimeoutExpired, ProcessLookupError):
                code = process.poll()
            finally:
                self._end(process)
            if self._stopped:
                raise Stopped
            output.seek(0)
            return code, output.read()

    def pytest(self, *words: str, limit: float) -> tuple[int | None, str]:
        """Run tests in the copy until one fails; returns as `python`."""
        options = ["-x", "-q", "-p", "no:cacheprovider", "--tb=line", "-m", self.tests, *words]
        return self.python("-P", "-m", "pytest", *options, limit=limit)

    def check(self, mutant: Mutant, order: list[str], limit: float) -> Result:
        """Test one mutant, first by the tests without commands and then by those of commands.

        Args:
            mutant: The change.
            order: Test files in the order in which they are run.
            limit: Time limit of all tests [s].
        """
        path, changed = self.folder / "tree" / mutant.file, applied(mutant, self.folder / "tree")
        source = path.read_text(encoding="utf-8")
        assert changed is not None
        patch = difflib.unified_diff(
            source.splitlines(), changed.splitlines(), mutant.file, mutant.file, lineterm="", n=1
        )
        begin, outcome, by = time.monotonic(), "survived", ""
        self.fresh_cache()
        path.write_text(changed, encoding="utf-8")
        try:
            # Tests of commands run last, with all forms compiled: their ranks and workers would time out while waiting
            # for the compiler.
            before = self._stamps()
            self.python("-P", "-c", STAMPS, limit=limit)
            for commands in (False, True):
                files = [file for file in order if file.startswith("tests/commands/") == commands]
                if not files:  # without files pytest would run all tests
                    continue
                if commands:
                    for stamp in self._stamps() - before:
                        stamp.unlink()
                code, output = self.pytest(*files, limit=max(begin + limit - time.monotonic(), 1.0))
                if code not in (0, 5):  # 5: no tests were selected
                    failed = re.search(r"^(?:FAILED|ERROR) (.+?)(?: - |$)", output, re.MULTILINE)
                    outcome = "timeout" if code is None else "killed"
                    by = failed[1] if failed else output.strip()[-200:]
                    break
        finally:
            path.write_text(source, encoding="utf-8")
        return Result(mutant, outcome, by, round(time.monotonic() - begin, 1), "\n".join(patch))

    def baseline(self, tiers: list[str]) -> dict[str, float]:
        """Run time of every test file of the given tiers without any change [s].

        Raises:
            SystemExit: A test fails.
        """
        self.fresh_cache()
        report = self.folder / "baseline.xml"
        code, output = self.pytest(*(f"tests/{tier}" for tier in tiers), f"--junitxml={report}", limit=3600.0)
        if code != 0:
            print(output[-KEPT:], file=sys.stderr)
            sys.exit(2)
        seconds: dict[str, float] = defaultdict(float)
        for case in ElementTree.parse(report).iter("testcase"):
            seconds[case.get("classname", "").replace(".", "/") + ".py"] += float(case.get("time", 0.0))
        return dict(seconds)


def ordered(mutant: Mutant, seconds: dict[str, float]) -> list[str]:
    """Order of test files for a mutant: those that import its module first, then by increasing run time."""
    module = mutant.file.removesuffix(".py").replace("/", ".")

    def key(file: str) -> tuple[bool, float]:
        package, _, name = module.rpartition(".")
        text = (ROOT / file).read_text(encoding="utf-8")
        imports = f"from {module} import" in text or re.search(rf"from {package} import .*\b{name}\b", text)
        return not imports, seconds[file]

    return sorted(seconds, key=key)


def read_results(file: Path) -> dict[Mutant, Result]:
    """Results of earlier commands."""
    found = {}
    for line in file.read_text(encoding="utf-8").splitlines() if file.exists() else []:
        with contextlib.suppress(json.JSONDecodeError):  # an incomplete last line of a command that was killed
            values = json.loads(line)
            mutant = Mutant(**values.pop("mutant"))
            found[mutant] = Result(mutant, **values)
    return found


def page(results: list[Result]) -> str:
    """Page with a table of the results and the diffs of the survivors."""
    outcomes = [result.outcome for result in results]
    survivors = [result for result in results if result.outcome == "survived"]
    lines = [
        f"# {len(results)} mutants: {len(results) - len(survivors)} killed, {len(survivors)} survived\n",
        f"{outcomes.count('timeout')} of the killed mutants exceeded the time limit.\n",
        "| module | mutants | survived |\n|---|---|---|",
    ]
    for file in sorted({result.mutant.file for result in results}):
        here = [result.outcome for result in results if result.mutant.file == file]
        lines.append(f"| {file} | {len(here)} | {here.count('survived')} |")
    for result in sorted(survivors, key=lambda r: (r.mutant.file, r.mutant.line)):
        lines.append(f"\n## {result.mutant.file}:{result.mutant.line}, {result.mutant.operator}\n")
        lines.append(f"```diff\n{result.diff}\n```")
    return "\n".join(lines) + "\n"


def main() -> int:
    form = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(prog="mutation", description=__doc__, formatter_class=form)
    parser.add_argument("-n", type=int, default=150, help="number of mutants")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("-o", "--output", type=Path, default=Path("runs/mutation"))
    parser.add_argument("--jobs", type=int, default=1, help="mutants tested at the same time")
    parser.add_argument("--limit", type=float, default=900.0, help="time limit of a mutant [s]")
    parser.add_argument("--memory", type=float, default=8.0, help="memory limit of a process [GB]")
    parser.add_argument("--only", default="", metavar="WORD", help="only modules whose path contains WORD")
    parser.add_argument("--tests", default=QUICK, metavar="EXPRESSION", help="marks of the tests, as of pytest -m")
    parser.add_argument("--tiers", nargs="+", default=TIERS, choices=TIERS, help="folders of tests")
    parser.add_argument("--list", action="store_true", help="print the sample and end")
    arguments = parser.parse_args()
    mutants = sample(arguments.n, arguments.seed, arguments.only)
    if arguments.list:
        for mutant in mutants:
            print(f"{mutant.file}:{mutant.line} {mutant.operator} {mutant.occurrence}")
        return 0
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))
    output = arguments.output.resolve()
    output.mkdir(parents=True, exist_ok=True)
    results_file, state_file = output / "mutants.jsonl", output / "state.json"
    belongs = f"{digest()} {arguments.tests} {' '.join(arguments.tiers)}"
    state: dict[str, Any] = json.loads(state_file.read_text()) if state_file.exists() else {"belongs": belongs}
    if state["belongs"] != belongs:
        print(f"{output} holds results of other sources, tests, --tests or --tiers; give another -o", file=sys.stderr)
        return 2
    warm = output / "cache"
    if not warm.exists():
        cache = Path(str(JIT_OPTIONS["cache_dir"])).parent
        cache.mkdir(parents=True, exist_ok=True)
        shutil.copytree(cache, warm)
    jobs = [Tree(output / f"job-{job}", warm, arguments.memory, arguments.tests) for job in range(arguments.jobs)]
    if "seconds" not in state:
        state["seconds"] = jobs[0].baseline(arguments.tiers)
        write_text(state_file, json.dumps(state))
    trees: queue.Queue[Tree] = queue.Queue()
    for tree in jobs:
        trees.put(tree)
    results = read_results(results_file)

    def check(mutant: Mutant) -> Result:
        tree = trees.get()
        try:
            result = tree.check(mutant, ordered(mutant, state["seconds"]), arguments.limit)
        finally:
            trees.put(tree)
        with results_file.open("a", encoding="utf-8") as file:
            file.write(json.dumps(asdict(result)) + "\n")
        return result

    pool = ThreadPoolExecutor(arguments.jobs)
    try:
        for result in pool.map(check, [mutant for mutant in mutants if mutant not in results]):
            results[result.mutant] = result
            place = f"{result.mutant.file}:{result.mutant.line} {result.mutant.operator}"
            print(f"{result.outcome:8} {result.seconds:6.1f} s  {place}  {result.by}", flush=True)
            write_text(output / "survivors.md", page([results[mutant] for mutant in mutants if mutant in results]))
    except (KeyboardInterrupt, SystemExit):
        for tree in jobs:
            tree.stop()
        raise
    finally:
        pool.shutdown(cancel_futures=True)
    found = [results[mutant] for mutant in mutants]
    text = page(found)
    write_text(output / "survivors.md", text)
    print(text.partition("\n")[0].removeprefix("# "))
    return int(any(result.outcome == "survived" for result in found))


if __name__ == "__main__":
    sys.exit(main())
