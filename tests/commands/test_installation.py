"""An incomplete installation gives a message of one line without a traceback."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest
from typer.testing import CliRunner

from pairsim.cli.app import app
from pairsim.runtime.child_process import module_command

CASE = "beta: 0.4\nDe: 0\nCa_e: 0.1\nd0: 0.1\n"
WITHOUT = {
    "MPI": (
        {
            "mpi4py/__init__.py": "",
            "mpi4py/MPI.py": "raise RuntimeError('cannot load MPI library\\n' + 'libmpi.so: no such file\\n' * 40)",
        },
        ("MPI cannot be loaded (cannot load MPI library)", "pip install 'pairsim[wheel]'"),
    ),
    "libraries of gmsh": (
        {"gmsh.py": "raise OSError('libGLU.so.1: cannot open shared object file')"},
        ("gmsh cannot be loaded (libGLU.so.1", "apt install libglu1-mesa"),
    ),
}


@pytest.mark.parametrize("lacking", WITHOUT)
def test_missing_library_is_one_line(lacking: str, tmp_path: Path) -> None:
    modules, expected = WITHOUT[lacking]
    for name, text in modules.items():
        path = tmp_path / "site" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    (tmp_path / "case.yaml").write_text(CASE)
    search = os.pathsep.join([str(tmp_path / "site"), os.environ.get("PYTHONPATH", "")])
    done = subprocess.run(
        module_command("pairsim", "run", "case.yaml"),
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": search},
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == 4
    assert len(done.stderr.splitlines()) == 1
    assert all(part in done.stderr for part in expected)
    assert not (tmp_path / "runs").exists()


def test_help_of_critical_keeps_its_brackets() -> None:
    assert "[least, largest]" in CliRunner().invoke(app, ["critical", "--help"]).output
