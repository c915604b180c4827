"""Case files and other inputs that several tests read."""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
OTHERS = {"curve", "critical", "focus", "study", "stream", "sweep", "train", "yield_stress"}
CONFIGS = sorted(path for path in (ROOT / "configs").glob("*.yaml") if path.stem not in OTHERS)
"""The shipped cases of `pairsim run`; other commands' are named after them."""
SMALL = "beta: 0.4, De: 0, Ca_e: 0, ends: developed, length: 3, mesh: {Np: 8}"
"""Keys of a pair on few cells."""
TINY = f"base: {{{SMALL}, output: {{fields: false}}, time: {{end: 0.01}}}}\n"
"""The base of grids whose cases take a second."""
STUDY = """
base: {beta: 0.4, De: 0, Ca_e: 0.1, d0: 0.1, ends: developed, length: 3, time: {end: 0.02}, output: {fields: false}}
at: [0.01, 0.02]
discretisations: [{mesh.Np: 8}, {mesh.Np: 11}, {mesh.Np: 16}, {mesh.Np: 8, time.fixed_step: 0.005}]
"""
"""Three meshes and a fixed step, compared at two times."""


def examples(page: str) -> list[str]:
    """The YAML blocks of a page of docs."""
    return re.findall(r"```yaml\n(.*?)```", (ROOT / "docs" / page).read_text(), re.DOTALL)
