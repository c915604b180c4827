"""The study that judges growth rates of trains, without computing a train."""

from __future__ import annotations

import sys

import numpy as np
import pandas as pd
import pytest
from support.inputs import ROOT

import pairsim

sys.path.append(str(ROOT / "scripts"))

from studies.trains import cases, judgement

INSIDE = "at least 95 % of the rates are inside their half-widths"
KEPT = "no error of a train is above 1 % of its largest rate without a warning"
SAME = "each train does the same on finer meshes"
IN_TIME = "rates of waves in runs differ by at most 1 % of the largest rate and the half-width"


def train(off: float = 0.0, run: float = 0.0, verdict: str = "orders", said: bool = False) -> pd.DataFrame:
    """A train whose wave of four beads grows too fast by `off`, its reference, and a run off by `run`."""
    rows = []
    same = {"train": "soft", "said": said, "seconds": 3.0, "computed": "2026-11-30", "code": "a", "ended": None}
    for kind, accuracy, error in (("case", "1%", 3e-4), ("reference", "0.2%", 3e-5)):
        about = {**same, "part": f"soft+{accuracy}", "kind": kind, "accuracy": accuracy}
        about["verdict"] = verdict if kind == "reference" else "orders"
        errors = {"growth_error": error, "frequency_error": error}
        growth = -0.04 + (off if kind == "case" else 0.0)
        rows.append({**about, "beads": 4.0, "growth": growth, "frequency": 0.08, **errors})
        rows.append({**about, "beads": 2.0, "growth": -0.06, "frequency": 1e-18, **errors})
    about = {**same, "part": "soft, wave of 2", "kind": "run", "said": None}
    return pd.DataFrame([*rows, {**about, "beads": 2, "growth": -0.06 + run, "frequency": 0.0}])


def verdicts(results: pd.DataFrame) -> dict[str, str]:
    return {text: each.verdict for text, each in judgement.statements(results, []).items()}


def test_trains_and_runs_are_valid_cases() -> None:
    for beads in cases.TRAINS:
        pairsim.load({**beads.keys, "train": {"spacing": beads.spacing}}, kind="train")
        for count in cases.WAVES if beads.in_time else ():
            for run in cases._runs(beads, beads.in_time, count):
                assert pairsim.load(run, kind="run").n == count


def test_beads_are_displaced_by_a_cosine_and_its_opposite() -> None:
    beads = cases.TRAINS[0]
    assert beads.in_time is not None
    gaps = [run["d0"] for run in cases._runs(beads, beads.in_time, 4)]
    assert gaps == [pytest.approx([0.1148, 0.1148, 0.1252]), pytest.approx([0.1252, 0.1252, 0.1148])]


@pytest.mark.parametrize("count", [2, 4])
def test_the_rate_of_a_wave_is_found_beside_terms_of_second_order(count: int) -> None:
    rate, spacing, k = -0.05 + (0.07j if count > 2 else 0), 0.5, 2 * np.pi / count
    names = ["T", "L"] if count == 2 else range(1, count + 1)

    def run(sign: int, t: np.ndarray) -> pd.DataFrame:
        x = sign * 0.005 * np.exp(rate * t)
        waves = {f"z_{j}": np.real(x * np.exp(1j * k * i)) + 40 * abs(x) ** 2 for i, j in enumerate(names)}
        return pd.DataFrame({name: z + spacing * i for i, (name, z) in enumerate(waves.items())} | {"t": t})

    tables = [run(sign, np.linspace(0, 6, 301)) for sign in (1, -1)]
    found = cases.rate_of(*(cases.wave_of(table, spacing, count) for table in tables), since=2.0)
    assert found == pytest.approx(rate, rel=1e-6)


def test_rates_are_judged_by_finer_meshes_and_the_wave_of_two_has_no_frequency() -> None:
    assert set(verdicts(train()).values()) <= {"holds", "does not hold"}
    assert verdicts(train())[INSIDE] == verdicts(train())[KEPT] == verdicts(train())[SAME] == "holds"
    assert len(judgement.judged(train())) == 3
    assert verdicts(train(off=0.01))[INSIDE] == verdicts(train(off=0.01))[KEPT] == "does not hold"
    assert verdicts(train(off=0.01, said=True))[KEPT] == "holds"
    assert verdicts(train(verdict="undecided"))[SAME] == "does not hold"


def test_runs_are_beside_the_rates_of_the_train() -> None:
    largest = float(np.hypot(0.04, 0.08))
    assert verdicts(train(run=0.009 * largest))[IN_TIME] == "holds"
    assert verdicts(train(run=0.02 * largest))[IN_TIME] == "does not hold"


def test_the_page_has_a_row_for_each_rate() -> None:
    waves = judgement.blocks(train(), [])["waves"].replace("\N{NO-BREAK SPACE}", " ").splitlines()
    assert waves[2:] == [
        "| soft | 2 | growth | -0.0600 ± 0.0003 | -0.06000 ± 0.00003 | 0.00 | -0.06 | 0 |",
        "| soft | 4 | growth | -0.0400 ± 0.0003 | -0.04000 ± 0.00003 | 0.00 |  |  |",
        "| soft | 4 | frequency | 0.0800 ± 0.0003 | 0.08000 ± 0.00003 | 0.00 |  |  |",
    ]
