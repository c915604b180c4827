"""Whether the beads of an experiment stay on the axis, without computing: for a single bead, to first order."""

from __future__ import annotations

from collections.abc import Iterator

from pairsim.atlas.focusing import OFF, FirstOrderFocusing
from pairsim.cases.case import SceneCase
from pairsim.quantities.kinds import POSITION
from pairsim.quantities.text import with_name


def first_order_focusing(case: SceneCase, Re: float | None) -> Iterator[str]:
    """Yield a sentence, without its full stop, on how each bead of a case focuses on its own, to first order.

    For beads that differ it gives the longest of their focusing lengths and the smallest of their limits in Re, and
    the bead that uses most of the range of first order decides on its validity. Nothing is yielded unless first order
    applies to all of them.

    Args:
        case: The case, with units.
        Re: Its Reynolds number rho U_av D_c/eta_0, if it is known.
    """
    if not case.drive.is_flow_alone:
        return
    kinds = dict.fromkeys(zip(case.betas, case.solid_models, strict=True))
    each = [FirstOrderFocusing.of(beta, solid, case.liquid_model) for beta, solid in kinds]
    found = [one for one in each if one is not None]
    if not found or len(found) < len(each):
        return
    bead = "a bead on its own" if len(found) == 1 else "each of these beads on its own"
    worst = max(found, key=lambda one: one.share)
    limits = [("Ca_e", max(case.Ca_es), worst.Ca_e_most), ("De", case.De, worst.De_most)]
    up_to = " and ".join(f"{name} = {most:.2g}" for name, value, most in limits if value and most)
    if not worst.holds:
        given = [f"{name} = {value:.3g}" for name, value, _ in limits if value]
        here = f"{' and '.join(given)} {'are' if len(given) > 1 else 'is'}"
        holds = f", which reaches up to {up_to}" if up_to else ""
        command = "pairsim focus computes whether beads stay on the axis, and within which length they get there"
        yield f"{here} beyond first order{holds}: {command}"
        return
    factor = POSITION.factor(case.scales)
    tube = with_name(case.scales, POSITION, float(f"{factor * max(one.tube for one in found):.2g}") / factor)
    most = min(one.Re_c for one in found)
    inertia = f"as long as the Reynolds number is below about {most:.2g}"
    if Re is not None and Re >= most:
        inertia = f"without inertia, which drives it off the axis above a Reynolds number of about {most:.2g}"
    here = "" if Re is None else f" (here {Re:.2g})"
    yield (
        f"{bead} focuses: a small displacement from the axis falls to a tenth within about {tube} of tube, "
        f"{inertia}{here}; to first order, which is accurate to {100 * OFF:g} % up to {up_to}"
    )
