"""Version of the package; setuptools reads it from this file."""

from __future__ import annotations

import subprocess
from importlib.resources import files
from pathlib import Path

__version__ = "0.2.0"

PATIENCE = 10.0  # time allowed for git [s]


def commit() -> str:
    """Commit from which the package comes, abbreviated; empty if unknown.

    A release has it in commit.txt, where `git archive` puts it. In a checkout git is asked, and `+` is appended if a
    file of the package has been changed since.
    """
    written = files("pairsim").joinpath("commit.txt").read_text(encoding="utf-8").strip()
    if not written.startswith("$"):
        return written
    package = Path(__file__).resolve().parents[1]
    if not (package.parent / ".git").exists():
        return ""
    head = _git(package, "rev-parse", "--short", "HEAD")
    return head + ("+" if head and _git(package, "status", "--porcelain", "--untracked-files=no", "--", ".") else "")


def _git(folder: Path, *words: str) -> str:
    try:
        done = subprocess.run(
            ["git", *words], cwd=folder, capture_output=True, text=True, timeout=PATIENCE, check=False
        )
    except (OSError, subprocess.SubprocessError):
        return ""
    return done.stdout.strip() if done.returncode == 0 else ""
