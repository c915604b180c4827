"""Parameters beyond those at which results were ever compared with finer meshes."""

from __future__ import annotations

from pairsim.config.case import SceneCase
from pairsim.config.curve_case import CriticalCase
from pairsim.config.materials import slowest_of

MOST_DE = 5.0  # docs/explanation/limits.md


def beyond_checked(case: SceneCase) -> list[str]:
    """Warn of particles at a De above all at which dU was compared with finer meshes.

    Of `critical` it is the largest De that it follows.
    """
    slowest = slowest_of(dict(case))
    values = [case.De]
    if isinstance(case, CriticalCase):
        values += [De for line in (case.along, case.lines) if line for De in line.get("De", ())]
    if (De := slowest * max(values)) <= MOST_DE or case.n == 0:
        return []
    mode = "" if slowest == 1 else " of the slowest mode"
    return [
        f"De = {De:g}{mode} is above {MOST_DE:g}, the largest at which dU was compared with finer meshes: the stress "
        "around the particles may not be resolved (docs/explanation/limits.md); compare with a finer mesh (mesh.Np, "
        "mesh.max_size)"
    ]
