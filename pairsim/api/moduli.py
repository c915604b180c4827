"""Young's moduli of the events in a cytometer's file, by a look-up table: `moduli`."""

from __future__ import annotations

import json
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from pairsim.cases.quantities import kelvin_of
from pairsim.physics.carriers import MEASURED, ZERO_CELSIUS, methyl_cellulose, wall_rate
from pairsim.results.cytometry import CONSISTENCY, INDEX, LAW, UNCORRECTED
from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import InputError

if TYPE_CHECKING:
    import pandas as pd

# What pixels add to the deformation of a sphere, by its area in pixels of 0.34 um (Herold, arXiv:1704.00572, 2017).
PIXEL, OFFSET = 0.34, 0.0012
DECAYS = ((0.020, 7.1), (0.010, 38.6), (0.005, 296.0))
OF_INDEX = 0.5  # largest error of the modulus over the difference of the flow indices (docs/how-to/cytometry.md)
OF_TABLE = "table"
POINTS = 90  # along each axis of the picture
WIDTH, FLOW_RATE = "setup:channel width", "setup:flow rate"


@dataclass(frozen=True)
class Moduli:
    """Moduli of the events of a file.

    Attributes:
        table: A row for each event: area [um^2], deformation without what the pixels add, Young's modulus and its
            half-width [kPa], nan outside of the look-up table.
        sentences: What was found, and what it rests on.
        look_up: The look-up table in the conditions of the file: area, deformation, modulus and relative half-width.
    """

    table: pd.DataFrame
    sentences: list[str]
    look_up: Array

    def draw(self, path: Path) -> None:
        """Draw the events over the lines of equal modulus into a PNG file."""
        from pairsim.plots.moduli import draw_moduli

        area, deformation = (np.linspace(each.min(), each.max(), POINTS) for each in self.look_up.T[:2])
        grid = np.meshgrid(area, deformation)
        modulus, _ = modulus_at(self.look_up, *map(np.ravel, grid))
        draw_moduli(self.table, (area, deformation, modulus.reshape(grid[0].shape)), path)


def moduli(
    file: Path | str, table: Path | str, *, carrier: str | None = None, temperature: str | None = None
) -> Moduli:
    """Compute Young's modulus of every event of a cytometer's file.

    Args:
        file: An .rtdc file.
        table: A look-up table of `pairsim table --cytometry`, or another one in the format of dclab.
        carrier: The carrier, such as "0.59% MC-PBS", in place of what the file says; "table" is that of the table.
        temperature: Its temperature, such as "24 degC", in place of that of each event or of the file.

    Raises:
        InputError: A file cannot be read or says too little, or the table does not hold for this carrier and flow.
    """
    import pandas as pd

    meta, look_up = read_look_up_table(Path(table))
    events, setup = read_events(Path(file))
    area, deformation = events["area_um"], events["deform"]
    channel = meta.get("channel", "equivalent" if meta.get("dimensionality") == "2Daxis" else "square")
    notes = [UNCORRECTED] if channel == "equivalent" else []
    if pixel := setup.get("imaging:pixel size"):
        pixels = sum(a * np.exp(-area * (PIXEL / pixel) ** 2 / decay) for a, decay in DECAYS)
        deformation = deformation - OFFSET - pixels
    else:
        notes.append("the file does not say the size of a pixel: deformations are as measured")
    stress, of_index, words = _stress(meta, setup, carrier, temperature, events.get("temp"))
    mean = float(np.nanmean(stress))
    look_up = look_up * [(setup[WIDTH] / meta["channel_width"]) ** 2, 1.0, mean, 1.0]
    modulus, error = modulus_at(look_up, area, deformation)
    modulus = modulus * stress / mean
    columns = {
        "area_um": area,
        "deform": deformation,
        "emodulus": modulus,
        "emodulus_error": modulus * (error + of_index),
    }
    inside = np.isfinite(modulus)
    if not inside.any():
        areas, deformations = (f"{each.min():.3g} to {each.max():.3g}" for each in look_up.T[:2])
        allowed = f"must have events in the table: of {areas} um^2, with deformations of {deformations}"
        raise InputError(str(file), "", None, allowed)
    low, middle, high = np.percentile(modulus[inside], (16, 50, 84))
    half = float(np.median(columns["emodulus_error"][inside]))
    sentences = [
        f"Young's modulus of {inside.sum()} events: median {middle:.4g} +- {half:.2g} kPa, two thirds of them within "
        f"{low:.4g} to {high:.4g} kPa",
        words,
        "in the half-width: the table, its interpolation, the flow index; not the viscosity, the pixels of one event",
        *([f"{(~inside).sum()} of {len(inside)} events lie outside of the table"] if not inside.all() else []),
        *notes,
    ]
    return Moduli(pd.DataFrame(columns), sentences, look_up)


def modulus_at(look_up: Array, area: Array, deformation: Array) -> tuple[Array, Array]:
    """Modulus and relative half-width at areas and deformations, nan outside of the table.

    Logarithms are interpolated, which are nearly linear in each other. The difference between linear and smooth
    interpolation is part of the half-width.

    Args:
        look_up: Area, deformation, modulus and relative half-width, shape (m, 4).
        area: Areas, shape (n,).
        deformation: Deformations, shape (n,).
    """
    from scipy.interpolate import CloughTocher2DInterpolator, LinearNDInterpolator
    from scipy.spatial import Delaunay, QhullError

    logs = np.log(look_up[:, 2])
    try:
        cells = Delaunay(np.log(look_up[:, :2]))
    except QhullError:
        raise InputError("pairsim moduli", "--table", None, "must have several areas and deformations") from None
    with np.errstate(divide="ignore", invalid="ignore"):
        wanted = np.log(np.column_stack([area, deformation]))
    linear, error = LinearNDInterpolator(cells, np.column_stack([logs, look_up[:, 3]]))(wanted).T
    smooth = CloughTocher2DInterpolator(cells, logs)(wanted)
    return np.exp(smooth), error + abs(smooth - linear)


def read_look_up_table(path: Path) -> tuple[dict[str, Any], Array]:
    """Read a look-up table in the format of dclab.

    Returns:
        What its head says; area [um^2], deformation, modulus [kPa] and relative half-width, 0 where the table does not
        know it, shape (m, 4).

    Raises:
        InputError: It is none.
    """
    try:
        head = [line[1:].strip() for line in path.read_text(encoding="utf-8").splitlines() if line.startswith("#")]
        meta = json.loads("\n".join(head[head.index("BEGIN METADATA") + 1 : head.index("END METADATA")]))
        names = [name.split()[0] for name in head[-1].split("\t")]
        values = np.loadtxt(path, ndmin=2)[:, [names.index(each) for each in ("area_um", "deform", "emodulus")]]
        errors = np.broadcast_to(meta.get("emodulus_error", 0.0), len(values))
        [meta[key] for key in ("channel_width", "flow_rate", "fluid_viscosity")]
    except (OSError, ValueError, IndexError, KeyError) as error:
        allowed = f"must be a table of pairsim table --cytometry, or one over area_um in dclab's format ({error})"
        raise InputError(str(path), "--table", None, allowed) from None
    return meta, np.column_stack([values, errors])


def read_events(path: Path) -> tuple[dict[str, Array], dict[str, Any]]:
    """Read an .rtdc file (HDF5).

    Returns:
        "area_um", "deform" and, if measured, "temp" of the events, each of shape (m,); and the attributes of the file,
        such as "setup:channel width" [um] and "setup:flow rate" [ul/s].

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
            wanted = [name for name in ("area_um", "deform", "circ", "temp") if name in group]
            events = {name: np.asarray(group[name], dtype=float) for name in wanted}
    except (OSError, KeyError) as error:
        allowed = f"must be an .rtdc file ({error}); a compressed one needs: pip install hdf5plugin"
        raise InputError(str(path), "", None, allowed) from None
    if "circ" in events:
        events.setdefault("deform", 1 - events["circ"])
    for key in ("area_um", "deform", WIDTH, FLOW_RATE):
        if key not in {**events, **setup}:
            raise InputError(str(path), key, None, "is missing in the file")
    if (region := setup.get("setup:chip region", "channel")) != "channel":
        raise InputError(str(path), "setup:chip region", region, "must be channel, where the flow deforms")
    return events, setup


def _stress(
    meta: dict[str, Any], setup: dict[str, Any], carrier: str | None, temperature: str | None, measured: Array | None
) -> tuple[Any, Any, str]:
    """Stress at the walls over that of a table, relative half-width by the flow index, and words on the carrier."""
    width, flow_rate = 1e-6 * float(setup[WIDTH]), 1e-9 * float(setup[FLOW_RATE])
    own_width, own_flow_rate = 1e-6 * meta["channel_width"], 1e-9 * meta["flow_rate"]
    if LAW in meta and INDEX not in meta:
        allowed = (
            f"holds for its own liquid ({meta[LAW]}) in {meta['channel_width']:g} um at {meta['flow_rate']:g} ul/s"
        )
        same = np.allclose((width, flow_rate), (own_width, own_flow_rate), rtol=1e-3, atol=0)
        if not same or carrier not in (None, OF_TABLE):
            raise InputError("pairsim moduli", "--table", None, f"{allowed} alone; another flow needs another table")
        return 1.0, 0.0, f"carrier: that of the table ({meta[LAW]})"
    own_n = meta.get(INDEX, 1.0)
    own_K = meta.get(CONSISTENCY, 1e-3 * meta["fluid_viscosity"])
    name = carrier or str(setup.get("setup:medium", ""))
    if name == OF_TABLE:
        K, n, words = own_K, own_n, f"that of the table, n = {own_n:.4g}"
    else:
        T: Any = ZERO_CELSIUS + float(setup.get("setup:temperature", np.nan))
        if temperature:
            T = kelvin_of(temperature)
        elif measured is not None and np.isfinite(measured).any():
            T = ZERO_CELSIUS + measured
        if not np.isfinite(T).any():
            raise InputError("pairsim moduli", "--temperature", None, "must be given: the file does not have it")
        K, n = methyl_cellulose(name, T)
        celsius, (least, most) = float(np.nanmean(T)) - ZERO_CELSIUS, MEASURED
        beyond = "" if least <= celsius <= most else f" (measured from {least} to {most} degC)"
        words = f"{name} at {celsius:.3g} degC{beyond}, n = {np.nanmean(n):.4g} (table: {own_n:.4g})"
    stress = K * wall_rate(flow_rate, width, n) ** n / (own_K * wall_rate(own_flow_rate, own_width, own_n) ** own_n)
    words = f"carrier: {words}; stress at the walls {np.nanmean(stress):.4g} times that of the table"
    return stress, OF_INDEX * abs(n - own_n), words
