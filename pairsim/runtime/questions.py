"""The names of all questions, which are those of the files in `pairsim/questions`; no file is imported for them."""

from __future__ import annotations

from pathlib import Path

FOLDER = Path(__file__).parents[1] / "questions"
"""Where the questions are, each in the file of its name."""
ORDER = ("run", "curve", "critical")
"""The questions that come first in lists; others follow by name."""
NAMES = (*ORDER, *sorted({file.stem for file in FOLDER.glob("[a-z]*.py")} - {*ORDER}))
