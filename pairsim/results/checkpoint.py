"""checkpoint.npz: the state of a run, from which it is resumed with the same results as without interruption.

The file contains arrays and one JSON text, no pickles. It is written under a temporary name and renamed, so that a
complete checkpoint exists at all times.
"""

from __future__ import annotations

import io
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pairsim.fem.geometry import Geometry, Outline, Reference
from pairsim.fem.six_node_mesh import SixNodeMesh
from pairsim.results.output import CHECKPOINT, RunFolder, write_bytes
from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import InputError
from pairsim.solvers.nonlinear.renewal import MatrixState, Place
from pairsim.solvers.stepping.history import Counts, Errors, History, State

FORMAT = 4
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
        state, history, reference = self.state, self.state.history, self.state.reference
        entries = {
            "format": FORMAT,
            "case": self.case,
            "gaps": self.gaps,
            "narrowest": self.narrowest,
            "rows": self.rows,
            "frames": self.frames,
            "wall": self.wall,
            "t": history.t,
            "t_y": history.t_y,
            "geometry": asdict(reference.geometry),
            "deformed": reference.deformed,
            "radii": [outline.radius for outline in reference.outlines],
            "soft": [mesh is not None for mesh in state.inside],
            "dt": state.dt,
            "U_m": state.U_m,
            "due": state.due,
            "counts": asdict(state.counts),
            "seconds": state.seconds,
        }
        arrays: dict[str, Any] = {"origin": self.origin, **_levels(history)}
        if state.errors is not None:
            entries |= {"t_errors": state.errors.t, "t_y_errors": state.errors.t_y}
            arrays |= {f"error_{name}": value for name, value in _levels(state.errors).items()}
            arrays |= {"error_imbalance": np.asarray(state.errors.imbalance), "error_dU": np.array(state.errors.dU)}
            arrays |= {"error_start": np.asarray(state.errors.start)}
        for i, (outline, nodes) in enumerate(zip(reference.outlines, reference.positions, strict=True)):
            arrays |= {f"angles_{i}": outline.angles, f"positions_{i}": nodes}
        for i, mesh in enumerate((state.mesh, *state.inside)):
            if mesh is not None:
                arrays |= {f"points_{i}": mesh.points, f"cells_{i}": mesh.cells}
        if (matrix := state.matrix_state) is not None:
            places = matrix.places[-1:] if matrix.places[0] is matrix.places[1] else matrix.places
            entries["memory"] = {"rate": matrix.rate, "relaxation": matrix.relaxation, "single": matrix.single}
            entries["places"] = [{"g": place.g, "U_m": place.U_m} for place in places]
            for i, place in enumerate(places):
                arrays |= {f"place_x_{i}": place.x}
                arrays |= {f"place_star_{i}": place.star} if place.star is not None else {}
        buffer = io.BytesIO()
        np.savez(buffer, allow_pickle=False, told=np.array(json.dumps(entries)), **arrays)
        write_bytes(folder.file(CHECKPOINT), buffer.getvalue())


def _levels(history: History) -> dict[str, Array]:
    """The arrays of a history by name."""
    levels = (("h", history.h), ("x", history.x), ("y", history.y))
    return {f"{name}_{k}": value for name, values in levels for k, value in enumerate(values)}


def _history(arrays: dict[str, Any], t: list[float], t_y: list[float]) -> History:
    """The history of arrays that were stored by these names."""
    h, x, y = ([arrays[f"{name}_{k}"] for k in range(len(times))] for name, times in (("h", t), ("x", t), ("y", t_y)))
    return History(t, h, x, y, t_y)


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
            return _checkpoint(entries, {name: stored[name] for name in stored.files})
    except Exception as error:  # a damaged or foreign file can raise almost anything
        allowed = f"must be a complete checkpoint of this version ({error}); run the case again with --overwrite"
        raise InputError(str(path), "", None, allowed) from error


def _checkpoint(entries: dict[str, Any], arrays: dict[str, Any]) -> Checkpoint:
    def mesh(i: int) -> SixNodeMesh:
        return SixNodeMesh(arrays[f"points_{i}"], arrays[f"cells_{i}"])

    count, geometry = len(entries["radii"]), entries["geometry"]
    reference = Reference(
        Geometry(tuple(geometry["betas"]), tuple(geometry["gaps"]), geometry["length"]),
        tuple(Outline(radius, arrays[f"angles_{i}"]) for i, radius in enumerate(entries["radii"])),
        tuple(arrays[f"positions_{i}"] for i in range(count)),
        entries["deformed"],
    )
    errors = None
    if "t_errors" in entries:
        stored = {name.removeprefix("error_"): array for name, array in arrays.items() if name.startswith("error_")}
        levels = vars(_history(stored, entries["t_errors"], entries["t_y_errors"]))
        errors = Errors(**levels, dU=list(stored["dU"]), imbalance=stored["imbalance"], start=stored.get("start", 0.0))
    matrix = None
    if "memory" in entries:
        places = [
            Place(arrays[f"place_x_{i}"], arrays.get(f"place_star_{i}"), **rest)
            for i, rest in enumerate(entries["places"])
        ]
        matrix = MatrixState((places[0], places[-1]), **entries["memory"])
    state = State(
        history=_history(arrays, entries["t"], entries["t_y"]),
        reference=reference,
        mesh=mesh(0),
        inside=tuple(mesh(i) if soft else None for i, soft in enumerate(entries["soft"], 1)),
        dt=entries["dt"],
        U_m=entries["U_m"],
        matrix_state=matrix,
        due=entries["due"],
        counts=Counts(**entries["counts"]),
        seconds=entries["seconds"],
        errors=errors,
    )
    gaps, (gap, arc) = tuple(entries["gaps"]), entries["narrowest"]
    return Checkpoint(
        state,
        {"start": "rest"} | entries["case"],  # the only start of earlier versions
        gaps,
        (gap, arc),
        arrays["origin"],
        entries["rows"],
        entries["frames"],
        entries["wall"],
    )


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
