"""The folder of one run: its files, the time series, and the table that says what each column means.

Everything here runs on rank 0 only and needs neither DOLFINx nor MPI, so that results can be read anywhere. Text files
appear whole or not at all (`write_text`); rows of the series reach the operating system as they are computed.
"""

from __future__ import annotations

import csv
import json
import math
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np
import yaml
from numpy.typing import ArrayLike, NDArray

from pairsim.errors import InputError

SERIES, CHECKPOINT = "series.csv", "checkpoint.npz"
OWN_FILES = (
    "case.yaml",
    "run.json",
    SERIES,
    CHECKPOINT,
    "series.png",
    "fields.xdmf",
    "fields_last.xdmf",
    "fields.h5",
    "fields.png",
    "perturbation.png",
    "curve.csv",
    "equilibria.csv",
    "curve.png",
    "critical.csv",
    "critical.png",
)
"""Every file that pairsim writes into a run folder; `--overwrite` removes these and nothing else."""


def _part(path: Path) -> Path:
    """The temporary name under which `path` is written; fixed, so that what a killed run left behind is found again."""
    return path.with_name(f".{path.name}.part")


def write_text(path: Path, text: str) -> None:
    """Write a text file so that readers see the old or the new content, never a half of it."""
    write_bytes(path, text.encode())


def write_bytes(path: Path, content: bytes) -> None:
    """Write a file as `write_text` does."""
    part = _part(path)
    try:
        with part.open("wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        os.replace(part, path)
    except BaseException:
        part.unlink(missing_ok=True)
        raise


def plain(value: Any, where: str = "") -> Any:
    """Turn numpy numbers and arrays, paths and tuples into what YAML and JSON know.

    Args:
        value: Nested mappings, sequences and scalars.
        where: Dotted key of `value`, used in the message of an error.

    Raises:
        ValueError: A number is nan; the message names its key.
        TypeError: A value has no plain form.
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
    """The folder that one run writes to. Make it with `RunFolder.create`."""

    path: Path

    @classmethod
    def create(cls, path: Path | str, overwrite: bool = False) -> RunFolder:
        """Make the folder, or empty it of an earlier run's files.

        Args:
            path: Folder; parents are made as needed.
            overwrite: Remove the files of an earlier run (`OWN_FILES`). Files of other names stay untouched.

        Raises:
            InputError: `path` is a file, cannot be written, or is not empty and `overwrite` is not set.
        """
        folder = Path(path)

        def refuse(allowed: str) -> InputError:
            return InputError(file=str(path), key="-o", value=None, allowed=allowed)

        try:
            if folder.exists() and not folder.is_dir():
                raise refuse("is a file; give the name of a folder")
            if folder.is_dir() and any(folder.iterdir()) and not overwrite:
                raise refuse("the folder exists and is not empty; give another, or use --overwrite to replace the run")
            folder.mkdir(parents=True, exist_ok=True)
            old = [file for name in OWN_FILES for file in (folder / name, _part(folder / name))]
            for file in old:
                if file.is_dir() and not file.is_symlink():
                    raise refuse(f"{file.name} is a folder, where pairsim writes a file; give another folder")
            for file in old:
                file.unlink(missing_ok=True)
            if not os.access(folder, os.W_OK | os.X_OK):
                raise refuse("the folder cannot be written to; give another one")
        except OSError as error:
            raise refuse(f"cannot be used as a folder ({error.strerror or error}); give another one") from error
        return cls(folder)

    @classmethod
    def reopen(cls, path: Path | str) -> RunFolder:
        """The folder of an earlier run, with all that is in it.

        Raises:
            InputError: It cannot be written to.
        """
        if not os.access(path, os.W_OK | os.X_OK):
            raise InputError(str(path), "--resume", None, "the folder cannot be written to; give another one")
        return cls(Path(path))

    def file(self, name: str) -> Path:
        """Path of one of `OWN_FILES`; other names are refused, as `--overwrite` would not find them again."""
        if name not in OWN_FILES:
            raise ValueError(f"{name} is not in OWN_FILES: {', '.join(OWN_FILES)}")
        return self.path / name

    def write_yaml(self, name: str, content: Mapping[str, Any]) -> Path:
        """Write a mapping as YAML, keys in the given order. Raises ValueError at nan (infinity is valid YAML)."""
        path = self.file(name)
        write_text(path, yaml.safe_dump(plain(content), sort_keys=False, allow_unicode=True, default_flow_style=None))
        return path

    def write_json(self, name: str, content: Mapping[str, Any]) -> Path:
        """Write a mapping as JSON, keys in the given order. Raises ValueError at nan and infinity."""
        path = self.file(name)
        write_text(path, json.dumps(plain(content), indent=2, allow_nan=False, ensure_ascii=False) + "\n")
        return path


@dataclass(frozen=True)
class Column:
    """One column of series.csv: its name, the paper's symbol (TeX), what it means, its unit (TeX, "" without one)."""

    name: str
    symbol: str
    meaning: str
    unit: str


RATE = r"U_{av}/D_c"
TIME, VELOCITY, LENGTH, STRESS = r"D_c/U_{av}", r"U_{av}", r"D_c", r"\eta_0 U_{av}/D_c"
COLUMNS: tuple[Column, ...] = (
    Column("t", r"t", "time", TIME),
    Column("d", r"d", "distance between the facing surfaces of the pair on the axis", LENGTH),
    Column("d_i", r"d_i", "distance between the facing surfaces of particles i and i+1 on the axis", LENGTH),
    Column("U_L", r"U_L", "velocity of the leading (downstream) particle, the volume average of u_z", VELOCITY),
    Column("U_T", r"U_T", "velocity of the trailing (upstream) particle, the volume average of u_z", VELOCITY),
    Column("U_i", r"U_i", "velocity of particle i, counted from upstream, the volume average of u_z", VELOCITY),
    Column("dU", r"\Delta U", "relative velocity of the pair, U_L - U_T, positive if they separate", VELOCITY),
    Column(
        "dU_i", r"\Delta U_i", "relative velocity of neighbours, U_(i+1) - U_i, positive if they separate", VELOCITY
    ),
    Column("D_L", r"D_L", "Taylor parameter (L_z - L_r)/(L_z + L_r) of the leading particle", ""),
    Column("D_T", r"D_T", "Taylor parameter (L_z - L_r)/(L_z + L_r) of the trailing particle", ""),
    Column("D_i", r"D_i", "Taylor parameter (L_z - L_r)/(L_z + L_r) of particle i, counted from upstream", ""),
    Column("dp", r"\Delta p", "pressure drop over the length of the tube", STRESS),
    Column("dp_plus", r"\Delta p^+", "pressure drop in excess of that of the same tube without particles", STRESS),
    Column("dt", r"\Delta t", "size of the step that ends here", TIME),
    Column("newton", r"n", "Newton iterations of the step, or on the way from the point before", ""),
    Column("mesh", r"k", "remeshings before the step", ""),
    Column("meshes", r"k", "meshes made so far", ""),
    Column("slope", r"\mathrm{d}\Delta U/\mathrm{d}d", "slope of dU over d; at a zero, negative is stable", RATE),
    Column("slope_i", r"\mathrm{d}\Delta U_i/\mathrm{d}d", "slope of dU_i when all distances change together", RATE),
    Column("drift", r"\delta", "change of dU by the terms that a quasi-steady solution leaves out", VELOCITY),
    Column("drift_i", r"\delta_i", "change of dU_i by the terms that a quasi-steady solution leaves out", VELOCITY),
    *(
        Column(
            f"by_{name}{i}",
            rf"\partial\Delta U{s}/\partial {symbol}",
            f"derivative of dU{i} by {name} at fixed d",
            VELOCITY,
        )
        for name, symbol in (("Ca_e", "Ca_e"), ("De", r"\mathrm{De}"), ("beta", r"\beta"))
        for i, s in (("", ""), ("_i", "_i"))
    ),
    Column("Ca_e", "Ca_e", "elastic capillary number of the soft particles", ""),
    Column("De", r"\mathrm{De}", "Deborah number", ""),
    Column("d_cr", r"d_{cr}", "critical distance: the pair moves as one", LENGTH),
    Column("stable", "", "true: a pair that is displaced a little comes back", ""),
    Column("kind", "", "wanted, added; vanishes: a stable and an unstable zero meet; edge: d leaves the range", ""),
    Column("branch", "", "number of the line of critical distances", ""),
    Column("U", "U", "velocity of the pair", VELOCITY),
    Column("d_error", r"\epsilon_d", "error of d_cr by the mesh: mesh_error over slope", LENGTH),
    Column("mesh_error", r"\epsilon", "|dU - dU on a mesh with cells 2^0.5 times larger|", VELOCITY),
    Column("mesh_error_i", r"\epsilon_i", "|dU_i - dU_i on a mesh with cells 2^0.5 times larger|", VELOCITY),
    Column("wanted", "", "1 at a point that was asked for, 0 at one that was added", ""),
    Column(
        "m", r"m", "uniform source in the liquid's continuity that the time scheme needs; a measure of its error", ""
    ),
    Column("volume_error", r"\epsilon_V", "largest relative change of a particle's volume", ""),
    Column(
        "distortion", r"q", "smallest ratio of a liquid cell's current to its reference Jacobian; 0 is turned over", ""
    ),
)
"""What the columns of series.csv mean; `_i` stands for the number of a particle or gap. Docs and plot labels use it."""
HEALTH = ("dt", "newton", "mesh", "m", "volume_error", "distortion")
"""The columns that every series.csv has after those."""
POLYMER_HEALTH = ("c_max", "c_max_z", "c_max_r", "c_min", "s_jump")
"""The columns that follow in a viscoelastic liquid."""
CURVE_HEALTH = ("meshes", "m", "volume_error", "distortion")
"""The columns that every curve.csv ends with, before those of a viscoelastic liquid."""


def curve_columns(n: int, common: bool, mesh_error: bool, sensitivities: Sequence[str]) -> list[str]:
    """The columns that curve.csv begins with.

    Args:
        n: Number of particles.
        common: Whether there is a curve over one distance, which has slopes.
        mesh_error: Whether points were solved on a coarser mesh too.
        sensitivities: Parameters by which dU was differentiated.
    """
    gaps = [""] if n == 2 else [f"_{i}" for i in range(1, n)]
    names = ["drift", *(["mesh_error"] if mesh_error else []), *(["slope"] if common else [])]
    names += [f"by_{name}" for name in sensitivities]
    return [*series_columns(n)[1:], "newton", *(name + gap for name in names for gap in gaps), "wanted"]


CRITICAL_COLUMNS = (
    *("Ca_e", "De", "d_cr", "stable", "kind", "branch", "slope", "U", "D_L", "D_T", "dp", "dp_plus"),
    *("newton", "drift"),
)
"""The columns that critical.csv begins with."""


def column(name: str) -> Column:
    """The entry of `COLUMNS` for a column, with the number filled in: `column("D_3").symbol == "D_{3}"`.

    Raises:
        KeyError: No entry of the table has that name.
    """
    table = {entry.name: entry for entry in COLUMNS}
    if name in table and not name.endswith("_i"):
        return table[name]
    match = re.fullmatch(r"(\w+)_(\d+)", name)
    entry = table.get(f"{match[1]}_i") if match else None
    if match is None or entry is None:
        raise KeyError(name)
    return Column(name, entry.symbol.replace("_i", f"_{{{match[2]}}}"), entry.meaning, entry.unit)


def series_columns(n: int) -> list[str]:
    """The columns that series.csv of a scene with `n` particles begins with, in their order."""
    if n < 0:
        raise ValueError(f"number of particles is {n}")
    if n == 2:
        return ["t", "d", "U_L", "U_T", "dU", "D_L", "D_T", "dp", "dp_plus"]
    gaps, particles = range(1, n), range(1, n + 1)
    names = ["t", *(f"d_{i}" for i in gaps), *(f"U_{i}" for i in particles)]
    return [*names, *(f"dU_{i}" for i in gaps), *(f"D_{i}" for i in particles), "dp", "dp_plus"]


def named_row(t: float, d: ArrayLike, U: ArrayLike, D: ArrayLike, dp: float, dp_plus: float) -> dict[str, float]:
    """One row of the series under the names of `series_columns`.

    Args:
        t: Time.
        d: The N-1 gaps, from upstream (empty below two particles).
        U: The N velocities, from upstream.
        D: The N Taylor parameters, from upstream.
        dp: Pressure drop over the length of the tube.
        dp_plus: The part of it that the particles cause.

    Raises:
        ValueError: The lengths of `d`, `U` and `D` do not fit each other.
    """
    gaps, velocities, shapes = (np.atleast_1d(np.asarray(a, dtype=float)) for a in (d, U, D))
    n = velocities.size
    if shapes.size != n or gaps.size != max(n - 1, 0):
        raise ValueError(f"{n} velocities, {shapes.size} Taylor parameters and {gaps.size} gaps do not fit each other")
    differences = np.diff(velocities)
    if n == 2:  # trailing = 1 = upstream; the header names the leading one first
        middle = [*gaps, *velocities[::-1], *differences, *shapes[::-1]]
    else:
        middle = [*gaps, *velocities, *differences, *shapes]
    values = (float(value) for value in (t, *middle, dp, dp_plus))
    return dict(zip(series_columns(n), values, strict=True))


class SeriesWriter:
    """series.csv, row by row; every row is handed to the operating system at once.

    Args:
        path: File, replaced if it exists.
        columns: Header; each row must have exactly these.
        keep: Go on after so many rows of the existing file instead.

    Raises:
        InputError: The existing file has other columns or fewer rows.
    """

    def __init__(self, path: Path | str, columns: list[str], keep: int | None = None) -> None:
        if len(set(columns)) != len(columns):
            raise ValueError(f"a column is named twice: {columns}")
        self.path, self.columns, self.rows = Path(path), tuple(columns), keep or 0
        if keep is not None:
            self._cut(keep)
        self._file = self.path.open("w" if keep is None else "a", encoding="utf-8", newline="")
        if keep is None:
            self._line(",".join(self.columns))

    def _cut(self, keep: int) -> None:
        """Leave so many rows of the file."""
        series = read_series(self.path)
        if tuple(series) != self.columns or len(series[self.columns[0]]) < keep:
            allowed = f"{keep} rows or more with the columns {','.join(self.columns)}, as the checkpoint has it"
            raise InputError(str(self.path), "", None, allowed)
        lines = self.path.read_text(encoding="utf-8").splitlines(keepends=True)
        write_text(self.path, "".join(lines[: keep + 1]))

    def _line(self, text: str) -> None:
        self._file.write(text + "\n")
        self._file.flush()

    def row(self, values: Mapping[str, float]) -> None:
        """Append a row; numbers are written so that reading them gives the same double.

        Raises:
            ValueError: A column is missing or unknown, or a value is nan or infinite; nothing is written then.
        """
        if missing := [name for name in self.columns if name not in values]:
            raise ValueError(f"{self.path.name}: no value for {', '.join(missing)}")
        if unknown := [name for name in values if name not in self.columns]:
            raise ValueError(f"{self.path.name}: no column {', '.join(unknown)}")
        numbers = [float(values[name]) for name in self.columns]
        for name, number in zip(self.columns, numbers, strict=True):
            if not math.isfinite(number):
                raise ValueError(f"{self.path.name}: {name} is {number}")
        self._line(",".join(map(repr, numbers)))
        self.rows += 1

    def close(self) -> None:
        """Close the file (harmless when repeated)."""
        self._file.close()

    def __enter__(self) -> SeriesWriter:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def write_table(path: Path, columns: Sequence[str], rows: Sequence[Mapping[str, Any]]) -> None:
    """Write a whole CSV table at once; numbers so that reading them gives the same double.

    Raises:
        ValueError: A number is nan or infinite; the old file stays.
    """
    lines = [",".join(columns)]
    for row in rows:
        entries = [row[name] for name in columns]
        for name, entry in zip(columns, entries, strict=True):
            if isinstance(entry, float) and not math.isfinite(entry):
                raise ValueError(f"{path.name}: {name} is {entry}")
        lines.append(",".join(entry if isinstance(entry, str) else repr(entry) for entry in entries))
    write_text(path, "\n".join(lines) + "\n")


def read_series(path: Path | str) -> dict[str, NDArray[np.float64]]:
    """Read series.csv, also while it is being written: a last line that is not finished is left out.

    Returns:
        One array a column, in the order of the header.

    Raises:
        InputError: The file is missing, has no header, or a line other than the last is broken.
    """
    file = Path(path)
    try:
        text = file.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(str(file), "", None, f"cannot be read ({error}); give a series that pairsim wrote") from error
    lines = list(csv.reader(text[: text.rfind("\n") + 1].splitlines()))
    if not lines or not all(lines[0]):
        raise InputError(str(file), "", None, "has no header; give a series that pairsim wrote")
    header, rows = lines[0], []
    for number, line in enumerate(lines[1:], start=2):
        try:
            rows.append([float(value) for value in line])
        except ValueError:
            raise InputError(str(file), f"line {number}", ",".join(line), "numbers separated by commas") from None
        if len(line) != len(header):
            raise InputError(str(file), f"line {number}", ",".join(line), f"{len(header)} values, as in the header")
    table = np.array(rows, dtype=float).reshape(len(rows), len(header))
    return {name: table[:, i].copy() for i, name in enumerate(header)}
