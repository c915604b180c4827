"""An atlas: dU of pairs at any beta, De, Ca_e and d of a box, with intervals, without computing.

It is a polynomial, made by `pairsim.atlas.fit` of many master curves. Only numpy is loaded to read and evaluate it.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from pairsim.atlas.basis import PARAMETERS, Basis, distance_terms
from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import InputError

SLACK = 1e-9  # part of a range by which a value may be outside by rounding
LONGEST = 4096  # places that are evaluated at a time, which bounds the memory


@dataclass(frozen=True)
class Prediction:
    """Values of an atlas with their intervals.

    Attributes:
        value: The values, of the common shape of the arguments.
        half_width: Half-widths of the intervals that hold the exact values in 95 % of all places, of the same shape.
    """

    value: Array
    half_width: Array


@dataclass(frozen=True)
class Slopes:
    """Derivatives of dU on the slow manifold [U_av], of the common shape of the arguments."""

    beta: Array
    De: Array
    Ca_e: Array
    d: Array


@dataclass(frozen=True)
class Quantity:
    """One quantity of an atlas.

    Attributes:
        coefficients: Of the terms in the parameters (rows) and in the distance (columns).
        power: The polynomial is multiplied by this power of beta.
        offset: Its value at De = Ca_e = 0, where it is the same at all distances; None where it is not.
        uncertainty: Covariance of the coefficients of a column, up to the factor `widths`, shape (terms, terms).
        widths: By distance, what the root of a variance is multiplied by, shape (distances,).
        own: By distance, the half-widths of the curves themselves over the largest |value|, shape (distances,).
    """

    coefficients: Array
    power: float
    offset: float | None
    uncertainty: Array
    widths: Array
    own: Array


class Atlas:
    """Relative velocities of pairs in a box of parameters.

    Arguments of all methods are numbers or arrays that broadcast: `beta` the diameter of the particles [D_c], `De`,
    `Ca_e`, and the distance `d` between their surfaces [D_c].

    Args:
        box: Least and largest beta, De, Ca_e and d.
        basis: The terms.
        quantities: dU and others, by name.
        distances: Those of `Quantity.widths` and `.own`, ascending.
        provenance: What the atlas was made of: liquid, solid, number of curves, versions, errors of held-out curves.
    """

    def __init__(
        self,
        box: Mapping[str, tuple[float, float]],
        basis: Basis,
        quantities: Mapping[str, Quantity],
        distances: Array,
        provenance: Mapping[str, Any],
    ) -> None:
        self.box, self.basis, self.quantities = dict(box), basis, dict(quantities)
        self.distances, self.provenance = distances, dict(provenance)

    @classmethod
    def load(cls, path: Path) -> Self:
        """Read an atlas.

        Raises:
            InputError: The file cannot be read, or is no atlas of this version.
        """
        try:
            with np.load(path, allow_pickle=False) as stored:
                head = json.loads(str(stored["head"]))
                quantities = {
                    name: Quantity(
                        stored[f"{name}.coefficients"],
                        each["power"],
                        each["offset"],
                        stored[f"{name}.uncertainty"].astype(float),
                        stored[f"{name}.widths"],
                        stored[f"{name}.own"],
                    )
                    for name, each in head["quantities"].items()
                }
                box = {name: (ends[0], ends[1]) for name, ends in head["box"].items()}
                basis = Basis(box, stored["degrees"])
                return cls(box, basis, quantities, stored["distances"], head["provenance"])
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise InputError(str(path), "", None, f"must be an atlas of this version ({error})") from error

    def save(self, path: Path) -> None:
        """Write the atlas to a file that `load` reads."""
        head = {
            "box": self.box,
            "quantities": {name: {"power": q.power, "offset": q.offset} for name, q in self.quantities.items()},
            "provenance": self.provenance,
        }
        arrays: dict[str, Any] = {"degrees": self.basis.degrees, "distances": self.distances, "head": json.dumps(head)}
        for name, each in self.quantities.items():
            arrays |= {f"{name}.coefficients": each.coefficients, f"{name}.uncertainty": np.float32(each.uncertainty)}
            arrays |= {f"{name}.widths": each.widths, f"{name}.own": each.own}
        with path.open("wb") as file:
            np.savez_compressed(file, **arrays)

    def contains(self, beta: ArrayLike, De: ArrayLike, Ca_e: ArrayLike, d: ArrayLike) -> np.ndarray:
        """Whether places are in the box; booleans of the common shape of the arguments."""
        inside = np.array(True)
        for name, values in zip((*PARAMETERS, "d"), (beta, De, Ca_e, d), strict=True):
            low, high = self.box[name]
            slack = SLACK * (high - low)
            given = np.asarray(values)
            inside = inside & (given >= low - slack) & (given <= high + slack)
        return inside

    def velocity(self, beta: ArrayLike, De: ArrayLike, Ca_e: ArrayLike, d: ArrayLike) -> Prediction:
        """dU of particles that move, on the slow manifold, with half-widths of its intervals [U_av].

        Raises:
            InputError: A place is outside of the box.
        """
        return self._predicted("dU", beta, De, Ca_e, d)

    def slopes(self, beta: ArrayLike, De: ArrayLike, Ca_e: ArrayLike, d: ArrayLike) -> Slopes:
        """Derivatives of dU by beta, De, Ca_e and d [U_av; U_av/D_c].

        Raises:
            InputError: A place is outside of the box.
        """
        places, distances, shape = self._places(beta, De, Ca_e, d)
        quantity, by = self.quantities["dU"], []
        for along in range(3):
            by.append(self._sum(quantity, places, distances, along=along))
        by.append(self._sum(quantity, places, distances, by_distance=True))
        return Slopes(*(each.reshape(shape) for each in by))

    def t_relax(self, beta: ArrayLike, De: ArrayLike, Ca_e: ArrayLike, d: ArrayLike) -> Array:
        """Decay time of a disturbance at held distances [D_c/U_av], as in curves; at least De."""
        return np.maximum(self._predicted("t_relax", beta, De, Ca_e, d).value, np.asarray(De, dtype=float))

    def stretch(self, beta: ArrayLike, De: ArrayLike, Ca_e: ArrayLike, d: ArrayLike) -> Array:
        """Derivative of the distance between the centres by d: d changes at the rate dU / stretch."""
        return self._predicted("stretch", beta, De, Ca_e, d).value

    def mean_velocity(self, beta: ArrayLike, De: ArrayLike, Ca_e: ArrayLike, d: ArrayLike) -> Array:
        """Mean of the velocities of both particles [U_av]."""
        return self._predicted("U", beta, De, Ca_e, d).value

    def _places(
        self, beta: ArrayLike, De: ArrayLike, Ca_e: ArrayLike, d: ArrayLike
    ) -> tuple[Array, Array, tuple[int, ...]]:
        """Parameters (places, 3), distances (places,), and the common shape of the arguments."""
        given = np.broadcast_arrays(*(np.asarray(each, dtype=float) for each in (beta, De, Ca_e, d)))
        outside = ~self.contains(*given)
        if outside.any():
            first = {name: float(each[outside].flat[0]) for name, each in zip(self.box, given, strict=True)}
            ranges = ", ".join(f"{name} {low:g} to {high:g}" for name, (low, high) in self.box.items())
            raise InputError("atlas", "", ", ".join(f"{k} = {v:g}" for k, v in first.items()), f"must be in {ranges}")
        flat = [each.ravel() for each in given]
        return np.stack(flat[:3], axis=-1), flat[3], given[0].shape

    def _predicted(self, name: str, *given: ArrayLike) -> Prediction:
        places, distances, shape = self._places(*given)
        quantity = self.quantities[name]
        value, half = np.empty(len(places)), np.empty(len(places))
        for start in range(0, len(places), LONGEST):
            part = slice(start, start + LONGEST)
            value[part], half[part] = self._values(quantity, places[part], distances[part])
        return Prediction(value.reshape(shape), half.reshape(shape))

    def _values(self, quantity: Quantity, places: Array, distances: Array) -> tuple[Array, Array]:
        """Values and half-widths, shape (places,) each."""
        count = quantity.coefficients.shape[1]
        terms = self.basis.terms(places, quantity.offset is not None)
        scale = places[:, 0] ** quantity.power
        by_distance = terms @ quantity.coefficients
        ends = self.box["d"]
        value = scale * (by_distance * distance_terms(distances, ends, count)).sum(axis=1)
        curves = by_distance @ distance_terms(self.distances, ends, count).T
        largest = scale * np.abs(curves).max(axis=1)
        spread = scale * np.sqrt(np.maximum(((terms @ quantity.uncertainty) * terms).sum(axis=1), 0.0))
        x = np.log(distances)
        widths, own = (np.interp(x, np.log(self.distances), each) for each in (quantity.widths, quantity.own))
        return value + (quantity.offset or 0.0), spread * widths + largest * own

    def _sum(
        self, quantity: Quantity, places: Array, d: Array, along: int | None = None, by_distance: bool = False
    ) -> Array:
        """A derivative of a quantity by a parameter or by the distance, shape (places,)."""
        vanishing, beta = quantity.offset is not None, places[:, 0]
        across = distance_terms(d, self.box["d"], quantity.coefficients.shape[1], by_distance)

        def total(along: int | None) -> Array:
            return np.asarray(((self.basis.terms(places, vanishing, along) @ quantity.coefficients) * across).sum(1))

        found = beta**quantity.power * total(along)
        if along == 0 and quantity.power:
            found = found + quantity.power * beta ** (quantity.power - 1) * total(None)
        return np.asarray(found)
