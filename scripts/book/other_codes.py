"""Other codes with which studies compare, if they are installed (scripts/studies/codes/README.md says how)."""

from __future__ import annotations

import os
import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from book.computing import ROOT
from book.study import Unavailable

PYOOMPH = ("PYOOMPH", ROOT / "peer" / "bin" / "python")
"""The environment variable with the path of pyoomph's Python, and the default path."""
OF_PYOOMPH = ROOT / "scripts" / "studies" / "codes"
"""The folder of the scripts that solve by pyoomph."""


def installed(code: str, place: tuple[str, Path]) -> Path:
    """The path of a code.

    Args:
        code: Its name.
        place: The environment variable with its path, and the default path.

    Raises:
        Unavailable: It is not there.
    """
    variable, usual = place
    found = Path(os.environ.get(variable, usual))
    if not found.exists():
        raise Unavailable(f"needs {code}, {variable}={found}; see scripts/studies/codes/README.md")
    return found


def by_pyoomph(script: str, words: Sequence[object], python: Path | None = None) -> pd.DataFrame:
    """The table that a script of `OF_PYOOMPH` writes.

    Args:
        script: Its name.
        words: Its options, without that of the table.
        python: The Python of pyoomph; by default the one that is installed.

    Raises:
        Unavailable: pyoomph is not there.
        CalledProcessError: The script has failed; the error has what it wrote.
    """
    python = python or installed("pyoomph", PYOOMPH)
    with tempfile.TemporaryDirectory() as folder:
        table = Path(folder) / "table.csv"
        command = [python, OF_PYOOMPH / script, *words, "--output", table]
        subprocess.run([*map(str, command)], check=True, capture_output=True, cwd=folder, text=True)
        return pd.read_csv(table)
