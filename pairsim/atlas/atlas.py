"""An atlas: master curves of pairs at any beta, De and Ca_e of a box, with intervals, without computing.

It is made by `pairsim.atlas.fit` of many curves. Only numpy is loaded to read and evaluate it.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from pairsim.atlas.kriging import Kriging
from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import InputError

PARAMETERS = ("beta", "De", "Ca_e")
OTHERS = ("U", "stretch", "t_relax")
"""What a curve has beside dU: mean velocity of the pair, motion of the centres over that of d, decay times."""
SHIPPED = sorted(Path(__file__).parent.glob("*.npz"))  # made by the files of these names in configs/atlas
BEND = 0.15  # De from which on dU bends: its coordinate is log(1 + De/BEND); chosen
POWER = 4.0  # of beta, by which dU is divided: of the order of what dU grows with
SLACK = 1e-9  # part of a range by which a value may be outside by rounding


@dataclass(frozen=True)
class Atlas:
    """Master curves over a box of parameters.

    Attributes:
        box: Least and largest beta, De, Ca_e and d.
        d: Distances of the curves, ascending [D_c], shape (distances,).
        dU: dU over beta ** POWER at each of them [U_av].
        others: `OTHERS` at each of them, less `means`.
        means: Shape (3 * distances,).
        widths: What a standard deviation of dU is multiplied by for the half-width of its interval, (distances,).
        own: Half-widths of the curves that it was made of over the largest |dU| of each, shape (curves, distances).
        provenance: Keys that its cases share, number of curves, version.
    """

    box: Mapping[str, tuple[float, float]]
    d: Array
    dU: Kriging
    others: Kriging
    means: Array
    widths: Array
    own: Array
    provenance: Mapping[str, Any]

    @classmethod
    def load(cls, path: Path) -> Self:
        """Read an atlas.

        Raises:
            InputError: The file cannot be read, or is no atlas of this version.
        """
        try:
            with np.load(path, allow_pickle=False) as stored:
                head = json.loads(str(stored["head"]))
                content: dict[str, Any] = {name: stored[name] for name in ("d", "means", "widths", "own")}
                for name in ("dU", "others"):
                    content[name] = Kriging(*(stored[f"{name}.{each.name}"] for each in fields(Kriging)))
                return cls(**head, **content)
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise InputError(str(path), "", None, f"must be an atlas of this version ({error})") from error

    def save(self, path: Path) -> None:
        """Write the atlas to a file that `load` reads."""
        arrays: dict[str, Any] = {"head": json.dumps({"box": self.box, "provenance": self.provenance})}
        arrays |= {name: getattr(self, name) for name in ("d", "means", "widths", "own")}
        for name in ("dU", "others"):
            arrays |= {f"{name}.{each.name}": getattr(getattr(self, name), each.name) for each in fields(Kriging)}
        with path.open("wb") as file:
            np.savez_compressed(file, **arrays)

    def outside(self, **given: float) -> list[str]:
        """In words, which of beta, De, Ca_e and d are not in the box."""
        found = []
        for name, value in given.items():
            low, high = self.box[name]
            slack = SLACK * (high - low)
            if not low - slack <= value <= high + slack:
                found.append(f"{name} = {value:.4g} is not in {low:g} to {high:g}")
        return found

    def velocities(self, places: ArrayLike) -> tuple[Array, Array]:
        """dU and half-widths of its intervals at the distances `d` [U_av], shape (places, distances) each.

        Args:
            places: beta, De and Ca_e, shape (places, 3); those outside of the box are extrapolated.
        """
        places = np.asarray(places, dtype=float)
        (x, _), size = scaled(self.box, places), places[:, :1] ** POWER
        values, spread = self.dU(x)
        dU = size * values[0]
        near = 1 / (((x[:, None] - self.dU.places) ** 2).sum(axis=2) + SLACK)
        own = np.exp(near / near.sum(axis=1, keepdims=True) @ np.log(self.own))
        return dU, size * spread[:, None] * self.widths + np.abs(dU).max(axis=1, keepdims=True) * own

    def table(self, beta: float, De: float, Ca_e: float) -> dict[str, Array]:
        """The columns of curve.csv that it has, with derivatives of dU, shape (distances,) each.

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
        U, stretch, t_relax = (self.others(x)[0][0, 0] + self.means).reshape(3, -1)
        slope = np.gradient(dU, np.log(self.d), edge_order=2) / self.d
        columns = {"d": self.d, "dU": dU, "dU_held": dU, "dU_discrete": dU, "dU_error": half_width, "slope": slope}
        columns |= {"U_L": U + dU / 2, "U_T": U - dU / 2, "stretch": stretch, "t_relax": np.maximum(t_relax, De)}
        return columns | {f"by_{name}": each for name, each in zip(PARAMETERS, by, strict=True)}


def scaled(box: Mapping[str, tuple[float, float]], places: Array) -> tuple[Array, Array]:
    """Coordinates of beta, De and Ca_e in [0, 1], zero where De and Ca_e are, and their derivatives, (places, 3)."""
    (low, high), (_, De), (_, Ca_e) = (box[name] for name in PARAMETERS)
    sizes = np.array([(high - low) or 1.0, np.log1p(De / BEND) or 1.0, Ca_e or 1.0])
    beta, bent, one = places[:, 0] - low, np.log1p(places[:, 1] / BEND), np.ones(len(places))
    by = np.stack([one, 1 / (BEND + places[:, 1]), one], axis=1)
    return np.stack([beta, bent, places[:, 2]], axis=1) / sizes, by / sizes
