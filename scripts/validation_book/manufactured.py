"""Manufactured solutions of the viscoelastic liquid on a moving mesh: observed orders in space and time."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any
from unittest.mock import patch

import numpy as np
import pandas as pd

from validation_book.page import Page, verification


def in_space(page: Page) -> pd.DataFrame:
    """Errors on meshes of 4, 8 and 16 cells across the radius."""
    meshes = (4, 8) if page.quick else (4, 8, 16)
    return errors({n: {"n": n, "times": list(np.linspace(0.0, 0.2, 17))} for n in meshes}, "cells across the radius")


def in_time(page: Page) -> pd.DataFrame:
    """Errors after steps that grow and shrink by 1.4 in turn, with sources that leave no error in space."""
    ends = {n: np.cumsum([0.0, *np.tile([1.0, 1.4], n // 2)]) for n in (24, 48)}
    return errors(
        {n: {"n": 4, "times": list(0.5 * t / t[-1]), "discrete": True} for n, t in ends.items()}, "time steps"
    )


def errors(discretisations: Mapping[int, Mapping[str, Any]], name: str) -> pd.DataFrame:
    """Errors by the number of cells or steps, with the observed orders between neighbours."""
    test = verification("test_manufactured")
    scene = patch("pairsim.solvers.meshed_scene.Scene", test.SourcedScene)
    with scene, patch("pairsim.fem.scene.mesh_moves", lambda *_, **__: True):
        found = pd.DataFrame({n: test.errors("general", **how) for n, how in discretisations.items()}).T
    orders = (found.shift() / found).apply(np.log2)
    return found.add_prefix("error of ").join(orders.add_prefix("order of ")).rename_axis(name).reset_index()
