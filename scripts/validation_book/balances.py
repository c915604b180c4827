"""Balances of mass, force and energy on written fields by scripts/field_balances.py, which does not import pairsim."""

from __future__ import annotations

import json
import subprocess
import sys
from math import pi
from pathlib import Path
from typing import Any

from book.computing import ROOT

import pairsim
from pairsim.api.results import Result
from validation_book.comparisons import CONFIGS, Comparison, Found, Keys, Setting, rows_of

SCRIPT = ROOT / "scripts" / "field_balances.py"
PAIR, RIGID = CONFIGS / "soft-pair.yaml", CONFIGS / "rigid-pair.yaml"
BETA = 0.4
DRAG = 3 * pi * BETA  # 6 pi eta_0 a U_av, the scale of forces
MASS, FORCE, ENERGY = "mass: divergence-free flow", "force balance", "energy balance"


def compute(setting: Setting) -> Found:
    """The balances of soft pairs in two liquids, of a run in time and of rigid spheres that are moved."""
    here: Keys = {"folder": setting.folder / "curve", "overwrite": True}
    point: Keys = here | {"d": [0.1], "fields": [0.1], "max_points": 1}
    coarse: Keys = {"mesh": {"Np": 20}} if setting.quick else {}
    soft = point | {"Ca_e": 0.1}
    rows = balances("soft pair, Newtonian", pairsim.curve(PAIR, **soft, **coarse), headline=True)
    rows += balances("rigid pair, dragged", pairsim.curve(RIGID, **point, velocity=1, flow=0), flow=0.0)
    if setting.quick:
        return Found(rows)
    rows += balances("soft pair, Giesekus, De 0.5", pairsim.curve(PAIR, **(soft | {"De": 0.5})), headline=True)
    here["folder"] = setting.folder / "run"
    run = pairsim.run(CONFIGS / "soft-run.yaml", **here, output={"times": [0.05, 0.2]}, time={"end": 0.2})
    return Found(rows + balances("soft pair, run in time", run))


def balances(what: str, result: Result, *, flow: float = 1.0, headline: bool = False) -> list[Comparison]:
    """The balances at the last frame of a folder; `flow` is the mean velocity."""
    table, Q = rows_of(result), flow * pi / 4
    found = by_script(Path(str(result.folder)))[-1]
    row = min(table, key=lambda row: abs(row["t" if "t" in row else "d"] - found["t"]))
    outside = [row.get("F_T", 0.0), row.get("F_L", 0.0)]
    rows = []
    if found["volumes"]:
        worst, full = max(found["flow_rates"], key=lambda rate: abs(rate - Q)), pi * BETA**3 / 6
        rows.append(Comparison(what, "flow rate", worst, None, Q, MASS, 1e-4, headline, "mass"))
        volume = max(found["volumes"], key=lambda volume: abs(volume - full))
        rows.append(Comparison(what, "volume of a particle", volume, None, full, MASS, 5e-6, table="mass"))
    for name, force, known in zip("TL", found["forces"], outside, strict=True):
        scaled = force / DRAG, None, known / DRAG
        rows.append(Comparison(f"{what}, particle {name}", "F/(3 pi beta)", *scaled, FORCE, 1e-4, table="force"))
    spent = found["liquid_power"] + found["particles_power"]
    put_in = row["dp"] * Q + sum(F * U for F, U in zip(outside, (row["U_T"], row["U_L"]), strict=True))
    rows.append(Comparison(what, "power", spent, None, put_in, ENERGY, 5e-5, headline, "energy"))
    return rows


def by_script(folder: Path) -> list[dict[str, Any]]:
    """What the script finds in a folder."""
    done = subprocess.run([sys.executable, str(SCRIPT), str(folder)], capture_output=True, text=True, check=True)
    return list(json.loads(done.stdout))
