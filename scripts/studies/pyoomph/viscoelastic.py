"""Pairs in a Giesekus liquid, by pyoomph and by pairsim: parts of the study.

Pairs at held distances are rigid or soft, and a rigid one moves from rest. Those of pyoomph are left out where it is
not installed; scripts/studies/codes/README.md says how it is.
"""

from __future__ import annotations

import json
import subprocess
from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

from book.case_parts import case_part
from book.other_codes import by_pyoomph
from book.study import Part, Row, Unavailable, computed
from book.uses import in_time, steady

SCRIPT = "pyoomph_viscoelastic.py"
OF_PYOOMPH = ("scripts.studies.codes.pyoomph_viscoelastic", "scripts.studies.codes.pyoomph_pair")
"""Code that what is computed by pyoomph depends on."""
OF_PAIRS = steady("newtonian", "giesekus", "neo_hookean")
OF_RUNS = tuple(dict.fromkeys((*steady("newtonian", "giesekus"), *in_time("newtonian", "giesekus"))))
"""Code that pairs at held distances and the one from rest depend on."""
SCENE: dict[str, Any] = {"beta": 0.4, "xi": 0.09, "liquid": {"law": "giesekus", "alpha": 0.2}}
SCENE |= {"ends": "developed", "length": "auto"}
DES, CA_ES, DISTANCES = (0.25, 1.0), (0.0, 0.1), (0.1, 0.4)
ACCURACY = "0.3%"
CELLS = {0: (24, 36), 1: (24, 36, 56)}
"""Cells of pyoomph on a half-circle, without and with SUPG."""
START: dict[str, float] = {"De": 0.25, "d": 0.1, "Ca_e": 0.0}
"""The pair that moves from rest."""
END, STEPS, TIMES = 1.0, 80, (0.25, 0.5, 1.0)
CELLS_FROM_REST, ACCURACIES_FROM_REST = (24, 36), ("1%", "0.3%")
LIMIT = 2400.0  # wall time of a run [s]


def parts() -> list[Part]:
    """Those of pairsim, then those of pyoomph, from few cells to many."""
    found = [_pair(De, Ca_e) for De, Ca_e in product(DES, CA_ES)]
    found += [_start_up(accuracy) for accuracy in ACCURACIES_FROM_REST]
    for cells, supg in sorted((cells, supg) for supg, numbers in CELLS.items() for cells in numbers):
        found += [_by_pyoomph(De, d, Ca_e, supg, cells) for De, Ca_e, d in product(DES, CA_ES, DISTANCES)]
    return found + [_start_up_by_pyoomph(cells) for cells in CELLS_FROM_REST]


def _pair(De: float, Ca_e: float) -> Part:
    """A pair at held distances."""
    case = {**SCENE, "De": De, "Ca_e": Ca_e, "d": list(DISTANCES), "max_points": len(DISTANCES), "accuracy": ACCURACY}
    columns = ("d", "dU_held", "dU_error", "D_T", "D_L")
    part = case_part(f"De {De:g}, Ca_e {Ca_e:g}", "curve", case, columns, {"kind": "pair", "De": De, "Ca_e": Ca_e})
    return replace(part, uses=OF_PAIRS)


def _start_up(accuracy: str) -> Part:
    """The pair from rest."""
    case = {**SCENE, "De": START["De"], "Ca_e": START["Ca_e"], "d0": START["d"], "dU_error": True}
    case |= {"time": {"end": END}, "output": {"times": list(TIMES), "fields": False}, "accuracy": accuracy}
    identity = json.dumps({"command": "run", **case}, sort_keys=True)
    about: Row = {"kind": "start-up", **START, "accuracy": accuracy}
    return Part(f"from rest, {accuracy}", identity, partial(_run, case, about), OF_RUNS)


def _run(case: Mapping[str, Any], about: Row, folder: Path) -> list[Row]:
    """dU at `TIMES`, and the largest |dU| of the run."""
    result = computed("run", case, folder, LIMIT)
    if result.status != "finished":
        return [{**about, "ended": result.reason or result.status}]
    table = result.table
    nearest = [int((table["t"] - t).abs().argmin()) for t in TIMES]
    rows = table.iloc[nearest].assign(t=TIMES, peak=table["dU"].abs().max())
    found: Any = rows[["t", "dU", "dU_error", "peak"]].to_dict("records")
    return [{**about, **row, "ended": None} for row in found]


def _by_pyoomph(De: float, d: float, Ca_e: float, supg: int, cells: int) -> Part:
    """A pair at a held distance on one mesh of pyoomph."""
    options = {"De": De, "d": d, "Ca_e": Ca_e, "supg": supg, "cells": cells}
    name = f"pyoomph, De {De:g}, Ca_e {Ca_e:g}, d {d:g}, {cells} cells{', SUPG' * supg}"
    return _theirs(name, {**options, "beta": SCENE["beta"], "xi": SCENE["xi"]}, "pair by pyoomph")


def _start_up_by_pyoomph(cells: int) -> Part:
    """The pair from rest on one mesh of pyoomph, with SUPG."""
    options = {**START, "supg": 1, "cells": cells, "end": END, "steps": STEPS}
    name = f"pyoomph, from rest, {cells} cells"
    return _theirs(name, {**options, "beta": SCENE["beta"], "xi": SCENE["xi"]}, "start-up by pyoomph")


def _theirs(name: str, options: Mapping[str, float], kind: str) -> Part:
    alpha = SCENE["liquid"]["alpha"]
    asked = {**options, "alpha": alpha}
    identity = json.dumps({"script": SCRIPT, **asked}, sort_keys=True)
    return Part(name, identity, partial(_table, asked, kind), OF_PYOOMPH)


def _table(options: Mapping[str, float], kind: str, _: Path) -> list[Row]:
    """The rows of a table by pyoomph.

    Raises:
        Unavailable: pyoomph is not there, or has found no solution.
    """
    words = [word for name, value in options.items() for word in (f"--{name}", value)]
    try:
        table = by_pyoomph(SCRIPT, words)
    except subprocess.CalledProcessError as failed:
        raise Unavailable(f"pyoomph ended with exit code {failed.returncode}") from failed
    about = {name: options[name] for name in ("De", "d", "Ca_e", "supg", "cells")}
    columns = [name for name in ("t", "dU", "D_T", "D_L", "unknowns", "seconds") if name in table]
    found: Any = table[columns].to_dict("records")
    return [{"kind": kind, **about, **row, "ended": None} for row in found]
