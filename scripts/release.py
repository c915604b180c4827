"""Checklist of a release: checks the tree, builds sdist and wheel into dist/, tries the wheel. Publishes nothing.

usage: scripts/release [--without-tests]

1. no file has been changed or added since the last commit
2. the version is new: no tag v<version>; CHANGELOG.md has a section of it with a date, below an empty [Unreleased];
   CITATION.cff has version and date
3. stored results of studies are those of this code, and so are the pictures of the documents
4. scripts/test passes (--without-tests leaves it out)
5. sdist and wheel are built from the commit, by way of git archive, and have what they must have
6. the wheel is installed with [fenicsx] in a clean environment in a temporary folder, and in another folder
   pairsim --version, init, run, plot and report work

Prints every point with ok or FAILED, and what is left to do by hand. Exit codes: 0 all is well, 1 a point has failed.
"""

from __future__ import annotations

import argparse
import re
import shutil
import subprocess
import sys
import tarfile
import tempfile
import time
import zipfile
from collections.abc import Iterator
from itertools import chain
from pathlib import Path

from book import yaml_files
from book.computing import ROOT
from book.results import Results
from book.study import names, study_of
from pictures import judged

from pairsim.runtime.child_process import clean_environment
from pairsim.runtime.version import __version__

DIST = ROOT / "dist"
SDIST, WHEEL = DIST / f"pairsim-{__version__}.tar.gz", DIST / f"pairsim-{__version__}-py3-none-any.whl"
NOT_IN_SDIST = (".gitignore", ".gitattributes", ".dockerignore")  # of the files that git tracks
FIRST_STEPS = (
    *("--version", "init beads", "run beads.yaml --set time.end=0.05 -q"),
    *("plot runs/beads", "report runs/beads"),
)
"""Commands that must work where the wheel is installed; the names are those of the files they make."""

type Points = Iterator[tuple[str, str]]
"""Points of the checklist, each with its fault, which is empty if all is well."""


def git(*words: str) -> str:
    """Output of git in the project."""
    return subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True, check=True).stdout.strip()


def tried(*command: str | Path, cwd: Path) -> tuple[str, str]:
    """Output of a command without PYTHONPATH, and its fault, if it fails."""
    environment = {name: value for name, value in clean_environment().items() if name != "PYTHONPATH"}
    done = subprocess.run(command, cwd=cwd, env=environment, capture_output=True, text=True, check=False)
    fault = f"exit code {done.returncode}: {(done.stderr.strip() or done.stdout.strip())[-300:]}"
    return done.stdout.strip(), fault if done.returncode else ""


def tree() -> Points:
    """The tree is that of the last commit, and names a new version everywhere."""
    changed = git("status", "--porcelain").splitlines()
    yield "nothing is uncommitted", f"{len(changed)} files" if changed else ""
    exists = git("tag", "--list", f"v{__version__}")
    yield f"version {__version__} is new", f"there is a tag {exists}" if exists else ""
    changelog = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    sections = dict(re.findall(r"^## \[(.+?)\](.*?)(?=^## |\Z)", changelog, re.MULTILINE | re.DOTALL))
    described = re.fullmatch(r" - (\d{4}-\d\d-\d\d)\n.*\S.*", sections.get(__version__, ""), re.DOTALL)
    fault = "" if described else f"needs ## [{__version__}] - YYYY-MM-DD and what is new"
    yield "CHANGELOG.md describes it", fault
    fault = "entries are left" if sections.get("Unreleased", "").strip() else ""
    yield "CHANGELOG.md has an empty [Unreleased]", fault if "Unreleased" in sections else "the section is missing"
    citation = yaml_files.read(ROOT / "CITATION.cff")
    cited = f"{citation['version']} of {citation['date-released']}"
    expected = f"{__version__} of {described[1]}" if described else __version__
    yield "CITATION.cff has version and date", "" if cited == expected else f"has {cited}, not {expected}"


def results() -> Points:
    """What the documents show was computed with this code; a person has to name what could not be."""
    for name in names():
        study = study_of(name)
        parts, stored = study.parts(False), Results(study.stored)
        stale = [part for part in parts if stored.stale(part, study.code_of(part)) != []]
        fault = f"{len(stale)} of {len(parts)} parts are to be computed, see scripts/study {name}" if stale else ""
        yield f"the results of the study {name} are those of this code", fault
    found = judged()
    count = int((found["verdict"] == "stale").sum())
    yield "no picture is stale", f"{count} are, see scripts/pictures" if count else ""


def tests() -> Points:
    passed = subprocess.run([ROOT / "scripts" / "test"], check=False).returncode == 0
    yield "scripts/test passes", "" if passed else "see above"


def archives(work: Path) -> Points:
    """Sdist and wheel are built from the last commit, and whole."""
    git("archive", "--output", str(work / "source.tar"), "HEAD")
    shutil.unpack_archive(work / "source.tar", work / "source", filter="tar")
    shutil.rmtree(DIST, ignore_errors=True)
    _, fault = tried(sys.executable, "-m", "build", "--outdir", DIST, work / "source", cwd=work)
    yield f"built {', '.join(path.name for path in sorted(DIST.glob('*')))}", fault
    if fault:
        return
    with tarfile.open(SDIST) as packed:
        names = {name.partition("/")[2] for name in packed.getnames()}
    lacking = set(git("ls-tree", "-r", "--name-only", "HEAD").splitlines()) - names - set(NOT_IN_SDIST)
    yield "the sdist has all files of the project", f"not {', '.join(sorted(lacking))}" if lacking else ""
    with zipfile.ZipFile(WHEEL) as zipped:
        lacking = {"pairsim/py.typed", "pairsim/cases/examples/run.yaml"} - set(zipped.namelist())
        commit = zipped.read("pairsim/commit.txt").decode().strip()
    yield "the wheel has its examples", f"not {', '.join(sorted(lacking))}" if lacking else ""
    right = bool(commit) and git("rev-parse", "HEAD").startswith(commit)
    yield "the wheel knows its commit", "" if right else f"has {commit}"


def installed(work: Path) -> Points:
    """The wheel can be installed in a clean environment, and does there what a new user does."""
    if not WHEEL.exists():
        return
    programs, folder = work / "environment" / "bin", work / "elsewhere"
    folder.mkdir()
    subprocess.run([sys.executable, "-m", "venv", work / "environment"], check=True)
    begin = time.monotonic()
    _, fault = tried(programs / "python", "-m", "pip", "install", "--quiet", f"{WHEEL}[fenicsx]", cwd=folder)
    yield f"pip install {WHEEL.name}[fenicsx] in {time.monotonic() - begin:.0f} s", fault
    for words in () if fault else FIRST_STEPS:
        begin = time.monotonic()
        output, fault = tried(programs / "pairsim", *words.split(), cwd=folder)
        lines = output.splitlines()
        lacking = [line for line in lines if "/" in line and not (folder / line).exists()]
        point = f"pairsim {words} in {time.monotonic() - begin:.0f} s: {', '.join(lines)}"
        yield point, fault or (f"there is no {lacking[0]}" if lacking else "")


def main() -> int:
    form = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(prog="release", description=__doc__, formatter_class=form)
    parser.add_argument("--without-tests", action="store_true", help="leave scripts/test out")
    without_tests = parser.parse_args().without_tests
    failed = 0
    with tempfile.TemporaryDirectory(prefix="pairsim-release-") as folder:
        work = Path(folder)
        for point, fault in chain(tree(), results(), () if without_tests else tests(), archives(work), installed(work)):
            print(f"FAILED  {point}: {fault}" if fault else f"ok      {point}", flush=True)
            failed += bool(fault)
    if failed:
        print(f"{failed} points have failed", file=sys.stderr)
        return 1
    print(f"By hand: git tag -a v{__version__} -m 'pairsim {__version__}', push it, and upload what is in {DIST}.")
    return 0


if __name__ == "__main__":
    sys.exit(main())
