"""Hashes, folders and captions of the shipped cases are those that they had before."""

from __future__ import annotations

from pathlib import Path

import pytest
from support import case_names
from support.inputs import ROOT

TABLE = Path(__file__).with_name("case_names.txt")


@pytest.mark.slow
def test_shipped_cases_keep_their_folders_and_captions(
    monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest
) -> None:
    """A folder name ends with the hash: where it changes, what users have computed is computed again."""
    monkeypatch.syspath_prepend(str(ROOT / "scripts"))
    found = list(case_names.lines())
    if request.config.getoption("--rewrite-messages"):
        TABLE.write_text("\n".join(found) + "\n")
    assert found == TABLE.read_text().splitlines()
