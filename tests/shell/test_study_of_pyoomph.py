"""The study of pairs beside pyoomph: which parts need it, and what is stated of pairs in a Giesekus liquid."""

from __future__ import annotations

import sys
from pathlib import Path

import pandas as pd
import pytest
from support.inputs import ROOT

sys.path.append(str(ROOT / "scripts"))

from book.results import Results
from book.study import Part, Unavailable, study_of
from studies.pyoomph import viscoelastic, viscoelastic_judgement

WITHIN = (
    "Giesekus: dU_held differs by at most its half-width and what their last refinement changes from "
    "pyoomph on its finest mesh"
)
CLOSER = "Giesekus: each refinement of pyoomph brings it closer, unless it was inside the half-width"
FROM_REST = "Giesekus, from rest: dU differs by at most its half-width and what their last refinement changes"


def part(name: str) -> Part:
    return next(each for each in viscoelastic.parts() if each.name == name)


def test_parts_of_pyoomph_are_left_out_without_it(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("PYOOMPH", str(tmp_path / "python"))
    with pytest.raises(Unavailable, match="needs pyoomph"):
        part("pyoomph, from rest, 24 cells").compute(tmp_path / "part")


def peer(folder: Path, lines: str) -> Path:
    """A Python of pyoomph that does what these lines do."""
    python = folder / "python"
    python.write_text(f"#!{sys.executable}\nimport sys\n{lines}\n")
    python.chmod(0o755)
    return python


def test_a_part_of_pyoomph_asks_its_script_for_one_mesh(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    lines = "open(sys.argv[-1], 'w').write('dU,D_T,D_L,newton\\n-1e-3,0.1,0.2,9\\n')\n"
    lines += f"open({str(tmp_path / 'words')!r}, 'w').write(' '.join(sys.argv[1:-1]))"
    monkeypatch.setenv("PYOOMPH", str(peer(tmp_path, lines)))
    (row,) = part("pyoomph, De 1, Ca_e 0.1, d 0.4, 56 cells, SUPG").compute(tmp_path / "part")
    asked = {"De": 1.0, "d": 0.4, "Ca_e": 0.1, "supg": 1, "cells": 56}
    assert row == {"kind": "pair by pyoomph", **asked, "dU": -1e-3, "D_T": 0.1, "D_L": 0.2, "ended": None}
    words = (tmp_path / "words").read_text()
    assert words.endswith("--De 1.0 --d 0.4 --Ca_e 0.1 --supg 1 --cells 56 --beta 0.4 --xi 0.09 --alpha 0.2 --output")


def test_a_mesh_on_which_pyoomph_fails_is_left_out(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("PYOOMPH", str(peer(tmp_path, "sys.exit(3)")))
    with pytest.raises(Unavailable, match="exit code 3"):
        part("pyoomph, from rest, 24 cells").compute(tmp_path / "part")


def pair(*theirs: float, half_width: float = 1e-5) -> pd.DataFrame:
    """A pair whose dU is 1e-3 by pairsim, and these by pyoomph on finer and finer meshes."""
    about = {"De": 1.0, "Ca_e": 0.0, "d": 0.1, "ended": None, "part": "a"}
    rows = [{**about, "d": 0.1 + 1e-16, "kind": "pair", "dU_held": 1e-3, "dU_error": half_width}]
    for cells, dU in zip((24, 36, 56), theirs, strict=False):
        rows.append({**about, "kind": "pair by pyoomph", "supg": 1, "cells": cells, "dU": dU})
    return pd.DataFrame(rows)


@pytest.mark.parametrize(
    ("theirs", "within", "closer"),
    [
        ((1.1e-3, 1.03e-3, 1.005e-3), "holds", "holds"),
        ((1.1e-3, 1.09e-3, 1.085e-3), "does not hold", "holds"),
        ((1.1e-3, 1.03e-3, 1.04e-3), "does not hold", "does not hold"),
        ((1.1e-3, 1.001e-3, 1.002e-3), "holds", "holds"),
    ],
)
def test_pyoomph_is_to_come_to_the_same_dU(theirs: tuple[float, ...], within: str, closer: str) -> None:
    found = viscoelastic_judgement.statements(pair(*theirs))
    assert (found[WITHIN].verdict, found[CLOSER].verdict) == (within, closer)


def test_a_row_has_what_is_off_on_its_finest_mesh() -> None:
    table = viscoelastic_judgement.blocks(pair(1.1e-3, 1.02e-3))["giesekus"]
    assert "| 1 | 0 | 0.1 | yes | 0.0011 | 0.00102 | " in table
    assert table.strip().endswith("| 2 | 2 |")


@pytest.mark.parametrize(("dU", "verdict"), [(1.01e-3, "holds"), (1.05e-3, "does not hold")])
def test_a_pair_from_rest_is_judged_at_all_times(dU: float, verdict: str) -> None:
    about = {"De": 0.25, "Ca_e": 0.0, "d": 0.1, "ended": None}
    rows = [{**about, "kind": "start-up", "accuracy": "0.3%", "dU": 1e-3, "dU_error": 1e-5}]
    for cells in viscoelastic.CELLS_FROM_REST:
        rows.append({**about, "kind": "start-up by pyoomph", "cells": cells, "dU": dU + (36 - cells) * 1e-7})
    times = [pd.DataFrame(rows).assign(t=t) for t in viscoelastic.TIMES]
    assert viscoelastic_judgement.statements(pd.concat(times))[FROM_REST].verdict == verdict


def test_what_is_not_computed_is_not_stated() -> None:
    study = study_of("pyoomph")
    results = Results(study.stored).of(study.parts(True) + study.parts(False)[:2])
    assert not viscoelastic_judgement.statements(results)
    assert "Not computed yet" in viscoelastic_judgement.blocks(results)["from-rest"]
