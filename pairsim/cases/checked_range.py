"""Parameters beyond those at which results were ever compared with finer meshes."""

from __future__ import annotations

from pairsim.cases.case import SceneCase
from pairsim.cases.materials import slowest_of

MOST_DE = 2.0  # docs/explanation/limits.md


def beyond_checked(case: SceneCase) -> list[str]:
    """Warn of particles at a De above all at which dU was compared with finer meshes."""
    slowest = slowest_of(dict(case))
    if (De := slowest * max(case.values_of_De)) <= MOST_DE or case.n == 0:
        return []
    mode = "" if slowest == 1 else " of the slowest mode"
    return [
        f"De = {De:g}{mode} is above {MOST_DE:g}, the largest at which dU was compared with finer meshes: the stress "
        "around the particles may not be resolved (docs/explanation/limits.md); compare with a finer mesh (mesh.Np, "
        "mesh.max_size)"
    ]
