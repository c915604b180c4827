"""The spheres and pairs of the study, each a part."""

from __future__ import annotations

from pathlib import Path

from book import yaml_files
from book.case_parts import case_of, case_part
from book.study import Part

HERE = Path(__file__).parent
SPHERE, PAIR = (yaml_files.read(HERE / f"{name}.yaml") for name in ("sphere", "pair"))
BETAS = (0.2, 0.4, 0.6)
MOVED = {"free": {}, "dragged": {"velocity": 1, "flow": 0}, "held": {"velocity": 0, "flow": 1}}
"""What the spheres do, and the keys for it."""


def parts(quick: bool) -> list[Part]:
    """Spheres of three diameters, free, dragged and held, and a pair at two distances."""
    columns = ("U_1", "dp_plus", "F_1", "F_error_1")
    spheres = [
        case_part(
            f"{kind}-{beta:g}", "curve", case_of(SPHERE, beta=beta, **keys), columns, {"kind": kind, "beta": beta}
        )
        for kind, keys in MOVED.items()
        for beta in ((0.4,) if quick else BETAS)
    ]
    pair = case_part("pair", "curve", PAIR, ("d", "U_L", "dp_plus", "dU", "dU_error"), {"kind": "pair", "beta": 0.4})
    return [*spheres, pair]
