"""Balances of mass, force and energy on written fields by scripts/field_balances.py, which does not import pairsim."""

from __future__ import annotations

import json
import subprocess
import sys
from math import pi
from pathlib import Path
from typing import Any

import pairsim
from pairsim.api.results import Result
from validation_book.comparisons import CONFIGS, ROOT, Comparison, Found, Setting, Subject

SCRIPT = ROOT / "scripts" / "field_balances.py"
BETA = 0.4
DRAG = 3 * pi * BETA  # 6 pi eta_0 a U_av, the scale of forces
MASS, FORCE, ENERGY = "mass: divergence-free flow", "force balance", "energy balance"


def compute(setting: Setting) -> Found:
    """The balances of a soft pair, of one in a Giesekus liquid, of a run in time and of rigid spheres that are moved."""
    point = {"d": [0.1], "fields": [0.1], "max_points": 1, "Ca_e": 0.1, "folder": setting.folder / "curve"}
    soft, rigid = CONFIGS / "soft-pair.yaml", CONFIGS / "rigid-pair.yaml"
    coarse = {"mesh": {"Np": 20}} if setting.quick else {}
    rows = balances("soft pair, Newtonian", pairsim.curve(soft, **point, **coarse, overwrite=True), headline=True)
    moved = {"Ca_e": 0, "velocity": 1, "flow": 0}
    rows += balances("rigid pair, dragged", pairsim.curve(rigid, **(point | moved), overwrite=True))
    if setting.quick:
        return Found(rows)
    rows += balances("soft pair, Giesekus, De 0.5", pairsim.curve(soft, **(point | {"De": 0.5}), overwrite=True), headline=True)
    output = {"output": {"times": [0.05, 0.2]}, "time": {"end": 0.2}}
    run = pairsim.run(CONFIGS / "soft-run.yaml", folder=setting.folder / "run", overwrite=True, **output)
    return Found(rows + balances("soft pair, run in time", run))


def balances(what: str, result: Result, *, headline: bool = False) -> list[Comparison]:
    """The balances at the last frame of a folder."""
    assert result.check().folder is not None
    found = by_script(Path(str(result.folder)))[-1]
    table = result.table
    row = table.iloc[(table["t" if "t" in table else "d"] - found["t"]).abs().argmin()]
    flow = 0.0 if "F_L" in table and row["U_L"] == 1 else pi / 4
    outside = [row.get("F_T", 0.0), row.get("F_L", 0.0)]
    rows = []
    if found["volumes"]:
        worst = max(found["flow_rates"], key=lambda Q: abs(Q - flow))
        rows.append(Comparison(what, "flow rate", worst, None, flow, MASS, 1e-4, headline, "mass"))
        volume = max(found["volumes"], key=lambda V: abs(V - pi * BETA**3 / 6))
        rows.append(Comparison(what, "volume of a particle", volume, None, pi * BETA**3 / 6, MASS, 5e-6, table="mass"))
    for name, value, known in zip("TL", found["forces"], outside, strict=True):
        rows.append(
            Comparison(f"{what}, particle {name}", "F/(3 pi beta)", value / DRAG, None, known / DRAG, FORCE, 1e-4, table="force")
        )
    spent = found["liquid_power"] + found["particles_power"]
    put_in = row["dp"] * flow + sum(F * U for F, U in zip(outside, (row["U_T"], row["U_L"]), strict=True))
    rows.append(Comparison(what, "power", spent, None, float(put_in), ENERGY, 5e-5, headline, "energy"))
    return rows


def by_script(folder: Path) -> list[dict[str, Any]]:
    """What the script finds in a folder."""
    done = subprocess.run([sys.executable, str(SCRIPT), str(folder)], capture_output=True, text=True, check=True)
    return list(json.loads(done.stdout))


SUBJECT = Subject("balances", "Balances on written fields", compute)
