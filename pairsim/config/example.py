"""The example files that come with the package: a commented one of each kind, and those of `configs`."""

from __future__ import annotations

import re
from collections.abc import Callable
from importlib.resources import files
from pathlib import Path

from pairsim.runtime.errors import InputError


def write_example(kind: str, name: str, directory: Path) -> Path:
    """Write a commented example to `<name>.yaml`.

    Args:
        kind: The command that reads the file: run, curve, critical or sweep.
        name: Name of the case, with or without `.yaml`.
        directory: Folder of the new file.

    Returns:
        Path of the file.

    Raises:
        InputError: The name is not allowed, the file exists, or it cannot be written.
    """
    stem = name.removesuffix(".yaml")
    text = files("pairsim.config").joinpath("examples", f"{kind}.yaml").read_text(encoding="utf-8")
    return _write(directory, stem, lambda path: text.format(name=stem, file=path.name))


def shipped_examples() -> list[str]:
    """Names of the files of `configs`, without `.yaml`, sorted."""
    return sorted(
        entry.name.removesuffix(".yaml")
        for entry in files("pairsim").joinpath("configs").iterdir()
        if entry.name.endswith(".yaml")
    )


def copy_example(example: str, name: str, directory: Path) -> Path:
    """Copy a file of `configs` to `<name>.yaml`.

    Args:
        example: One of `shipped_examples`, with or without `.yaml`.
        name: Name of the copy, with or without `.yaml`.
        directory: Folder of the copy.

    Returns:
        Path of the copy.

    Raises:
        InputError: There is no such example, the name is not allowed, the file exists, or it cannot be written.
    """
    wanted = example.removesuffix(".yaml")
    if wanted not in shipped_examples():
        raise InputError("pairsim init", "--example", example, f"must be one of {', '.join(shipped_examples())}")
    text = files("pairsim").joinpath("configs", f"{wanted}.yaml").read_text(encoding="utf-8")
    return _write(directory, name.removesuffix(".yaml"), lambda _: text)


def _write(directory: Path, stem: str, text: Callable[[Path], str]) -> Path:
    """Write a new file; `text` makes its content from its path."""
    if not re.fullmatch(r"\w[\w.+-]{0,99}", stem):
        allowed = "must be a name of letters, digits and . _ + -, without a folder"
        raise InputError("pairsim init", "NAME", stem, allowed)
    path = directory / f"{stem}.yaml"
    try:
        with path.open("x", encoding="utf-8") as file:
            file.write(text(path))
    except FileExistsError:
        raise InputError(str(path), "NAME", None, "must be another name: the file exists") from None
    except OSError as error:
        if path.is_file():  # the disk is full
            path.unlink()
        raise InputError(str(path), "NAME", None, f"must be a writable file ({error.strerror})") from None
    return path
