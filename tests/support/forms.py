"""The forms that tests solve with, compiled before the first test and by two processes."""

from __future__ import annotations

import itertools
import multiprocessing
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor
from unittest import mock

from pairsim.fem.form_cache import compile_missing

ELASTIC = ("giesekus", "oldroyd-b", "ptt-linear", "ptt-exp", "fene-p", "white-metzner")
VISCOUS = ("newtonian", "power-law")
SOLIDS = ("neo-hookean", "kelvin-voigt", "mooney-rivlin")
RUNS = ("newtonian:moving", "neo-hookean", "mooney-rivlin", "giesekus:moving")
FORMS = [
    *(f"{liquid}:fixed" for liquid in ELASTIC),
    *("giesekus:moving", "fene-p:moving", "giesekus:fixed:steady:enriched"),
    *(f"{liquid}:moving:steady:enriched" for liquid in (*ELASTIC, "giesekus+giesekus")),
    *(f"{liquid}:{mesh}:enriched" for liquid in VISCOUS for mesh in ("moving", "fixed")),
    *(f"{solid}:enriched" for solid in SOLIDS),
    *(f"{kind}:recovered" for kind in RUNS),
]
"""Kinds of forms, as `pairsim.fem.form_cache` names them."""


def compile_forms(forms: Iterable[str]) -> None:
    """Compile kinds of forms; those that have a part in common in one process, which compiles it once."""
    alike = itertools.groupby(sorted(forms), lambda form: form.removesuffix(":enriched").removesuffix(":recovered"))
    groups = [list(group) for _, group in alike]
    with ProcessPoolExecutor(2, multiprocessing.get_context("spawn")) as pool:
        list(pool.map(_compile, groups))


def _compile(forms: list[str]) -> None:
    """Compile without the lock for which a second process of a machine waits."""
    with mock.patch("fcntl.flock"):
        compile_missing(forms)
