"""Streams: what drops get, beside what is exact of them, and the commands."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.inputs import ROOT
from support.pictures import drawn_figures

import pairsim
from pairsim.analysis.arrivals import Arrivals
from pairsim.analysis.drops import poisson, shares
from pairsim.computing.kept_rows import SOLVING, KeptRows
from pairsim.questions.stream import computation
from pairsim.runtime.errors import InputError

RIGID = {"beta": 0.3, "De": 0, "Ca_e": 0, "d": 1.0, "mesh": {"Np": 8, "max_size": 0.3}}
FEW = {"beads": 100, "streams": 4, "tube": 50, "neighbours": 2, "drop": 0.7}
SHORT = {"beads": 40, "streams": 2, "tube": 5}
"""Streams of which only the rows are of interest."""


@pytest.fixture(autouse=True)
def own_cache(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Rows that other tests have solved are not known."""
    folder = tmp_path_factory.getbasetemp() / "rows"
    monkeypatch.setattr("pairsim.computing.kept_rows.cache_folder", lambda: folder)
    return folder


def stream(keys: dict[str, Any], **more: Any) -> Any:
    return pairsim.stream(keys | {"stream": FEW | more}).check()


def test_shares_of_drops_are_counted_as_they_are() -> None:
    assert shares(np.arange(1001.0), 1.0)[1] == pytest.approx(1.0, abs=2e-3)
    assert shares(np.arange(1001.0), 0.5)[:2] == pytest.approx([0.5, 0.5], abs=2e-3)
    random = np.cumsum(np.random.default_rng(0).exponential(1.0, 200_000))
    assert shares(random, 1.3) == pytest.approx(poisson(1.3), abs=4e-3)
    assert np.isnan(shares(np.arange(3.0), 5.0)).all()


def test_beads_arrive_without_overlap_at_the_mean_distance() -> None:
    for kind in ("random", "regular"):
        arrivals = Arrivals(kind, 0.1, 0.4, 0.01, 0.02, 0.1)  # type: ignore[arg-type]
        gaps, parts = arrivals.draw(np.random.default_rng(1), 1.0, 20_000)
        assert gaps.min() >= 0.01
        assert gaps.mean() == pytest.approx(1.0, rel=0.02)
        assert parts.std(axis=0) == pytest.approx([0.02, 0.1], rel=0.03)
    assert gaps.std() == pytest.approx(0.1 * 2**0.5 * 1.4, rel=0.05)


def test_drops_of_equal_rigid_beads_in_a_newtonian_liquid_are_those_of_the_arrivals() -> None:
    """Their motion is reversible. Arrivals are Poisson's but for the room that beads take."""
    table = stream(RIGID).frame()
    for name in ("single", "double", "empty", "d_spread"):
        assert abs(table[name].iloc[-1] - table[name][0]) < table[f"{name}_error"][0]
    assert table["in_contact"].max() < 0.02
    far = stream(RIGID | {"d": 30.0}, drop=20.0).frame().iloc[-1]
    for name in ("empty", "single", "double", "more"):
        assert abs(far[name] - far[f"{name}_poisson"]) < 2 * far[f"{name}_error"] + 0.01


def test_beads_that_differ_meet_and_equal_ones_do_not() -> None:
    last = stream(RIGID | {"spread": {"diameter": 0.04}}).frame().iloc[-1]
    assert last["in_contact"] > 0.1
    assert last["d_spread"] > stream(RIGID).frame().iloc[-1]["d_spread"]


def test_short_rows_are_solved_once_for_all_streams_of_a_bead(own_cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    first = stream(RIGID, **SHORT)

    def solved(*_: Any) -> Any:
        raise AssertionError("rows are known")

    monkeypatch.setattr("pairsim.computing.solved_rows.solved_rows", solved)
    assert stream(RIGID, **SHORT).frame().equals(first.frame())
    other = stream(RIGID, **SHORT, seed=1).frame()
    assert other["single"][0] != first.frame()["single"][0]
    with pytest.raises(AssertionError, match="rows are known"):
        stream(RIGID | {"beta": 0.31}, **SHORT)


def test_streams_of_known_rows_may_take_long(monkeypatch: pytest.MonkeyPatch) -> None:
    """A command without a budget gives up where nothing is found for long, but known rows are something."""
    stream(RIGID, **SHORT)
    waiting = list[bool]()

    def follow(*given: Any) -> Any:
        waiting.append(given[-1].awaits_result)
        return real(*given)

    real = computation.follow
    monkeypatch.setattr(computation, "follow", follow)
    stream(RIGID, **SHORT)
    assert waiting
    assert not any(waiting)


def test_rows_of_earlier_versions_are_known_by_all_code_that_solves_them() -> None:
    """Of the package of rows, by the modules that import solvers of the flow."""
    package = ROOT / "pairsim" / "solvers" / "rows"
    solving = [file.stem for file in package.glob("*.py") if "pairsim.solvers.steady" in file.read_text()]
    assert sorted(solving) == sorted(SOLVING)


def test_kept_rows_are_those_that_were_solved(tmp_path: Path) -> None:
    from pairsim.solvers.rows.model import Row

    rows = [
        Row(np.zeros(0), np.ones((1, 3)), np.zeros((1, 0, 2)), 0.0, np.ones((1, 1, 2))),
        Row(np.array([0.3]), np.arange(6.0).reshape(2, 3), np.ones((2, 1, 2)), 1e-4),
    ]
    waves = [(0.12, np.array([0.0, 1.0]), np.array([0.0, 0.1 + 0.2j]))]
    kept = KeptRows(tmp_path / "rows.npz")
    assert kept.read() is None
    kept.write(rows, waves)
    found, trains = kept.read() or ([], [])
    for one, other in zip(rows, found, strict=True):
        assert one.values.tolist() == other.values.tolist()
        assert (one.by_particle is None) == (other.by_particle is None)
        assert one.dU_error == other.dU_error
    assert trains[0][0] == 0.12
    assert trains[0][2].tolist() == waves[0][2].tolist()


def test_positions_come_from_a_file_with_their_unit(tmp_path: Path) -> None:
    file = tmp_path / "beads.csv"
    file.write_text("z [um]\n" + "\n".join(f"{60 * i:g}" for i in range(12)))
    keys = {"physical": {"tube": "60 um", "velocity": "5 mm/s", "viscosity": "1 Pa.s", "particle": "24 um"}, "Ca_e": 0}
    case = pairsim.load(keys | {"stream": {"positions": str(file)}}, kind="stream")
    assert case.stream.positions == pytest.approx(range(12))
    assert case.beads == 12
    with pytest.raises(InputError, match="must have positions in tube diameters"):
        pairsim.load(RIGID | {"d": None, "stream": {"positions": str(file)}}, kind="stream")
    with pytest.raises(InputError, match="must be a file of positions"):
        pairsim.load(RIGID | {"d": None, "stream": {"positions": "missing.csv"}}, kind="stream")
    for heading, encoding in (("z/um", "utf-8"), ("z in um", "utf-8"), ("z [µm]", "cp1252"), ("z [µm]", "utf-16")):
        file.write_text(heading + "\n" + "\n".join(f"{60 * i:g}" for i in range(12)), encoding=encoding)
        case = pairsim.load(keys | {"stream": {"positions": str(file)}}, kind="stream")
        assert case.stream.positions == pytest.approx(range(12)), heading
    file.write_text("position\n" + "\n".join(f"{60 * i:g}" for i in range(12)))
    with pytest.raises(InputError, match=r"must have the unit in its heading, such as z \[um\] or z \[D_c\], not 'pos"):
        pairsim.load(keys | {"stream": {"positions": str(file)}}, kind="stream")
    file.write_text("distance [um]\n" + "\n".join("36" for _ in range(12)))
    with pytest.raises(
        InputError, match="must be positions of centres, not distances: two are 0 D_c apart, less than half"
    ):
        pairsim.load(keys | {"stream": {"positions": str(file)}}, kind="stream")


@pytest.mark.parametrize("volume", ["282743.33882308 um^3", "0.28274333882308 nl", "282.74333882308 pl"])
def test_a_drop_is_a_volume_or_the_length_of_tube_that_holds_it(volume: str) -> None:
    """A tube of 60 um holds pi/4 60^2 100 um^3 in 100 um."""

    def drop(given: str, tube: str = "60 um") -> float | None:
        block = {"drop": given, "tube": tube, "velocity": "5 mm/s", "viscosity": "1 Pa.s", "particle": "24 um"}
        return pairsim.load({"physical": block, "Ca_e": 0, "d": 1.0}, kind="stream").stream.drop

    assert drop(volume) == pytest.approx(drop("100 um"), rel=1e-12)
    assert drop("100 um") == pytest.approx(100 / 60, rel=1e-12)
    assert drop("1 nl", "120 um") == pytest.approx((drop("1 nl") or 0) / 8, rel=1e-12)  # in tube diameters


def test_beads_of_a_concentration_flow_out_in_it() -> None:
    """As many as the liquid that a drop takes has in the reservoir, however fast they are in the tube."""
    found = stream({**RIGID, "d": None}, concentration=0.02, drop=1.0)
    per_drop = 0.02 * 1.5 / 0.3**3  # volumes of tube and bead: pi/4 and pi/6 beta^3
    expected = poisson(per_drop)
    assert found.frame()["single_poisson"][0] == pytest.approx(expected[1], rel=0.05)


@pytest.mark.slow
@pytest.mark.parametrize(
    "bead",
    [
        "24 um",
        # With the beads that differ, as it ships, 52 short rows are solved: a minute.
        pytest.param({"mean": "24 um", "each": "0.5 um"}, marks=pytest.mark.long),
    ],
    ids=["equal", "shipped"],
)
def test_the_shipped_case_says_what_a_chip_gets(bead: str | dict[str, str], tmp_path: Path) -> None:
    shorter = {"beads": 60, "streams": 2, "neighbours": 2}
    coarse = {"Np": 8, "max_size": 0.3, "adapt": False}
    shipped = ROOT / "configs" / "stream.yaml"
    found = pairsim.stream(
        shipped, folder=tmp_path / "out", mesh=coarse, stream=shorter, **{"physical.particle": bead}
    ).check()
    assert found.record.scales is not None
    assert found.case.De > 0.4
    assert "After 50 mm of tube" in found.answer
    assert "A drop takes the liquid of 100 um of tube (0.2827 nl)" in found.answer


def test_the_answer_says_what_drops_get_and_pictures_show_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found = pairsim.stream(RIGID | {"stream": FEW}, folder=tmp_path / "out").check()
    assert "of the drops have one bead" in found.answer
    assert "Poisson" in found.answer
    assert "D_c apart on average" in found.answer
    assert f"the liquid of {FEW['drop']:g} D_c of tube" in found.answer
    assert len(found.frame("kymograph")) == len(found.frame())
    assert found.frame("distances").groupby("position")["part"].sum().to_numpy() == pytest.approx(1.0)
    with drawn_figures(monkeypatch) as drawn:
        pairsim.plot(tmp_path / "out")
    assert len(drawn) == 2
