"""The atlas: an interpolant of master curves with intervals."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from pairsim.atlas import fit
from pairsim.atlas.atlas import Atlas
from pairsim.atlas.basis import nodes
from pairsim.runtime.errors import InputError

BOX = {"beta": (0.3, 0.5), "De": (0.0, 1.0), "Ca_e": (0.0, 0.1), "d": (0.02, 2.0)}
LOADED = """import sys
from pathlib import Path
from pairsim.atlas.atlas import Atlas
Atlas.load(Path(sys.argv[1])).velocity(.4, .5, .05, .1)
print(*sys.modules)"""


def exact(beta: np.ndarray, De: np.ndarray, Ca_e: np.ndarray, d: np.ndarray) -> np.ndarray:
    """A function that behaves as dU: it vanishes at De = Ca_e = 0, changes sign over d, and bends in De."""
    return beta**4 * (Ca_e * np.exp(-3 * d) * (1 + beta) + De / (1 + De) * (d - 0.2) * np.exp(-d / 0.3) * (1 - Ca_e))


def curves_at(places: np.ndarray) -> dict[str, fit.Samples]:
    d, e = nodes(BOX["d"], fit.COLUMNS), 1e-6
    values = exact(*places.T[:, :, None], d)
    steps = [np.eye(3)[i] * e for i in range(3)]
    gradients = [(exact(*(places + s).T[:, :, None], d) - exact(*(places - s).T[:, :, None], d)) / 2 / e for s in steps]
    peaks = np.abs(values).max(axis=1, keepdims=True)
    dU = fit.Samples(places, values, np.array(gradients), 1e-3 * peaks + 0 * values)
    rigid = {
        "t_relax": places[:, 1:2] + 0 * d,
        "stretch": 1 + places[:, 2:] * np.exp(-d),
        "U": 2 - places[:, :1] + 0 * d,
    }
    return {"dU": dU, **{name: fit.Samples(places, each, None, 0 * each) for name, each in rigid.items()}}


@pytest.fixture(scope="module")
def made() -> Atlas:
    x = np.random.default_rng(1).random((24, 3))
    samples = curves_at(np.array([0.3, 0.0, 0.0]) + x * [0.2, 1.0, 0.1])
    regression = fit.Regression(fit.terms_of(BOX), fit.POWER, True)
    return fit.fit(samples, 0 * samples["dU"].values, BOX, {"curves": 24}, regression)[0]


def test_intervals_hold_a_known_function(made: Atlas) -> None:
    x = np.random.default_rng(2).random((400, 4))
    beta, De, Ca_e, d = 0.3 + 0.2 * x[:, 0], x[:, 1], 0.1 * x[:, 2], 0.02 * 100 ** x[:, 3]
    found, value = made.velocity(beta, De, Ca_e, d), exact(beta, De, Ca_e, d)
    assert (np.abs(found.value - value) <= found.half_width).mean() > 0.93
    assert (made.velocity(beta, 0, 0, d).value == 0).all()
    assert made.stretch(0.4, 0.5, 0.05, 0.3) == pytest.approx(1 + 0.05 * np.exp(-0.3), rel=1e-3)


def test_slopes_are_differences(made: Atlas) -> None:
    place, e = np.array([0.41, 0.4, 0.06, 0.13]), 1e-5
    for i, slope in enumerate(vars(made.slopes(*place)).values()):
        high, low = (made.velocity(*(place + s * np.eye(4)[i])).value for s in (e, -e))
        assert slope == pytest.approx((high - low) / 2 / e, rel=1e-5)


def test_a_file_has_all_of_an_atlas(made: Atlas, tmp_path: Path) -> None:
    made.save(tmp_path / "a.npz")
    again = Atlas.load(tmp_path / "a.npz")
    there = 0.35, 0.2, 0.03, np.array([0.05, 0.5])
    assert again.velocity(*there).value == pytest.approx(made.velocity(*there).value, rel=1e-12)
    assert again.velocity(*there).half_width == pytest.approx(made.velocity(*there).half_width, rel=1e-3)
    assert again.box == BOX
    assert again.provenance == {"curves": 24}


def test_what_is_outside_or_no_atlas_is_refused(made: Atlas, tmp_path: Path) -> None:
    assert made.contains(0.3, 0, 0.1, [0.02, 2.0, 2.1]).tolist() == [True, True, False]
    with pytest.raises(InputError, match=r"beta = 0\.6.*beta 0\.3 to 0\.5"):
        made.velocity(0.6, 0, 0.1, 0.1)
    (tmp_path / "a.npz").write_text("no")
    with pytest.raises(InputError, match="must be an atlas"):
        Atlas.load(tmp_path / "a.npz")


def test_an_atlas_is_read_with_numpy_alone(made: Atlas, tmp_path: Path) -> None:
    made.save(tmp_path / "a.npz")
    command = [sys.executable, "-c", LOADED, str(tmp_path / "a.npz")]
    output = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    assert not {"dolfinx", "scipy", "pandas", "pydantic", "xarray"} & set(output.split())
