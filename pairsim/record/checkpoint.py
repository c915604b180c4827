"""checkpoint.npz: the state from which a run is resumed; a resumed run differs by Newton's tolerance at most.

The file contains arrays and one JSON text, no pickles. It is written under a temporary name and renamed, so that a
complete checkpoint exists at all times.
"""

from __future__ import annotations

import io
import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields, is_dataclass
from pathlib import Path
from types import UnionType
from typing import Any, cast, get_args, get_origin, get_type_hints

import numpy as np

from pairsim.cases.yaml_file import Content
from pairsim.record.folder import CHECKPOINT, write_bytes
from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import InputError
from pairsim.runtime.plain import Plain
from pairsim.solvers.goals import dU
from pairsim.solvers.transient.adaptation import RunAdaptation
from pairsim.solvers.transient.state import State

FORMAT = 8
OF_0_3_0 = 7  # the format of version 0.3.0, whose runs estimate errors of dU only
ARRAY = "array"
FREE = ("name", "time.end", "physical.end", "limits", "output")
"""Keys and groups of keys that may differ when a run is resumed."""


@dataclass(frozen=True)
class Checkpoint:
    """A run after an accepted step."""

    state: State
    case: dict[str, Plain]  # with all defaults, as plain data
    adaptation: RunAdaptation | None  # from which its cells follow; None if they are those of the case
    rows: int  # number of rows in series.csv at this step
    frames: int  # number of frames in fields.xdmf at this step
    wall: float  # wall time of the run so far [s]

    def save(self, folder: Path) -> None:
        """Write checkpoint.npz into a folder.

        Raises:
            OSError: It cannot be written; the old file is kept.
        """
        arrays: dict[str, Array] = {}
        entries = {"format": FORMAT, "checkpoint": _packed(self, arrays)}
        buffer = io.BytesIO()
        np.savez(buffer, allow_pickle=False, entries=np.array(json.dumps(entries)), **cast(Any, arrays))
        write_bytes(folder / CHECKPOINT, buffer.getvalue())


def _packed(value: Any, arrays: dict[str, Array]) -> Any:
    """The value as plain data, in which arrays are replaced by names under which they are added to `arrays`."""
    if isinstance(value, np.ndarray):
        arrays[name := f"array_{len(arrays)}"] = value
        return {ARRAY: name}
    if is_dataclass(value):
        return {each.name: _packed(getattr(value, each.name), arrays) for each in fields(value)}
    if isinstance(value, dict):
        return {name: _packed(each, arrays) for name, each in value.items()}
    return [_packed(each, arrays) for each in value] if isinstance(value, list | tuple) else value


def _unpacked(kind: Any, value: Any, arrays: Mapping[str, Array]) -> Any:
    """The value of type `kind`, such as a nested dataclass, from the plain data that `_packed` made of it."""
    if isinstance(value, dict) and ARRAY in value:
        return arrays[value[ARRAY]]
    if isinstance(kind, UnionType):
        return value if value is None else _unpacked(get_args(kind)[0], value, arrays)
    if is_dataclass(kind):
        kinds = get_type_hints(kind)
        return cast(Any, kind)(**{name: _unpacked(kinds[name], each, arrays) for name, each in value.items()})
    if (origin := get_origin(kind)) is dict:
        return {name: _unpacked(get_args(kind)[1], each, arrays) for name, each in value.items()}
    if origin in (list, tuple):
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
            entries = json.loads(str(stored["entries"]))
            if entries["format"] == OF_0_3_0:
                _upgrade(entries["checkpoint"]["state"])
            elif entries["format"] != FORMAT:
                raise ValueError(f"its format is {entries['format']}, not {FORMAT}")
            return _unpacked(Checkpoint, entries["checkpoint"], dict(stored))
    except Exception as error:  # a damaged or foreign file can raise almost anything
        allowed = f"must be a complete checkpoint of this version ({error}); run the case again with `overwrite`"
        raise InputError(str(path), "", None, allowed) from error


def _upgrade(state: dict[str, Any]) -> None:
    """Convert the state of a run of version 0.3.0 into the present format, in place.

    Raises:
        ValueError: The run estimates half-widths, but of dU alone; those of the other goals cannot begin midway.
    """
    errors = state["run_errors"]
    if state["error_history"] is not None or errors["interval"]["start"]:
        raise ValueError("it has half-widths of dU only")
    own = {name: errors[name] for name in ("steps", "interval", "largest")}
    state["run_errors"] = {"goals": {dU.name: own}, "lost": errors["lost"]}


def check_same(old: Content, new: Content, source: str) -> None:
    """Check that a resumed run solves the problem of its checkpoint.

    Args:
        old: The resolved case of the checkpoint, as plain data.
        new: That of the resumed run.
        source: The file that messages name.

    Raises:
        InputError: Keys that are not in `FREE` differ; gives both values of each.
    """
    if mistakes := list(_differences(old, new, source)):
        mistakes[-1].allowed += f"; a resumed run may change only {', '.join(FREE)}"
        raise InputError.of_all(mistakes)


def _differences(old: Content, new: Content, source: str, group: str = "") -> Iterator[InputError]:
    """Yield an error for each key that differs but must not; names of keys begin with `group`, such as "mesh."."""
    for key in dict.fromkeys((*old, *new)):
        name = group + key
        if name in FREE:
            continue
        before, after = old.get(key), new.get(key)
        if isinstance(before, Mapping) and isinstance(after, Mapping):
            yield from _differences(before, after, source, f"{name}.")
        elif before != after:
            allowed = f"must be {'left out' if before is None else repr(before)}, as when the run began"
            yield InputError(source, name, "nothing" if after is None else after, allowed)
