"""An atlas: master curves of pairs at any beta, De and Ca_e of a box, with intervals, without computing.

It is made by `pairsim.atlas.fit` from many curves, which its file holds. Only numpy is loaded to read and evaluate it.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Self, TypedDict

import numpy as np
from numpy.typing import ArrayLike

from pairsim.atlas.kriging import Kriging
from pairsim.runtime.arrays import Array, Flags
from pairsim.runtime.errors import InputError

if TYPE_CHECKING:
    from pairsim.atlas.unequal import Unequal, UnequalAtlas
    from pairsim.runtime.plain import Plain

PARAMETERS = ("beta", "De", "Ca_e")
SHIPPED = sorted(Path(__file__).parent.glob("*.npz"))  # made by the files of these names in configs/atlas
VANISHING = (1, 2)  # of these: dU of equal pairs vanishes where De and Ca_e do
BEND = 0.05  # De at which dU bends: the coordinate of De is log(1 + De/BEND); chosen by curves left out
POWER = 4.0  # power of beta by which dU is divided: about that with which dU grows
SLACK = 1e-9  # part of a range by which a value may be outside by rounding
UNSURE = 0.1  # half-width of a curve over its peak above which, at any distance, its derivatives are not used; chosen
SMOOTH = np.array([1.5, 1.0, 1.5])  # correlation lengths of the quantities of a curve beside dU; chosen
ERROR_OF_OTHERS = 1e-4  # error of these quantities, over their standard deviation among the curves; chosen
ENOUGH = 8  # least number of curves with a derivative by the difference of diameters to interpolate this; chosen


@dataclass(frozen=True)
class Curves:
    """Master curves at the same distances."""

    places: Array  # beta, De and Ca_e, shape (curves, 3)
    random: Flags  # whether its place was drawn at random in the box, shape (curves,)
    dU: Array  # dU on the slow manifold [U_av], shape (curves, distances)
    errors: Array  # half-widths of its intervals, of the same shape
    gradients: Array  # its derivatives by beta, De and Ca_e, nan where not known, shape (curves, 3, distances)
    others: Array  # mean velocity of the pair, derivative of the centres' distance by d, decay time, of the same shape
    differences: Array  # derivative of dU by the relative difference of diameters, nan where not known, shape as dU

    def __add__(self, other: Curves) -> Curves:
        return Curves(*map(np.concatenate, zip(vars(self).values(), vars(other).values(), strict=True)))

    @property
    def peaks(self) -> Array:
        """The largest |dU| of each, shape (curves, 1)."""
        return np.asarray(np.abs(self.dU).max(axis=1, keepdims=True))

    def kriging(self, box: Mapping[str, Sequence[float]], settings: Array) -> Kriging:
        """Kriging of dU/beta**POWER.

        Args:
            box: Least and largest values of the parameters.
            settings: Correlation lengths (3), error of the values relative to the peak of a curve, and errors of the
                derivatives (3).
        """
        beta, (x, slopes) = self.places[:, :1], scaled(box, self.places)
        values = self.dU / beta**POWER
        by = self.gradients.swapaxes(0, 1) / beta**POWER
        by[0] -= POWER / beta * values
        by /= slopes.T[:, :, None]
        by[:, (self.errors > UNSURE * self.peaks).any(axis=1)] = np.nan
        sizes = np.abs(values).max(axis=1)
        relative = sizes / _median(sizes / np.hypot(x[:, 1], x[:, 2]))
        lengths, of_values, of_derivatives = np.split(settings, (3, 4))
        errors = np.stack([of_values * relative, *(np.full_like(sizes, each) for each in of_derivatives)])
        return Kriging.of(x, np.concatenate([values[None], by]), errors, lengths, VANISHING)


def _median(values: Array) -> float:
    """The median; that of numpy loads masked arrays, which takes as long as interpolating a curve."""
    middle = len(values) // 2
    return float(np.sort(values)[middle - (len(values) % 2 == 0) : middle + 1].mean())


@dataclass(frozen=True)
class Interpolated:
    """A master curve at one place in the box, shape (distances,) each."""

    d: Array  # distances [D_c]
    dU: Array  # dU on the slow manifold [U_av]
    half_widths: Array  # of the intervals of dU
    slope: Array  # derivative of dU by the distance
    U: Array  # mean velocity of the pair
    stretch: Array  # derivative of the distance between the centres by that between the surfaces
    t_relax: Array  # decay time [D_c/U_av]
    sensitivities: Mapping[str, Array]  # derivatives of dU by beta, De and Ca_e
    by_difference: Array | None  # that by the difference of the diameters over their mean; None where not known


@dataclass(frozen=True)
class AboutMeans:
    """Functions of scaled places that vary less than dU, interpolated without derivatives."""

    kriging: Kriging  # of the functions less their means
    means: Array  # over the places where they are known, shape (functions,)

    @classmethod
    def of(cls, x: Array, values: Array) -> AboutMeans:
        """The functions of these values, shape (places, functions), at places `x`, (places, 3); nan where not known."""
        known = values[np.isfinite(values).all(axis=1)]
        means, size = known.mean(axis=0), known.std(axis=0).max() or 1.0
        data = np.full((1 + x.shape[1], *values.shape), np.nan)
        data[0] = values - means
        return cls(Kriging.of(x, data, np.full(data.shape[:2], ERROR_OF_OTHERS * size), SMOOTH, ()), means)

    def __call__(self, x: Array) -> Array:
        """The functions at places, shape (places, functions)."""
        return np.asarray(self.kriging(x)[0][0] + self.means)


class Provenance(TypedDict):
    """The origin of the curves of an atlas."""

    pairsim: str  # version that made it
    case: Mapping[str, Plain]  # keys that its cases share


@dataclass(frozen=True)
class Atlas:
    """Master curves over a box of parameters."""

    box: Mapping[str, Sequence[float]]  # least and largest beta, De, Ca_e and d
    provenance: Provenance
    d: Array  # distances of the curves, ascending [D_c], shape (distances,)
    settings: Array  # see `Curves.kriging`
    widths: Array  # factors from the standard deviation of dU to the half-width of its interval, (distances,)
    curves: Curves  # those that it is made of
    unequal: Unequal | None = None  # pairs whose beads differ; None if it has none

    @classmethod
    def load(cls, path: Path) -> Self:
        """Read an atlas.

        Raises:
            InputError: The file cannot be read, or is no atlas of this version.
        """
        try:
            with np.load(path, allow_pickle=False) as stored:
                arrays = dict(stored)
            head = json.loads(str(arrays.pop("head")))
            arrays.setdefault("differences", np.full_like(arrays["dU"], np.nan))  # files of 0.3.0 have none
            curves = Curves(*(arrays.pop(each.name) for each in fields(Curves)))
            unequal = None
            if (ratios := head.pop("ratios", None)) is not None:
                from pairsim.atlas.unequal import Unequal

                unequal = Unequal.of_file(ratios, head["box"], arrays)
            return cls(**head, **arrays, curves=curves, unequal=unequal)
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise InputError(str(path), "", None, f"must be an atlas of this version ({error})") from error

    def save(self, path: Path) -> None:
        """Write the atlas to a file that `load` reads."""
        arrays = vars(self.curves) | {name: getattr(self, name) for name in ("d", "settings", "widths")}
        head: dict[str, object] = {"box": self.box, "provenance": self.provenance}
        if self.unequal is not None:
            head["ratios"] = self.unequal.ratios
            arrays |= self.unequal.arrays
        with path.open("wb") as file:
            np.savez_compressed(file, head=json.dumps(head), **arrays)

    @cached_property
    def of_unequal(self) -> UnequalAtlas | None:
        """dU of pairs whose beads differ; None where it has none."""
        if self.unequal is None:
            return None
        from pairsim.atlas.unequal import UnequalAtlas

        return UnequalAtlas(self, self.unequal)

    @cached_property
    def dU(self) -> Kriging:
        """The kriging of dU over beta ** POWER at all distances."""
        return self.curves.kriging(self.box, self.settings)

    @cached_property
    def others(self) -> AboutMeans:
        """`Curves.others`, at all distances one after the other."""
        return AboutMeans.of(self.dU.places, self.curves.others.reshape(len(self.curves.others), -1))

    @cached_property
    def by_difference(self) -> AboutMeans | None:
        """`Curves.differences` over beta ** 2; None where too few are known."""
        values = self.curves.differences / self.curves.places[:, :1] ** 2
        if np.isfinite(values).all(axis=1).sum() < ENOUGH:
            return None
        return AboutMeans.of(self.dU.places, values)

    @cached_property
    def own(self) -> Array:
        """Half-widths of the curves of which the atlas is made, relative to their peaks, shape (curves, distances)."""
        return np.asarray(np.maximum(self.curves.errors / self.curves.peaks, SLACK))

    @cached_property
    def patterns(self) -> Array:
        """How errors of the atlas are distributed over the distances, shape (curves, distances).

        Each row is proportional to the error for a curve that was left out. The sum of all rows, each times an
        independent normal number of variance 1, has variance 1 at every distance, and is correlated over the distances
        as errors of dU are.
        """
        residuals, spreads = self.dU.left_out()
        ratios = residuals / spreads[:, None]
        return np.asarray(ratios / np.linalg.norm(ratios, axis=0))

    def outside(self, **given: float) -> list[str]:
        """Which of the given beta, De, Ca_e and d are outside of the box, in words."""
        found = []
        for name, value in given.items():
            low, high = self.box[name]
            slack = SLACK * (high - low)
            if not low - slack <= value <= high + slack:
                found.append(f"{name} = {value:.4g} is not between {low:g} and {high:g}")
        return found

    def velocities(self, places: ArrayLike) -> tuple[Array, Array]:
        """dU and half-widths of its intervals at the distances `d` [U_av], shape (places, distances) each.

        Half-widths combine that of the interpolation with those of the curves nearby: the mean of these, weighted with
        the inverse fourth powers of how far away the curves are in the box. Where soft pairs nearly touch, half-widths
        of curves differ by factors of a hundred.

        Args:
            places: beta, De and Ca_e, shape (places, 3); those outside of the box are extrapolated.
        """
        places = np.asarray(places, dtype=float)
        (x, _), size = scaled(self.box, places), places[:, :1] ** POWER
        values, spread = self.dU(x)
        dU = size * values[0]
        near = 1 / (((x[:, None] - self.dU.places) ** 2).sum(axis=2) + SLACK) ** 2
        own = near / near.sum(axis=1, keepdims=True) @ self.own
        return dU, np.hypot(size * spread[:, None] * self.widths, np.abs(dU).max(axis=1, keepdims=True) * own)

    def with_slopes(self, places: ArrayLike) -> Array:
        """dU and its derivatives by beta, De and Ca_e, (4, places, distances); places as in `velocities`."""
        places = np.asarray(places, dtype=float)
        (x, slopes), beta = scaled(self.box, places), places[:, :1]
        values = self.dU(x)[0] * beta**POWER
        values[1:] *= slopes.T[:, :, None]
        values[1] += POWER / beta * values[0]
        return values

    def changes_by_difference(self, places: ArrayLike) -> Array | None:
        """Derivatives of dU by the difference of the diameters over their mean [U_av], shape (places, distances).

        None where they are not known. Places are those of `velocities`. In an atlas that has pairs whose beads differ,
        they follow from these, too.
        """
        if self.of_unequal is not None:
            return self.of_unequal.by_difference(np.asarray(places, dtype=float))
        if self.by_difference is None:
            return None
        places = np.asarray(places, dtype=float)
        return np.asarray(places[:, :1] ** 2 * self.by_difference(scaled(self.box, places)[0]))

    def at(self, beta: float, De: float, Ca_e: float) -> Interpolated:
        """The curve at a place in the box.

        Raises:
            InputError: The place is outside of the box.
        """
        if wrong := self.outside(beta=beta, De=De, Ca_e=Ca_e):
            raise InputError("atlas", "", None, "; ".join(wrong))
        place = np.array([[beta, De, Ca_e]])
        (dU,), (half_width,) = self.velocities(place)
        x, slopes = scaled(self.box, place)
        by = beta**POWER * self.dU(x)[0][1:, 0] * slopes.T
        by[0] += POWER / beta * dU
        U, stretch, t_relax = self.others(x)[0].reshape(3, -1)
        slope = np.gradient(dU, np.log(self.d), edge_order=2) / self.d
        changes = self.changes_by_difference(place)
        by_difference = None if changes is None else changes[0]
        sensitivities = dict(zip(PARAMETERS, by, strict=True))
        t_relax = np.maximum(t_relax, De)
        return Interpolated(self.d, dU, half_width, slope, U, stretch, t_relax, sensitivities, by_difference)


def scaled(box: Mapping[str, Sequence[float]], places: Array) -> tuple[Array, Array]:
    """Coordinates in [0, 1] of beta, De and Ca_e, which vanish with De and Ca_e, and their derivatives, (places, 3)."""
    (low, high), (_, De), (_, Ca_e) = (box[name] for name in PARAMETERS)
    sizes = np.array([(high - low) or 1.0, np.log1p(De / BEND) or 1.0, Ca_e or 1.0])
    beta, bent, one = places[:, 0] - low, np.log1p(places[:, 1] / BEND), np.ones(len(places))
    by = np.stack([one, 1 / (BEND + places[:, 1]), one], axis=1)
    return np.stack([beta, bent, places[:, 2]], axis=1) / sizes, by / sizes
