"""Liquids with a shear-dependent viscosity, several modes, and viscous solids around particles."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from scipy.interpolate import CubicSpline
from studies.thinning.references import DRAG
from studies.thinning.unbounded import ritz

import pairsim

PAIR = {"beta": 0.4, "d": [0.1], "tol": 1, "ends": "developed", "length": 5, "mesh": {"Np": 14}}
SPHERE = {"particles": 1, "beta": 0.5, "Ca_e": 0, "ends": "developed", "length": 4}


def power_law(n: float) -> dict[str, Any]:
    return {"law": "power-law", "n": n}


def row(**keys: Any) -> pd.Series:
    table = pairsim.curve(keys).check().table
    assert len(table) == 1
    return table.iloc[0]


def drag(n: float, beta: float, **keys: Any) -> tuple[float, float]:
    """The drag of a sphere that moves through liquid at rest over 3 pi K V^n D_p^(2 - n), and its half-width."""
    found = row(**{**SPHERE, "beta": beta, "liquid": power_law(n), "velocity": 1, "flow": 0, **keys})
    unit = 3 * np.pi * beta ** (2 - n)
    return float(found["F_1"]) / unit, float(found["F_error_1"]) / unit


@pytest.mark.slow
@pytest.mark.parametrize("n", [0.4, 0.3])
def test_equal_rigid_spheres_keep_their_distance(n: float) -> None:
    """The stress is odd in the velocity, and the pair is its own mirror image; Newton's method leaves 2e-11."""
    found = row(**PAIR, Ca_e=0, liquid=power_law(n))
    assert abs(found["dU"]) < 1e-10
    assert 1 < found["U_L"] < 2 * (3 * n + 1) / (2 * n + 2)


@pytest.mark.slow
@pytest.mark.parametrize(("n", "d", "Ca_e"), [(0.6, 0.05, 0), (0.5, 0.02, 0.05)])
def test_near_pairs_in_thinning_liquids_are_found(n: float, d: float, Ca_e: float) -> None:
    """From the developed flow Newton's method fails in these gaps."""
    found = row(**{**PAIR, "d": [d], "length": 4, "mesh": {"Np": 12}}, Ca_e=Ca_e, liquid=power_law(n))
    assert abs(found["dU"]) < (1e-10 if Ca_e == 0 else 1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("n", [0.6, 0.4])
def test_velocity_of_a_sphere_converges(n: float) -> None:
    """The differences of halved cells fall with order 2 or more, and the correction leaves less than half of them."""
    found = [row(**SPHERE, liquid=power_law(n), mesh={"Np": Np, "max_size": 3 / Np}) for Np in (14, 28, 56)]
    corrected = [float(each["U_1"]) for each in found]
    U = [float(each["U_1"] - each["U_correction_1"]) for each in found]
    assert abs(U[2] - U[1]) < 0.25 * abs(U[1] - U[0])
    assert abs(corrected[1] - corrected[2]) < 0.5 * abs(U[1] - corrected[2])


def test_drag_in_a_tube_is_that_of_an_independent_code() -> None:
    assert drag(1.0, 0.5)[0] == pytest.approx(DRAG[1.0], rel=1e-4)
    assert drag(0.8, 0.5)[0] == pytest.approx(DRAG[0.8], rel=2e-4)


@pytest.mark.slow
def test_drag_far_from_the_wall_tends_to_that_of_an_unbounded_liquid() -> None:
    """The published value, 1.38, is 3 % below (see docs/validation/thinning.md)."""
    n = 0.6
    unbounded = ritz(n)
    assert unbounded == pytest.approx(1.4288, rel=5e-4)
    wide = {"length": 5, "mesh": {"Np": 40, "max_size": 0.1, "growth": 0.1}}
    X = [drag(n, beta, **wide)[0] for beta in (0.05, 0.025)]
    assert X[0] > X[1] > unbounded - 1e-3
    ratio = 0.22  # of these differences for halved spheres
    assert X[1] - (X[0] - X[1]) * ratio / (1 - ratio) == pytest.approx(unbounded, rel=2e-3)


def run_of(n: float, end: float) -> pairsim.RunResult:
    case = {key: value for key, value in PAIR.items() if key not in ("d", "tol")}
    return pairsim.run(
        {**case, "Ca_e": 0.1, "liquid": power_law(n), "d0": 0.1, "time": {"end": end}, "output": {"fields": False}}
    ).check()


@pytest.mark.slow
def test_a_run_in_a_thinning_liquid_tends_to_the_quasi_steady_dU() -> None:
    found, point = run_of(0.6, 3.0).table.iloc[-1], row(**PAIR, Ca_e=0.1, liquid=power_law(0.6))
    assert found["dU"] == pytest.approx(
        point["dU"] - point["dU_correction"] + (found["d"] - point["d"]) * point["slope"], rel=0.02
    )


@pytest.mark.slow
def test_runs_in_a_strongly_thinning_liquid_start_from_rest() -> None:
    """Newton's method by itself fails below n = .6."""
    run = run_of(0.2, 0.002)
    assert run.record["reason"] == "end"
    assert run.record["rejected_steps"] <= 2


@pytest.mark.slow
def test_t_relax_of_viscous_particles_does_not_depend_on_the_mesh() -> None:
    keys = {**PAIR, "Ca_e": 0.1, "De": 0, "solid": {"law": "kelvin-voigt", "eta": 20.0}}
    coarse, fine = (row(**{**keys, "mesh": {"Np": Np}}) for Np in (20, 28))
    assert coarse["t_relax"] == pytest.approx(fine["t_relax"], rel=0.02)


@pytest.mark.slow
def test_a_run_with_viscous_particles_forgets_its_start_within_t_relax() -> None:
    """A start from rest excites slower modes of the inside than the lag of a moving pair, for which t_relax is made."""
    keys = {**PAIR, "Ca_e": 0.1, "De": 0, "solid": {"law": "kelvin-voigt", "eta": 10.0}, "mesh": {"Np": 16}}
    curve = pairsim.curve({**keys, "d": [0.1, 0.11, 0.12, 0.13, 0.14]}).check().table
    fixed = {key: value for key, value in keys.items() if key not in ("d", "tol")}
    run = pairsim.run({**fixed, "d0": 0.1, "time": {"end": 6}, "output": {"fields": False}}).check().table
    late = run[run["t"] > 3]
    left = np.abs(late["dU"] - CubicSpline(curve["d"], curve["dU"])(late["d"]))
    measured = -1 / np.polyfit(late["t"], np.log(left), 1)[0]
    assert curve["t_relax"].median() < measured < 1.4 * curve["t_relax"].median()


@pytest.mark.slow
@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_a_run_goes_on_without_an_error_where_its_estimate_diverges(tmp_path: Path) -> None:
    keys = {"beta": 0.4, "De": 0, "Ca_e": 0.15, "solid": {"law": "mooney-rivlin", "c": 0.5}, "d0": 0.1, "length": 5}
    steps = {"ends": "developed", "mesh": {"Np": 20, "rows": 0}, "time": {"end": 2.6}, "output": {"fields": False}}
    run = pairsim.run({**keys, **steps, "dU_error": True}, folder=tmp_path / "run").check()
    known = run.table["dU_error"].notna()
    assert known.iloc[0]
    assert not known.iloc[-1]
    assert run.table.loc[known, "dU_correction"].abs().max() <= 1
    assert run.table["dU"].between(-0.01, 0.02).all()
    assert any("the estimate of the error diverged at t = " in warning for warning in run.warnings)
    again = pairsim.run(
        {**keys, **steps, "time": {"end": 2.65}, "dU_error": True}, folder=tmp_path / "run", resume=True
    )
    assert again.record["reason"] == "end"
    assert again.table["dU_error"].isna().iloc[-1]
