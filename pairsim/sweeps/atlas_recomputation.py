"""`pairsim atlas` with `recompute`: compute all curves of an atlas again at the same places, and fit it anew."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from pairsim.atlas import fit
from pairsim.atlas.atlas import PARAMETERS, Atlas
from pairsim.atlas.unequal import Unequal
from pairsim.atlas.unequal_fit import with_unequal
from pairsim.cases.coverage import beyond
from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import InputError
from pairsim.runtime.plain import Plain
from pairsim.runtime.version import __version__
from pairsim.sweeps.atlas_curves import among, curve_folders, curves_in, unequal_curves_in
from pairsim.sweeps.grid import Grid, grid_from
from pairsim.sweeps.sweep import Options, Workers, run_sweep
from pairsim.sweeps.unequal_building import beads_in, grid_of_beads


@dataclass(frozen=True)
class Recomputation:
    """The recomputation of an atlas.

    Attributes:
        path: The atlas file, which messages name.
        base: Keys that all curves share.
        atlas: The atlas whose curves are computed again.
        options: How curves are computed.
    """

    path: Path
    base: Mapping[str, Plain]
    atlas: Atlas
    options: Options

    def build(self, directory: Path, table: str, workers: Workers) -> tuple[int, str]:
        """Compute the curves that have not been computed yet, and write the atlas; returns exit code and message.

        Curves that fail are left out.

        Raises:
            InputError: The base has other physics than the atlas.
        """
        before = self.atlas
        equal = self._grid("equal", [dict(zip(PARAMETERS, map(float, at), strict=True)) for at in before.curves.places])
        if why := beyond(equal.cases[0].case, before):
            allowed = f"must be an atlas of the same base: {' and '.join(why)}"
            raise InputError(str(self.path), "start", None, allowed)
        code, message = run_sweep(equal, directory / equal.name, self.options, workers)
        if code not in (0, 3):
            return code, message
        drawn = before.curves.places[before.curves.random]
        curves = curves_in(curve_folders(directory / equal.name), before.d, drawn)
        atlas = fit.fit(curves, before.d, before.box, {**before.provenance, "pairsim": __version__})
        if before.unequal is not None:
            code, message, atlas = self._with_unequal(atlas, before.unequal, directory, workers)
            if code not in (0, 3):
                return code, message
        atlas.save(directory / table)
        return (
            code,
            f"{message}; {len(curves.places)} of {len(before.curves.places)} curves of equal pairs were computed again",
        )

    def _with_unequal(
        self, atlas: Atlas, unequal: Unequal, directory: Path, workers: Workers
    ) -> tuple[int, str, Atlas]:
        """The atlas with its unequal pairs and single beads computed again, after exit code and message."""
        singles = unequal.beads.singles
        if len(singles[1]):
            beads = grid_of_beads(self.path, "beads", self.base, singles[0])
            code, message = run_sweep(beads, directory / beads.name, replace(self.options, flags={}), workers)
            if code not in (0, 3):
                return code, message, atlas
            singles = beads_in(curve_folders(directory / beads.name))
        those = unequal.curves.beads
        pairs = zip(those.betas.tolist(), those.De.tolist(), those.Ca_es.tolist(), strict=True)
        grid = self._grid("unequal", [{"beta": betas, "De": De, "Ca_e": Ca_es} for betas, De, Ca_es in pairs])
        code, message = run_sweep(grid, directory / grid.name, self.options, workers)
        if code not in (0, 3):
            return code, message, atlas
        curves = unequal_curves_in(curve_folders(directory / grid.name), atlas.d)
        drawn: Array = those.numbers[unequal.curves.random]
        curves = replace(curves, random=np.asarray(among(curves.beads.numbers, drawn)))
        return code, message, with_unequal(atlas, curves, singles, unequal.ratios)

    def _grid(self, name: str, cases: Sequence[Mapping[str, Plain]]) -> Grid:
        """The sweep of a name over these cases, which compute curves."""
        return grid_from(self.path, {"name": name, "command": "curve", "base": self.base, "cases": list(cases)})
