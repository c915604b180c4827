"""Streams of beads that differ in size or in stiffness, at several concentrations, and what drops get of them.

All beads of a liquid are the same ones but for their spread, so that the short rows of the first case are those of all.
Where beads are to be equal they have a spread that changes nothing that is shown.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

from book.study import Part, Row, computed
from book.uses import steady

from pairsim.questions.stream import IN_CONTACT, POISSON, POSITION_OF_STREAM, SINGLE, SPREAD
from pairsim.record.columns import DISTANCE, DU, DU_ERROR

LIQUIDS: dict[str, dict[str, float]] = {
    "soft": {"De": 0.0, "Ca_e": 0.1},
    "De 1": {"De": 1.0, "Ca_e": 0.0},
    "De 2": {"De": 2.0, "Ca_e": 0.0},
    "rigid": {"De": 0.0, "Ca_e": 0.0},
}
"""Soft beads in a Newtonian liquid; rigid ones in a Giesekus liquid, and in a Newtonian one."""
BETA, ACCURACY, COARSE = 0.4, "1%", {"accuracy": "5%", "mesh": {"Np": 8}}
EQUAL = {"diameter": 0.0005}
STREAM = {"beads": 100, "streams": 4, "seed": 85}
TUBE = 300.0  # length of tube [D_c]
SPREADS: dict[str, dict[str, float]] = {
    "equal": EQUAL,
    "2 % of size": {"diameter": 0.02},
    "5 % of size": {"diameter": 0.05},
    "2 % of stiffness": {"modulus": 0.02},
    "5 % of stiffness": {"modulus": 0.05},
    "20 % of stiffness": {"modulus": 0.2},
}
DISTANCES = (3.2, 1.6, 0.8, 0.4, 0.2)  # mean distances [D_c]
BETAS = (0.15, 0.2, 0.3, 0.4)  # of pairs
PAIR: dict[str, Any] = {"De": 0.5, "Ca_e": 0.0, "d": [0.4, 0.6, 0.8]}
LIMIT = 7200.0  # wall time of a case [s]
SHOWN = (0, 25, 50)  # rows of stream.csv that are kept: the inlet, half way, the outlet


def parts(quick: bool) -> list[Part]:
    """All parts; or two on coarse cells."""
    found = [
        *(
            _part("order", name, "soft", {"d": 0.3, "spread": spread}, {"arrivals": "regular"}, quick)
            for name, spread in SPREADS.items()
        ),
        *(
            _part("contact", f"d {d:g}, {name}", "De 1", {"d": d, "spread": SPREADS[name]}, {}, quick)
            for name in ("equal", "2 % of size")
            for d in DISTANCES
        ),
        *(
            _part("drops", f"{liquid}, d {d:g}, {of}", liquid, {"d": d, "spread": SPREADS[of]}, one_a_drop(d), quick)
            for liquid in ("De 1", "De 2")
            for of in ("equal", "2 % of size")
            for d in (1.6, 0.8)
        ),
        *(
            _part("exact", f"rigid, Newtonian, d {d:g}", "rigid", {"d": d, "spread": EQUAL}, one_a_drop(d), quick)
            for d in (3.2, 0.8)
        ),
        *(_pair(beta) for beta in BETAS),
    ]
    return [part for part in found if part.name.startswith("exact")] if quick else found


def one_a_drop(d: float) -> dict[str, float]:
    """A drop that gets one bead on average: beads are faster than the liquid, by about as much as small ones."""
    return {"drop": float(f"{(BETA + d) / (2 - 4 / 3 * BETA**2):.3g}"), "tube": 1000.0}


def _part(shows: str, name: str, liquid: str, keys: Mapping[str, Any], stream: Mapping[str, Any], quick: bool) -> Part:
    how = COARSE if quick else {"accuracy": ACCURACY}
    case = {"beta": BETA, **LIQUIDS[liquid], **how, **keys, "stream": {"tube": TUBE, **STREAM, **stream}}
    about: Row = {"shows": shows, "case": name, "liquid": liquid, "d": keys["d"]}
    return Part(f"{shows}: {name}", json.dumps(case, sort_keys=True), partial(_rows, case, about))


def _pair(beta: float) -> Part:
    case = {"beta": beta, **PAIR, "max_points": len(PAIR["d"]), "accuracy": ACCURACY}
    about: Row = {"shows": "pair", "case": f"beta {beta:g}", "liquid": f"De {PAIR['De']:g}", "beta": beta}
    compute = partial(_rows_of_pair, case, about)
    return Part(f"pair: beta {beta:g}", json.dumps(case, sort_keys=True), compute, steady("newtonian", "giesekus"))


def _rows_of_pair(case: Mapping[str, Any], about: Row, folder: Path) -> list[Row]:
    """dU of a pair at each distance."""
    result = computed("curve", case, folder, LIMIT)
    about = {**about, "ended": result.reason or result.status, "seconds": result.record.wall_time or 0.0}
    kept = [DISTANCE.name, DU.name, DU_ERROR.name]
    rows = result.table[kept].to_dict("records") if len(result.table) else []
    return [{**about, **row} for row in rows] or [about]


def _rows(case: Mapping[str, Any], about: Row, folder: Path) -> list[Row]:
    """What was counted at some lengths of tube."""
    result = computed("stream", case, folder, LIMIT)
    about = {**about, "ended": result.reason or result.status, "seconds": result.record.wall_time or 0.0}
    if len(result.table) <= max(SHOWN):
        return [about]
    found = list[Row]()
    for row in result.table.iloc[list(SHOWN)].to_dict("records"):
        kept = {POSITION_OF_STREAM.name: row[POSITION_OF_STREAM.name], "poisson": row.get(POISSON[SINGLE].name)}
        for column in (SPREAD, IN_CONTACT, SINGLE):
            kept |= {name: row.get(name) for name in (column.name, f"{column.name}_error", f"{column.name}_model")}
        found.append({**about, **kept})
    return found
