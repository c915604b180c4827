"""The site of the documentation: built with warnings as errors, complete, readable without a network."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
import typer
from support.inputs import ROOT

from pairsim.cli.app import app
from pairsim.computing.case_files import FILES
from pairsim.computing.schema import schema_rows


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The built site; internal links and anchors are checked by mkdocs."""
    folder = tmp_path_factory.mktemp("site")
    quiet = {"NO_MKDOCS_2_WARNING": "1", "PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(folder)]
    done = subprocess.run(command, cwd=ROOT, env=os.environ | quiet, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "WARNING" not in done.stderr
    return folder


@pytest.mark.slow
def test_reference_has_every_key_and_command(site: Path) -> None:
    keys = (site / "reference" / "case-files.html").read_text()
    for command in FILES:
        assert not [row[0] for row in schema_rows(command) if f"<code>{row[0]}</code>" not in keys]
    commands = (site / "reference" / "cli.html").read_text()
    names = list(typer.main.get_command(app).commands)
    assert "run" in names
    assert not [name for name in names if f"<code>pairsim {name}</code>" not in commands]


@pytest.mark.slow
def test_nothing_is_loaded_from_elsewhere(site: Path) -> None:
    """Equations are part of the pages, fonts and scripts are files of the site."""
    loaded = re.compile(r"<(?:script|img|iframe)[^>]*\ssrc=\"?(?:https?:)?//|<link[^>]*rel=\"?stylesheet\"?[^>]*//")
    assert not [page for page in site.rglob("*.html") if loaded.search(page.read_text())]
    physics = (site / "explanation" / "physics.html").read_text()
    assert physics.count("<math") > 50
    assert "\\boldsymbol" not in physics.replace("\\\\", "")
