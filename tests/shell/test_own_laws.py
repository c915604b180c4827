"""Laws that users bring: those of docs/tutorials/own-law.md, in files of their own."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest
from support.commands import Pairsim
from support.inputs import ROOT

PAGE = (ROOT / "docs" / "tutorials" / "own-law.md").read_text()
LAWS = re.search(r'```python title="my_laws.py"\n(.*?)```', PAGE, re.DOTALL)[1]  # type: ignore[index]
CASE = """\
{beta: 0.4, De: 0.5, Ca_e: 0, d: [0.2], ends: developed, length: 4, mesh: {Np: 10}, tol: 1, max_points: 1,
 liquid: {law: fene-cr, L2: 20}}
"""
SWEEP = f"{{command: curve, base: {CASE}, grid: {{beta: [0.4]}}}}"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "my_laws.py").write_text(LAWS)
    (tmp_path / "case.yaml").write_text(CASE)
    (tmp_path / "grid.yaml").write_text(SWEEP)
    return tmp_path


@pytest.mark.slow
def test_results_are_those_of_one_source_of_a_law(pairsim_apart: Pairsim, folder: Path) -> None:
    def sweep() -> str:
        done = pairsim_apart("sweep", "grid.yaml", "-o", "first", "--laws", "my_laws.py")
        return str(done.stdout + done.stderr)

    assert "1 of 1 cases finished" in sweep()
    (record,) = (json.loads(path.read_text()) for path in (folder / "first").glob("curve-*/run.json"))
    assert list(record["laws"]) == ["fene-cr"]
    (folder / "my_laws.py").write_text(LAWS.replace("(self.L2 - 3)", "1.0 * (self.L2 - 3)"))
    assert "a sweep of another grid" in sweep()


@pytest.mark.slow
def test_a_case_file_alone_runs_no_code(pairsim_apart: Pairsim, folder: Path) -> None:
    done = pairsim_apart("curve", "case.yaml", "--dry-run")
    assert done.returncode == 2
    assert "--laws FILE adds laws of your own" in done.stderr
    assert pairsim_apart("--laws", "my_laws.py", "curve", "case.yaml", "--dry-run").returncode == 0


def test_units_has_an_option_for_each_number_of_a_law_of_ones_own(pairsim_apart: Pairsim, folder: Path) -> None:
    gent = ["--solid", "gent", "--Jm", "2", "--tube", "50um", "--particle", "20um", "--flow", "1ul/min"]
    gent += ["--modulus", "5kPa", "--viscosity", "1Pa.s"]
    done = pairsim_apart("units", "--laws", "my_laws.py", *gent)
    assert re.search(r"^solid\.Jm +2 ", done.stdout, re.MULTILINE), done.stderr
    assert "(fene-p, fene-cr)" in " ".join(pairsim_apart("units", "--laws", "my_laws.py", "--help").stdout.split())
    assert "No such option: --Jm" in " ".join(pairsim_apart("units", *gent).stderr.split())


@pytest.mark.slow
def test_check_law_tells_a_wrong_sign(pairsim_apart: Pairsim, folder: Path) -> None:
    (folder / "my_laws.py").write_text(LAWS.replace("-self.spring(at), self.spring(at), 0.0", "-1.0, -1.0, 0.0"))
    done = pairsim_apart("check-law", "my_laws.py:FeneCR", "L2=20")
    assert done.returncode == 3
    wrong = [line for line in done.stdout.splitlines() if line.startswith("WRONG")]
    assert "De is the relaxation time" in wrong[1]
    assert "not tried" in wrong[-1]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ((r"return self.Jm /", "return (self.Jm /"), r"my_laws.py:\d+: cannot be imported: SyntaxError"),
        ((r'"fene-cr"', '"giesekus"'), "FeneCR.name: got 'giesekus'; is the name of another law"),
        ((r"@dataclass.frozen=True.\nclass Gent", "class Gent"), "Gent: must be decorated"),
        (
            (r"class Gent\(Solid\)", "class Gent(Solid.__mro__[1])"),
            "Gent: must be derived from ViscousLaw, ConformationLaw, YieldLaw or Solid",
        ),
    ],
)
def test_mistakes_in_a_file_of_laws_are_told(
    pairsim_apart: Pairsim, folder: Path, change: tuple[str, str], said: str
) -> None:
    (folder / "my_laws.py").write_text(re.sub(*change, LAWS))
    done = pairsim_apart("curve", "case.yaml", "--dry-run", "--laws", "my_laws.py")
    assert done.returncode == 2
    assert re.search(said, done.stderr), done.stderr


def test_laws_are_objects_in_python_and_installed_packages_bring_some(folder: Path) -> None:
    """One that is defined in the program itself is refused: processes of a sweep could not import it."""
    about = folder / "my_laws-1.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: my-laws\nVersion: 1\n")
    (about / "entry_points.txt").write_text("[pairsim.liquids]\nfene-cr = my_laws:FeneCR\n")
    (folder / "program.py").write_text(
        f"{LAWS}\nimport my_laws, pairsim\n"
        "print(pairsim.load('case.yaml', kind='curve').liquid_model.label)\n"
        "keys = {'beta': 0.4, 'De': 0.5, 'd0': 0.2}\n"
        "case = pairsim.load(keys, liquid=my_laws.FeneCR(L2=20), solid=my_laws.Gent(0.1, Jm=2))\n"
        "print(case.liquid_model.modes[0].L2, case.Ca_e, case.solid_models[1].Jm)\n"
        "pairsim.load(keys, liquid=FeneCR(L2=20))\n"
    )
    done = subprocess.run([sys.executable, "program.py"], cwd=folder, capture_output=True, text=True, check=False)
    assert done.stdout.split() == ["FENE-CR", "20.0", "0.1", "2.0"]
    assert "FeneCR: must be defined in a file of its own" in done.stderr


def test_laws_are_made_known_before_the_first_case_is_read(folder: Path) -> None:
    """In a process of its own, which has read no case."""
    read = "print(pairsim.load('case.yaml', kind='curve').liquid_model.label)"
    code = f"import pairsim\npairsim.use_laws('my_laws.py')\n{read}"
    done = subprocess.run([sys.executable, "-c", code], cwd=folder, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    late = (
        f"import pairsim\npairsim.load({{'beta': 0.4, 'Ca_e': 0, 'd0': 0.1}})\npairsim.use_laws('my_laws.py')\n{read}"
    )
    done = subprocess.run([sys.executable, "-c", late], cwd=folder, capture_output=True, text=True, check=False)
    assert "must be known before the first case is read" in done.stderr
