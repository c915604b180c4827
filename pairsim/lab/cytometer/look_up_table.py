"""Look-up tables for deformability cytometry, in the format that dclab registers (dclab.features.emodulus.load)."""

from __future__ import annotations

import io
import json
from dataclasses import astuple
from pathlib import Path
from typing import Any, Final, Literal, TypedDict

import numpy as np

from pairsim.cases.attributes import Attribute
from pairsim.cases.laws import liquid_in
from pairsim.cases.yaml_file import read_yaml
from pairsim.lab.cytometer.suspending_media import gradient_in_square, wall_rate
from pairsim.physics.homogeneous import steady_shear
from pairsim.physics.liquids import Liquid
from pairsim.physics.pipe import Pipe
from pairsim.quantities.scales import FLOW_RATE, Scales
from pairsim.record.record import Record, scales_for
from pairsim.record.table_files import read_table
from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import Argument, InputError
from pairsim.runtime.version import __version__

Channel = Literal["equivalent", "square", "round"]
# Width of the tube over that of a square channel in which a Newtonian liquid has the same pressure gradient, and so the
# same curvature of its velocity on the axis (Mietke et al., Biophys. J. 109, 2023, 2015, supplement S3).
RATIO = 1.094
# Relative increase of the modulus of a sphere by the walls of a square channel, the sum of a x^p with its diameter x in
# channel widths: fitted to the ratio of dclab's HE-3D-FEM-22 to HE-2D-FEM-22, from which the ratio of the pressure
# gradients was taken off (docs/how-to/cytometry.md).
WALLS = ((0.1736, 4), (0.1692, 12))
LARGEST = 0.85  # largest x of the fit
FITTED_INDEX = 0.6039  # flow index of the carrier in both tables
# Relative half-width of the fit (95 % of the entries): a constant, and one that is divided by the deformation.
OF_FIT, OF_SMALL = 0.01, 1e-4
LAW: Final = "fluid_law"
INDEX: Final = "fluid_flow_behaviour_index"  # only of power laws
CONSISTENCY: Final = "fluid_consistency_coefficient"  # likewise
TABLE, SHAPE = "shape.csv", ("area_hull", "deformation_hull", "Ca_e", "deformation_error")
ENDED = "finished", "failed"  # the shapes that a failed case has found are valid, too
NEEDED = "channel_width", "flow_rate", "fluid_viscosity"
HEAD_NUMBERS = (
    Attribute("channel_width", "um", 1, 1000),
    Attribute("flow_rate", "uL/s", 1e-4, 100),
    Attribute("fluid_viscosity", "mPa s", 0.01, 1e6),
    Attribute(INDEX, "", 0.05, 2),
    Attribute(CONSISTENCY, "", 1e-6, 1e6),
)


class Head(TypedDict, total=False):
    """Channel, flow and liquid in the head of a table; every table has the entries that `NEEDED` lists."""

    channel: str
    dimensionality: str  # what tables of dclab have in place of the channel
    channel_width: float
    channel_width_unit: str
    flow_rate: float
    flow_rate_unit: str
    fluid_law: str
    fluid_flow_behaviour_index: float  # this and the next two only of power laws
    fluid_consistency_coefficient: float
    fluid_consistency_coefficient_unit: str
    fluid_viscosity: float
    fluid_viscosity_unit: str
    software: str
    identifier: str
    emodulus_error: list[float]  # relative half-widths of the moduli


HEAD = "area_um [um^2]\tdeform\temodulus [kPa]"
UNCORRECTED = (
    f"a square channel is treated as a tube {RATIO} times as wide, which in methyl cellulose makes moduli 3 to 14 % "
    "too low; pairsim table --cytometry --channel square corrects them"
)


def in_square(n: float, size: Array, deformation: Array, elastic: bool) -> tuple[Array, Array]:
    """Modulus of a sphere in a square channel over that in the equivalent tube, and its half-width.

    What the walls add is known for one carrier. In others it may be absent or twice as large: the half-width contains
    this in proportion to the difference of the flow indices, and in full at n = 1 and where the carrier is elastic.

    Args:
        n: Flow index of the carrier.
        size: Diameters over the width of the channel, shape (m,).
        deformation: Deformations, shape (m,).
        elastic: Whether the carrier is elastic.

    Returns:
        Factors and their relative half-widths, shape (m,) each.
    """
    walls = np.asarray(sum(a * size**p for a, p in WALLS))
    unlike = 1.0 if elastic else min(abs(n - FITTED_INDEX) / (1 - FITTED_INDEX), 1.0)
    return gradient_in_square(n, RATIO) * (1 + walls), OF_FIT + OF_SMALL / deformation + unlike * walls


def look_up_table(directory: Path, channel: Channel = "equivalent") -> tuple[str, list[str]]:
    """Tabulate area and deformation of the convex hull, and Young's modulus 3 G_p, of all shapes in a folder.

    Args:
        directory: Folder of `pairsim shape` or of a sweep of it, in one tube, flow and liquid. Its name is part of the
            identifier of the table.
        channel: The channel of the cytometer: a square one for which the tube stands, without ("equivalent") or with
            ("square") the correction by `in_square`, or the tube itself ("round").

    Returns:
        The table as text, and notes on it.

    Raises:
        InputError: There are no shapes, or a case has no `physical` block, or another tube, flow or liquid.
    """
    files = [directory / TABLE, *sorted(directory.glob(f"*/{TABLE}"))]
    folders = [file.parent for file in files if file.is_file() and Record.read(file.parent).status in ENDED]
    if not folders:
        allowed = "must have shapes: a folder of pairsim shape, or a sweep of it"
        raise InputError(str(directory), Argument("cytometry"), None, allowed)
    scales, *others = scales_for(folders, True)
    liquid, *liquids = (liquid_in(read_yaml(folder / "case.yaml")) for folder in folders)
    if not all(np.allclose(astuple(each), astuple(scales)) for each in others) or set(liquids) - {liquid}:
        raise InputError(str(directory), "", None, "must have shapes in one tube, one flow and one liquid")
    try:
        tables = [np.array([read_table(folder / TABLE)[name] for name in SHAPE]) for folder in folders]
    except KeyError as missing:
        allowed = "is missing: compute the shapes with this version"
        raise InputError(str(directory), str(missing.args[0]), None, allowed) from None
    area, deformation, Ca_e, off = np.concatenate(tables, axis=1)
    modulus, error = 3e-3 * scales.stress / Ca_e, off / deformation / 2  # deformation goes as 1/E^2
    meta, notes = _head(scales, liquid, channel), [UNCORRECTED] if channel == "equivalent" else []
    if channel == "square":
        size = RATIO * np.sqrt(4 * area / np.pi)
        factor, of_channel = in_square(_index(liquid), size, deformation, bool(liquid.modes))
        modulus, error, kept = modulus * factor, error + of_channel, size <= LARGEST
        area, deformation, modulus, error, factor = (each[kept] for each in (area, deformation, modulus, error, factor))
        ranges = [f"{100 * each.min():.2g} to {100 * each.max():.3g} %" for each in (factor - 1, error)]
        notes = [f"square channel: moduli are raised by {ranges[0]}; half-widths are {ranges[1]}"]
        notes += [f"{sum(~kept)} shapes wider than {LARGEST} of the channel were left out"] if not kept.all() else []
    meta["identifier"], meta["emodulus_error"] = f"pairsim:{directory.resolve().name}", error.round(5).tolist()
    head = f"BEGIN METADATA\n{json.dumps(meta, indent=2)}\nEND METADATA\n\n{HEAD}"
    values = np.column_stack([1e12 * scales.length**2 * area, deformation, modulus])
    np.savetxt(text := io.StringIO(), values, "%.6e", "\t", header=head)
    return text.getvalue(), notes


def _index(liquid: Liquid, part: float = 1.0) -> float:
    """Flow index at `part` times the shear rate at the wall of the tube without particles."""
    rates = part * Pipe(liquid).steady().wall_rate * np.array([0.99, 1.01])
    slope = np.diff(np.log(steady_shear(liquid, rates)[0])) / np.diff(np.log(rates))
    return 1 + float(slope[0])


def _head(scales: Scales, liquid: Liquid, channel: Channel) -> Head:
    """The head of a table; its viscosity is that at the walls of a square channel, as in dclab."""
    width = scales.length / (1.0 if channel == "round" else RATIO)
    flow_rate, n = FLOW_RATE * scales.velocity * scales.length**2, _index(liquid)
    rate = wall_rate(flow_rate, width, n)
    viscosity = scales.viscosity * float(steady_shear(liquid, np.array([rate * scales.time]))[0].item())
    head: Head = {
        "channel": channel,
        "channel_width": round(1e6 * width, 6),
        "channel_width_unit": "um",
        "flow_rate": round(1e9 * flow_rate, 9),
        "flow_rate_unit": "uL/s",
        "fluid_law": (liquid.modes[0] if liquid.modes else liquid.solvent).name,
    }
    if not liquid.modes and np.isclose(n, _index(liquid, 1e-3)):
        head["fluid_flow_behaviour_index"] = round(n, 6)
        head["fluid_consistency_coefficient"] = viscosity * rate ** (1 - n)
        head["fluid_consistency_coefficient_unit"] = "Pa s^n"
    head["fluid_viscosity"], head["fluid_viscosity_unit"] = round(1e3 * viscosity, 6), "mPa s"
    head["software"] = f"pairsim {__version__}"
    return head


def modulus_at(look_up: Array, area: Array, deformation: Array) -> tuple[Array, Array]:
    """Interpolate modulus and relative half-width in a look-up table; nan outside of it.

    Logarithms are interpolated, as they depend nearly linearly on each other. The difference between linear and smooth
    interpolation is part of the half-width.

    Args:
        look_up: Area [um^2], deformation, modulus and its relative half-width, shape (m, 4).
        area: Areas [um^2], shape (n,).
        deformation: Deformations, shape (n,).

    Returns:
        Moduli, in the unit of the table, and relative half-widths, shape (n,) each.

    Raises:
        InputError: The table does not have several areas and deformations.
    """
    from scipy.interpolate import CloughTocher2DInterpolator, LinearNDInterpolator
    from scipy.spatial import Delaunay, QhullError

    logs = np.log(look_up[:, 2])
    try:
        cells = Delaunay(np.log(look_up[:, :2]))
    except QhullError:
        raise InputError(
            "pairsim moduli", Argument("table"), None, "must have several areas and deformations"
        ) from None
    with np.errstate(divide="ignore", invalid="ignore"):
        wanted = np.log(np.column_stack([area, deformation]))
    linear, error = LinearNDInterpolator(cells, np.column_stack([logs, look_up[:, 3]]))(wanted).T
    smooth = CloughTocher2DInterpolator(cells, logs)(wanted)
    return np.exp(smooth), error + abs(smooth - linear)


def read_look_up_table(path: Path) -> tuple[Head, Array]:
    """Read a look-up table in the format of dclab.

    Returns:
        Its head; and area [um^2], deformation, modulus [kPa] and relative half-width, 0 where the table does not give
        it, shape (m, 4).

    Raises:
        InputError: The file is no such table, or a number is not physical or in another unit.
    """
    try:
        head = [line[1:].strip() for line in path.read_text(encoding="utf-8").splitlines() if line.startswith("#")]
        meta = json.loads("\n".join(head[head.index("BEGIN METADATA") + 1 : head.index("END METADATA")]))
        names, columns = [name.strip() for name in head[-1].split("\t")], HEAD.split("\t")
        if missing := [each for each in columns if each not in names]:
            raise ValueError(f"no column {missing[0]}")
        values = np.loadtxt(path, ndmin=2)[:, [names.index(each) for each in columns]]
        errors = np.broadcast_to(np.asarray(meta.get("emodulus_error", 0.0), dtype=float), len(values))
        for number in HEAD_NUMBERS:
            if number.key in meta or number.key in NEEDED:
                meta[number.key] = _in_unit(number, meta[number.key], meta.get(f"{number.key}_unit"))
    except (OSError, ValueError, TypeError, AttributeError, IndexError, KeyError) as error:
        allowed = f"must be a table of pairsim table --cytometry, or one over area_um in dclab's format ({error})"
        raise InputError(str(path), Argument("table"), None, allowed) from None
    table = np.column_stack([values, errors])
    if not np.isfinite(table).all() or (table[:, :3] <= 0).any() or (errors < 0).any():
        allowed = "must have areas, deformations and moduli above 0 in all rows, and errors that are not negative"
        raise InputError(str(path), Argument("table"), None, allowed)
    return meta, table


def _in_unit(number: Attribute, value: Any, unit: Any) -> float:
    """A number of a head; ValueError if it is not physical, or is in another unit than that of the format."""
    if unit is not None and number.unit and str(unit).casefold() != number.unit.casefold():
        raise ValueError(f"{number.key} must be in {number.unit}, not {unit}")
    try:
        return number.number(value)
    except ValueError as error:
        raise ValueError(f"{number.key} {error}, not {value}") from None
