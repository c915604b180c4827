"""The kinds of cases that there are: whoever lists them says so here, as nothing below knows their files."""

from __future__ import annotations

from collections.abc import Callable, Sequence

LISTS: list[Callable[[], Sequence[type]]] = []
"""Functions that return the models of cases, whose files they import."""
