"""`pairsim atlas` with ratios: curves of pairs whose beads differ, added to an atlas of equal pairs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import ceil
from pathlib import Path

import numpy as np
from scipy.stats import qmc

from pairsim.atlas.atlas import PARAMETERS, Atlas
from pairsim.atlas.unequal import UnequalCurves, outside_of
from pairsim.atlas.unequal_fit import left_out, with_unequal
from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import InputError
from pairsim.runtime.plain import Plain
from pairsim.sweeps.atlas_curves import among, beads_in, curve_folders, unequal_curves_in
from pairsim.sweeps.atlas_file import PER_ROUND, AtlasFile
from pairsim.sweeps.atlas_grids import check_pairs, check_start, grid_of_beads, grid_of_curves
from pairsim.sweeps.grid import Grid
from pairsim.sweeps.sweep import Ending, Options, Workers, run_sweep

STRETCH = 1.25  # factor by which draws are stretched about their middle: a fifth are then at ends of the range; chosen
SEED_OF_BEADS = 2  # added to the seed of the file
type Ends = tuple[float, float]


@dataclass(frozen=True)
class UnequalBuilding:
    """The computation of the unequal pairs of an atlas.

    Attributes:
        path: The atlas file, which messages name.
        file: Its content.
        base: Keys that all curves share.
        atlas: The atlas to which the pairs are added.
        others: Further atlases, whose unequal curves that lie in the box are added, too.
        options: How curves are computed.
    """

    path: Path
    file: AtlasFile
    base: Mapping[str, Plain]
    atlas: Atlas
    others: Sequence[Atlas]
    options: Options

    @property
    def ratios(self) -> dict[str, list[float]]:
        """Least and largest ratios of diameters and moduli, as in `Unequal.ratios`."""
        return {"diameters": [*self._diameters], "moduli": [*self._moduli]}

    @property
    def _diameters(self) -> tuple[float, float]:
        assert self.file.diameters is not None
        return self.file.diameters

    @property
    def _moduli(self) -> tuple[float, float]:
        assert self.file.moduli is not None
        return self.file.moduli

    def build(self, directory: Path, table: str, workers: Workers) -> Ending:
        """Compute the curves that have not been computed yet, and write the atlas after each round.

        Raises:
            InputError: The atlas has other ratios, another box or other cases.
        """
        atlas, before = self.atlas, self.atlas.unequal
        if before is not None and before.ratios != self.ratios:
            allowed = f"must be {before.ratios}, the ratios of the atlas to which curves are added"
            raise InputError(str(self.path), "diameters, moduli", self.ratios, allowed)
        curves = None if before is None else before.curves
        singles = (np.zeros((0, 3)), np.zeros(0)) if before is None else before.beads.singles
        for other in self.others:
            curves = _joined(self.atlas, curves, other, str(self.path))
        if self.file.beads:
            folder = directory / "beads"
            options = replace(self.options, flags={})
            ending = run_sweep(self._grid_of_beads(folder.name), folder, options, workers)
            if not ending.to_the_end:
                return ending
            singles = beads_in(curve_folders(folder))
        random = qmc.Halton(5, rng=np.random.default_rng(self.file.seed))
        random.fast_forward(0 if curves is None else int(curves.random.sum()))
        for number in range(ceil(self.file.curves / PER_ROUND)):
            folder = directory / f"round-{number:02d}"
            grid = self._grid_of_pairs(random.random(PER_ROUND), folder.name)
            ending = run_sweep(grid, folder, self.options, workers)
            if not ending.to_the_end:
                return ending
            found = unequal_curves_in(curve_folders(folder), self.atlas.d)
            curves = found if curves is None else curves + found
            atlas = with_unequal(self.atlas, curves, singles, self.ratios)
            atlas.save(directory / table)
        assert curves is not None
        return ending.saying(_known(atlas, curves))

    def _grid_of_pairs(self, x: Array, name: str) -> Grid:
        """The cases of the pairs at coordinates `x` from 0 to 1, shape (pairs, 5).

        Raises:
            InputError: The base is not that of pairs, or not of the box and physics of the atlas.
        """
        grid = grid_of_curves(self.path, name, self.base, pairs_at(x, self.file, self._diameters, self._moduli))
        pair = grid.cases[0].case
        check_pairs(pair, self.path)
        equal = {"beta": pair.betas[0], "De": pair.De, "Ca_e": pair.Ca_es[0]}
        alike = grid_of_curves(self.path, name, self.base, [equal]).cases[0].case
        check_start(self.atlas, alike, self.path, self.file.start)
        return grid

    def _grid_of_beads(self, name: str) -> Grid:
        """The cases of single beads."""
        random = qmc.Halton(3, rng=np.random.default_rng(self.file.seed + SEED_OF_BEADS))
        x = _to_the_ends(random.random(self.file.beads))
        ends = np.array([getattr(self.file, key) for key in PARAMETERS])
        x[:, 1] **= 2  # dU bends most where De is small
        places = np.round(ends[:, 0] + (ends[:, 1] - ends[:, 0]) * x, 6)
        return grid_of_beads(self.path, name, self.base, places)


def pairs_at(x: Array, file: AtlasFile, diameters: Ends, moduli: Ends) -> Iterator[dict[str, Plain]]:
    """Yield the pairs at coordinates `x` from 0 to 1, shape (pairs, 5), as keys of cases.

    The coordinates are beta of the trailing bead, De (squared, so that small ones are denser), Ca_e of the softer bead,
    and the logarithms of the ratios of diameters and of moduli. The ranges of beta and Ca_e are narrowed so that both
    beads lie in the box.
    """
    for a, b, c, size, softness in _to_the_ends(x):
        larger, stiffer = (_in_logarithms(*each) for each in ((diameters, size), (moduli, softness)))
        (least, most), (softest, softer) = file.beta, file.Ca_e
        first, last = max(least, least / larger), min(most, most / larger)
        trailing, ratio = first + (last - first) * a, min(stiffer, 1 / stiffer)
        Ca_e = softest / ratio + (softer - softest / ratio) * c
        both = [Ca_e, Ca_e * ratio] if stiffer >= 1 else [Ca_e * ratio, Ca_e]
        De = file.De[0] + (file.De[1] - file.De[0]) * b**2
        numbers = {"beta": [trailing, trailing * larger], "De": [De], "Ca_e": both}
        rounded = {key: [round(float(each), 6) for each in values] for key, values in numbers.items()}
        yield {**rounded, "De": rounded["De"][0]}


def _to_the_ends(x: Array) -> Array:
    return np.clip(0.5 + STRETCH * (x - 0.5), 0.0, 1.0)


def _in_logarithms(ends: Ends, part: float) -> float:
    return float(ends[0] * (ends[1] / ends[0]) ** part)


def _joined(atlas: Atlas, curves: UnequalCurves | None, other: Atlas, source: str) -> UnequalCurves | None:
    """Unequal curves, with those of another atlas whose beads lie in the box; the latter do not count as random.

    Messages name the file `source`.

    Raises:
        InputError: The other one has other distances.
    """
    if other.unequal is None:
        return curves
    if len(other.d) != len(atlas.d) or not np.allclose(other.d, atlas.d):
        raise InputError(source, "start", None, "must be atlases of the same curves: its curves are at other distances")
    theirs = other.unequal.curves
    pairs = zip(theirs.betas, theirs.De, theirs.Ca_es, strict=True)
    inside = np.array([not outside_of(atlas, *pair) for pair in pairs])
    known = np.zeros((0, 5)) if curves is None else curves.beads.numbers
    new = theirs[inside & ~among(theirs.beads.numbers, known)]
    new = replace(new, random=np.zeros(len(new.De), dtype=bool))
    return new if curves is None else curves + new


def _known(atlas: Atlas, curves: UnequalCurves) -> str:
    """The number of unequal curves of an atlas, and the median over them of its leave-one-out error, in words."""
    assert atlas.of_unequal is not None
    size = 100 * np.sqrt(np.median(np.mean(left_out(atlas.of_unequal) ** 2, axis=1)))
    many = f"{len(curves.De)} curves of unequal pairs"
    return f"{many}; left out, half of them are off by up to {size:.2g} % of their peak"
