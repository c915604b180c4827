"""Version of the package; setuptools reads it from this file."""

from __future__ import annotations

__version__ = "0.3.0"


def commit() -> str:
    """Commit of a release, abbreviated, which `git archive` writes into commit.txt; empty in a checkout."""
    from importlib.resources import files  # takes as long as everything else that `import pairsim` loads

    written = files("pairsim").joinpath("commit.txt").read_text(encoding="utf-8").strip()
    return "" if written.startswith("$") else written
