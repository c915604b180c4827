"""Registry of the kinds of cases: packages that this one may not import register functions that list them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pairsim.cases.case import SceneCase

LISTS: list[Callable[[], Sequence[type[SceneCase]]]] = []
"""Functions that return the models of cases, whose files they import."""
EXAMPLES = Path(__file__).with_name("examples")
"""The commented examples of `pairsim init`, each in the file of its kind."""


def with_key(name: str) -> list[str]:
    """The kinds of cases that have a key of this name at their top."""
    return [model.kind for models in LISTS for model in models() if name in model.model_fields]


def has_example(kind: str) -> bool:
    """Whether there is a commented example of a kind of file."""
    return (EXAMPLES / f"{kind}.yaml").is_file()
