"""Which kinds of compiled forms a case needs, in the words of the form cache."""

from __future__ import annotations

from pairsim.config.case import Case, SceneCase
from pairsim.fem.moving_mesh import mesh_moves


def forms_of(case: SceneCase) -> tuple[str, ...]:
    """Kinds of forms that a case needs."""
    steady = not isinstance(case, Case)
    soft = any(Ca_e > 0 for Ca_e in case.Ca_es)
    moving = mesh_moves(case.n, soft=soft, viscoelastic=case.law is not None, steady=steady)
    words = [case.law.name if case.law else "newtonian", "moving" if moving else "fixed"]
    words += ["steady"] if case.law and steady else []
    kinds = (":".join(words), *(("neo-hookean",) if soft else ()))
    # Quasi-steady solutions come with an estimate of their error.
    return tuple(f"{kind}:enriched" for kind in kinds) if steady else kinds
