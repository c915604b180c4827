"""The atlas: an interpolant of master curves with intervals."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from pairsim.atlas import fit
from pairsim.atlas.atlas import PARAMETERS, Atlas
from pairsim.atlas.kriging import covariance
from pairsim.runtime.errors import InputError

BOX = {"beta": (0.3, 0.5), "De": (0.0, 1.0), "Ca_e": (0.0, 0.1), "d": (0.02, 2.0)}
D = np.geomspace(*BOX["d"], 41)
LOADED = """import sys
from pathlib import Path
from pairsim.atlas.atlas import Atlas
Atlas.load(Path(sys.argv[1])).table(.4, .5, .05)
print(*sys.modules)"""


def exact(beta: np.ndarray, De: np.ndarray, Ca_e: np.ndarray, d: np.ndarray) -> np.ndarray:
    """A function that behaves as dU: it vanishes at De = Ca_e = 0, changes sign over d, and bends in De."""
    return beta**4 * (Ca_e * np.exp(-3 * d) * (1 + beta) + De / (1 + De) * (d - 0.2) * np.exp(-d / 0.3) * (1 - Ca_e))


def values_at(places: np.ndarray) -> np.ndarray:
    return exact(*places.T[:, :, None], D)


def curves_at(places: np.ndarray) -> fit.Curves:
    steps = 1e-6 * np.eye(3)
    gradients = np.array([(values_at(places + s) - values_at(places - s)) / 2e-6 for s in steps])
    values = values_at(places)
    others = np.array([2 - places[:, :1] + 0 * D, 1 + places[:, 2:] * np.exp(-D), places[:, 1:2] + 0 * D])
    return fit.Curves(places, values, 1e-3 * np.abs(values).max(axis=1, keepdims=True) + 0 * values, gradients, others)


@pytest.fixture(scope="module")
def made() -> Atlas:
    x = np.random.default_rng(1).random((24, 3))
    return fit.fit(curves_at(np.array([0.3, 0.0, 0.0]) + x * [0.2, 1.0, 0.1]), D, BOX, {"curves": 24})[0]


def test_intervals_hold_a_known_function(made: Atlas) -> None:
    x = np.random.default_rng(2).random((100, 3))
    places = np.array([0.3, 0.0, 0.0]) + x * [0.2, 1.0, 0.1]
    dU, half_width = made.velocities(places)
    values = values_at(places)
    assert (np.abs(dU - values) <= half_width).mean() > 0.93
    assert np.median(half_width / np.abs(values).max(axis=1, keepdims=True)) < 0.01
    assert (made.velocities([[0.4, 0.0, 0.0]])[0] == 0).all()
    table = made.table(0.4, 0.5, 0.05)
    assert table["stretch"] == pytest.approx(1 + 0.05 * np.exp(-D), rel=1e-3)
    assert table["U_L"] - table["U_T"] == pytest.approx(table["dU"])


def test_covariances_of_derivatives_are_their_derivatives() -> None:
    X, Z = np.random.default_rng(4).random((2, 3, 3))
    lengths, e = np.array([0.5, 0.7, 0.9]), 1e-5
    for vanishing in (True, False):
        whole = covariance(X, Z, lengths, vanishing)
        for i, step in enumerate(e * np.eye(3)):
            ends = [covariance(X + s * step, Z, lengths, vanishing)[0] for s in (1, -1)]
            assert whole[1 + i] == pytest.approx((ends[0] - ends[1]) / (2 * e), abs=1e-8)


def test_slopes_are_differences(made: Atlas) -> None:
    place, e = np.array([0.41, 0.4, 0.06]), 1e-5
    table = made.table(*place)
    for name, step in zip(PARAMETERS, np.eye(3) * e, strict=True):
        high, low = (made.table(*(place + s * step))["dU"] for s in (1, -1))
        assert table[f"by_{name}"] == pytest.approx((high - low) / (2 * e), rel=1e-4, abs=1e-9)


def test_curves_left_out_are_those_of_the_others_alone() -> None:
    x = np.random.default_rng(5).random((8, 3))
    curves = curves_at(np.array([0.3, 0.0, 0.0]) + x * [0.2, 1.0, 0.1])
    whole, rest = (fit.Curves(*(each[..., at, :] for each in vars(curves).values())) for at in (range(8), range(1, 8)))
    settings = np.array([1.0, 1.0, 1.0, 1e-2, 1e-2])
    found = fit.interpolant(rest, BOX, settings)(fit.scaled(BOX, curves.places[:1]))[0][0, 0]
    value = curves.dU[0] / curves.places[0, 0] ** 4
    assert fit.interpolant(whole, BOX, settings).left_out()[0][0] == pytest.approx(found - value, rel=0.05, abs=1e-5)


def test_further_places_are_far_from_known_ones_and_near_errors() -> None:
    candidates = np.random.default_rng(3).random((200, 3))
    chosen = candidates[fit.farthest(np.empty((0, 3)), np.empty(0), candidates, 8)]
    apart = np.linalg.norm(chosen[:, None] - chosen, axis=2) + np.eye(8)
    assert apart.min() > 0.5
    known = np.array([[0.1, 0.5, 0.5], [0.9, 0.5, 0.5]])
    (wanted,) = candidates[fit.farthest(known, np.array([0.1, 1.0]), candidates, 1)]
    assert wanted[0] > 0.5


def test_a_file_has_all_of_an_atlas(made: Atlas, tmp_path: Path) -> None:
    made.save(tmp_path / "a.npz")
    again = Atlas.load(tmp_path / "a.npz")
    for name, column in made.table(0.35, 0.2, 0.03).items():
        assert again.table(0.35, 0.2, 0.03)[name] == pytest.approx(column, rel=1e-12), name
    assert {name: tuple(ends) for name, ends in again.box.items()} == BOX
    assert again.provenance == {"curves": 24}


def test_what_is_outside_or_no_atlas_is_refused(made: Atlas, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"beta = 0\.6 is not in 0\.3 to 0\.5"):
        made.table(0.6, 0, 0.1)
    (tmp_path / "a.npz").write_text("no")
    with pytest.raises(InputError, match="must be an atlas"):
        Atlas.load(tmp_path / "a.npz")


def test_an_atlas_is_read_with_numpy_alone(made: Atlas, tmp_path: Path) -> None:
    made.save(tmp_path / "a.npz")
    command = [sys.executable, "-c", LOADED, str(tmp_path / "a.npz")]
    output = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    assert not {"dolfinx", "scipy", "pandas", "pydantic", "xarray"} & set(output.split())
