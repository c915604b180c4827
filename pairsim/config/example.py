"""Commented examples of every kind of file, which come with the package."""

from __future__ import annotations

import re
from importlib.resources import files
from pathlib import Path

from pairsim.runtime.errors import InputError


def write_example(kind: str, name: str, directory: Path) -> Path:
    """Write an example into NAME.yaml.

    Args:
        kind: The command that it is for.
        name: Name of the case, with or without the ending of the file.
        directory: Where to.

    Raises:
        InputError: The name cannot be that of a file and a folder, the file exists, or it cannot be written.
    """
    stem = name.removesuffix(".yaml")
    if not re.fullmatch(r"\w[\w.+-]{0,99}", stem):
        raise InputError(
            "pairsim init", "NAME", name, "must be letters, digits and . _ + -, without a folder before it"
        )
    path = directory / f"{stem}.yaml"
    text = files("pairsim.config").joinpath("examples", f"{kind}.yaml").read_text(encoding="utf-8")
    try:
        with path.open("x", encoding="utf-8") as file:
            file.write(text.format(name=stem, file=path.name))
    except FileExistsError:
        raise InputError(str(path), "NAME", None, "the file exists and is kept; give another name") from None
    except OSError as error:
        raise InputError(str(path), "NAME", None, f"cannot be written ({error.strerror})") from None
    return path
