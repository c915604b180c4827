"""Critical distances against those of finer meshes."""

from __future__ import annotations

import pytest

import pairsim


@pytest.mark.slow
def test_small_soft_spheres_have_a_stable_critical_distance() -> None:
    """.0554 at N_p 40 (docs/explanation/decisions.md)."""
    case = {"beta": 0.2, "De": 0, "Ca_e": 0.1, "ends": "developed", "length": 3, "mesh": {"Np": 16}}
    found = pairsim.critical(case, along={"Ca_e": [0.1]}, d=[0.04, 0.08]).check().table
    assert found["d_cr"].tolist() == pytest.approx([0.0554], rel=0.03)
    assert found["stable"].all()
