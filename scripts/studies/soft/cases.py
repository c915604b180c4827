"""Pairs at two small Ca_e, and a single sphere in time: the parts of the study."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from book import yaml_files
from book.apart import apart
from book.case_parts import case_of, case_part
from book.study import Part, Row

from studies.soft.bullet import modes_of_sphere

PAIR = yaml_files.read(Path(__file__).with_name("pair.yaml"))
SMALL = (1e-3, 5e-4)
"""The Ca_e from which dU/Ca_e is extrapolated to 0."""
PLACES = ((0.4, 0.1), (0.4, 0.3), (0.2, 0.1))
"""Diameters and distances of the pairs [D_c]."""


def parts(quick: bool) -> list[Part]:
    """The pairs, and the sphere, which the quick form leaves out."""
    columns = ("dU", "dU_error")
    pairs = [
        case_part(
            f"pair-{beta:g}-{d:g}+{Ca_e:g}",
            "curve",
            case_of(PAIR, beta=beta, d=[d], Ca_e=Ca_e),
            columns,
            {"kind": "pair", "beta": beta, "d": d, "Ca_e": Ca_e},
        )
        for beta, d in PLACES[: 1 if quick else None]
        for Ca_e in SMALL
    ]
    return pairs if quick else [*pairs, Part("sphere", f"modes of a single sphere at Ca_e {SMALL[0]:g}", _sphere)]


def _sphere(folder: Path) -> Sequence[Row]:
    """The modes of the outline of the single sphere."""
    f = apart(modes_of_sphere, SMALL[0])
    return [{"kind": "sphere", "beta": 0.4, "Ca_e": SMALL[0], **{f"f_{n}": float(f[n]) for n in range(2, 6)}}]
