"""Pairs whose fields are written, and what field_balances.py finds in the last ones: the parts of the study."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Mapping, Sequence
from functools import partial
from math import pi
from pathlib import Path
from typing import Any

from book import yaml_files
from book.case_parts import LIMIT, case_of
from book.study import Part, Row, computed

HERE = Path(__file__).parent
PROGRAM = HERE / "field_balances.py"
SOFT, RUN, RIGID = (
    yaml_files.read(path)
    for path in (HERE.parent / "soft" / "pair.yaml", HERE / "run.yaml", HERE.parent / "rigid" / "pair.yaml")
)
COARSE = {"mesh.Np": 20}


def parts(quick: bool) -> list[Part]:
    """Soft pairs in two liquids and in time, and a rigid one that is dragged; in the quick form few and coarse."""
    soft = case_of(SOFT, Ca_e=0.1, fields=[0.1], max_points=1)
    rigid = case_of(RIGID, d=[0.1], fields=[0.1], max_points=1, velocity=1, flow=0)
    times = [0.02] if quick else [0.05, 0.2]
    run = case_of(RUN, **{"time.end": times[-1], "output.times": times})
    cases = {"soft Newtonian": ("curve", soft), "soft Giesekus": ("curve", case_of(soft, De=0.5))}
    cases |= {"rigid dragged": ("curve", rigid), "soft in time": ("run", run)}
    if quick:
        cases = {
            name: (cases[name][0], case_of(cases[name][1], **COARSE)) for name in ("soft Newtonian", "soft in time")
        }
    return [
        Part(name, json.dumps({"command": question, **case}, sort_keys=True), partial(_rows, name, question, case))
        for name, (question, case) in cases.items()
    ]


def _rows(name: str, question: str, case: Mapping[str, Any], folder: Path) -> Sequence[Row]:
    """Worst slice and worst volume, forces over that on a sphere in unbounded liquid at unit velocity, and powers."""
    result = computed(question, case, folder, LIMIT)
    if result.status != "finished":
        return [{"pair": name, "ended": result.reason or result.status}]
    done = subprocess.run([sys.executable, PROGRAM, folder], capture_output=True, text=True, check=True)
    found, table = json.loads(done.stdout)[-1], result.table
    row = table.loc[(table["t" if "t" in table else "d"] - found["t"]).abs().idxmin()]
    beta, flow = case["beta"], case.get("flow", 1)
    Q, drag, volume = flow * pi / 4, 3 * pi * beta, pi * beta**3 / 6
    outside = {particle: float(row.get(f"F_{particle}", 0.0)) for particle in "TL"}
    line: dict[str, Any] = {"pair": name, "beta": beta, "flow": flow, "ended": None}
    if found["volumes"]:
        line["flow_rate"] = max(found["flow_rates"], key=lambda rate: abs(rate - Q))
        line["volume"] = max(found["volumes"], key=lambda each: abs(each - volume))
    for (particle, known), force in zip(outside.items(), found["forces"], strict=True):
        line |= {f"force_{particle}": force / drag, f"outside_{particle}": known / drag}
    line["power"] = found["liquid_power"] + found["particles_power"]
    return [line | {"put_in": row["dp"] * Q + sum(F * row[f"U_{particle}"] for particle, F in outside.items())}]
