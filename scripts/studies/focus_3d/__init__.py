"""A rigid bead off the axis in three dimensions, by an independent program, beside `pairsim focus`."""

from pathlib import Path

from book.computing import DOCS
from book.study import Study
from book.uses import off_axis

from studies.focus_3d.cases import parts
from studies.focus_3d.judgement import blocks, statements

OWN = tuple(f"scripts.studies.focus_3d.{name}" for name in ("flow", "mesh", "stokes", "conformation"))
STUDY = Study(
    folder=Path(__file__).parent,
    shows="the velocity of a rigid bead off the axis in a Giesekus liquid against a three-dimensional computation",
    uses=(*off_axis("newtonian", "giesekus"), "scripts.studies.focus.scenes", *OWN),
    parts=parts,
    statements=statements,
    blocks=blocks,
    page=DOCS / "validation" / "focus.md",
)
