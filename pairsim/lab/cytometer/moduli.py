"""Young's moduli of the events in a cytometer's file, by a look-up table: `moduli`."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from pairsim.lab.cytometer.look_up_table import (
    CONSISTENCY,
    INDEX,
    LAW,
    UNCORRECTED,
    Head,
    modulus_at,
    read_look_up_table,
)
from pairsim.lab.cytometer.rtdc_file import (
    FLOW_RATE,
    MEDIUM,
    PIXEL_SIZE,
    WIDTH,
    CytometerFile,
    read_cytometer_file,
)
from pairsim.lab.cytometer.suspending_media import NAMES, concentration, extrapolated, methyl_cellulose, wall_rate
from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import Argument, InputError

# The deformation that pixels of 0.34 um add to that of a sphere, over its area (Herold, arXiv:1704.00572, 2017).
PIXEL, OFFSET = 0.34, 0.0012
DECAYS = ((0.020, 7.1), (0.010, 38.6), (0.005, 296.0))
OF_INDEX = 0.5  # largest relative error of the modulus per difference of the flow indices (docs/how-to/cytometry.md)
OF_TABLE = "table"


class Moduli(NamedTuple):
    """Young's moduli of the events of a file.

    Attributes:
        table: A row for each event: area [um^2], deformation without what pixels add to it, modulus and its half-width
            [kPa]; the last two are nan outside of the look-up table.
        sentences: What was found, and what it rests on.
        look_up: The look-up table scaled to channel and flow of the file: area [um^2], deformation, modulus [kPa] and
            its relative half-width, shape (m, 4).
    """

    table: pd.DataFrame
    sentences: list[str]
    look_up: Array


def moduli(file: Path | str, table: Path | str, *, carrier: str | None = None, celsius: float | None = None) -> Moduli:
    """Compute Young's modulus of every event of a cytometer's file.

    Args:
        file: An .rtdc file.
        table: A look-up table of `pairsim table --cytometry`, or another one in the format of dclab.
        carrier: The carrier, such as "0.59% MC-PBS", in place of that in the file; "table" is that of the table.
        celsius: Its temperature in degrees Celsius, in place of that in the file.

    Raises:
        InputError: A file cannot be read or says too little, or the table does not hold for this carrier and flow.
    """
    meta, look_up = read_look_up_table(Path(table))
    found = read_cytometer_file(Path(file))
    area, pixel = found.area, found.number(PIXEL_SIZE)
    added = sum(a * np.exp(-area * (PIXEL / pixel) ** 2 / decay) for a, decay in DECAYS)
    events = pd.DataFrame({"area_um": area, "deform": found.deformation - OFFSET - added})
    flow = _flow(meta, found, carrier, celsius)
    look_up = look_up * [(found.number(WIDTH) / meta["channel_width"]) ** 2, 1.0, flow.stress, 1.0]
    events["emodulus"], error = modulus_at(look_up, *events.to_numpy().T)
    events["emodulus_error"] = events["emodulus"] * (error + flow.of_index)
    inside = events.dropna()
    if inside.empty:
        allowed, own = (_ranges(each) for each in (look_up, events.to_numpy()))
        raise InputError(str(file), "", None, f"must have events in the table, {allowed}; those of the file are {own}")
    low, middle, high = inside["emodulus"].quantile([0.16, 0.5, 0.84])
    sentences = [
        f"Young's modulus of {len(inside)} of {len(events)} events, which lie in the table: median {middle:.4g} +- "
        f"{inside['emodulus_error'].median():.2g} kPa, two thirds of them from {low:.4g} to {high:.4g} kPa",
        flow.words,
        "the half-width includes errors of the table, its interpolation and the flow index, but not those of the "
        "viscosity and of the pixels of single events",
    ]
    if meta.get("channel", meta.get("dimensionality")) in ("equivalent", "2Daxis"):
        sentences.append(UNCORRECTED)
    sentences += [f"warning: {doubt}" for doubt in (*flow.warnings, *found.doubts())]
    return Moduli(events, sentences, look_up)


def _ranges(values: Array) -> str:
    """The ranges of the finite areas and deformations, which are the first two columns, in words."""
    finite = [column[np.isfinite(column)] for column in values.T[:2]]
    if not all(column.size for column in finite):
        return "not numbers"
    areas, deformations = (f"{column.min():.3g} to {column.max():.3g}" for column in finite)
    return f"of {areas} um^2, with deformations of {deformations}"


class _Flow(NamedTuple):
    """The flow of a file compared with that of a table."""

    stress: float  # at the walls, over that of the table
    of_index: float  # relative half-width of moduli due to the difference of the flow indices
    words: str  # on the carrier
    warnings: list[str]


def _flow(meta: Head, file: CytometerFile, carrier: str | None, celsius: float | None) -> _Flow:
    """Compare the flow of a file with that of a table, whose head is `meta`."""
    width, flow_rate = 1e-6 * file.number(WIDTH), 1e-9 * file.number(FLOW_RATE)
    own_width, own_flow_rate = 1e-6 * meta["channel_width"], 1e-9 * meta["flow_rate"]
    own_liquid = LAW in meta and INDEX not in meta
    if celsius is not None and (own_liquid or carrier == OF_TABLE):
        allowed = "must be left out: the liquid is that of the table, at any temperature"
        raise InputError("pairsim moduli", Argument("celsius"), celsius, allowed)
    if own_liquid:
        flow = f"in {meta['channel_width']:g} um at {meta['flow_rate']:g} ul/s"
        allowed = f"holds for its own liquid ({meta[LAW]}) {flow}"
        same = np.allclose((width, flow_rate), (own_width, own_flow_rate), rtol=1e-3, atol=0)
        if not same or carrier not in (None, OF_TABLE):
            raise InputError(
                "pairsim moduli", Argument("table"), None, f"{allowed} only; another flow needs another table"
            )
        return _Flow(1.0, 0.0, f"carrier: that of the table ({meta[LAW]})", [])
    own_n = n = meta.get(INDEX, 1.0)
    own_K = K = meta.get(CONSISTENCY, 1e-3 * meta["fluid_viscosity"])
    name, warnings = file.text(MEDIUM) if carrier is None else carrier, list[str]()
    if name != OF_TABLE:
        known = NAMES[_concentration(name, file, carrier)]
        warnings += file.doubtful_temperatures() if celsius is None else ()
        celsius = file.celsius if celsius is None else celsius
        K, n = methyl_cellulose(name, celsius)
        warnings += extrapolated(celsius, wall_rate(flow_rate, width, n))
        name += f"{'' if name == known else f' ({known})'} at {celsius:.3g} degC, n = {n:.4g}"
    stress = K * wall_rate(flow_rate, width, n) ** n / (own_K * wall_rate(own_flow_rate, own_width, own_n) ** own_n)
    words = f"carrier: {name} (table: n = {own_n:.4g}); stress at the walls {stress:.4g} times that of the table"
    return _Flow(stress, OF_INDEX * abs(n - own_n), words, warnings)


def _concentration(name: str, file: CytometerFile, carrier: str | None) -> float:
    """Concentration of the carrier [% of the mass]; an InputError for an unknown name says where it was given."""
    try:
        return concentration(name)
    except InputError as error:
        if carrier is not None:
            raise InputError("pairsim moduli", Argument("carrier"), name, f"{error.allowed}, or table") from None
        raise InputError(str(file.path), MEDIUM, name or None, f"{error.allowed}; or give `carrier`") from None
