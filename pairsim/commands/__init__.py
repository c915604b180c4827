"""What pairsim can compute of one case, a file a command. Every `COMMAND` in this folder is in `COMMANDS`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from importlib import import_module
from pkgutil import iter_modules
from typing import Any

from pairsim.commands.command import Command
from pairsim.results.columns import Column, declare

ORDER = ("run", "curve", "critical")
"""The commands that come first in lists; others follow by name."""


class _Commands(Mapping[str, Command[Any]]):
    """The commands by name, which is that of their file; the file is imported when its command is asked for."""

    def __init__(self) -> None:
        found = {entry.name for entry in iter_modules(__path__)} - {"command"}
        self._names = (*ORDER, *sorted(found - set(ORDER)))

    def __getitem__(self, name: str) -> Command[Any]:
        if name not in self._names:
            raise KeyError(name)
        command: Command[Any] = import_module(f"{__name__}.{name}").COMMAND
        declare(each for each in command.columns if isinstance(each, Column))
        return command

    def __contains__(self, name: object) -> bool:
        return name in self._names

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)


COMMANDS = _Commands()
"""The commands by name."""


def own_files() -> tuple[str, ...]:
    """Every file that a command writes into a folder of results, but for single frames of fields."""
    from pairsim.results.output import files_of

    found = COMMANDS.values()
    return files_of(
        (name for each in found for name in each.tables), (name for each in found for name in each.captions)
    )


__all__ = ["COMMANDS", "Command", "own_files"]
