"""The master curve of a pair, read from an atlas."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pairsim.analysis.master_curve import Curve
from pairsim.atlas.atlas import Atlas
from pairsim.record.columns import (
    BY_DIFFERENCE,
    BY_STIFFNESS,
    DISTANCE,
    DU,
    DU_DISCRETE,
    DU_ERROR,
    DU_HELD,
    SENSITIVITIES,
    SLOPE,
    STRETCH,
    T_RELAX,
    U,
)
from pairsim.runtime.errors import InputError

SOURCE = "atlas"


def curve_of_atlas(
    atlas: Atlas,
    *,
    beta: float | Sequence[float],
    De: float,
    Ca_e: float | Sequence[float],
    stiffness: bool = False,
) -> Curve:
    """The curve of an atlas at a place in its box, with derivatives of dU.

    Args:
        atlas: The atlas.
        beta, De, Ca_e: The pair: one value for both beads, or those of the trailing and the leading one.
        stiffness: Whether the derivative by the difference of the moduli is added, if both beads are soft and the atlas
            has unequal pairs.

    Raises:
        InputError: The pair is outside of the box, or its beads differ by more than those of the atlas do.
    """
    betas, Ca_es = (np.broadcast_to(np.asarray(each, dtype=float), 2).tolist() for each in (beta, Ca_e))
    if betas[0] == betas[1] and Ca_es[0] == Ca_es[1]:
        found = atlas.at(betas[0], De, Ca_es[0])
    elif atlas.of_unequal is None:
        raise InputError(SOURCE, "", None, "must be an atlas of pairs whose beads differ")
    else:
        found = atlas.of_unequal.at(betas, De, Ca_es)
    columns = {DISTANCE: found.d, DU: found.dU, DU_HELD: found.dU, DU_DISCRETE: found.dU}
    columns |= {DU_ERROR: found.half_widths, SLOPE: found.slope}
    columns |= {U.with_suffix("_L"): found.U + found.dU / 2, U.with_suffix("_T"): found.U - found.dU / 2}
    columns |= {STRETCH: found.stretch, T_RELAX: found.t_relax}
    if found.by_difference is not None:
        columns[BY_DIFFERENCE] = found.by_difference
    if stiffness and atlas.of_unequal is not None and all(Ca_es):
        columns[BY_STIFFNESS] = atlas.of_unequal.by_stiffness(betas, De, Ca_es)
    columns |= {SENSITIVITIES[name]: change for name, change in found.sensitivities.items()}
    return Curve({column.name: values for column, values in columns.items()}, source=SOURCE)
