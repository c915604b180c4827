"""The sphere in a Newtonian liquid, and in an Oldroyd-B liquid at twelve De on three meshes: the parts of the study."""

from __future__ import annotations

from pathlib import Path

from book import yaml_files
from book.case_parts import case_of, case_part
from book.study import Part

SPHERE = yaml_files.read(Path(__file__).with_name("sphere.yaml"))
DES = tuple(round(0.075 * i, 3) for i in range(1, 13))
ACCURACIES = {"5%": 0.9, "1%": 0.9, "0.1%": 0.53}
"""The meshes, and De up to which each is asked for; on an earlier one of 0.1 % steps became ever smaller near 0.59."""
INDICATORS = ("s_jump", "c_max", "c_max_z", "c_max_r")
"""Columns that say how well the stress is resolved."""


def parts(quick: bool) -> list[Part]:
    """All of these, in the order of De; in the quick form the least De, on two meshes."""
    columns, about = ("F_1", "F_error_1", *INDICATORS), {"beta": SPHERE["beta"]}
    newtonian = case_of(SPHERE, De=0, liquid=None, xi=0.09)
    meshes = {name: most for name, most in ACCURACIES.items() if not quick or name != "0.1%"}
    return [
        case_part("newtonian", "curve", newtonian, columns, about | {"De": 0.0, "accuracy": "1%"}),
        *(
            case_part(
                f"oldroyd-b-{De:g}+{accuracy}",
                "curve",
                case_of(SPHERE, De=De, accuracy=accuracy),
                columns,
                about | {"De": De, "accuracy": accuracy},
                entries=("unknowns",),
            )
            for De in DES[: 1 if quick else None]
            for accuracy, most in meshes.items()
            if most >= De
        ),
    ]
