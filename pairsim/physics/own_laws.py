"""Laws that users bring: classes in files of their own, or in installed packages.

`--laws FILE` and `pairsim.use_laws` put files into the environment variable PAIRSIM_LAWS, which child processes
inherit; packages name laws as entry points in the groups `pairsim.liquids` and `pairsim.solids`. A case file
alone never executes code.
"""

from __future__ import annotations

import hashlib
import inspect
import os
import sys
from collections.abc import Iterator
from importlib.machinery import SourceFileLoader
from importlib.util import module_from_spec, spec_from_loader
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

from pairsim.runtime.errors import InputError

if TYPE_CHECKING:
    from pairsim.physics.material import Material

OWN = "PAIRSIM_LAWS"
"""Environment variable with the files, separated as those of PATH are."""
GROUPS = "pairsim.liquids", "pairsim.solids"
OPTION = "--laws"
_SHIPPED = __name__.rpartition(".")[0]


def files() -> list[Path]:
    """The files that were named."""
    return [Path(each) for each in os.environ.get(OWN, "").split(os.pathsep) if each]


def name_file(file: Path) -> None:
    """Add a file to those that are loaded, in this process and its children.

    Raises:
        InputError: There is no such file.
    """
    if not file.is_file():
        raise InputError(OPTION, "", str(file), "must be a Python file with laws, which exists")
    if (whole := file.resolve()) not in files():
        os.environ[OWN] = os.pathsep.join(map(str, [*files(), whole]))


def load_all() -> Iterator[type[Material]]:
    """The laws in the named files and the installed packages.

    Raises:
        InputError: A file or an entry point cannot be imported, or a file has no law.
    """
    for file in files():
        yield from load_file(file)
    from importlib.metadata import entry_points

    for entry in (entry for group in GROUPS for entry in entry_points(group=group)):
        try:
            law = entry.load()
        except Exception as error:
            raise InputError(f"entry point {entry.name} of {entry.group}", "", entry.value, _why(error)) from error
        yield law


def load_file(file: Path) -> list[type[Material]]:
    """The laws in a file.

    Raises:
        InputError: It cannot be imported, or has none.
    """
    laws = list(classes_in(_imported(file.resolve())))
    if not laws:
        raise InputError(str(file), "", None, "must have a law: a class with a name (docs/tutorials/own-law.md)")
    return laws


def classes_in(module: ModuleType) -> Iterator[type[Material]]:
    """The laws that a module defines: classes that have a name of a law."""
    for each in list(vars(module).values()):
        if isinstance(each, type) and each.__module__ == module.__name__ and isinstance(vars(each).get("name"), str):
            yield each


def _imported(file: Path) -> ModuleType:
    """The module of a file; found in `sys.modules`, so that its classes can be sent to other processes."""
    name = f"pairsim_laws_{hashlib.sha256(str(file).encode()).hexdigest()[:8]}_{file.stem}"
    if name not in sys.modules:
        loader = SourceFileLoader(name, str(file))
        spec = spec_from_loader(name, loader)
        assert spec is not None
        module = sys.modules[name] = module_from_spec(spec)
        try:
            loader.exec_module(module)
        except InputError:
            raise
        except Exception as error:
            line = next((f.lineno for f in reversed(inspect.trace()) if f.filename == str(file)), None)
            line = error.lineno if isinstance(error, SyntaxError) else line
            raise InputError(str(file), "", None, _why(error), line=line) from error
    return sys.modules[name]


def _why(error: Exception) -> str:
    return f"cannot be imported: {type(error).__name__}: {error}"


def file_of(law: type[Material]) -> Path | None:
    """The file of a law of a user's own; None for those that ship.

    Raises:
        InputError: The class is in no file, as in an interactive session.
    """
    if law.__module__.startswith(f"{_SHIPPED}."):
        return None
    try:
        if law.__module__ != "__main__":  # which other processes would run again
            return Path(inspect.getfile(law)).resolve()
    except (OSError, TypeError):
        pass
    raise InputError(law.__name__, "", None, "must be defined in a file of its own, which processes can import")


def digest_of(file: Path) -> str:
    """Hash of the source of a law."""
    return hashlib.sha256(file.read_bytes()).hexdigest()
