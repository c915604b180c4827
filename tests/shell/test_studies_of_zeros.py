"""Parts of studies that are curves with their zeros: the rows that they store."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from studies.atlas import cases as of_atlas
from studies.yield_stress import cases as of_yield_stress

from pairsim.computing.result_content import Content
from pairsim.questions.registry import QUESTIONS
from pairsim.record.record import Record


@pytest.mark.parametrize("study", [of_atlas, of_yield_stress])
def test_the_zeros_of_a_curve_are_rows_with_dU_0(study: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    d, question = np.array(of_atlas.DISTANCES[:2]), QUESTIONS["curve"]
    curve = {"d": d, "dU": np.array([1e-3, -1e-3]), "dU_error": np.full(2, 1e-5)}
    zeros = {"d": np.array([d.mean()]), "d_error": np.array([0.01])}
    content = Content({"curve": curve, "equilibria": zeros}, Record({"status": "finished"}), None)
    result = question.result(question, content=content)
    monkeypatch.setattr(study, "computed", lambda *_: result)
    part = next(each for each in study.parts(False) if each.name.startswith("curve"))
    rows = part.compute(tmp_path)
    assert sorted(row["d"] for row in rows) == [d[0], d.mean(), d[1]]
    assert [row["dU_error"] for row in rows if row["dU"] == 0] == [0.01]
