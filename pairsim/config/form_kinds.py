"""Which kinds of compiled forms a case needs, in the words of the form cache."""

from __future__ import annotations

from pairsim.config.case import Case, SceneCase


def forms_of(case: SceneCase) -> tuple[str, ...]:
    """Kinds of forms that a case needs (the rule of `Scene`: a lone rigid particle may need no moving mesh)."""
    steady = not isinstance(case, Case)
    soft = any(Ca_e > 0 for Ca_e in case.Ca_es)
    moving = soft or case.n > (0 if case.polymer and not steady else 1)
    words = [case.polymer.name if case.polymer else "newtonian", "moving" if moving else "fixed"]
    words += ["steady"] if case.polymer and steady else []
    return (":".join(words), *(("neo-hookean",) if soft else ()))
