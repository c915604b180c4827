"""Pairs whose beads differ in size and stiffness, in an atlas: dU from curves of equal and of unequal pairs.

dU of a pair has three parts: that of two equal beads of the mean diameter and the mean Ca_e; the difference of the
velocities of both beads on their own, which is all that is left far apart; and a rest, which vanishes where the beads
are equal. The rest is kriging over beta, De, Ca_e (means) and the differences of the diameters and of Ca_e, from
unequal curves with their derivatives, and from the derivative of equal ones by the difference of the diameters.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any, NamedTuple, Self

import numpy as np

from pairsim.atlas.atlas import PARAMETERS, SLACK, Atlas, Interpolated, scaled
from pairsim.atlas.kriging import Kriging
from pairsim.atlas.single_beads import SingleBeads
from pairsim.runtime.arrays import Array, Flags
from pairsim.runtime.errors import InputError

PREFIX = "unequal_"  # of names of arrays in a file
DIMENSIONS = 5  # beta, De and Ca_e (means), and the two differences
DIFFERENCES = (3, 4)  # the places of these two, with which the rest vanishes
OF_DIAMETERS = 0.1  # unit of the difference of the diameters; that of Ca_e is the largest Ca_e of the box
NEIGHBOURS = 3  # distances on either side over which a median is taken
ROUNDING = 1e-3  # part of a ratio by which it may be outside, as numbers may have few digits
POWER_OF_REST = 2.0  # power of beta by which the rest is divided: that with which the effect of a difference grows


class Beads(NamedTuple):
    """Pairs of beads, the trailing (upstream) one first."""

    betas: Array  # shape (pairs, 2)
    De: Array  # shape (pairs,)
    Ca_es: Array  # shape (pairs, 2)

    def those(self, which: Flags) -> Beads:
        """Some of the pairs."""
        return Beads(*(each[which] for each in self))

    @property
    def means(self) -> Array:
        """beta, De and Ca_e of equal beads between them, shape (pairs, 3)."""
        return np.stack([self.betas.mean(axis=1), self.De, self.Ca_es.mean(axis=1)], axis=1)

    @property
    def differences(self) -> Array:
        """Leading minus trailing bead: diameters, over their mean, and Ca_e, shape (pairs, 2)."""
        relative = np.diff(self.betas)[:, 0] / self.betas.mean(axis=1)
        return np.stack([relative, np.diff(self.Ca_es)[:, 0]], axis=1)

    def alone(self, which: int) -> Array:
        """beta, De and Ca_e of the trailing (0) or leading (1) bead, shape (pairs, 3)."""
        return np.stack([self.betas[:, which], self.De, self.Ca_es[:, which]], axis=1)

    @property
    def numbers(self) -> Array:
        """betas, De and Ca_es, shape (pairs, 5)."""
        return np.concatenate([self.betas, self.De[:, None], self.Ca_es], axis=1)

    @property
    def ratios(self) -> dict[str, Array]:
        """Ratios of the diameters and of the moduli, leading over trailing, shape (pairs,) each; 1 of rigid beads."""
        (first, second), (soft, softer) = self.betas.T, self.Ca_es.T
        with np.errstate(divide="ignore", invalid="ignore"):
            return {"diameters": second / first, "moduli": np.where(soft == softer, 1.0, soft / softer)}


@dataclass(frozen=True)
class UnequalCurves:
    """Master curves of unequal pairs at the distances of an atlas."""

    betas: Array  # as in `Beads`
    De: Array
    Ca_es: Array
    random: Flags  # whether they were drawn at random among all pairs of the atlas, shape (curves,)
    dU: Array  # dU on the slow manifold [U_av], shape (curves, distances)
    errors: Array  # half-widths of its intervals, of the same shape
    gradients: Array  # derivatives by means and differences, nan where not known, (curves, DIMENSIONS, distances)
    ends: Array  # velocities of the trailing and the leading bead at the largest distance [U_av], shape (curves, 2)

    @property
    def beads(self) -> Beads:
        return Beads(self.betas, self.De, self.Ca_es)

    def __add__(self, other: UnequalCurves) -> UnequalCurves:
        return UnequalCurves(*map(np.concatenate, zip(vars(self).values(), vars(other).values(), strict=True)))

    def __getitem__(self, which: Flags) -> UnequalCurves:
        return UnequalCurves(*(each[which] for each in vars(self).values()))


@dataclass(frozen=True)
class Unequal:
    """The pairs of an atlas whose beads differ, beside its curves of equal ones."""

    ratios: Mapping[str, Sequence[float]]  # least and largest ratio of "diameters" and "moduli", leading to trailing
    settings: Array  # correlation lengths (DIMENSIONS), errors of values, of derivatives, and of those of equal pairs
    widths: Array  # factors from the standard deviation to the half-width of the rest, (distances,)
    curves: UnequalCurves
    beads: SingleBeads  # beads on their own

    @property
    def arrays(self) -> dict[str, Array]:
        """Its arrays by their names in the file of an atlas."""
        own = {"settings": self.settings, "widths": self.widths}
        return {f"{PREFIX}{name}": array for name, array in (vars(self.curves) | own).items()} | self.beads.arrays

    @classmethod
    def of_file(
        cls, ratios: Mapping[str, Sequence[float]], box: Mapping[str, Sequence[float]], arrays: dict[str, Any]
    ) -> Self:
        """The unequal pairs of a file of an atlas, whose arrays are removed from `arrays`."""
        curves = UnequalCurves(*(arrays.pop(f"{PREFIX}{each.name}") for each in fields(UnequalCurves)))
        settings, widths = (arrays.pop(f"{PREFIX}{name}") for name in ("settings", "widths"))
        return cls(ratios, settings, widths, curves, SingleBeads.of_file(box, arrays))


@dataclass(frozen=True)
class UnequalAtlas:
    """An atlas together with its unequal pairs, for which it answers."""

    equal: Atlas
    unequal: Unequal

    def without_rest(self, beads: Beads) -> Array:
        """The first two parts of dU, and derivatives by means and differences, (1 + DIMENSIONS, pairs, distances)."""
        means, found = beads.means, self.equal.with_slopes(beads.means)
        whole = np.concatenate([found, np.zeros((2, *found.shape[1:]))])
        (trailing, by_trailing), (leading, by_leading) = (self.unequal.beads(beads.alone(i)) for i in (0, 1))
        beta, half = means[:, 0], beads.differences[:, 0] / 2
        changes = [
            leading - trailing,
            (1 + half) * by_leading[0] - (1 - half) * by_trailing[0],
            by_leading[1] - by_trailing[1],
            by_leading[2] - by_trailing[2],
            beta / 2 * (by_leading[0] + by_trailing[0]),
            (by_leading[2] + by_trailing[2]) / 2,
        ]
        return whole + np.array(changes)[:, :, None]

    def coordinates(self, beads: Beads) -> tuple[Array, Array]:
        """Coordinates of the rest, and their derivatives by means and differences, shape (pairs, DIMENSIONS)."""
        x, slopes = scaled(self.equal.box, beads.means)
        units = np.array([OF_DIAMETERS, self.equal.box["Ca_e"][1] or 1.0])
        by = np.broadcast_to(1 / units, (len(x), 2))
        return np.concatenate([x, beads.differences / units], axis=1), np.concatenate([slopes, by], axis=1)

    def data_of(self, curves: UnequalCurves) -> tuple[Array, Array]:
        """Coordinates of the data of the rest, those of equal pairs first, and the data as for `Kriging.of`.

        The values of each curve at its largest distance are subtracted from it: beads are on their own there, and
        errors of derivatives that are the same at all distances vanish with them.
        """
        equal = self.equal.curves
        same = Beads(equal.places[:, [0, 0]], equal.places[:, 1], equal.places[:, [2, 2]])
        x, known = zip(*(self.coordinates(beads) for beads in (same, curves.beads)), strict=True)
        size = curves.betas.mean(axis=1)[:, None] ** POWER_OF_REST
        rest = np.concatenate([curves.dU[None], curves.gradients.swapaxes(0, 1)])
        rest[: 1 + len(PARAMETERS)] -= self.equal.with_slopes(curves.beads.means)
        rest = (rest - rest[:, :, -1:]) / size
        rest[1] -= POWER_OF_REST / curves.betas.mean(axis=1)[:, None] * rest[0]
        rest[1:] /= known[1].T[:, :, None]
        of_equal = np.full((1 + DIMENSIONS, *equal.dU.shape), np.nan)
        change = _without_outliers(equal.differences - equal.differences[:, -1:])
        of_equal[1 + DIFFERENCES[0]] = change * OF_DIAMETERS / equal.places[:, :1] ** POWER_OF_REST
        return np.concatenate(x), np.concatenate([of_equal, rest], axis=1)

    def kriging(self, places: Array, data: Array, settings: Array) -> Kriging:
        """The kriging of the rest from data, as from `data_of`; settings are those of `Unequal`."""
        of_values, of_derivatives, of_equal = settings[DIMENSIONS:]
        errors = np.full(data.shape[:2], of_derivatives)
        errors[0], errors[:, : len(self.equal.curves.places)] = of_values, of_equal
        return Kriging.of(places, data, errors, settings[:DIMENSIONS], DIFFERENCES)

    @cached_property
    def rest(self) -> Kriging:
        """The kriging of the rest over beta ** POWER_OF_REST, the third part of dU."""
        return self.kriging(*self.data_of(self.unequal.curves), self.unequal.settings)

    @cached_property
    def own(self) -> tuple[Array, Array]:
        """Coordinates of the unequal curves, and their half-widths relative to their peaks, (curves, distances)."""
        curves = self.unequal.curves
        relative = curves.errors / np.abs(curves.dU).max(axis=1, keepdims=True)
        return self.coordinates(curves.beads)[0], np.maximum(relative, SLACK)

    def velocities(self, beads: Beads) -> tuple[Array, Array]:
        """dU and half-widths of its intervals at the distances of the atlas [U_av], shape (pairs, distances) each.

        Half-widths combine those of the equal pair between them, of both beads on their own, of the rest, and of the
        unequal curves nearby.
        """
        (between, of_equal), (x, _) = self.equal.velocities(beads.means), self.coordinates(beads)
        (trailing, of_trailing), (leading, of_leading) = (self.unequal.beads.values(beads.alone(i)) for i in (0, 1))
        rest, spread = self.rest.values(x)
        size = beads.means[:, :1] ** POWER_OF_REST
        dU = between + (leading - trailing)[:, None] + size * rest
        places, relative = self.own
        near = 1 / (((x[:, None] - places) ** 2).sum(axis=2) + SLACK) ** 2
        own = near / near.sum(axis=1, keepdims=True) @ relative * np.abs(dU).max(axis=1, keepdims=True)
        of_rest, alone = size * spread[:, None] * self.unequal.widths, np.hypot(of_trailing, of_leading)[:, None]
        return dU, np.sqrt(of_equal**2 + alone**2 + of_rest**2 + own**2)

    def slopes(self, beads: Beads) -> Array:
        """Derivatives of dU by means and differences, shape (DIMENSIONS, pairs, distances)."""
        x, slopes = self.coordinates(beads)
        rest, beta = self.rest(x)[0], beads.means[:, :1]
        by = rest[1:] * slopes.T[:, :, None]
        by[0] += POWER_OF_REST / beta * rest[0]
        return np.asarray(self.without_rest(beads)[1:] + beta**POWER_OF_REST * by)

    def by_difference(self, places: Array) -> Array:
        """Derivatives of dU of equal pairs by the difference of their diameters over their mean, (places, distances).

        Args:
            places: beta, De and Ca_e, shape (places, 3).
        """
        beta, De, Ca_e = places.T
        return np.asarray(self.slopes(Beads(np.tile(beta, (2, 1)).T, De, np.tile(Ca_e, (2, 1)).T))[3])

    def outside(self, betas: Sequence[float], De: float, Ca_es: Sequence[float]) -> list[str]:
        """Which numbers of a pair are outside of the box or of the ratios, in words."""
        said = outside_of(self.equal, betas, De, Ca_es)
        for name, (value,) in beads_of(betas, De, Ca_es).ratios.items():
            low, high = self.unequal.ratios[name]
            if not low * (1 - ROUNDING) <= value <= high * (1 + ROUNDING):
                said.append(
                    f"the ratio of the {name}, leading to trailing, is {value:.4g}, not between {low:g} and {high:g}"
                )
        return said

    def at(self, betas: Sequence[float], De: float, Ca_es: Sequence[float]) -> Interpolated:
        """The curve of a pair, of which beta and Ca_e are those of the trailing and the leading bead.

        Derivatives by beta and Ca_e are those by the larger one of both beads at constant ratios, as for curves.

        Raises:
            InputError: The pair is outside of the box or of the ratios.
        """
        if wrong := self.outside(betas, De, Ca_es):
            raise InputError("atlas", "", None, "; ".join(wrong))
        beads = beads_of(betas, De, Ca_es)
        (dU,), (half_widths,) = self.velocities(beads)
        ((beta, _, Ca_e),), ((difference, softness),) = beads.means, beads.differences
        between = self.equal.at(beta, De, Ca_e)
        by_beta, by_De, by_Ca_e, by_difference, by_softness = self.slopes(beads)[:, 0]
        sensitivities = {
            "beta": by_beta * beta / max(betas),
            "De": by_De,
            "Ca_e": (by_Ca_e * Ca_e + by_softness * softness) / (max(Ca_es) or 1.0),
        }
        velocities = [self.unequal.beads(places)[0][0] for places in (beads.alone(0), beads.alone(1), beads.means)]
        return Interpolated(
            self.equal.d,
            dU,
            half_widths,
            np.gradient(dU, np.log(self.equal.d), edge_order=2) / self.equal.d,
            between.U + (velocities[0] + velocities[1]) / 2 - velocities[2],
            between.stretch,
            between.t_relax,
            sensitivities,
            by_difference * (1 - difference**2 / 4) + by_beta * beta * difference / 4,
        )

    def by_stiffness(self, betas: Sequence[float], De: float, Ca_es: Sequence[float]) -> Array:
        """The derivative of dU of a pair by the difference of its moduli over their mean, (distances,)."""
        beads = beads_of(betas, De, Ca_es)
        ((_, _, Ca_e),), ((_, softness),) = beads.means, beads.differences
        _, _, by_Ca_e, _, by_softness = self.slopes(beads)[:, 0]
        return np.asarray(-(by_Ca_e * softness / 4 + by_softness * Ca_e))


def _without_outliers(values: Array) -> Array:
    """Medians of values over neighbouring distances, shape (curves, distances); monotonic values do not change.

    Derivatives by the difference of diameters come from few points of coarse curves, of which some are wrong.
    """
    padded = np.pad(values, ((0, 0), (NEIGHBOURS, NEIGHBOURS)), mode="edge")
    return np.asarray(np.median(np.lib.stride_tricks.sliding_window_view(padded, 2 * NEIGHBOURS + 1, axis=1), axis=2))


def outside_of(atlas: Atlas, betas: Sequence[float], De: float, Ca_es: Sequence[float]) -> list[str]:
    """Which numbers of a pair are outside of the box of an atlas, in words."""
    pairs = zip(betas, Ca_es, strict=True)
    found = [each for beta, Ca_e in pairs for each in atlas.outside(beta=beta, De=De, Ca_e=Ca_e)]
    return list(dict.fromkeys(found))


def beads_of(betas: Sequence[float], De: float, Ca_es: Sequence[float]) -> Beads:
    """One pair."""
    return Beads(np.array([betas], dtype=float), np.array([De], dtype=float), np.array([Ca_es], dtype=float))


def gradients_of(beads: Beads, by: Mapping[str, Array]) -> Array:
    """Derivatives by means and differences from the columns of curves, nan where not known, (DIMENSIONS, pairs, n).

    Args:
        beads: The pairs.
        by: Derivatives by beta, De and Ca_e (the larger one at constant ratios), by the "difference" of the diameters
            and the "stiffness", each over their means, shape (pairs, n).
    """
    (beta, _, Ca_e), (difference, softness) = beads.means.T[:, :, None], beads.differences.T[:, :, None]
    by_beta = by["beta"] * beads.betas.max(axis=1)[:, None] / beta
    by_difference = (by["difference"] - beta * difference / 4 * by_beta) / (1 - difference**2 / 4)
    softer = by["Ca_e"] * beads.Ca_es.max(axis=1)[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        by_Ca_e = (Ca_e * softer + softness * by["stiffness"]) / (Ca_e**2 - softness**2 / 4)
        by_softness = -(by["stiffness"] + softness / 4 * by_Ca_e) / Ca_e
    return np.stack([by_beta, by["De"], by_Ca_e, by_difference, by_softness])
