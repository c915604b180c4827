"""The fields that can be drawn: what each is, and its values from a frame of fields.xdmf."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from pairsim.plots.meridional_section import surface_nodes
from pairsim.results.columns import STRESS, VELOCITY
from pairsim.results.xdmf import FieldFrame
from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import InputError


@dataclass(frozen=True)
class Field:
    """A field that can be drawn.

    Attributes:
        label: Symbol and unit (TeX), for the colour bar.
        values: At the nodes (n,), from a frame.
        needs: Fields of fields.xdmf that it is made of: all of them, or any one of them if `any_of`.
        any_of: Whether one of `needs` is enough. Where the liquid's or the particles' is missing, they stay blank.
        liquid: The field of fields.xdmf without which the liquid stays blank, "" if it never does.
        solid: The same of the particles; None: they have no such field.
        diverging: Whether colours are centred on zero.
        meaning: In words, for `pairsim plot --help`.
    """

    label: str
    values: Callable[[FieldFrame], Array]
    meaning: str
    needs: tuple[str, ...]
    any_of: bool = False
    liquid: str = ""
    solid: str | None = None
    diverging: bool = True

    def there(self, frame: FieldFrame) -> bool:
        """Whether a frame has what it is made of."""
        found = [name in frame.point_data for name in self.needs]
        return any(found) if self.any_of else all(found)


def particle_velocity(frame: FieldFrame) -> float:
    """Mean axial velocity of the particles' surfaces; 0 without particles."""
    nodes = surface_nodes(frame)
    return float(np.mean([frame.point_data["velocity"][arc, 0].mean() for arc in nodes])) if nodes else 0.0


def _velocity(frame: FieldFrame) -> Array:
    return frame.point_data["velocity"][:, 0]


def _relative(frame: FieldFrame) -> Array:
    return frame.point_data["velocity"][:, 0] - particle_velocity(frame)


def _stress(component: Callable[[Array], Array]) -> Callable[[FieldFrame], Array]:
    """A component of the polymer's stress in the liquid and of the elastic stress in the particles."""

    def values(frame: FieldFrame) -> Array:
        parts = [component(frame.point_data[name]) for name in ("tau_p", "tau_s") if name in frame.point_data]
        return np.asarray(sum(parts))  # each is zero where the other one lives

    return values


def _stored(name: str) -> Callable[[FieldFrame], Array]:
    return lambda frame: frame.point_data[name]


BOTH: dict[str, Any] = {"needs": ("tau_p", "tau_s"), "any_of": True, "liquid": "tau_p", "solid": "tau_s"}
FIELDS: dict[str, Field] = {
    "velocity": Field(
        rf"$u_z\ [{VELOCITY}]$", _velocity, "axial velocity", ("velocity",), solid="tau_s", diverging=False
    ),
    "streamlines": Field(
        rf"$u_z - U\ [{VELOCITY}]$", _relative, "streamlines in the frame of the particles", ("velocity",)
    ),
    "tr_c": Field(r"$\mathrm{tr}\,c\ [-]$", _stored("tr_c"), "trace of the conformation", ("tr_c",), diverging=False),
    "N1": Field(
        rf"$\tau_{{zz}} - \tau_{{rr}}\ [{STRESS}]$",
        _stress(lambda tau: tau[:, 0] - tau[:, 2]),
        "normal stress difference: of the polymer, and elastic in the particles",
        **BOTH,
    ),
    "tau_zz": Field(
        rf"$\tau_{{zz}}\ [{STRESS}]$",
        _stress(lambda tau: tau[:, 0]),
        "axial stress: of the polymer, and elastic in the particles",
        **BOTH,
    ),
    "tau_zz_extra": Field(
        rf"$\tau_{{zz}} - \tau_{{zz\infty}}\ [{STRESS}]$",
        _stored("tau_p_zz_extra"),
        "axial stress of the polymer less that without particles",
        ("tau_p_zz_extra",),
    ),
    "pressure": Field(rf"$p\ [{STRESS}]$", _stored("pressure"), "pressure", ("pressure",), diverging=False),
    "pressure_extra": Field(
        rf"$p - p_\infty\ [{STRESS}]$",
        _stored("pressure_extra"),
        "pressure less that without particles",
        ("pressure_extra",),
    ),
}
"""The fields by the names that `pairsim plot --field` takes."""


def chosen_fields(words: str | None, frame: FieldFrame, where: str) -> list[str]:
    """Names of fields, separated by commas; "all": those that a frame has.

    Args:
        words: The names, None for none.
        frame: A frame.
        where: Its file, for messages.

    Raises:
        InputError: A name is unknown, or the frame does not have that field.
    """
    if words is None:
        return []
    there = [name for name, entry in FIELDS.items() if entry.there(frame)]
    names = there if words == "all" else list(dict.fromkeys(name.strip() for name in words.split(",")))
    for name in names:
        if name not in FIELDS:
            raise InputError("--field", "", name, f"must be one or more of {', '.join(FIELDS)}, or all")
        if name not in there:
            raise InputError("--field", "", name, f"must be one of {', '.join(there)}, which {where} has")
    return names
