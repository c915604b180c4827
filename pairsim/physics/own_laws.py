"""Laws of users: classes in their own files, or in installed packages.

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
from os import PathLike
from pathlib import Path
from types import ModuleType

from pairsim.physics.material import NAMED, Material
from pairsim.runtime.errors import InputError

OWN = "PAIRSIM_LAWS"
"""Environment variable with the files, separated as those of PATH are."""
GROUPS = "pairsim.liquids", "pairsim.solids"
OPTION = "--laws"
_SHIPPED = __name__.rpartition(".")[0]
MAIN = "__main__"
DECLARED = f"{_SHIPPED}.declared"
"""The module that lists the laws for case files, once it is imported."""


def files() -> list[Path]:
    """The files with users' laws that have been named."""
    return [Path(each) for each in os.environ.get(OWN, "").split(os.pathsep) if each]


def name_file(file: Path) -> None:
    """Name a file with laws, which this process and its children load.

    Raises:
        InputError: There is no such file.
    """
    if not file.is_file():
        raise InputError(OPTION, "", str(file), "must be a Python file with laws, which exists")
    if (whole := file.resolve()) not in files():
        os.environ[OWN] = os.pathsep.join(map(str, [*files(), whole]))


def own_laws() -> Iterator[type[Material]]:
    """The laws in the named files, in the installed packages, and in modules that a program has imported.

    Raises:
        InputError: A file or an entry point cannot be imported, or a law does not declare all that it must.
    """
    from importlib.metadata import entry_points

    for file in files():
        load_file(file)
    named = entry_points()  # once, as this reads the metadata of every installed package
    for entry in (entry for group in GROUPS for entry in named.select(group=group)):
        try:
            entry.load()
        except Exception as error:
            raise InputError(f"entry point {entry.name} of {entry.group}", "", entry.value, _why(error)) from error
    for law in NAMED:
        if law.__module__ != MAIN and (own := file_of(law)) is not None:
            _check(law, own)
            name_file(own)
            yield law


def _check(law: type[Material], file: Path) -> None:
    if "__dataclass_fields__" not in vars(law):
        raise InputError(str(file), law.__name__, None, "must be decorated with @dataclass(frozen=True)")
    for said in ("label", "words"):
        if not isinstance(getattr(law, said, None), str):
            raise InputError(str(file), f"{law.__name__}.{said}", None, "must be a text")


def load_file(file: Path) -> list[type[Material]]:
    """The laws in a file.

    Raises:
        InputError: The file cannot be imported, or has no law.
    """
    module = _imported(file.resolve()).__name__
    laws = [law for law in NAMED if law.__module__ == module]
    if not laws:
        raise InputError(str(file), "", None, "must have a law: a class with a name (docs/tutorials/own-law.md)")
    return laws


def _imported(file: Path) -> ModuleType:
    """The module of a file; found in `sys.modules`, so that its classes can be sent to other processes."""
    name = f"pairsim_laws_{hashlib.sha256(os.fsencode(file)).hexdigest()[:8]}_{file.stem}"
    if name not in sys.modules:
        loader = SourceFileLoader(name, str(file))
        spec = spec_from_loader(name, loader)
        assert spec is not None
        module = sys.modules[name] = module_from_spec(spec)
        try:
            loader.exec_module(module)
        except Exception as error:
            del sys.modules[name]  # so that the file is read again once it has been corrected
            line = next((f.lineno for f in reversed(inspect.trace()) if f.filename == str(file)), None)
            line = error.lineno if isinstance(error, SyntaxError) else line
            raise InputError(str(file), "", None, _why(error), line=line) from error
    return sys.modules[name]


def _why(error: Exception) -> str:
    return f"cannot be imported: {type(error).__name__}: {error}"


def file_of(law: type[Material]) -> Path | None:
    """The file of a user's law; None for a law of the program.

    Raises:
        InputError: The class is in no file, as in an interactive session.
    """
    if law.__module__.startswith(f"{_SHIPPED}."):
        return None
    try:
        if law.__module__ != MAIN:  # a file that other processes would run again
            return Path(inspect.getfile(law)).resolve()
    except (OSError, TypeError):
        pass
    raise InputError(law.__name__, "", None, "must be defined in a file of its own, which processes can import")


def digest_of(file: Path) -> str:
    """Hash of the source of a law, as hexadecimal digits."""
    return hashlib.sha256(file.read_bytes()).hexdigest()


def use_laws(*laws: str | PathLike[str] | type[Material]) -> None:
    """Make your own laws known, before the first case is read; processes of sweeps know them, too.

    Args:
        laws: Files as for `--laws`, or classes that are defined in a file.

    Raises:
        InputError: A file or class cannot be used, or a case has been read already.
    """
    for each in laws:
        file = file_of(each) if isinstance(each, type) else Path(each)
        if file is None:  # a law of the program
            continue
        name_file(file)
        for law in [each] if isinstance(each, type) else load_file(file):
            if DECLARED in sys.modules and law.name not in sys.modules[DECLARED].LAWS:
                allowed = "must be known before the first case is read: import it, or call pairsim.use_laws, earlier"
                raise InputError("pairsim.use_laws", law.__name__, None, allowed)
