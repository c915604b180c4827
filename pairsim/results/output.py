"""Read and write a folder of results: text files, tables, and series.csv row by row.

Everything here imports neither DOLFINx nor MPI: results can be read on any machine.
Text files are replaced atomically (`write_text`); rows of series.csv are flushed as they are computed.
"""

from __future__ import annotations

import json
import math
import os
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from operator import itemgetter
from pathlib import Path
from typing import Any, BinaryIO, Self

import numpy as np
from numpy.typing import NDArray

from pairsim.config.yaml_file import yaml_text
from pairsim.runtime.errors import InputError
from pairsim.runtime.locks import LOCK_FILES

FORMAT = 1
"""Format number of a folder of results, in run.json. Earlier folders without the number have the same tables."""
SERIES, WAY, CHECKPOINT, REPORT = "series.csv", "way.csv", "checkpoint.npz", "report.html"
FIELDS_XDMF, FIELDS_LAST, FIELDS_H5 = "fields.xdmf", "fields_last.xdmf", "fields.h5"
FRAMES = "fields"
"""Folder with a file for each frame of fields, while a command is at work."""
PICTURES = ("fields", "perturbation", "runs", "curves")
EXTRA = ("velocity_extra", "tau_zz_extra", "pressure_extra")
FIELD_NAMES = ("velocity", "streamlines", "tr_c", "N1", "tau_zz", "pressure", *EXTRA)
PICTURE_ENDINGS = ("png", "pdf", "svg", "gif", "mp4")
OWN_FILES = (
    "case.yaml",
    "run.json",
    CHECKPOINT,
    FIELDS_XDMF,
    FIELDS_LAST,
    FIELDS_H5,
    REPORT,
    *(f"{stem}.{end}" for stem in (*PICTURES, *(f"field-{n}" for n in FIELD_NAMES)) for end in PICTURE_ENDINGS),
)
"""Files of all commands in a folder of results, but for `frame_files`, and for the tables and pictures of a command."""


def files_of(tables: Iterable[str], pictures: Iterable[str]) -> tuple[str, ...]:
    """All files in folders of commands with these tables and pictures; `--overwrite` removes only these."""
    drawn = (f"{stem}.{end}" for stem in pictures for end in PICTURE_ENDINGS)
    return tuple(dict.fromkeys((*OWN_FILES, *(f"{name}.csv" for name in tables), *drawn)))


def make_folder(path: Path) -> None:
    """Make a folder for pictures and the like, where it is not there yet.

    Raises:
        InputError: It cannot be used.
    """
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(str(path), "-o", None, f"cannot be used as a folder ({error.strerror})") from error


def part_of(path: Path) -> Path:
    """The temporary name under which `path` is written; fixed, so that what a killed run left behind is found again."""
    return path.with_name(f".{path.name}.part")


def frame_files(folder: Path) -> list[tuple[int, Path]]:
    """The files of single frames of fields with their numbers, also those that a killed run left unfinished."""
    found = [
        (re.fullmatch(r"(\d{6,})\.h5|\.(\d{6,})\.h5\.part", file.name), file) for file in folder.glob(f"{FRAMES}/*")
    ]
    return sorted((int(match[1] or match[2]), file) for match, file in found if match)


def write_text(path: Path, text: str) -> None:
    """Write a text file atomically: readers see either the old or the new content.

    Raises:
        OSError: It cannot be written; the old file is kept.
    """
    write_bytes(path, text.encode())


def write_bytes(path: Path, content: bytes) -> None:
    """Write a file as `write_text` does."""
    with replaced(path) as file:
        file.write(content)


@contextmanager
def replaced(path: Path) -> Iterator[BinaryIO]:
    """Context with a new file that replaces `path` at its end, as `write_text` does.

    Raises:
        OSError: It cannot be written; the old file is kept.
    """
    part = part_of(path)
    try:
        with part.open("wb") as file:
            yield file
            file.flush()
            os.fsync(file.fileno())
        os.replace(part, path)
    except BaseException:
        with suppress(OSError):  # on a file system that is read-only
            part.unlink(missing_ok=True)
        raise


def plain(value: Any, where: str = "") -> Any:
    """Convert numpy numbers and arrays, paths and tuples to types that YAML and JSON have.

    Args:
        value: Nested mappings, sequences and scalars.
        where: Dotted key of `value`, for error messages.

    Raises:
        ValueError: A number is nan; the message names its key.
        TypeError: A value is of a type that cannot be converted.
    """
    if isinstance(value, np.ndarray | np.generic):
        return plain(value.tolist(), where)
    if isinstance(value, Mapping):
        return {str(key): plain(item, f"{where}.{key}" if where else str(key)) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item, f"{where}[{i}]") for i, item in enumerate(value)]
    if isinstance(value, float) and math.isnan(value):
        raise ValueError(f"{where or 'value'} is nan and would be written to a file")
    if isinstance(value, Path):
        return str(value)
    if value is None or isinstance(value, bool | int | float | str):
        return value
    raise TypeError(f"{where or 'value'}: cannot write a {type(value).__name__}")


@dataclass(frozen=True)
class RunFolder:
    """A folder for the results of one case; made with `RunFolder.create` or `RunFolder.reopen`."""

    path: Path
    files: Sequence[str] = OWN_FILES

    @classmethod
    def create(cls, path: Path | str, overwrite: bool = False, files: Sequence[str] = OWN_FILES) -> RunFolder:
        """Create the folder, or remove the files of earlier results from it.

        Args:
            path: Folder; created with its parents if needed.
            overwrite: Whether existing results (`files`, `frame_files`) are removed; other files are kept.
            files: Names of the files that pairsim writes into folders.

        Raises:
            InputError: `path` is a file or not writable, or it is not empty and `overwrite` is not set.
        """
        folder = Path(path)

        def refuse(allowed: str) -> InputError:
            return InputError(file=str(path), key="-o", value=None, allowed=allowed)

        try:
            if folder.exists() and not folder.is_dir():
                raise refuse("must be a folder, but is a file")
            present = [file for file in folder.iterdir() if file.name not in LOCK_FILES] if folder.is_dir() else []
            if present and not overwrite:
                raise refuse("must be a new or empty folder, unless --overwrite replaces the results in it")
            folder.mkdir(parents=True, exist_ok=True)
            old = [file for name in files for file in (folder / name, part_of(folder / name))]
            for file in old:
                if file.is_dir() and not file.is_symlink():
                    raise refuse(f"must be another folder: {file.name} in it is a folder, where pairsim writes a file")
            if (folder / FRAMES).exists() and not (folder / FRAMES).is_dir():
                raise refuse(f"must be another folder: {FRAMES} in it is a file, where pairsim makes a folder")
            for file in (*old, *(file for _, file in frame_files(folder))):
                file.unlink(missing_ok=True)
            with suppress(OSError):  # not there, or not empty
                (folder / FRAMES).rmdir()
            if not os.access(folder, os.W_OK | os.X_OK):
                raise refuse("must be a folder with write permission")
        except OSError as error:
            raise refuse(f"must be a folder that can be used ({error.strerror or error})") from error
        return cls(folder, files)

    @classmethod
    def reopen(cls, path: Path | str, files: Sequence[str] = OWN_FILES) -> RunFolder:
        """Open an existing folder and keep its files.

        Raises:
            InputError: It is not writable.
        """
        if not os.access(path, os.W_OK | os.X_OK):
            raise InputError(str(path), "--resume", None, "must be a folder with write permission")
        return cls(Path(path), files)

    def file(self, name: str) -> Path:
        """Path of one of `files`; other names are refused, as `--overwrite` would not find them again."""
        if name not in self.files:
            raise ValueError(f"{name} is not a file of pairsim: {', '.join(self.files)}")
        return self.path / name

    def write_yaml(self, name: str, content: Mapping[str, Any]) -> Path:
        """Write a mapping as YAML, keys in the given order.

        Returns:
            Path of the file.

        Raises:
            ValueError: A number is nan (infinity is valid YAML).
            OSError: The file cannot be written.
        """
        path = self.file(name)
        write_text(path, yaml_text(plain(content)))
        return path

    def write_json(self, name: str, content: Mapping[str, Any]) -> Path:
        """Write a mapping as JSON, keys in the given order.

        Returns:
            Path of the file.

        Raises:
            ValueError: A number is nan or infinite.
            OSError: The file cannot be written.
        """
        path = self.file(name)
        write_text(path, _json(content))
        return path

    def overwrite_json(self, name: str, content: Mapping[str, Any]) -> bool:
        """Overwrite a JSON file in place, within the disk space that it has: on a full disk, where `write_json` fails.

        Returns:
            Whether it has enough space; otherwise the old content is kept.

        Raises:
            ValueError: A number is nan or infinite.
            OSError: The file cannot be written.
        """
        path, text = self.file(name), _json(content).encode()
        if not path.is_file() or len(text) > 512 * path.stat().st_blocks:
            return False
        with path.open("r+b") as file:
            file.write(text)
            file.truncate()
        return True


def _json(content: Mapping[str, Any]) -> str:
    return json.dumps(plain(content), indent=2, allow_nan=False, ensure_ascii=False) + "\n"


class SeriesWriter:
    """Writes a table of numbers row by row, as series.csv; each row is flushed.

    Args:
        path: File, replaced if it exists.
        columns: Names of the columns.
        keep: Append to the existing file after this number of its rows. None: replace the file.
        unknown: Columns whose values may be unknown, which is written as nan.

    Raises:
        InputError: The existing file has other columns or fewer rows.
    """

    def __init__(
        self, path: Path | str, columns: Sequence[str], keep: int | None = None, unknown: Sequence[str] = ()
    ) -> None:
        self.path, self.columns, self.rows, self.unknown = Path(path), tuple(columns), keep or 0, unknown
        if keep is not None:
            self._cut(keep)
        self._file = self.path.open("w" if keep is None else "a", encoding="utf-8", newline="")
        if keep is None:
            self._line(",".join(self.columns))

    def _cut(self, keep: int) -> None:
        """Keep the first rows of the file and remove the others."""
        series = read_series(self.path)
        if tuple(series) != self.columns or len(series[self.columns[0]]) < keep:
            allowed = f"must have at least {keep} rows with the columns {','.join(self.columns)}, to fit the checkpoint"
            raise InputError(str(self.path), "", None, allowed)
        lines = self.path.read_text(encoding="utf-8").splitlines(keepends=True)
        write_text(self.path, "".join(lines[: keep + 1]))

    def _line(self, text: str) -> None:
        self._file.write(text + "\n")
        self._file.flush()

    def row(self, values: Mapping[str, float]) -> None:
        """Append a row, as `table_line` makes it of numbers."""
        self._line(table_line(self.columns, {name: float(value) for name, value in values.items()}, self.unknown))
        self.rows += 1

    def close(self) -> None:
        """Close the file; may be called more than once."""
        self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def table_line(columns: Sequence[str], row: Mapping[str, Any], unknown: Sequence[str] = ()) -> str:
    """A row of a CSV table as text; numbers are written with full precision.

    Args:
        columns: Names of the columns.
        row: Values by column; those of other columns are left out.
        unknown: Columns whose values may be nan.

    Raises:
        ValueError: A column has no value, or a number is nan or infinite.
    """
    if missing := [name for name in columns if name not in row]:
        raise ValueError(f"no value for {', '.join(missing)}")
    entries = {name: row[name] for name in columns}
    for name, entry in entries.items():
        if isinstance(entry, float) and not math.isfinite(entry) and (math.isinf(entry) or name not in unknown):
            raise ValueError(f"{name} is {entry}")
    return ",".join(entry if isinstance(entry, str) else repr(entry) for entry in entries.values())


def write_table(
    path: Path, columns: Sequence[str], rows: Iterable[Mapping[str, Any] | str], unknown: Sequence[str] = ()
) -> None:
    """Write a CSV table atomically.

    Args:
        path: The file.
        columns: Names of the columns.
        rows: Values by column, or the text of `table_line`.
        unknown: Columns whose values may be unknown, which is written as nan.

    Raises:
        ValueError: As for `table_line`; the old file is kept.
        OSError: The file cannot be written; the old file is kept.
    """
    lines = [row if isinstance(row, str) else table_line(columns, row, unknown) for row in rows]
    write_text(path, "\n".join([",".join(columns), *lines]) + "\n")


class TableWriter:
    """A CSV table that is written as a whole, as `write_table` does, and again with each further row.

    Args:
        path: The file.
        columns: Names of the columns.
        rows: Values by column.
        ascending: Whether rows are kept in ascending order of the first column.
        unknown: Columns whose values may be unknown, which is written as nan.
    """

    def __init__(
        self,
        path: Path,
        columns: Sequence[str],
        rows: Iterable[Mapping[str, Any]] = (),
        ascending: bool = False,
        unknown: Sequence[str] = (),
    ) -> None:
        self.path, self.columns, self.ascending, self.unknown = path, columns, ascending, unknown
        self._lines = [(row[columns[0]], table_line(columns, row, unknown)) for row in rows]
        self._write()

    def row(self, values: Mapping[str, Any]) -> None:
        """Add a row."""
        self._lines.append((values[self.columns[0]], table_line(self.columns, values, self.unknown)))
        if self.ascending:
            self._lines.sort(key=itemgetter(0))
        self._write()

    def _write(self) -> None:
        write_table(self.path, self.columns, (line for _, line in self._lines))

    def close(self) -> None:
        """Nothing is left to be done."""


def read_series(path: Path | str) -> dict[str, NDArray[np.float64]]:
    """Read a table of numbers, also while it is being written: an incomplete last line is skipped.

    Returns:
        An array of shape (rows,) for each column, in the order of the header.

    Raises:
        InputError: The file is missing, has no header, or has an invalid line.
    """
    file = Path(path)
    try:
        text = file.read_text(encoding="utf-8")
        header, *lines = text[: text.rfind("\n") + 1].splitlines() or [""]
        names = header.split(",")
        table = np.loadtxt(lines, delimiter=",", comments=None, ndmin=2) if lines else np.zeros((0, len(names)))
        if not all(names) or table.shape[1] != len(names):
            raise ValueError(f"{table.shape[1]} values below the columns {header}")
    except (OSError, ValueError) as error:
        allowed = f"must be a readable table of pairsim: names, and numbers below them, separated by commas ({error})"
        raise InputError(str(file), "", None, allowed) from error
    return {name: values.copy() for name, values in zip(names, table.T, strict=True)}
