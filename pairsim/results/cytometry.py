"""Look-up tables for deformability cytometry, in the format that dclab registers (dclab.features.emodulus.load)."""

from __future__ import annotations

import json
import time
from dataclasses import astuple
from pathlib import Path

import numpy as np

from pairsim.results.folder import read_record
from pairsim.results.table_files import read_table
from pairsim.results.units import scales_of
from pairsim.runtime.errors import InputError
from pairsim.runtime.version import __version__

# Width of the tube over that of a square channel that acts alike on a particle on the axis (Mietke et al., Biophys. J.
# 109, 2023, 2015, supplement S3).
SQUARE = 1.094
TABLE = "shape.csv"
ENDED = "finished", "failed"  # shapes that were found are right, whether or not others were
HEAD = "area_um [um^2]\tdeform\temodulus [kPa]"


def look_up_table(directory: Path) -> str:
    """Area and deformation of the convex hull, and Young's modulus 3 G_p, of all shapes in a folder.

    Args:
        directory: Folder of `pairsim shape` or of a sweep of it, in one tube, flow and liquid. Its name identifies the
            table.

    Raises:
        InputError: There are no shapes, a case has no `physical` block, or another tube, flow or liquid than the first
            one.
    """
    rows, first = [np.empty((0, 3))], None
    for file in (directory / TABLE, *sorted(directory.glob(f"*/{TABLE}"))):
        folder, record = file.parent, read_record(file.parent)
        if not file.is_file() or record.get("status") not in ENDED:
            continue
        scales, table = scales_of(record, str(folder)), read_table(file)
        first = first or scales
        if not np.allclose(astuple(scales), astuple(first)):
            raise InputError(str(folder), "", None, "must have the tube, the flow and the liquid of the other shapes")
        modulus = 3e-3 * scales.stress / np.asarray(table["Ca_e"])
        area = 1e12 * scales.length**2 * np.asarray(table["area_hull"])
        rows.append(np.column_stack([area, table["deformation_hull"], modulus]))
    if first is None:
        allowed = "must have shapes: a folder of pairsim shape, or a sweep of it"
        raise InputError(str(directory), "--cytometry", None, allowed)
    width = 1e6 * first.length / SQUARE
    meta = {
        "authors": "",
        "channel_width": round(width, 6),
        "channel_width_unit": "um",
        "date": time.strftime("%Y-%m-%d"),
        "dimensionality": "2Daxis",
        "flow_rate": round(1e9 * first.velocity * np.pi / 4 * first.length**2, 9),
        "flow_rate_unit": "uL/s",
        "fluid_viscosity": round(1e3 * first.viscosity, 9),
        "fluid_viscosity_unit": "mPa s",
        "identifier": directory.resolve().name,
        "method": "FEM",
        "model": "steady shapes without inertia; case files of pairsim have the laws",
        "software": f"pairsim {__version__}",
        "summary": "axisymmetric spheres on the axis of a tube 1.094 times as wide as the square channel",
    }
    lines = json.dumps(meta, indent=2).splitlines()
    head = ["BEGIN METADATA", *lines, "END METADATA", "", HEAD]
    body = ["\t".join(f"{value:.6e}" for value in row) for row in np.concatenate(rows)]
    return "".join(f"# {line}".rstrip() + "\n" for line in head) + "".join(f"{line}\n" for line in body)
