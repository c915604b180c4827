"""`pairsim.critical`: distances at which dU vanishes, followed along parameters."""

from __future__ import annotations

from pathlib import Path

import pytest
from support.commands import Pairsim

import pairsim


@pytest.mark.slow
def test_critical_distances_follow_the_zeros_of_curves_along_lines(tmp_path: Path) -> None:
    """At beta .4 there is an unstable distance, smaller for larger Ca_e, as in Fig. 11."""
    mesh = {"Np": 8, "max_size": 0.1}  # 0.1 is that of `accuracy: 5%`: no warning of it
    pair = {"beta": 0.4, "De": 0.5, "Ca_e": 0.1, "ends": "developed", "length": 3.0, "mesh": mesh}
    asked = {"along": {"De": [0.4, 0.5]}, "lines": {"Ca_e": [0.05, 0.1]}, "d": [0.22, 0.28]}
    critical = pairsim.critical(pair, **asked, folder=tmp_path / "out").check()
    rows = critical.table[critical.table["kind"] == "wanted"]
    assert sorted(zip(rows["Ca_e"], rows["De"], strict=True)) == [(c, d) for c in (0.05, 0.1) for d in (0.4, 0.5)]
    assert rows["branch"].nunique() == 2
    assert not rows["stable"].any()
    assert rows["d_error"].to_numpy() == pytest.approx((rows["dU_error"] / rows["slope"].abs()).to_numpy(), rel=1e-6)
    assert (rows["d_error"] > 0).all()
    found = rows.set_index(["Ca_e", "De"])
    for De in (0.4, 0.5):
        assert found.loc[(0.1, De), "d_cr"] < found.loc[(0.05, De), "d_cr"]
    zeros = pairsim.curve(pair, d={"start": 0.22, "stop": 0.28, "num": 3}, tol=1e-3).check().zeros
    d_cr, d_error = found.loc[(0.1, 0.5), ["d_cr", "d_error"]]
    assert zeros["d"].tolist() == pytest.approx([d_cr], abs=float(d_error))
    assert zeros["stable"].tolist() == [False]
    assert {end["reason"] for end in critical.ends} == {"range"}
    assert not any("not resolved" in warning for warning in critical.warnings)
    assert any("was not kept" in warning for warning in critical.warnings)
    (picture,) = critical.plot(tmp_path)
    assert picture.stat().st_size > 10_000


def test_one_critical_distance_is_no_picture_and_plot_says_so(pairsim: Pairsim, tmp_path: Path) -> None:
    (tmp_path / "case.yaml").write_text("{beta: 0.4, De: 0, Ca_e: 0, d: [0.1, 0.3], mesh: {Np: 8}}")
    pairsim("critical", "case.yaml", "-o", "out")
    done = pairsim("plot", "out")
    assert (done.returncode, done.stdout) == (0, "")
    assert "nothing to draw" in done.stderr
