"""Random scenes, each solved with its half-widths and with finer cells for the truth: the parts of the study.

Scenes are points of Sobol's sequence over the law, De to 2, Ca_e, beta, one to three particles and their distances, of
which any first ones cover the range evenly.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from functools import partial
from math import nan
from pathlib import Path
from typing import Any

import numpy as np
from book.apart import apart
from book.study import Part, Row
from scipy.stats import qmc

from pairsim.fem.meshes.geometry import MeshSettings
from pairsim.physics.liquids import NEWTONIAN, Liquid
from pairsim.physics.liquids.fene_p import FeneP
from pairsim.physics.liquids.giesekus import Giesekus
from pairsim.physics.liquids.liquid import single
from pairsim.physics.liquids.oldroyd_b import OldroydB
from pairsim.physics.liquids.ptt import LinearPTT
from pairsim.physics.solids import soft
from pairsim.runtime.errors import RunFailure
from pairsim.solvers.focus.stability import Stability
from pairsim.solvers.parameters import Parameters
from pairsim.solvers.problems import SteadyProblem
from pairsim.solvers.steady.ends import Ended
from pairsim.solvers.steady.first_solution import first_scene

LAWS: dict[str, Any] = {
    "Newtonian": None,
    "Giesekus 0.2": Giesekus(alpha=0.2),
    "Giesekus 0.05": Giesekus(alpha=0.05),
    "linear PTT 0.1": LinearPTT(epsilon=0.1),
    "FENE-P 50": FeneP(L2=50.0),
    "Oldroyd-B": OldroydB(),
}
SEED = 84
SCENES = 30
COARSE, FINE = 14, 28
QUICK_SCENES, QUICK_CELLS = (6, 10), (8, 16)
RIGID = 0.3  # part of the viscoelastic scenes whose particles are rigid
RANGES = {"De": (0.05, 2.0), "Ca_e": (0.002, 0.05), "beta": (0.2, 0.6), "d": (0.05, 1.0)}


def scenes(count: int) -> list[dict[str, Any]]:
    """The first scenes, with numbers rounded as one would write them."""
    found = []
    for law, De, Ca_e, rigid, beta, n, *d in qmc.Sobol(8, rng=SEED).random_base2(int(np.ceil(np.log2(count))))[:count]:
        name, number = list(LAWS)[int(law * len(LAWS))], 1 + int(n * 3)

        def drawn(key: str, at: float) -> float:
            low, high = RANGES[key]
            return float(f"{low * (high / low) ** at:.3g}")

        stiff = name != "Newtonian" and rigid < RIGID
        gaps = [drawn("d", each) for each in d][: number - 1]
        numbers = {"De": drawn("De", De) if LAWS[name] else 0.0, "Ca_e": 0.0 if stiff else drawn("Ca_e", Ca_e)}
        found.append({"law": name, **numbers, "beta": drawn("beta", beta), "particles": number, "d": gaps})
    return found


def solved(scene: dict[str, Any], Np: int) -> dict[str, Any]:
    """What is judged of a scene on one mesh, with half-widths, or the reason why there is nothing."""
    count, betas = scene["particles"], (scene["beta"],) * scene["particles"]
    length = 3.0 + sum(betas) + sum(scene["d"])
    problem = SteadyProblem(betas=betas, length=length, periodic=False, mesh=MeshSettings(Np=Np))
    law = LAWS[scene["law"]]
    liquid: Liquid = NEWTONIAN if law is None else single(law, scene["De"], 0.09)
    solids = soft(*(scene["Ca_e"],) * count) if scene["Ca_e"] else (None,) * count
    try:
        solver = first_scene(problem, Parameters(tuple(scene["d"]), solids, liquid))
        if isinstance(solver, Ended):
            return {"reason": "no steady state"}
        try:
            found = Stability.of(solver)
        finally:
            solver.close()
    except RunFailure as error:
        return {"reason": error.reason}
    names = [f"a_{i}{j}" for i in range(1, count + 1) for j in range(1, count + 1)]
    values = {
        name: [float(value), float(width)]
        for name, value, width in zip(names, found.disturbance.rates.ravel(), found.half_widths.ravel(), strict=True)
    }
    values["growth"] = [float(found.growth[0].real), found.growth_error]
    if found.Re_c > 0 and np.isfinite(found.Re_c):
        values["Re_c"] = [found.Re_c, found.Re_c_error]
    return {"converged": found.disturbance.converged, "verdict": found.verdict.value, "values": values}


def rows_of(scene: dict[str, Any], coarse: int, fine: int) -> list[dict[str, Any]]:
    """A row for each quantity of a scene, or one that says why there is none."""
    found = solved(scene, coarse)
    truth: dict[str, Any] = solved(scene, fine) if "values" in found else {"reason": "not computed"}
    of_scene = scene | {"d": " ".join(f"{each:g}" for each in scene["d"])}
    if "values" not in found or "values" not in truth:
        return [of_scene | {"ended": found.get("reason") or f"finer mesh: {truth.get('reason')}"}]
    rows = []
    for name, (value, width) in found["values"].items():
        known, error = truth["values"].get(name, [nan, nan])
        row = {"quantity": name, "value": value, "half_width": width, "truth": known, "of_truth": error}
        more = {"converged": found["converged"], "verdict": found["verdict"], "finer": truth["verdict"], "ended": None}
        rows.append(of_scene | row | more)
    return rows


def parts(quick: bool) -> list[Part]:
    """Thirty scenes; in the quick form the first ones of two laws, on coarser cells."""
    chosen = {number: scene for number, scene in enumerate(scenes(SCENES)) if not quick or number in QUICK_SCENES}
    cells = QUICK_CELLS if quick else (COARSE, FINE)
    return [
        Part(f"scene {number}", f"{json.dumps(scene)} with {cells} cells", partial(_rows, number, scene, cells))
        for number, scene in chosen.items()
    ]


def _rows(number: int, scene: dict[str, Any], cells: tuple[int, int], folder: Path) -> Sequence[Row]:
    return [{"scene": number, **row} for row in apart(rows_of, scene, *cells)]
