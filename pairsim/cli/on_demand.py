"""Commands that are imported when they are used: the list of commands needs their names and a line each."""

from __future__ import annotations

import ast
from collections.abc import Callable
from functools import cached_property
from importlib import resources
from typing import Any

import typer
from typer.core import TyperCommand
from typer.main import get_command


class OnDemand(TyperCommand):
    """A command that is made when it is used.

    Args:
        module: Its module, whose description begins with "`pairsim NAME`: what it computes".
        make: Makes an application of this command alone.
    """

    def __init__(self, module: str, make: Callable[[], typer.Typer]) -> None:
        package, _, file = module.rpartition(".")
        source = resources.files(package).joinpath(f"{file}.py").read_text(encoding="utf-8")
        title, _, words = (ast.get_docstring(ast.parse(source)) or "").partition("\n")[0].partition(": ")
        super().__init__(title.strip("`").removeprefix("pairsim "), help=f"Compute {words}", rich_markup_mode="rich")
        self._make = make

    @cached_property
    def whole(self) -> Any:
        """The command with its arguments and options."""
        return get_command(self._make())

    def make_context(self, *arguments: Any, **more: Any) -> Any:
        return self.whole.make_context(*arguments, **more)
