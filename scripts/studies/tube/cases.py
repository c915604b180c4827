"""Flow of the laws in one dimension and on the mesh: the parts of the study."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path

from book.apart import apart
from book.study import Part, Row

from pairsim.physics.liquids import single
from pairsim.physics.liquids.giesekus import Giesekus
from pairsim.physics.liquids.oldroyd_b import OldroydB
from pairsim.physics.pipe import Pipe
from studies.tube.pipe import LAWS, pipe_in_two_dimensions
from studies.tube.references import START_UP, STEADY

CELLS, LENGTH = 0.05, 0.5  # of the mesh and of the piece of tube [D_c]
SETTLED = 20  # time of steady flow [De]
LIQUIDS = {
    **{f"Giesekus, De {De:g}": single(Giesekus(), De) for De in STEADY},
    **LAWS,
    "Oldroyd-B, De 1": single(OldroydB(), 1.0),
}
"""The liquids by their names in the results."""


def in_one_dimension(name: str) -> list[Row]:
    """Steady flow by the one-dimensional solver."""
    flow = Pipe(LIQUIDS[name]).steady()
    rows = {"dp/L": flow.gradient, "u(0)": flow.u[0]}
    rows |= {f"c_{component} wall": flow.c[-1, i] for i, component in enumerate(("zz", "rz", "rr"))}
    return [{"liquid": name, "quantity": each, "value": float(value)} for each, value in rows.items()]


def on_the_mesh(name: str, times: Sequence[float], cells: float) -> list[Row]:
    """Pressure gradient and largest velocity at some times after start-up."""
    found = pipe_in_two_dimensions(LIQUIDS[name], list(times), length=LENGTH, max_size=cells)
    return [
        {"liquid": name, "t": t, "quantity": quantity, "value": value}
        for t, values in found.items()
        for quantity, value in zip(("dp/L", "u(0)"), values, strict=True)
    ]


def parts(quick: bool) -> list[Part]:
    """All liquids in one dimension and on the mesh; on that the quick form has the start-up of a Giesekus liquid."""
    steady = [*(name for name in LIQUIDS if name != "Oldroyd-B, De 1")]
    wanted = {} if quick else {f"steady {name}": (name, [SETTLED * LIQUIDS[name].De], CELLS) for name in steady}
    starting = ("Giesekus, De 1",) if quick else ("Giesekus, De 1", "Oldroyd-B, De 1")
    ends = [t for t in START_UP if not quick or t <= 0.25]
    wanted |= {f"start-up {name}": (name, ends, 0.1 if quick else CELLS) for name in starting}
    return [
        Part("one dimension", f"steady flow of {', '.join(steady)}", partial(_one_dimension, steady)),
        *(Part(part, f"{part}: {each}", partial(_mesh, part.partition(" ")[0], each)) for part, each in wanted.items()),
    ]


def _one_dimension(names: Sequence[str], folder: Path) -> list[Row]:
    return [{"kind": "one dimension", **row} for name in names for row in in_one_dimension(name)]


def _mesh(kind: str, wanted: tuple[str, list[float], float], folder: Path) -> list[Row]:
    return [{"kind": kind, **row} for row in apart(on_the_mesh, *wanted)]
