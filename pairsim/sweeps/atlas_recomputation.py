"""`pairsim atlas` with `recompute`: compute all curves of an atlas again at the same places, and fit it anew."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from pairsim.atlas import fit
from pairsim.atlas.atlas import Atlas
from pairsim.atlas.unequal import Unequal
from pairsim.atlas.unequal_fit import with_unequal
from pairsim.runtime.arrays import Array
from pairsim.runtime.plain import Plain
from pairsim.runtime.version import __version__
from pairsim.sweeps.atlas_curves import among, beads_in, curve_folders, curves_in, unequal_curves_in
from pairsim.sweeps.atlas_grids import check_start, grid_of_beads, grid_of_curves, keys_at
from pairsim.sweeps.sweep import Ending, Options, Workers, run_sweep


@dataclass(frozen=True)
class Recomputation:
    """The recomputation of an atlas.

    Attributes:
        path: The atlas file, which messages name.
        start: The key of that name in it.
        base: Keys that all curves share.
        atlas: The atlas whose curves are computed again.
        options: How curves are computed.
    """

    path: Path
    start: str | list[str]
    base: Mapping[str, Plain]
    atlas: Atlas
    options: Options

    def build(self, directory: Path, table: str, workers: Workers) -> Ending:
        """Compute the curves that have not been computed yet, and write the atlas.

        Curves that fail are left out.

        Raises:
            InputError: The base has other physics than the atlas.
        """
        before = self.atlas
        equal = grid_of_curves(self.path, "equal", self.base, map(keys_at, before.curves.places))
        check_start(before, equal.cases[0].case, self.path, self.start)
        ending = run_sweep(equal, directory / equal.name, self.options, workers)
        if not ending.to_the_end:
            return ending
        drawn = before.curves.places[before.curves.random]
        curves = curves_in(curve_folders(directory / equal.name), before.d, drawn)
        atlas = fit.fit(curves, before.d, before.box, {**before.provenance, "pairsim": __version__})
        if before.unequal is not None:
            ending, atlas = self._with_unequal(atlas, before.unequal, directory, workers)
            if not ending.to_the_end:
                return ending
        atlas.save(directory / table)
        return ending.saying(
            f"{len(curves.places)} of {len(before.curves.places)} curves of equal pairs were computed again"
        )

    def _with_unequal(self, atlas: Atlas, unequal: Unequal, directory: Path, workers: Workers) -> tuple[Ending, Atlas]:
        """How the last sweep has ended, and the atlas with its unequal pairs and single beads computed again."""
        singles = unequal.beads.singles
        if len(singles[1]):
            beads = grid_of_beads(self.path, "beads", self.base, singles[0])
            ending = run_sweep(beads, directory / beads.name, replace(self.options, flags={}), workers)
            if not ending.to_the_end:
                return ending, atlas
            singles = beads_in(curve_folders(directory / beads.name))
        those = unequal.curves.beads
        pairs = zip(those.betas.tolist(), those.De.tolist(), those.Ca_es.tolist(), strict=True)
        cases = [{"beta": betas, "De": De, "Ca_e": Ca_es} for betas, De, Ca_es in pairs]
        grid = grid_of_curves(self.path, "unequal", self.base, cases)
        ending = run_sweep(grid, directory / grid.name, self.options, workers)
        if not ending.to_the_end:
            return ending, atlas
        curves = unequal_curves_in(curve_folders(directory / grid.name), atlas.d)
        drawn: Array = those.numbers[unequal.curves.random]
        curves = replace(curves, random=np.asarray(among(curves.beads.numbers, drawn)))
        return ending, with_unequal(atlas, curves, singles, unequal.ratios)
