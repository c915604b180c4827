"""`pairsim atlas`: curves of equal and of unequal pairs are computed, and made into an atlas."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from pairsim.app.command_line import app
from pairsim.atlas.atlas import Atlas
from pairsim.cases.yaml_file import read_yaml
from pairsim.lab.atlas_curve import curve_of_atlas
from pairsim.record.table_files import read_table
from pairsim.runtime.errors import InputError
from pairsim.sweeps import atlas_building, unequal_building
from pairsim.sweeps.atlas_curves import curve_folders

BOX = "beta: [0.3, 0.4]\nDe: [0, 0]\nCa_e: [0, 0.05]\nd: [0.15, 0.25]\n"
BASE = "base: {mesh: {Np: 8, max_size: 0.3}, tol: 0.5}\n"


def build(folder: Path, name: str, text: str) -> tuple[Atlas, str]:
    """The atlas of a file, made in a folder of its name, and what the command says."""
    (folder / f"{name}.yaml").write_text(text)
    done = CliRunner().invoke(app, ["atlas", str(folder / f"{name}.yaml"), "-o", str(folder / name)])
    if isinstance(done.exception, InputError):
        raise done.exception
    assert done.exit_code == 0, done.output
    return Atlas.load(folder / name / "atlas.npz"), done.output


def assert_computed(atlas: Atlas, folder: Path) -> None:
    """Intervals of an atlas hold the curves of a folder at the ends of d."""
    folders = list(curve_folders(folder / "round-00"))
    assert folders
    for each in folders:
        table, case = read_table(each / "curve.csv"), read_yaml(each / "case.yaml")
        found, at = curve_of_atlas(atlas, beta=case["beta"], De=0.0, Ca_e=case["Ca_e"]).table, [0, -1]
        assert (np.abs(found["dU"][at] - table["dU"][at]) <= found["dU_error"][at] + table["dU_error"][at]).all()


@pytest.fixture(scope="module")
def equal(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Atlas, str]:
    """The folder of an atlas of equal pairs, the atlas, and what the command says."""
    folder = tmp_path_factory.mktemp("atlas")
    return folder, *build(folder, "equal", f"{BOX}{BASE}curves: 6\n")


@pytest.mark.slow
def test_curves_are_computed_and_made_into_an_atlas(equal: tuple[Path, Atlas, str]) -> None:
    folder, atlas, said = equal
    assert "5 of 5 cases finished; 5 curves; left out, half of them are off by up to " in said
    assert atlas.provenance["case"]["mesh"]["Np"] == 8
    assert atlas.curves.random.sum() == 3
    assert_computed(atlas, folder / "equal")


@pytest.mark.slow
def test_curves_are_added_in_a_part_of_the_box(equal: tuple[Path, Atlas, str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(atlas_building, "PER_ROUND", 2)
    folder, _, _ = equal
    start = f"start: {folder / 'equal' / 'atlas.npz'}\n"
    more, said = build(folder, "more", f"{BOX}{BASE}{start}curves: 2\nwithin: {{beta: [0.36, 0.4]}}\n")
    assert "2 of 2 cases finished; 7 curves" in said
    assert (more.curves.places[5:, 0] >= 0.36).all()
    assert (more.box["beta"], more.curves.random.sum()) == ([0.3, 0.4], 3)
    for changed, why in (
        (BOX + BASE.replace("tol: 0.5", "tol: 0.5, length: 20"), "length is 20, but auto in the atlas"),
        (BOX.replace("0.05", "0.06") + BASE, "its box is different"),
    ):
        with pytest.raises(InputError, match=f"must be an atlas of the same box and base: {why}"):
            build(folder, "other", f"{changed}{start}curves: 6\n")


@pytest.mark.slow
def test_unequal_curves_are_computed_and_added(equal: tuple[Path, Atlas, str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(unequal_building, "PER_ROUND", 4)
    folder, before, _ = equal
    ratios = f"diameters: [0.9, 1.1]\nmoduli: [0.5, 2]\nstart: {folder / 'equal' / 'atlas.npz'}\n"
    atlas, said = build(folder, "unequal", f"{BOX}{BASE}{ratios}curves: 4\nbeads: 4\n")
    assert "4 curves of unequal pairs; left out, half of them are off by up to " in said
    assert atlas.curves.dU.tolist() == before.curves.dU.tolist()
    assert atlas.unequal is not None
    assert atlas.unequal.beads.alone.sum() == 4
    assert_computed(atlas, folder / "unequal")
    again, said = build(folder, "again", f"{BOX}{BASE}start: {folder / 'unequal' / 'atlas.npz'}\nrecompute: true\n")
    assert "5 of 5 curves of equal pairs were computed again" in said
    assert again.unequal is not None
    assert {*map(tuple, again.curves.places)} == {*map(tuple, atlas.curves.places)}
    assert again.curves.random.sum() == atlas.curves.random.sum()
    assert again.unequal.curves.random.sum() == atlas.unequal.curves.random.sum()
    for name in ("dU", "gradients"):
        both = [np.sort(getattr(each, name), axis=0) for each in (again.unequal.curves, atlas.unequal.curves)]
        assert both[0] == pytest.approx(both[1], rel=1e-6, abs=1e-9, nan_ok=True)
    assert again.velocities([[0.35, 0, 0.03]])[0] == pytest.approx(atlas.velocities([[0.35, 0, 0.03]])[0], rel=0.01)
