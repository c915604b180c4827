"""What pairsim can compute of one case, a file a command. Every `COMMAND` in this folder is in `COMMANDS`."""

from __future__ import annotations

from importlib import import_module
from pkgutil import iter_modules
from typing import Any

from pairsim.commands.command import Command
from pairsim.results.columns import Column, declare

ORDER = ("run", "curve", "critical")
"""The commands that come first in lists; others follow by name."""


def _found() -> dict[str, Command[Any]]:
    modules = (import_module(f"{__name__}.{entry.name}") for entry in iter_modules(__path__))
    commands = {module.COMMAND.name: module.COMMAND for module in modules if hasattr(module, "COMMAND")}
    for command in commands.values():
        declare(each for each in command.columns if isinstance(each, Column))
    return {name: commands[name] for name in (*ORDER, *sorted(commands.keys() - set(ORDER)))}


COMMANDS = _found()
"""The commands by name."""


def own_files() -> tuple[str, ...]:
    """Every file that a command writes into a folder of results, but for single frames of fields."""
    from pairsim.results.output import files_of

    found = COMMANDS.values()
    return files_of(
        (name for each in found for name in each.tables), (name for each in found for name in each.captions)
    )


__all__ = ["COMMANDS", "Command", "own_files"]
