"""The names, in the form cache, of the compiled forms that a case needs."""

from __future__ import annotations

from pairsim.config.case import Case, SceneCase
from pairsim.fem.moving_mesh import mesh_moves


def forms_of(case: SceneCase) -> tuple[str, ...]:
    """Names of the forms that a case needs, such as "giesekus:moving:steady" and "neo-hookean"."""
    if not isinstance(case, Case):
        return _steady(case)
    # The error of quasi-steady solutions is estimated, that of runs on demand; a mesh is adapted to the former.
    suffix = ":recovered" if case.dU_error and case.n > 1 else ""
    own = tuple(kind + suffix for kind in _kinds(case, steady=False))
    return (*own, *_steady(case)) if case.adapts else own


def _steady(case: SceneCase) -> tuple[str, ...]:
    return tuple(f"{kind}:enriched" for kind in _kinds(case, steady=True))


def _kinds(case: SceneCase, *, steady: bool) -> tuple[str, ...]:
    soft = any(Ca_e > 0 for Ca_e in case.Ca_es)
    moving = mesh_moves(case.n, soft=soft, viscoelastic=case.law is not None, steady=steady)
    parts = [case.law.name if case.law else "newtonian", "moving" if moving else "fixed"]
    parts += ["steady"] if case.law and steady else []
    return (":".join(parts), *(("neo-hookean",) if soft else ()))
