"""A part for each De and displacement in three dimensions, and one for each De of `pairsim focus`.

A steady flow is found from that at the De before it, which its part has left in a file, or computes again.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path

from book.apart import apart
from book.study import Part, Row

from pairsim.physics.liquids import NEWTONIAN
from pairsim.physics.liquids.giesekus import Giesekus
from pairsim.physics.liquids.liquid import single
from pairsim.solvers.focus.errors import half_widths
from pairsim.solvers.focus.rates import Displacement
from studies.focus.scenes import resistance, scene
from studies.focus_3d.flow import giesekus, newtonian
from studies.focus_3d.mesh import Sizes

BETA, ALPHA, XI = 0.4, 0.2, 0.09
FINE, COARSE = Sizes(BETA / 2, 1.7, 0.05, 0.2, 0.14), Sizes(BETA / 2, 1.0, 0.12, 0.4, 0.25)
CELLS, FEW_CELLS = 24, 10
"""On the half-circle, of `pairsim focus`."""
AT = (0.05, 0.025)
"""Displacements [D_c]."""
SMALL = 0.002
"""De from whose first step the limit of a second-order liquid follows."""
LADDER = (0.01, 0.1, 0.3, 0.5)


def axisymmetric(De: float, Np: int) -> Row:
    """What `pairsim focus` has for a bead that keeps its displacement, per displacement."""
    liquid = single(Giesekus(alpha=ALPHA), De, XI) if De else NEWTONIAN
    with scene((BETA,), (None,), liquid, Np=Np) as solver, Displacement(solver) as displacement:
        found = displacement.found
        U, error = float(solver.observe().U[0]), float(half_widths(displacement).rates[0, 0])
    row = {"V": float(found.at_rest[0, 0]), "error": error, "U": U, "rotation": float(found.rotation[0, 0])}
    drag, torque = resistance(BETA, Np) if not De else (None, None)
    return row | {"drag": None if drag is None else float(drag), "torque": None if torque is None else float(torque)}


def parts(quick: bool) -> list[Part]:
    """All of these; in the quick form a Newtonian liquid and one De, at one displacement, on coarse cells."""
    sizes, Np, at = (COARSE, FEW_CELLS, AT[:1]) if quick else (FINE, CELLS, AT)
    found = [
        Part(f"axis, De {De:g}", f"pairsim focus at De {De:g} with {Np} cells", partial(_axisymmetric, De, Np))
        for De in (0.0, LADDER[1] if quick else SMALL, *(() if quick else LADDER))
    ]
    for x in at:
        found.append(Part(f"x {x:g}, Newtonian", f"{sizes}, x {x:g}", partial(_newtonian, sizes, x)))
        ladders = [LADDER[1:2]] if quick else [(SMALL,), *(LADDER[: i + 1] for i in range(len(LADDER)))]
        found += [
            Part(f"x {x:g}, De {each[-1]:g}", f"{sizes}, x {x:g}, De {each}", partial(_giesekus, sizes, x, each))
            for each in ladders
        ]
    return found


def _axisymmetric(De: float, Np: int, folder: Path) -> Sequence[Row]:
    return [{"kind": "axis", "De": De, **apart(axisymmetric, De, Np)}]


def _newtonian(sizes: Sizes, x: float, folder: Path) -> Sequence[Row]:
    return [{"kind": "3D", "De": 0.0, "x": x, **apart(newtonian, sizes, x)}]


def _giesekus(sizes: Sizes, x: float, ladder: tuple[float, ...], folder: Path) -> Sequence[Row]:
    files = [folder.parent / f"x {x:g}, De {De:g} from {ladder[0]:g}.npz" for De in ladder]
    files[-1].unlink(missing_ok=True)
    return [{"kind": "3D", "De": ladder[-1], "x": x, **apart(giesekus, sizes, x, ladder, files)}]
