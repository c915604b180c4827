"""Half-widths of `pairsim focus` against rates on finer meshes, in random scenes.

usage, in scripts: python -m studies.focus_half_widths [-o runs/focus_half_widths] [--scenes N] [--only LAW,LAW,...]
    [--report]

Scenes are points of Sobol's sequence over the law, De to 2, Ca_e, beta, one to three particles and their distances, of
which any first ones cover the range evenly. Each is solved with N_p 14, with its half-widths, and with N_p 28 for the
truth; what is found is written to a file of its own, so that the same command goes on after any kind of end. Rates
a_ij, the largest growth rate and the Reynolds number up to which particles stay are judged. With --report nothing is
computed: results.csv beside this script is written from the files, and the judgement is printed.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from scipy.stats import qmc

from pairsim.fem.meshes.geometry import MeshSettings
from pairsim.physics.liquids import NEWTONIAN, Liquid
from pairsim.physics.liquids.fene_p import FeneP
from pairsim.physics.liquids.giesekus import Giesekus
from pairsim.physics.liquids.liquid import single
from pairsim.physics.liquids.oldroyd_b import OldroydB
from pairsim.physics.liquids.ptt import LinearPTT
from pairsim.physics.solids import soft
from pairsim.record.folder import write_text
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
COARSE, FINE = 14, 28
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
    if found.Re_most > 0 and np.isfinite(found.Re_most):
        values["Re_most"] = [found.Re_most, found.Re_error]
    return {"converged": found.disturbance.converged, "verdict": found.verdict.value, "values": values}


def judged(folder: Path, wanted: list[dict[str, Any]]) -> pd.DataFrame:
    """A row for each quantity of the scenes that are done."""
    rows = []
    for number, scene in enumerate(wanted):
        if not (file := folder / f"{number:02d}.json").exists():
            continue
        found = json.loads(file.read_text())
        of_scene = {"scene": number} | scene | {"d": " ".join(f"{each:g}" for each in scene["d"])}
        coarse, fine = found["coarse"], found["fine"]
        if "values" not in coarse or "values" not in fine:
            rows.append(of_scene | {"quantity": coarse.get("reason") or f"finer mesh: {fine.get('reason')}"})
            continue
        for name, (value, width) in coarse["values"].items():
            truth, error = fine["values"].get(name, [np.nan, np.nan])
            row = {"quantity": name, "value": value, "half_width": width, "truth": truth, "of_truth": error}
            more = {"part": abs(value - truth) / width if width else np.nan, "converged": coarse["converged"]}
            rows.append(of_scene | row | more | {"verdict": coarse["verdict"], "finer": fine["verdict"]})
    return pd.DataFrame(rows)


def report(table: pd.DataFrame) -> None:
    """Print how many are inside their half-widths."""
    known = table[np.isfinite(table["half_width"]) & np.isfinite(table["truth"])] if len(table) else table
    print(f"{table['scene'].nunique()} scenes, {known['scene'].nunique()} with half-widths")
    kinds = known["quantity"].str.replace(r"a_\d\d", "a_ij", regex=True)
    for name, group in known.groupby(kinds):
        inside = int((group["part"] <= 1).sum())
        print(
            f"{name}: {inside} of {len(group)} inside, in the median at {group['part'].median():.2f} of the half-width"
        )
    print(known[known["part"] > 1].to_string(index=False))
    print(table[~table.index.isin(known.index)].drop(columns=["truth", "of_truth", "part"]).to_string(index=False))


def main() -> None:
    """Compute the scenes that are not there yet, or report."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", dest="folder", type=Path, default=Path("runs/focus_half_widths"))
    parser.add_argument("--scenes", type=int, default=30)
    parser.add_argument("--only", default="", help="beginnings of names of laws, whose scenes alone are computed")
    parser.add_argument("--report", action="store_true")
    given = parser.parse_args()
    wanted = scenes(given.scenes)
    given.folder.mkdir(parents=True, exist_ok=True)
    for number, scene in enumerate(wanted):
        file = given.folder / f"{number:02d}.json"
        if given.report or file.exists() or not scene["law"].startswith(tuple(given.only.split(","))):
            continue
        start = time.process_time()
        found = {"scene": scene, "coarse": solved(scene, COARSE)}
        found["fine"] = solved(scene, FINE) if "values" in found["coarse"] else {"reason": "not computed"}
        write_text(file, json.dumps(found | {"seconds": time.process_time() - start}, indent=1))
        print(number, scene, found["coarse"].get("verdict"), f"{time.process_time() - start:.0f} s", flush=True)
    table = judged(given.folder, wanted)
    if given.report:
        table.to_csv(Path(__file__).with_name("results.csv"), index=False, float_format="%.6g")
    report(table)


if __name__ == "__main__":
    main()
