"""A command made of a function, whose parameters are its arguments and options."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import typer
from typer.core import TyperCommand


def made(name: str, function: Callable[..., Any], words: str, examples: str) -> TyperCommand:
    """A command with its help and the examples at the end of it."""
    app = typer.Typer(rich_markup_mode="rich", pretty_exceptions_enable=False, add_completion=False)
    app.command(name, help=words, epilog=examples)(function)
    command = typer.main.get_command(app)
    assert isinstance(command, TyperCommand)
    return command
