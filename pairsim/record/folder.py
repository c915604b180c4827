"""A folder of results: the names of its files, how they are written, and what its run.json says."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from pairsim.cases.yaml_file import yaml_text
from pairsim.runtime.errors import Argument, InputError
from pairsim.runtime.locks import LOCK_FILES
from pairsim.runtime.plain import Plain
from pairsim.runtime.text import printable

SERIES, WAY, CHECKPOINT, REPORT = "series.csv", "way.csv", "checkpoint.npz", "report.html"
FIELDS_XDMF, FRAMES = "fields.xdmf", "fields"
"""The index of the frames of fields, and the folder with a file for each."""
PICTURES = ("fields", "runs", "curves")
EXTRA = ("velocity_extra", "tau_zz_extra", "pressure_extra")
FIELD_NAMES = ("velocity", "streamlines", "tr_c", "N1", "tau_zz", "pressure", *EXTRA)
PICTURE_ENDINGS = ("png", "pdf", "svg", "gif")
OWN_FILES = (
    "case.yaml",
    "run.json",
    CHECKPOINT,
    FIELDS_XDMF,
    REPORT,
    *(f"{stem}.{end}" for stem in (*PICTURES, *(f"field-{n}" for n in FIELD_NAMES)) for end in PICTURE_ENDINGS),
)
"""Files that any command may write into a folder of results, beside `frame_files` and its own tables and pictures."""


def part_of(path: Path) -> Path:
    """The temporary name under which `path` is written; fixed, so that what a killed run left behind is found again."""
    return path.with_name(f".{path.name}.part")


def frame_files(folder: Path) -> list[tuple[int, Path]]:
    """The files of single frames of fields with their numbers, also those that a killed run left unfinished."""
    found = [
        (re.fullmatch(r"(\d{4,})\.h5|\.(\d{4,})\.h5\.part", file.name), file) for file in folder.glob(f"{FRAMES}/*")
    ]
    return sorted((int(match[1] or match[2]), file) for match, file in found if match)


def write_text(path: Path, text: str) -> None:
    """Write a text file as `write_bytes` does."""
    write_bytes(path, printable(text).encode())


def write_file(path: Path, content: str | bytes, key: str = "") -> None:
    """Write a file; its folder is made if needed.

    Args:
        path: The file.
        content: Its text or bytes.
        key: What an error names as the key, such as the option that gave the path.

    Raises:
        InputError: It cannot be written.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_bytes(path, printable(content).encode() if isinstance(content, str) else content)
    except OSError as error:
        raise InputError(str(path), key, None, f"must be a writable file ({error.strerror or error})") from None


def write_bytes(path: Path, content: bytes) -> None:
    """Write a file under a temporary name and rename it: however the process ends, readers see old or new content.

    The file is not flushed to the disk, which would take 5 to 10 ms: this guards against the end of the process, not
    against a crash of the machine.

    Raises:
        OSError: It cannot be written; the old file is kept, and the error names it.
    """
    part = part_of(path)
    with naming(path):
        try:
            part.write_bytes(content)
            part.replace(path)
        except BaseException:
            with suppress(OSError):  # on a file system that is read-only
                part.unlink(missing_ok=True)
            raise


@contextmanager
def naming(path: Path) -> Iterator[None]:
    """Context that adds the name of a file to any OSError; errors in writing to an open file come without it."""
    try:
        yield
    except OSError as error:
        error.filename = str(path)
        raise


def plain(value: Any, where: str = "") -> Any:
    """Convert numpy numbers and arrays, paths and tuples, also nested ones, to types that YAML and JSON have.

    Error messages name the value by `where`, its dotted key.

    Raises:
        ValueError: A number is nan; the message names its key.
        TypeError: A value is of a type that cannot be converted.
    """
    import numpy as np  # not at the top: its threads must begin while SIGTERM is blocked, see runtime/fenicsx

    if isinstance(value, np.floating):  # `tolist` leaves those with more digits than a float unchanged
        return plain(float(value), where)
    if isinstance(value, np.ndarray | np.generic):
        numbers = value.astype(float) if isinstance(value, np.ndarray) and value.dtype == np.longdouble else value
        return plain(numbers.tolist(), where)
    if isinstance(value, Mapping):
        return {str(key): plain(item, f"{where}.{key}" if where else str(key)) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item, f"{where}[{i}]") for i, item in enumerate(value)]
    if isinstance(value, float):
        if math.isnan(value):
            raise ValueError(f"{where or 'value'}: must be a number, not nan")
        return value + 0.0  # turns -0.0 into 0.0, lest one case have two hashes
    if isinstance(value, Path | str):
        return printable(str(value))
    if value is None or isinstance(value, bool | int):
        return value
    allowed = "must be a number, text, true or false, or a list or group of these"
    raise TypeError(f"{where or 'value'}: {allowed}, not a {type(value).__name__}")


def prepare_folder(folder: Path, overwrite: bool = False, files: Iterable[str] = OWN_FILES) -> None:
    """Make a folder for results, and its parents; if it exists, remove the files of earlier results from it.

    Args:
        folder: The folder.
        overwrite: Whether earlier results in it may be removed.
        files: Names of the files to remove; all others are kept.

    Raises:
        InputError: It cannot be used as a folder, or it is not empty and `overwrite` is not set.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if all(file.name in LOCK_FILES for file in folder.iterdir()):
            return
        if not overwrite:
            allowed = "must be a new or empty folder; `overwrite` replaces the results in it"
            if (folder / CHECKPOINT).is_file():
                allowed += f"; pairsim run --resume {folder} continues its run"
            raise InputError(str(folder), Argument("folder"), None, allowed)
        old = [file for name in files for file in (folder / name, part_of(folder / name))]
        for file in (*old, *(file for _, file in frame_files(folder))):
            file.unlink(missing_ok=True)
        with suppress(OSError):  # not there, or not empty
            (folder / FRAMES).rmdir()
    except OSError as error:
        why = "is a file" if folder.is_file() else str(error)
        raise InputError(str(folder), Argument("folder"), None, f"must be a usable folder ({why})") from error


def write_yaml(path: Path, content: Mapping[str, object]) -> None:
    """Write a mapping as YAML, keys in the given order.

    Raises:
        ValueError: A number is nan (infinity is valid YAML).
        OSError: The file cannot be written.
    """
    write_text(path, yaml_text(plain(content)))


def write_json(path: Path, content: Mapping[str, object]) -> None:
    """Write a mapping as JSON, keys in the given order.

    Raises:
        ValueError: A number is nan or infinite.
        OSError: The file cannot be written.
    """
    write_text(path, json.dumps(plain(content), indent=2, allow_nan=False, ensure_ascii=False) + "\n")


MARKS = {"study.csv": "study", "sweep.json": "sweep"}
"""The files by which the folder of a command for many cases is recognised."""
MOST_FOLDERS = 5  # most folders that a message names


def kind_of(directory: Path) -> str:
    """The command that wrote a folder.

    Raises:
        InputError: It is not a folder of results.
    """
    if not directory.exists():
        raise InputError(str(directory), "", None, "no such folder")
    if not directory.is_dir():
        raise InputError(
            str(directory), "", None, "must be a folder of results, such as runs/quickstart, but is a file"
        )
    for name, kind in MARKS.items():
        if (directory / name).is_file():
            return kind
    if isinstance(named := read_json(directory / "run.json").get("kind"), str):
        return named
    content = "has no run.json, sweep.json or study.csv" if any(directory.iterdir()) else "is empty"
    inside = sorted({path.parent.name for path in directory.glob("*/run.json")})
    more = ", ..." if len(inside) > MOST_FOLDERS else ""
    hint = f"; there are results in the folders in it: {', '.join(inside[:MOST_FOLDERS])}{more}" if inside else ""
    raise InputError(str(directory), "", None, f"must be a folder of results, but {content}{hint}")


def read_json(path: Path) -> dict[str, Plain]:
    """The entries of a JSON file by name; empty if it is missing or invalid."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return content if isinstance(content, dict) else {}
