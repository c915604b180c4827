"""How many intervals of `pairsim fit` hold: films of runs at 0.1 %, with noise, first guesses and uncertain diameters.

    python tests/support/judge_fits.py FOLDER [NAME ...]

Runs are kept in the folder: a minute each in Newtonian liquids, minutes in Giesekus ones. Twenty-five films a scene are
then fitted, a second each, with beads that are said to be equal and with an unknown difference; lines like those of
docs/how-to/films.md are printed.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
from scipy.interpolate import PchipInterpolator

import pairsim

TUBE = {"tube": "50um", "flow_rate": "1ul/min", "viscosity": "1Pa.s"}
GIESEKUS = {"liquid": {"law": "giesekus", "alpha": 0.2}, "xi": 0.09}
FILMS, FRAMES = 25, 100
NOISE, GUESSES = (0.005, 0.05), (0.8, 100.0)  # of a diameter; of the hidden value
UNCERTAIN = 0.02  # half-width of the diameter in every fourth film

# Diameter [um], modulus [kPa], relaxation time [ms], first distance [um], end [D_c/U_av], start, and what is hidden.
SCENES: dict[str, tuple[float, float, float, float, float, str, str]] = {
    "N1": (20, 2, 0, 4, 20, "rest", "modulus"),
    "N1-40ms": (20, 2, 0, 4, 6.8, "rest", "modulus"),
    "N2": (24, 4, 0, 3, 20, "rest", "modulus"),
    "N3": (17, 2.5, 0, 2, 30, "rest", "modulus"),
    "N4": (22, 8, 0, 2, 30, "rest", "modulus"),
    "G1": (20, 3, 3, 8, 40, "rest", "relaxation"),
    "G2": (22, 2, 5, 5, 30, "steady", "relaxation"),
    "G3": (20, 2, 1, 3, 20, "rest", "modulus"),
}


def judge(name: str, folder: Path, seed: int) -> None:
    """Print how many intervals of a scene hold, and their median half-width where inputs are exact."""
    diameter, modulus, relaxation, d, end, start, hidden = SCENES[name]
    known = TUBE | {"particle": f"{diameter} um", "modulus": f"{modulus} kPa", "distance": f"{d} um"}
    liquid: dict[str, Any] = {}
    if relaxation:
        known["relaxation"], liquid = f"{relaxation} ms", GIESEKUS
    case = {"physical": known, "accuracy": "0.1%", "time": {"end": end}, "start": start, **liquid}
    if not (folder / name / "run.json").exists():
        pairsim.run(case, folder=folder / name).check()
    result = pairsim.open(folder / name)
    t, gaps = (np.append(first, result.columns[key]) for key, first in (("t", 0.0), ("d", result.columns["d"][0])))
    motion, times = PchipInterpolator(t, gaps), np.linspace(0, t[-1], FRAMES)
    seconds, value = times * result.record["scales"]["time"], modulus if hidden == "modulus" else relaxation
    for difference in ({"particle_difference": "0 %"}, {}):
        inside, widths = 0, []
        for k in range(FILMS):
            random = np.random.default_rng(seed + k)
            noise, guess = (np.exp(random.uniform(*np.log(ends))) for ends in (NOISE, GUESSES))
            half_width = UNCERTAIN if k % 4 == 3 else 0.0
            measured = diameter * (1 + half_width / 1.96 * random.standard_normal())
            said = f"{measured} um" + f" +- {100 * half_width} %" * bool(half_width)
            unit = "kPa" if hidden == "modulus" else "ms"
            block = {**known, "particle": said, hidden: f"{guess * value} {unit}", **difference}
            seen = 50 * motion(times) + noise * diameter * random.standard_normal(FRAMES)
            rows = "".join(f"{a:.9g},{abs(b):.7g}\n" for a, b in zip(seconds, seen, strict=True))
            (folder / "film.csv").write_text(f"t [s],d [um]\n{rows}")
            found, least, most, _ = pairsim.fit(
                folder / "film.csv", {"physical": block, **liquid}, unknown=hidden
            ).values[hidden]
            inside += least <= value <= most
            widths += [] if half_width else [(most - least) / 2 / found]
        said = "equal" if difference else "unknown difference"
        print(
            f"{name}, {said}: {inside} of {FILMS} inside, median half-width {100 * np.median(widths):.2g} %", flush=True
        )


if __name__ == "__main__":
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    for i, each in enumerate(SCENES):
        if each in (sys.argv[2:] or SCENES):
            judge(each, folder, 1000 * i)
