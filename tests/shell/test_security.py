"""The statements of SECURITY.md about what files cannot do."""

from __future__ import annotations

import io
import itertools
import os
import re
import zipfile
from pathlib import Path

import numpy as np
import pytest
from support.commands import in_process
from support.field_samples import scene

from pairsim.cases.quantity_text import A_LENGTH, si
from pairsim.computing.case_files import read_case
from pairsim.questions.registry import QUESTIONS
from pairsim.record.checkpoint import load
from pairsim.record.xdmf import FieldsWriter, read_frame, read_times
from pairsim.runtime.errors import InputError
from pairsim.sweeps.grid import read_grid

CASE = "beta: 0.4\nDe: 0\nCa_e: 0.1\nd0: 0.1\n"
GRID = "base: {beta: 0.4, De: 0, Ca_e: 0.1}\ngrid: {d0: [0.1, 0.2]}\n"


class Executed:
    """Runs a command when it is unpickled."""

    def __reduce__(self) -> tuple[object, ...]:
        return os.system, ("touch executed",)


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder, the current one."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("unit", ["__import__('os').system('touch executed')", "(lambda: um)()"])
def test_quantities_are_not_evaluated(unit: str, here: Path) -> None:
    with pytest.raises(ValueError, match=r"must be a length"):
        si(f"1 {unit}", A_LENGTH)
    assert not (here / "executed").exists()


@pytest.mark.parametrize("name", ["../out", "/tmp/out", "..", ".hidden", "a/b", "$HOME", "-rf"])
def test_name_of_a_case_or_sweep_is_no_path(name: str, here: Path) -> None:
    path = here / "case.yaml"
    path.write_text(CASE + f"name: '{name}'\n")
    with pytest.raises(InputError, match="must be a word"):
        read_case(QUESTIONS["run"], path)
    if name in ("$HOME", "-rf"):
        return  # a folder may be named so
    path.write_text(f"name: '{name}'\n" + GRID)
    with pytest.raises(InputError, match="must be the name of a folder"):
        read_grid(path)


def test_checkpoint_holds_no_objects(here: Path) -> None:
    content = io.BytesIO()
    np.save(content, np.array([Executed()], dtype=object), allow_pickle=True)
    with zipfile.ZipFile(here / "checkpoint.npz", "w") as archive:
        archive.writestr("told.npy", content.getvalue())
    with pytest.raises(InputError, match="must be a complete checkpoint"):
        load(here)
    assert not (here / "executed").exists()


def test_description_of_fields_names_files_of_its_folder_only(here: Path) -> None:
    FieldsWriter(here).write(scene(0.1, [(0.0, 0.2, 0.2)]))
    described = here / "fields.xdmf"
    text = described.read_text()
    (here / "below").mkdir()
    assert read_times(here).tolist() == [0.1]
    for named in ("../fields/0000.h5", str(here / "fields" / "0000.h5"), "fields/../../fields/0000.h5"):
        (here / "below" / "fields.xdmf").write_text(text.replace("fields/0000.h5", named))
        with pytest.raises(InputError, match="must be a readable file with fields"):
            read_frame(here / "below")
    bomb = "".join(f'<!ENTITY x{i + 1} "{f"&x{i};" * 10}">' for i in range(9))
    for declared in (f'<!ENTITY x0 "x">{bomb}', '<!ENTITY x9 SYSTEM "file:///etc/passwd">'):
        head = f"<!DOCTYPE Xdmf [{declared}]><Xdmf"
        described.write_text(text.replace("<Xdmf", head).replace(">fields/", ">&x9;fields/"))
        with pytest.raises(InputError, match="must be a readable file with fields"):
            read_times(here)


def test_record_of_settings_holds_them_as_comments(here: Path) -> None:
    """grid.yaml in the folder of a sweep begins with the settings; a line break would make keys of them."""
    (here / "grid.yaml").write_text(GRID)
    with pytest.raises(InputError, match="must be key=value on one line"):
        read_grid(here / "grid.yaml", ("mesh.Np=8\nname: x",))


WHOLE = "beta: 0.4\nDe: 0.5\nCa_e: 0.1\nd0: 0.1\nliquid: {law: giesekus, alpha: 0.1}\nmesh:\n  Np: 20\n"
PARTS = (
    "0.3",
    "# 1",
    "- 1",
    "{a: 1",
    "&a [*a]",
    "*b",
    "<<: [1]\n",
    "!!python/name:os.system",
    "\t1",
    "yes",
    ".nan",
    "-1",
    "50 um",
)


@pytest.mark.slow
def test_a_damaged_file_ends_a_command_in_order(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """Parts of a file are overwritten, in turn: in a number, across the end of a line, behind the end."""
    codes = set[int]()
    for part, place in zip(PARTS, itertools.cycle((6, 20, len(WHOLE))), strict=False):
        (tmp_path / "case.yaml").write_text(WHOLE[:place] + part + WHOLE[place + 3 :])
        done = in_process(tmp_path, ("run", "case.yaml", "--dry-run"), capfd)
        assert done.returncode in (0, 2), (part, place, done)
        assert re.match(r"pairsim( \w+)?: ", done.stderr) if done.returncode else done.stdout, (part, place, done)
        assert "Traceback" not in done.stderr, (part, place, done)
        codes.add(done.returncode)
    assert codes == {0, 2}
    assert [path.name for path in tmp_path.iterdir()] == ["case.yaml"]
