"""checkpoint.npz: the state of a run, from which it is resumed with the same results as without interruption.

The file contains arrays and one JSON text, no pickles. It is written under a temporary name and renamed, so that a
complete checkpoint exists at all times.
"""

from __future__ import annotations

import io
import json
from collections.abc import Mapping
from dataclasses import dataclass, fields, is_dataclass, replace
from pathlib import Path
from types import UnionType
from typing import Any, cast, get_args, get_origin, get_type_hints

import numpy as np

from pairsim.results.output import CHECKPOINT, RunFolder, write_bytes
from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import InputError
from pairsim.solvers.stepping.history import State

FORMAT = 5
ARRAY = "array"
FREE = ("name", "time.end", "physical.end", "limits", "output")
"""Keys and groups of keys that may be changed when a run is resumed."""


@dataclass(frozen=True)
class Checkpoint:
    """A run after an accepted step.

    Attributes:
        state: The state of the time stepping.
        case: The case with all defaults, as plain data.
        gaps: Distances between the particles [D_c].
        narrowest: Gap and length of the adjacent arcs [D_c] when their ratio was smallest.
        origin: Positions h of the material at t = 0 [D_c], shape (n_h,).
        rows: Number of rows in series.csv at this step.
        frames: Number of frames in fields.xdmf at this step.
        wall: Wall time of the run so far [s].
    """

    state: State
    case: dict[str, Any]
    gaps: tuple[float, ...]
    narrowest: tuple[float, float]
    origin: Array
    rows: int
    frames: int
    wall: float

    def save(self, folder: RunFolder) -> None:
        """Write checkpoint.npz.

        Raises:
            OSError: It cannot be written; the old file is kept.
        """
        arrays: dict[int, Array] = {}
        entries = {"format": FORMAT, "checkpoint": _packed(self, arrays)}
        named = {f"array_{number}": array for number, array in enumerate(arrays.values())}
        buffer = io.BytesIO()
        np.savez(buffer, allow_pickle=False, told=np.array(json.dumps(entries)), **cast(Any, named))
        write_bytes(folder.file(CHECKPOINT), buffer.getvalue())


def _packed(value: Any, arrays: dict[int, Array]) -> Any:
    """Plain data, in which an array is the number of its place in `arrays`, where each is put once, by its identity."""
    if isinstance(value, np.ndarray):
        arrays.setdefault(id(value), value)
        return {ARRAY: list(arrays).index(id(value))}
    if is_dataclass(value):
        return {each.name: _packed(getattr(value, each.name), arrays) for each in fields(value)}
    return [_packed(each, arrays) for each in value] if isinstance(value, list | tuple) else value


def _unpacked(kind: Any, value: Any, arrays: Mapping[str, Array]) -> Any:
    """The value of a type, such as a dataclass of others, from its plain data."""
    if isinstance(value, dict) and ARRAY in value:
        return arrays[f"array_{value[ARRAY]}"]
    if isinstance(kind, UnionType):
        return value if value is None else _unpacked(get_args(kind)[0], value, arrays)
    if is_dataclass(kind):
        kinds = get_type_hints(kind)
        return cast(Any, kind)(**{name: _unpacked(kinds[name], each, arrays) for name, each in value.items()})
    if (origin := get_origin(kind)) in (list, tuple):
        return origin(_unpacked(get_args(kind)[0], each, arrays) for each in value)
    return value


def load(folder: Path) -> Checkpoint | None:
    """Read the checkpoint of a folder, None if there is none.

    Raises:
        InputError: The file is damaged, or of another format.
    """
    path = folder / CHECKPOINT
    if not path.exists():
        return None
    try:
        with np.load(path, allow_pickle=False) as stored:
            entries = json.loads(str(stored["told"]))
            if entries["format"] != FORMAT:
                raise ValueError(f"its format is {entries['format']}, not {FORMAT}")
            found: Checkpoint = _unpacked(Checkpoint, entries["checkpoint"], dict(stored))
    except Exception as error:  # a damaged or foreign file can raise almost anything
        allowed = f"must be a complete checkpoint of this version ({error}); run the case again with --overwrite"
        raise InputError(str(path), "", None, allowed) from error
    if (matrix := found.state.matrix_state) is not None and matrix.places[0].x is matrix.places[1].x:
        matrix = replace(matrix, places=(matrix.places[0],) * 2)  # one place, as it was
        found = replace(found, state=replace(found.state, matrix_state=matrix))
    return found


def check_same(old: Mapping[str, Any], new: Mapping[str, Any], source: str, group: str = "") -> None:
    """Check that a resumed run solves the problem of its checkpoint.

    Args:
        old: The resolved case of the checkpoint, as plain data.
        new: The resolved case of the resumed run, as plain data.
        source: Name of the checkpoint file, for messages.
        group: Prefix of the keys, such as "mesh.".

    Raises:
        InputError: A key that is not in `FREE` differs; gives both values.
    """
    for key in dict.fromkeys((*old, *new)):
        name = group + key
        if name in FREE:
            continue
        before, after = old.get(key), new.get(key)
        if isinstance(before, Mapping) and isinstance(after, Mapping):
            check_same(before, after, source, f"{name}.")
        elif before != after:
            allowed = "left out" if before is None else repr(before)
            allowed = f"must be {allowed}, as when the run began; a resumed run may change only {', '.join(FREE)}"
            raise InputError(source, name, "nothing" if after is None else after, allowed)
