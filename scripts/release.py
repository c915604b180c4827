"""Checklist of a release: checks the tree, builds sdist and wheel into dist/, tries the wheel. Publishes nothing.

usage: scripts/release [--without-tests]

1. no file has been changed or added since the last commit
2. the version is new: no tag v<version>; CHANGELOG.md has a section of it with a date, below an empty [Unreleased];
   CITATION.cff has version and date
3. scripts/test passes (--without-tests leaves it out)
4. sdist and wheel are built from the commit, by way of git archive, and have what they must have
5. the wheel is installed with [fenicsx] in a clean environment in a temporary folder, and in another folder
   pairsim --version, init, run, plot and report work

Prints every point with ok or FAILED, and what is left to do by hand. Exit codes: 0 all is well, 1 a point has failed.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
import tarfile
import tempfile
import time
import zipfile
from pathlib import Path

import yaml

from pairsim.config.example import shipped_examples
from pairsim.runtime.child_process import clean_environment
from pairsim.runtime.version import __version__

ROOT = Path(__file__).resolve().parent.parent
DIST = ROOT / "dist"
IN_WHEEL = ("py.typed", "commit.txt", "api/templates/report.html.j2", "config/examples/run.yaml")
IN_SDIST = (
    *("README.md", "CHANGELOG.md", "CITATION.cff", "LICENSE", "Dockerfile", "environment.yml", "pixi.toml"),
    *("configs/sweep.yaml", "docs/index.md", "scripts/pairsim", "tests/conftest.py"),
)
FIRST_STEPS = (
    ("--version",),
    ("init", "beads"),
    ("run", "beads.yaml", "--set", "time.end=0.05", "-q"),
    ("plot", "runs/beads"),
    ("report", "runs/beads"),
)
"""Commands that must work where the wheel is installed; the names are those of the files they make."""


class Checklist:
    """Prints points as they are checked, and remembers those that failed."""

    def __init__(self) -> None:
        self.failed: list[str] = []

    def check(self, point: str, fault: str) -> None:
        """Print a point; it has failed if there is a fault."""
        print(f"FAILED  {point}: {fault}" if fault else f"ok      {point}", flush=True)
        if fault:
            self.failed.append(point)


def git(*words: str) -> str:
    """Output of git in the project."""
    return subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True, check=True).stdout.strip()


def section(changelog: str, title: str) -> tuple[str, str] | None:
    """Rest of the title line and text of a section of CHANGELOG.md, None if there is none."""
    found = re.search(rf"^## \[{re.escape(title)}\](.*)\n((?:(?!## ).*\n?)*)", changelog, re.MULTILINE)
    return (found[1].strip(" -"), found[2].strip()) if found else None


def check_texts(points: Checklist) -> None:
    """Check version and date in CHANGELOG.md and CITATION.cff, and that the version is new."""
    exists = git("tag", "--list", f"v{__version__}")
    points.check(f"version {__version__} is new", f"there is a tag {exists}" if exists else "")
    changelog = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    date, text = section(changelog, __version__) or ("", "")
    dated = re.fullmatch(r"\d{4}-\d\d-\d\d", date) and text
    points.check("CHANGELOG.md describes it", "" if dated else f"needs ## [{__version__}] - YYYY-MM-DD and what is new")
    unreleased = section(changelog, "Unreleased")
    fault = "the section is missing" if unreleased is None else "entries are left" if unreleased[1] else ""
    points.check("CHANGELOG.md has an empty [Unreleased]", fault)
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    cited = (str(citation.get("version")), str(citation.get("date-released")))
    wrong = "" if cited == (__version__, date) else f"has {cited[0]} of {cited[1]}, not {__version__} of {date}"
    points.check("CITATION.cff has version and date", wrong)


def build(points: Checklist, work: Path) -> Path | None:
    """Build sdist and wheel from the last commit; returns the wheel, or None if that fails."""
    source = work / "source"
    source.mkdir()
    archive = work / "source.tar"
    git("archive", "--output", str(archive), "HEAD")
    with tarfile.open(archive) as packed:
        packed.extractall(source, filter="tar")
    shutil.rmtree(DIST, ignore_errors=True)
    command = [sys.executable, "-m", "build", "--outdir", str(DIST), str(source)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    built = sorted(DIST.glob("*"))
    fault = "" if done.returncode == 0 else (done.stdout + done.stderr).strip().splitlines()[-1]
    points.check(f"built {', '.join(path.name for path in built)}", fault)
    if fault:
        return None
    sdist, wheel = DIST / f"pairsim-{__version__}.tar.gz", DIST / f"pairsim-{__version__}-py3-none-any.whl"
    with tarfile.open(sdist) as packed:
        names = {name.partition("/")[2] for name in packed.getnames()}
    lacking = [name for name in IN_SDIST if name not in names]
    points.check("the sdist has examples, tests and documentation", f"not {', '.join(lacking)}" if lacking else "")
    with zipfile.ZipFile(wheel) as zipped:
        wanted = [*IN_WHEEL, *(f"configs/{name}.yaml" for name in shipped_examples())]
        lacking = [name for name in wanted if f"pairsim/{name}" not in zipped.namelist()]
        commit = zipped.read("pairsim/commit.txt").decode().strip()
    points.check("the wheel has its examples", f"not {', '.join(lacking)}" if lacking else "")
    right = bool(commit) and git("rev-parse", "HEAD").startswith(commit)
    points.check("the wheel knows its commit", "" if right else f"has {commit}")
    return wheel


def try_wheel(points: Checklist, wheel: Path, work: Path) -> None:
    """Install the wheel in a clean environment, and do what a new user does."""
    home, folder = work / "environment", work / "elsewhere"
    folder.mkdir()
    environment = {name: value for name, value in clean_environment().items() if name != "PYTHONPATH"}
    begin = time.monotonic()
    subprocess.run([sys.executable, "-m", "venv", str(home)], check=True)
    install = [str(home / "bin" / "python"), "-m", "pip", "install", "--quiet", f"{wheel}[fenicsx]"]
    done = subprocess.run(install, env=environment, capture_output=True, text=True, check=False)
    fault = "" if done.returncode == 0 else done.stderr.strip().splitlines()[-1]
    points.check(f"pip install {wheel.name}[fenicsx] in {time.monotonic() - begin:.0f} s", fault)
    for words in FIRST_STEPS if not fault else ():
        begin = time.monotonic()
        command = [str(home / "bin" / "pairsim"), *words]
        done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
        said = done.stdout.strip().splitlines() or [""]
        fault = "" if done.returncode == 0 else f"exit code {done.returncode}: {done.stderr.strip()[-300:]}"
        files = [line for line in said if "/" in line and not (folder / line).exists()]
        fault = fault or (f"there is no {files[0]}" if files else "")
        seconds = time.monotonic() - begin
        points.check(f"pairsim {' '.join(words)} in {seconds:.0f} s: {', '.join(said)}", fault)


def main() -> int:
    """Returns the exit code."""
    form = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(prog="release", description=__doc__, formatter_class=form)
    parser.add_argument("--without-tests", action="store_true", help="leave scripts/test out")
    without_tests = parser.parse_args().without_tests
    points = Checklist()
    changed = git("status", "--porcelain").splitlines()
    points.check("nothing is uncommitted", f"{len(changed)} files" if changed else "")
    check_texts(points)
    if not without_tests:
        passed = subprocess.run([str(ROOT / "scripts" / "test")], env=os.environ, check=False).returncode == 0
        points.check("scripts/test passes", "" if passed else "see above")
    with tempfile.TemporaryDirectory(prefix="pairsim-release-") as work:
        if (wheel := build(points, Path(work))) is not None:
            try_wheel(points, wheel, Path(work))
    if points.failed:
        print(f"{len(points.failed)} points have failed", file=sys.stderr)
        return 1
    print(f"By hand: git tag -a v{__version__} -m 'pairsim {__version__}', push it, and upload what is in {DIST}.")
    return 0


if __name__ == "__main__":
    sys.exit(main())
