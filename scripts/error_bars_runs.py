"""Error bars of dU in runs against errors: `scripts/error_bars --runs`.

Integrates every case of configs/error_bars/runs.yaml with the cells and steps of two values of `accuracy` and the
estimate of the error, and on two fine meshes of different kinds with smaller steps, which give its truth.
dU is compared at ten times. Some twenty minutes; the same command goes on after any kind of end. Writes runs.md into
the folder.
"""

from __future__ import annotations

import json
import statistics
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from pairsim.results.output import read_series, write_text

CASES = Path(__file__).resolve().parent.parent / "configs" / "error_bars" / "runs.yaml"
JUDGED, FINE = ("5%", "1%"), ("fine 1", "fine 2")
# Meshes and tolerances of the truth by kind of liquid.
NEWTONIAN = {
    "fine 1": {"mesh": {"Np": 80, "max_size": 0.1}, "tol": 5e-5},
    "fine 2": {"mesh": {"Np": 64, "max_size": 0.14, "growth": 0.1}, "tol": 8e-5},
}
VISCOELASTIC = {
    "fine 1": {"mesh": {"Np": 48, "max_size": 0.03, "rows": 0.5, "grading": 1.0}, "tol": 1e-4},
    "fine 2": {"mesh": {"Np": 44, "max_size": 0.035, "growth": 0.1, "rows": 1.0, "grading": 1.0}, "tol": 1.5e-4},
}
TIMES = 10
# The truth must be known to this part of an error that is judged, and errors below this part of the peak do not count.
KNOWN, NEGLIGIBLE = 0.2, 2e-4


@dataclass(frozen=True)
class Row:
    """A time of a run.

    Attributes:
        t: The time.
        dU, correction, half_width: Of the run.
        error: Exact minus computed dU.
        known: Difference of the two fine runs.
        peak: Largest |dU| of the scene.
        mesh: Number of remeshings.
    """

    t: float
    dU: float
    correction: float
    half_width: float
    error: float
    known: float
    peak: float
    mesh: int

    @property
    def verdict(self) -> str:
        """Whether the interval holds the truth, as far as can be told."""
        if abs(self.error) < NEGLIGIBLE * self.peak:
            return "negligible"
        if self.known > KNOWN * abs(self.error):
            return "undecided"
        return "held" if abs(self.error) <= self.half_width else "missed"


def integrate(name: str, case: Mapping[str, Any], kind: str, folder: Path) -> Mapping[str, np.ndarray]:
    """The series of a case in one discretisation, at the times that are compared; computed where it is not there."""
    import pairsim.runtime.fenicsx  # noqa: F401 - orders MPI ahead of everything compiled
    from pairsim.api.compute import run

    end = case["time"]["end"]
    keys = {"ends": "developed", "length": "auto", **case}
    if kind in JUDGED:
        keys |= {"accuracy": kind, "dU_error": True}
    else:
        settings = (VISCOELASTIC if case["De"] else NEWTONIAN)[kind]
        keys |= {"mesh": settings["mesh"], "time": {"end": end, "tol": settings["tol"]}}
    wanted = [round(end * k / TIMES, 10) for k in range(1, TIMES + 1)]
    keys["output"] = {"fields": False, "times": wanted}
    record = folder / "run.json"
    if not record.is_file() or json.loads(record.read_text())["status"] != "finished":
        run(keys, folder=folder, resume=folder.is_dir())
        print(name, kind, json.loads(record.read_text())["status"], flush=True)
    series = read_series(folder / "series.csv")
    places = [int(np.argmin(np.abs(series["t"] - t))) for t in wanted]
    return {key: values[places] for key, values in series.items()} | {"all": series["dU"]}


def compared(runs: Mapping[str, Mapping[str, np.ndarray]], kind: str) -> list[Row]:
    """The rows of a judged run of one scene."""
    run, first, second = runs[kind], *(runs[name] for name in FINE)
    peak = float(np.abs(first["all"]).max())
    columns = (run[name] for name in ("t", "dU", "dU_correction", "dU_error"))
    truth, known = (first["dU"] + second["dU"]) / 2, np.abs(first["dU"] - second["dU"])
    return [
        Row(float(t), float(dU), float(c), float(half), float(exact - dU), float(by), peak, int(mesh))
        for t, dU, c, half, exact, by, mesh in zip(*columns, truth, known, run["mesh"], strict=True)
    ]


def page(rows: Mapping[tuple[str, str], list[Row]]) -> str:
    """The judgement: a summary, and every time."""
    head = ["scene", "accuracy", "remeshings", "judged", "held", "dU_correction/error", "dU_error/error"]
    head += ["negligible", "undecided"]
    lines = [f"| {' | '.join(head)} |", "|---" * len(head) + "|"]
    every = [row for group in rows.values() for row in group]
    for (scene, kind), group in [*rows.items(), (("all", ""), every)]:
        judged = [row for row in group if row.verdict in ("held", "missed")]
        counts = [sum(row.verdict == word for row in group) for word in ("held", "negligible", "undecided")]
        cells = [scene, kind, str(max(row.mesh for row in group)) if kind else "", str(len(judged)), str(counts[0])]
        for ratios in ([r.correction / r.error for r in judged], [r.half_width / abs(r.error) for r in judged]):
            middle = f"{statistics.median(ratios):.2f} ({min(ratios):.2g} to {max(ratios):.2g})" if ratios else ""
            cells.append(middle)
        lines.append(f"| {' | '.join([*cells, *map(str, counts[1:])])} |")
    judged = [row for row in every if row.verdict in ("held", "missed")]
    within = sum(0.5 <= abs(row.correction / row.error) <= 2 for row in judged)
    better = sum(abs(row.error - row.correction) < abs(row.error) for row in judged)
    signs = sum(row.error * row.correction > 0 for row in judged)
    lines += ["", f"|dU_correction| within [.5, 2] of the error: {within} of {len(judged)}; sign right: {signs};"]
    lines += [f"dU better with its correction: {better}.", ""]
    lines += ["| scene | accuracy | t | dU | dU_error | error | dU_correction | truth known to | |"]
    lines += ["|---" * 9 + "|"]
    for (scene, kind), group in rows.items():
        for r in group:
            cells = [f"{r.t:g}", f"{r.dU:+.4e}", f"{r.half_width:.1e}", f"{r.error:+.2e}", f"{r.correction:+.2e}"]
            lines.append(f"| {' | '.join([scene, kind, *cells, f'{r.known:.1e}', r.verdict])} |")
    return "\n".join(lines) + "\n"


def judge(output: Path, only: str, table: bool) -> int:
    """Integrate what has not been, then judge; returns the number of scenes that failed.

    Args:
        output: Folder of the runs.
        only: Scenes whose name contains it.
        table: Compute nothing.
    """
    from pairsim.runtime.errors import RunFailure

    rows: dict[tuple[str, str], list[Row]] = {}
    failed = 0
    for name, case in yaml.safe_load(CASES.read_text()).items():
        folders = {kind: output / f"{name}-{kind.replace(' ', '-')}" for kind in (*JUDGED, *FINE)}
        if only not in name or (table and not all((folder / "run.json").is_file() for folder in folders.values())):
            continue
        try:
            runs = {kind: integrate(name, case, kind, folder) for kind, folder in folders.items()}
        except RunFailure as failure:
            failed += 1
            print(f"{name}: {failure.message}")
            continue
        rows |= {(name, kind): compared(runs, kind) for kind in JUDGED}
    text = page(rows)
    write_text(output / "runs.md", text)
    print(text)
    return failed
