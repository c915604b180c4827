"""The kinds of cases that there are: whoever lists them says so here, as nothing below knows their files."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

LISTS: list[Callable[[], Sequence[type]]] = []
"""Functions that return the models of cases, whose files they import."""
EXAMPLES = Path(__file__).with_name("examples")
"""The commented examples of `pairsim init`, each in the file of its kind."""


def has_example(kind: str) -> bool:
    """Whether there is a commented example of a kind of file."""
    return (EXAMPLES / f"{kind}.yaml").is_file()
