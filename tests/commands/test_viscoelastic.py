"""Runs in viscoelastic liquids: an unresolved stress gives a warning."""

from __future__ import annotations

import pytest

import pairsim


@pytest.mark.slow
def test_a_stress_that_cells_do_not_resolve_is_told(capfd: pytest.CaptureFixture[str]) -> None:
    """At the wall of a pipe whose cells are half as large as its radius c changes by more than e^2 within a cell."""
    pipe = {"particles": 0, "De": 10, "ends": "developed", "length": 1, "mesh": {"max_size": 0.25}}
    for end, count in ((0.001, 0), (2, 1)):
        result = pairsim.run(pipe, time={"end": end}, output={"fields": False}, progress=True).check()
        assert len(result.warnings) == count
        assert ("is not resolved" in capfd.readouterr().err) == bool(count)
