"""Manufactured solutions of the viscoelastic liquid on a moving mesh: observed orders in space and time."""

from __future__ import annotations

from typing import Any
from unittest.mock import patch

import numpy as np

from validation_book.comparisons import Comparison, Found, Setting, text_table, verification

TIMES = tuple(np.linspace(0.0, 0.2, 17))
THEORY = "order of the elements or of the scheme"


def compute(setting: Setting) -> Found:
    """Errors on meshes of 4, 8 and 16 cells across the radius, and with 24 and 48 time steps."""
    test = verification("test_manufactured")
    module = "pairsim.solvers.meshed_scene.Scene"
    with patch(module, test.SourcedScene), patch("pairsim.fem.scene.mesh_moves", lambda *_, **__: True):
        meshes = (4, 8) if setting.quick else (4, 8, 16)
        found = {n: test.errors("general", n, list(TIMES)) for n in meshes}
        lines, orders = table(found, "cells across the radius")
        expected = {"u": 3.0, "p": 2.0, "s": 2.0}
        rows = [
            order(f"space, {meshes[-2]} to {meshes[-1]} cells", name, orders[name], expected[name], "space")
            for name in expected
        ]
        tables = {"space-errors": lines}
        if not setting.quick:
            found = {count: in_time(test, count) for count in (24, 48)}
            tables["time-errors"], orders = table(found, "time steps")
            rows += [order("time, 24 to 48 steps", name, orders[name], 3.0, "time") for name in expected]
    return Found(rows, tables)


def in_time(test: Any, count: int) -> dict[str, float]:
    """Errors after steps that grow and shrink by 1.4 in turn, with sources that leave no error in space."""
    steps = np.tile([1.0, 1.4], count // 2)
    times = 0.5 * np.concatenate([[0.0], np.cumsum(steps)]) / steps.sum()
    return dict(test.errors("general", 4, list(times), discrete=True))


def table(found: dict[int, dict[str, float]], name: str) -> tuple[Any, dict[str, float]]:
    """Errors with the observed orders between neighbours, and the orders of the last two."""
    lines, before, orders = [], None, {}
    for n, errors in found.items():
        cells = []
        for key, error in errors.items():
            orders[key] = float(np.log2(before[key] / error)) if before else np.nan
            cells += [f"{error:.2e}", f"{orders[key]:.2f}" if before else ""]
        lines.append([str(n), *cells])
        before = errors
    return text_table(
        [name, *(text for key in ("u", "p", "s") for text in (f"error of {key}", "order"))], lines
    ), orders


def order(what: str, name: str, found: float, expected: float, group: str) -> Comparison:
    """An observed order beside the expected one; that of s falls to it as meshes are refined (2.7, 2.5, 2.3)."""
    allowed = 0.4 if (name, group) == ("s", "space") else 0.1
    return Comparison(what, f"order of {name}", found, None, expected, THEORY, allowed, name == "u", group)
