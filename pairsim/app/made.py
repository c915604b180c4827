"""A command made from a function, whose parameters are its arguments and options."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import typer
from typer.core import TyperCommand

from pairsim.runtime.errors import InputError


class Command(TyperCommand):
    """A command whose errors name its options in place of the arguments of functions."""

    def invoke(self, ctx: Any) -> Any:
        try:
            return super().invoke(ctx)
        except InputError as error:
            named = ((str(each.name), name) for each in self.params for name in each.opts[:1])
            error.call_arguments({argument: name for argument, name in named if name.startswith("-")})
            raise


def made(name: str, function: Callable[..., Any], words: str, examples: str) -> TyperCommand:
    """The command of a function, with its help and the examples at the end of this."""
    app = typer.Typer(rich_markup_mode="rich", pretty_exceptions_enable=False, add_completion=False)
    app.command(name, cls=Command, help=words, epilog=examples)(function)
    command = typer.main.get_command(app)
    assert isinstance(command, TyperCommand)
    return command
