"""run.json as an object: what it says is declared, and what it does not know is kept."""

from __future__ import annotations

import json
from pathlib import Path
from zipfile import ZipFile

import pytest
from support.inputs import ROOT

from pairsim.questions.registry import QUESTIONS
from pairsim.record.record import Record
from pairsim.record.run_entries import AT_THE_END, COMMON, KIND, STATUS, Entry

KINDS = "run", "curve", "critical", "train"


@pytest.mark.parametrize("kind", KINDS)
def test_every_entry_is_declared_by_its_question_or_by_all(kind: str, tmp_path: Path) -> None:
    with ZipFile(ROOT / "tests" / "support" / "folders-0.3.0.zip") as archive:
        archive.extract(f"{kind}/run.json", tmp_path)
    record = Record.read(tmp_path / kind)
    declared = {entry.name for entry in (*COMMON, *QUESTIONS[kind].entries, *AT_THE_END)}
    assert record.kind == kind
    assert not set(record) - declared


def test_entries_of_all_questions_have_meanings_and_one_name_each() -> None:
    for question in QUESTIONS.values():
        entries = [*COMMON, *question.entries, *AT_THE_END]
        assert all(entry.meaning for entry in entries)
        assert len({entry.name for entry in entries}) == len(entries)


def test_what_another_version_wrote_is_kept(tmp_path: Path) -> None:
    (tmp_path / "run.json").write_text('{"kind": "run", "of_the_future": [1], "status": "running"}')
    record = Record.read(tmp_path).with_entries({STATUS: "failed"})
    record.write(tmp_path)
    assert json.loads((tmp_path / "run.json").read_text()) == {"kind": "run", "of_the_future": [1], "status": "failed"}
    assert (record.status, record["of_the_future"], KIND.of(record)) == ("failed", [1], "run")
    assert Entry[int]("points", "points").of(record) is None


def test_a_folder_without_a_record_has_one_without_entries(tmp_path: Path) -> None:
    record = Record.read(tmp_path)
    assert (record.status, record.reason, record.key, record.scales, record.inputs) == ("", "", None, None, [])
    (tmp_path / "run.json").write_text("[torn")
    assert not Record.read(tmp_path)
