"""checkpoint.npz: what the next step of a run depends on, so that a stopped run goes on as if it had not been stopped.

The file holds plain arrays and one text in JSON, no pickles; it is written aside and renamed, so that a whole one is
there at every moment.
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
from pairsim.solvers.history import Counts, History, State
from pairsim.solvers.matrix_state import MatrixState, Place

FORMAT = 3
FREE = ("name", "time.end", "physical.end", "limits", "output")
"""Keys and groups of keys that may change when a run is resumed."""


@dataclass(frozen=True)
class Checkpoint:
    """A run after an accepted step.

    Attributes:
        state: The march.
        case: The resolved case.
        gaps: Distances between the particles.
        narrowest: The gap that was shortest against the arcs beside it, and their length.
        origin: Positions of the material at t = 0.
        rows, frames: Rows of series.csv and frames of fields.xdmf that belong to it.
        wall: Seconds that the run took so far.
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
        """Write checkpoint.npz. Raises OSError where the disk is full; the old file stays then."""
        state, history, reference = self.state, self.state.history, self.state.reference
        told = {
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
        arrays: dict[str, Any] = {"origin": self.origin}
        for name, values in (("h", history.h), ("x", history.x), ("y", history.y)):
            arrays |= {f"{name}_{k}": value for k, value in enumerate(values)}
        for i, (outline, nodes) in enumerate(zip(reference.outlines, reference.positions, strict=True)):
            arrays |= {f"angles_{i}": outline.angles, f"positions_{i}": nodes}
        for i, mesh in enumerate((state.mesh, *state.inside)):
            if mesh is not None:
                arrays |= {f"points_{i}": mesh.points, f"cells_{i}": mesh.cells}
        if (matrix := state.matrix_state) is not None:
            places = matrix.places[-1:] if matrix.places[0] is matrix.places[1] else matrix.places
            told["memory"] = {"rate": matrix.rate, "relaxation": matrix.relaxation}
            told["places"] = [{"g": place.g, "U_m": place.U_m} for place in places]
            for i, place in enumerate(places):
                arrays |= {f"place_x_{i}": place.x}
                arrays |= {f"place_star_{i}": place.star} if place.star is not None else {}
        buffer = io.BytesIO()
        np.savez(buffer, allow_pickle=False, told=np.array(json.dumps(told)), **arrays)
        write_bytes(folder.file(CHECKPOINT), buffer.getvalue())


def load(folder: Path) -> Checkpoint | None:
    """The checkpoint of a folder, None if it has none.

    Raises:
        InputError: It is torn, or no checkpoint of this format.
    """
    path = folder / CHECKPOINT
    if not path.exists():
        return None
    try:
        with np.load(path, allow_pickle=False) as stored:
            told = json.loads(str(stored["told"]))
            if told["format"] != FORMAT:
                raise ValueError(f"its format is {told['format']}, not {FORMAT}")
            return _checkpoint(told, {name: stored[name] for name in stored.files})
    except Exception as error:  # whatever a file that something else wrote, or half of one, may provoke
        allowed = f"is no whole checkpoint that this version wrote ({error}); run the case again with --overwrite"
        raise InputError(str(path), "", None, allowed) from error


def _checkpoint(told: dict[str, Any], arrays: dict[str, Any]) -> Checkpoint:
    def mesh(i: int) -> SixNodeMesh:
        return SixNodeMesh(arrays[f"points_{i}"], arrays[f"cells_{i}"])

    count, geometry = len(told["radii"]), told["geometry"]
    reference = Reference(
        Geometry(tuple(geometry["betas"]), tuple(geometry["gaps"]), geometry["length"]),
        tuple(Outline(radius, arrays[f"angles_{i}"]) for i, radius in enumerate(told["radii"])),
        tuple(arrays[f"positions_{i}"] for i in range(count)),
        told["deformed"],
    )
    levels = {name: [arrays[f"{name}_{k}"] for k in range(len(told["t"]))] for name in ("h", "x")}
    y = [arrays[f"y_{k}"] for k in range(len(told["t_y"]))]
    matrix = None
    if "memory" in told:
        places = [
            Place(arrays[f"place_x_{i}"], arrays.get(f"place_star_{i}"), **rest)
            for i, rest in enumerate(told["places"])
        ]
        matrix = MatrixState((places[0], places[-1]), **told["memory"])
    state = State(
        history=History(told["t"], levels["h"], levels["x"], y, told["t_y"]),
        reference=reference,
        mesh=mesh(0),
        inside=tuple(mesh(i) if soft else None for i, soft in enumerate(told["soft"], 1)),
        dt=told["dt"],
        U_m=told["U_m"],
        matrix_state=matrix,
        due=told["due"],
        counts=Counts(**told["counts"]),
        seconds=told["seconds"],
    )
    gaps, (gap, arc) = tuple(told["gaps"]), told["narrowest"]
    return Checkpoint(
        state, told["case"], gaps, (gap, arc), arrays["origin"], told["rows"], told["frames"], told["wall"]
    )


def check_same(old: Mapping[str, Any], new: Mapping[str, Any], source: str, group: str = "") -> None:
    """Refuse to go on with another problem than the one that a checkpoint is of.

    Args:
        old, new: The resolved cases, the checkpoint's and the one that is asked for, in plain data.
        source: The checkpoint's file.
        group: Dotted name of the group of keys that they are.

    Raises:
        InputError: With the first key that differs and is not one of `FREE`, and both values.
    """
    for key in dict.fromkeys((*old, *new)):
        name = group + key
        if name in FREE:
            continue
        before, after = old.get(key), new.get(key)
        if isinstance(before, Mapping) and isinstance(after, Mapping):
            check_same(before, after, source, f"{name}.")
        elif before != after:
            allowed = f"{'nothing' if before is None else repr(before)}, with which this run began; a resumed run may "
            allowed += f"change only {', '.join(FREE)}"
            raise InputError(source, name, "nothing" if after is None else after, allowed)
