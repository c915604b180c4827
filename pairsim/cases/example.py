"""The commented example of each kind of file, as `pairsim init` writes it."""

from __future__ import annotations

from pathlib import Path

from pairsim.cases.kinds_of_cases import EXAMPLES
from pairsim.cases.values import NAME_WORDS, is_name
from pairsim.runtime.errors import InputError


def write_example(kind: str, name: str, directory: Path) -> Path:
    """Write the commented example of a kind of file ("sweep" or the name of a question), and return its path.

    Raises:
        InputError: The name is not allowed, the file exists, or it cannot be written.
    """
    stem = name.removesuffix(".yaml")
    if not is_name(stem):
        raise InputError("pairsim init", "NAME", stem, f"must be {NAME_WORDS}")
    path = directory / f"{stem}.yaml"
    text = (EXAMPLES / f"{kind}.yaml").read_text(encoding="utf-8")
    try:
        with path.open("x", encoding="utf-8") as file:
            file.write(text.format(name=stem, file=path.name))
    except FileExistsError:
        raise InputError(str(path), "NAME", None, "must be another name: the file exists") from None
    except OSError as error:
        raise InputError(str(path), "NAME", None, f"must be a writable file ({error.strerror})") from None
    return path
