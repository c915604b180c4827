"""The names, in the form cache, of the compiled forms that a case needs."""

from __future__ import annotations

from pairsim.config.case import Case, SceneCase
from pairsim.fem.phases.moving_mesh import mesh_moves


def forms_of(case: SceneCase) -> tuple[str, ...]:
    """Names of the forms that a case needs, such as "giesekus:moving:steady" and "neo-hookean"."""
    # The error of quasi-steady solutions is estimated, that of runs on demand.
    steady = _forms(case, "enriched", steady=True)
    if not isinstance(case, Case):
        return steady
    in_time = _forms(case, "recovered" if case.estimates_error else "", steady=False)
    # A pair's run ends with a quasi-steady solution.
    return tuple(dict.fromkeys((*in_time, *(steady if case.n > 1 or case.start == "steady" else ()))))


def _forms(case: SceneCase, error: str, *, steady: bool) -> tuple[str, ...]:
    """Names of the forms of one kind of problem, with those of an estimate of its error."""
    liquid, soft = case.liquid_model, [solid.name for solid in case.solid_models if solid]
    moving = mesh_moves(case.n, soft=bool(soft), viscoelastic=bool(liquid.modes), steady=steady)
    parts = [liquid.structure, "moving" if moving else "fixed"]
    parts += ["steady"] if liquid.modes and steady else []
    kinds = (":".join(parts), *dict.fromkeys(soft))
    return tuple(f"{kind}:{error}" for kind in kinds) if error else kinds
