"""Columns belong to the tables of a question: what one is depends neither on imports nor on other questions."""

from __future__ import annotations

import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.inputs import ROOT

from pairsim.computing.question import Question
from pairsim.quantities.kinds import LENGTH, VELOCITY
from pairsim.questions.compute import Computation
from pairsim.questions.registry import QUESTIONS
from pairsim.record.column import PARTICLE, Column, Columns
from pairsim.record.columns import DU, SHARED
from pairsim.record.table import Table
from pairsim.record.tables import frame_of, readable

SAYS = """
from pairsim.questions.registry import QUESTIONS
for name in {names}:
    QUESTIONS[name]
print([QUESTIONS[name].tables[table].column(column).unit.name for name, table, column in {columns}])
"""


@pytest.mark.parametrize("first", [["train", "shape"], ["run"], []])
def test_what_a_column_is_does_not_depend_on_which_questions_are_loaded(first: list[str]) -> None:
    columns = [("train", "train", "spacing"), ("shape", "shape", "area"), ("curve", "curve", "dU_1")]
    script = SAYS.format(names=first, columns=columns)
    done = subprocess.run([sys.executable, "-P", "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout == "['D_c', 'D_c^2', 'U_av']\n"


def test_two_questions_may_have_columns_of_one_name() -> None:
    """`U` of critical.csv is that of the pair, in other tables every particle has its own."""
    alone = QUESTIONS["critical"].tables["critical"].column("U")
    own = QUESTIONS["curve"].tables["curve"].column("U_L")
    assert (alone.meaning, own.meaning) == (
        "velocity of the pair",
        "velocity of the leading (downstream) particle, the volume average of u_z",
    )
    long, fast = (Columns(Column("size", "s", "a size", unit)) for unit in (LENGTH, VELOCITY))
    units = [frame_of(Table({"size": np.ones(1)}, declared)).attrs["units"] for declared in (long, fast, long)]
    assert units == [{"size": "D_c"}, {"size": "U_av"}, {"size": "D_c"}]


def test_every_half_width_belongs_to_a_column_that_declares_it() -> None:
    """But for parts of another half-width, that of what is followed at a fold, and an error that is none."""
    others = {"ends_error", "regularisation_error", "parameter_error", "volume_error"}
    for question in QUESTIONS.values():
        for columns in (*question.tables.values(), question.sweep_columns):
            errors = {each.name for each in columns if each.name.endswith("_error")}
            assert errors - {each.half_width for each in (*columns, *SHARED)} <= others


def test_half_widths_of_a_shape_stand_beside_what_they_are_of() -> None:
    """The error of the deformation is that of the hull, and of D for the one particle; that of the volume is none."""
    declared = QUESTIONS["shape"].tables["shape"]
    names = ["D_1", "D_error", "deformation", "deformation_hull", "deformation_error", "volume", "U_1", "U_error_1"]
    frame = frame_of(Table({name: np.ones(1) for name in (*sorted(names), "volume_error")}, declared))
    assert {name: declared.half_width(name) for name in names if declared.half_width(name)} == {
        "D_1": "D_error",
        "deformation_hull": "deformation_error",
        "U_1": "U_error_1",
    }
    shown = list(readable(frame, whole=True))
    assert [shown.index(error) - shown.index(name) for name, error in frame.attrs["half_widths"].items()] == [1, 1, 1]
    assert shown[-1] == "volume_error"


def test_no_question_knows_the_columns_of_another() -> None:
    with pytest.raises(KeyError):
        QUESTIONS["run"].tables["series"].column("spacing")
    assert SHARED.get("spacing") is None


def test_a_table_has_its_columns_by_what_they_are() -> None:
    table = Table({"t": np.arange(2.0), "dU_1": np.ones(2), "dU_2": np.zeros(2), "dU_error_2": np.full(2, 0.1)})
    assert (table.gaps, table.rows) == (["_1", "_2"], 2)
    assert table.of(DU, "_2") is table["dU_2"]
    assert table.half_widths(DU, "_1") is None
    assert table.half_widths(DU, "_2") is table["dU_error_2"]
    assert not table.has(DU), "that of a pair"
    assert list(table.each(DU)) == ["dU_1", "dU_2"]
    with pytest.raises(KeyError):
        table[DU]


def test_a_column_of_the_page_is_declared_in_the_record_of_its_question_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    code = re.search(r"```python\n(.*?)```", (ROOT / "docs" / "how-to" / "add-column.md").read_text(), re.DOTALL)
    assert code is not None
    names: dict[str, Any] = {"Column": Column, "PARTICLE": PARTICLE, "VELOCITY": VELOCITY}
    exec(code[1], names)
    lead: Column = names["LEAD"]
    known: Question[Any] = QUESTIONS["curve"]
    question = replace(known, tables={**known.tables, "curve": Columns(known.tables["curve"], lead)})
    for place in ("", ".computation", ".parts"):
        monkeypatch.setattr(f"pairsim.questions.curve{place}.QUESTION", question)
    case = {"beta": 0.4, "De": 0, "Ca_e": 0, "particles": 1, "ends": "developed", "length": 3}
    result = Computation[Any](question)(case, mesh={"Np": 8, "max_size": 0.5}, folder=tmp_path / "out")
    frame = result.frame()
    assert list(frame)[-1] == "lead_1"
    assert frame["lead_1"][0] == pytest.approx(frame["U_1"][0] - 1)
    assert frame.attrs["units"]["lead_1"] == "U_av"
    assert result.columns.of(lead, "_1")[0] == frame["lead_1"][0]
    meaning = result.columns.declared.column("lead_1").meaning
    assert meaning == "velocity of particle i (counted from upstream) beyond the mean velocity of the liquid"


def test_declarations_load_no_numpy() -> None:
    """Its threads begin while SIGTERM is blocked (`runtime/fenicsx.py`), which a question is asked before.

    Those about one particle declare their goals as well, whose module loads it.
    """
    script = "import sys\nfrom pairsim.questions.registry import QUESTIONS\n"
    script += "[QUESTIONS[name] for name in ('run', 'curve', 'critical', 'train')]\n"
    done = subprocess.run(
        [sys.executable, "-P", "-c", script + "print('numpy' in sys.modules)"],
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout == "False\n"
