"""What the law of a liquid demands of the other keys of a case: checks that the keys declare (`Key.check`)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from pairsim.cases.mistakes import Mistake, missing

if TYPE_CHECKING:
    from pairsim.cases.case import SceneCase


def check_liquid(case: SceneCase) -> Iterator[Mistake]:
    """Yield the mistake of a law without a memory that has De, or of a yield stress where there can be none."""
    liquid = case.laws.liquid
    if liquid.is_viscous:
        if case.De > 0:
            allowed = "has no memory: leave out De (or physical.relaxation), or name a viscoelastic law"
            yield Mistake("liquid", liquid.name, allowed)
    elif liquid.yielding is not None and case.De and case.xi and (why := _not_yielding(case)):
        yield Mistake(liquid.yielding.key, liquid.yielding.name, f"must be left out: {why}")


def check_De(case: SceneCase) -> Iterator[Mistake]:
    """Yield the mistake of a viscoelastic law without De."""
    liquid = case.laws.liquid
    if liquid.is_viscous or case.De:
        return
    named = [name for name, law in (("solvent", liquid.solvent), ("yielding", liquid.yielding)) if law is not None]
    if case.liquid is not None and "De" not in case.model_fields_set:
        yield missing("De", f"must be given with liquid: {liquid.name}")
    elif named:
        yield Mistake(
            "De", case.De, f"must be above 0 with liquid.{named[0]}, which a liquid without elasticity does not have"
        )


def check_xi(case: SceneCase) -> str:
    """What the viscosity of the solvent must be."""
    viscous = case.laws.liquid.is_viscous or not case.De
    return "" if viscous or case.xi else "must be above 0 in a viscoelastic liquid"


def _not_yielding(case: SceneCase) -> str:
    """Why the liquid of a case cannot have a yield stress, at least not in this question; "" if it can."""
    mode, *others = case.liquid_model.modes
    if others:
        return "the laws of a yield stress are for liquids with one mode"
    if mode.follows_rate:
        return f"{mode.name} prescribes the flow curve, which a yield stress would change"
    return (
        ""
        if case.has_history
        else "below a yield stress no state is steady: use `pairsim run`, or the key after of a curve"
    )
