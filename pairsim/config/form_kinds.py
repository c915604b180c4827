"""The names, in the form cache, of the compiled forms that a case needs."""

from __future__ import annotations

from pairsim.config.case import Case, SceneCase
from pairsim.fem.moving_mesh import mesh_moves


def forms_of(case: SceneCase) -> tuple[str, ...]:
    """Names of the forms that a case needs, such as "giesekus:moving:steady" and "neo-hookean"."""
    steady = not isinstance(case, Case)
    soft = any(Ca_e > 0 for Ca_e in case.Ca_es)
    moving = mesh_moves(case.n, soft=soft, viscoelastic=case.law is not None, steady=steady)
    parts = [case.law.name if case.law else "newtonian", "moving" if moving else "fixed"]
    parts += ["steady"] if case.law and steady else []
    kinds = (":".join(parts), *(("neo-hookean",) if soft else ()))
    # The error of quasi-steady solutions is estimated, that of runs on demand.
    if isinstance(case, Case):
        return tuple(f"{kind}:recovered" for kind in kinds) if case.estimates_error else kinds
    return tuple(f"{kind}:enriched" for kind in kinds)
