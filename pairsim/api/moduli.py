"""Young's moduli of the events in a cytometer's file, by a look-up table: `moduli`."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from pairsim.physics.carriers import extrapolated, methyl_cellulose, wall_rate
from pairsim.results.cytometry import CONSISTENCY, INDEX, LAW, UNCORRECTED, modulus_at, read_look_up_table
from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import InputError

# What pixels add to the deformation of a sphere, by its area in pixels of 0.34 um (Herold, arXiv:1704.00572, 2017).
PIXEL, OFFSET = 0.34, 0.0012
DECAYS = ((0.020, 7.1), (0.010, 38.6), (0.005, 296.0))
OF_INDEX = 0.5  # largest error of the modulus over the difference of the flow indices (docs/how-to/cytometry.md)
OF_TABLE = "table"
WIDTH, FLOW_RATE, TEMPERATURE = "setup:channel width", "setup:flow rate", "setup:temperature"
PIXEL_SIZE = "imaging:pixel size"


class Moduli(NamedTuple):
    """Area [um^2], deformation without what pixels add, modulus and its half-width [kPa] of the events of a file.

    They are nan outside of the look-up table, which is here in the conditions of the file, with relative half-widths.
    """

    table: pd.DataFrame
    sentences: list[str]  # what was found, and what it rests on
    look_up: Array


def moduli(file: Path | str, table: Path | str, *, carrier: str | None = None, celsius: float | None = None) -> Moduli:
    """Compute Young's modulus of every event of a cytometer's file.

    Args:
        file: An .rtdc file.
        table: A look-up table of `pairsim table --cytometry`, or another one in the format of dclab.
        carrier: The carrier, such as "0.59% MC-PBS", in place of what the file says; "table" is that of the table.
        celsius: Its temperature, in place of what the file says.

    Raises:
        InputError: A file cannot be read or says too little, or the table does not hold for this carrier and flow.
    """
    meta, look_up = read_look_up_table(Path(table))
    found, setup = read_events(Path(file))
    added = sum(a * np.exp(-found["area_um"] * (PIXEL / setup[PIXEL_SIZE]) ** 2 / decay) for a, decay in DECAYS)
    events = pd.DataFrame({"area_um": found["area_um"], "deform": found["deform"] - OFFSET - added})
    stress, of_index, words = _stress(meta, setup, carrier, celsius)
    look_up = look_up * [(setup[WIDTH] / meta["channel_width"]) ** 2, 1.0, stress, 1.0]
    events["emodulus"], error = modulus_at(look_up, *events.to_numpy().T)
    events["emodulus_error"] = events["emodulus"] * (error + of_index)
    inside = events.dropna()
    if inside.empty:
        areas, deformations = (f"{each.min():.3g} to {each.max():.3g}" for each in look_up.T[:2])
        allowed = f"must have events in the table: of {areas} um^2, with deformations of {deformations}"
        raise InputError(str(file), "", None, allowed)
    low, middle, high = inside["emodulus"].quantile([0.16, 0.5, 0.84])
    sentences = [
        f"Young's modulus of {len(inside)} of {len(events)} events, which lie in the table: median {middle:.4g} +- "
        f"{inside['emodulus_error'].median():.2g} kPa, two thirds of them within {low:.4g} to {high:.4g} kPa",
        words,
        "in the half-width: the table, its interpolation, the flow index; not the viscosity, the pixels of one event",
    ]
    if meta.get("channel", meta.get("dimensionality")) in ("equivalent", "2Daxis"):
        sentences.append(UNCORRECTED)
    return Moduli(events, sentences, look_up)


def read_events(path: Path) -> tuple[dict[str, Array], dict[str, Any]]:
    """Read an .rtdc file (HDF5).

    Returns:
        "area_um" and "deform" of the events, (m,) each; and the attributes of the file, such as "setup:flow rate"
        [ul/s], lengths in um, with the median temperature where events have one.

    Raises:
        InputError: It cannot be read, was not measured in the channel, or does not have what is needed.
    """
    import h5py

    with suppress(ImportError):
        import hdf5plugin  # noqa: F401  # registers the filters of compressed files

    try:
        with h5py.File(path) as file:
            setup = {key: each.decode() if isinstance(each, bytes) else each for key, each in file.attrs.items()}
            group = file["events"]
            wanted = [name for name in ("area_um", "deform", "temp") if name in group]
            events = {name: np.asarray(group[name], dtype=float) for name in wanted}
    except (OSError, KeyError) as error:
        allowed = f"must be a file of a cytometer, .rtdc ({error}); a compressed one needs: pip install hdf5plugin"
        raise InputError(str(path), "", None, allowed) from None
    if np.isfinite(events.get("temp", np.nan)).any():
        setup[TEMPERATURE] = np.nanmedian(events["temp"])
    for key in ("area_um", "deform", WIDTH, FLOW_RATE, PIXEL_SIZE):
        if key not in {**events, **setup}:
            raise InputError(str(path), key, None, "is missing in the file")
    if (region := setup.get("setup:chip region", "channel")) != "channel":
        raise InputError(str(path), "setup:chip region", region, "must be channel, where the flow deforms")
    return events, setup


def _stress(
    meta: dict[str, Any], setup: dict[str, Any], carrier: str | None, celsius: float | None
) -> tuple[float, float, str]:
    """Stress at the walls over that of a table, relative half-width by the flow index, and words on the carrier."""
    width, flow_rate = 1e-6 * float(setup[WIDTH]), 1e-9 * float(setup[FLOW_RATE])
    own_width, own_flow_rate = 1e-6 * meta["channel_width"], 1e-9 * meta["flow_rate"]
    if LAW in meta and INDEX not in meta:
        flow = f"in {meta['channel_width']:g} um at {meta['flow_rate']:g} ul/s"
        allowed = f"holds for its own liquid ({meta[LAW]}) {flow}"
        same = np.allclose((width, flow_rate), (own_width, own_flow_rate), rtol=1e-3, atol=0)
        if not same or carrier not in (None, OF_TABLE):
            raise InputError("pairsim moduli", "--table", None, f"{allowed} alone; another flow needs another table")
        return 1.0, 0.0, f"carrier: that of the table ({meta[LAW]})"
    own_n = n = meta.get(INDEX, 1.0)
    own_K = K = meta.get(CONSISTENCY, 1e-3 * meta["fluid_viscosity"])
    name = carrier or str(setup.get("setup:medium", ""))
    if name != OF_TABLE:
        celsius = float(setup.get(TEMPERATURE, np.nan)) if celsius is None else celsius
        if not np.isfinite(celsius):
            raise InputError("pairsim moduli", "--celsius", None, "must be given: the file does not have it")
        K, n = methyl_cellulose(name, celsius)
        beyond = extrapolated(celsius)
        name += f" at {celsius:.3g} degC, n = {n:.4g}{beyond and f' ({beyond})'}"
    stress = K * wall_rate(flow_rate, width, n) ** n / (own_K * wall_rate(own_flow_rate, own_width, own_n) ** own_n)
    words = f"carrier: {name} (table: n = {own_n:.4g}); stress at the walls {stress:.4g} times that of the table"
    return stress, OF_INDEX * abs(n - own_n), words
