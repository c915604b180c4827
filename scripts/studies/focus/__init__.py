"""Particles displaced from the axis: limits of small spheres, rates to first order, and spheres in a square duct."""

from pathlib import Path

from book.computing import DOCS
from book.study import Study
from book.uses import off_axis

from studies.focus.cases import parts
from studies.focus.judgement import blocks, statements

STUDY = Study(
    folder=Path(__file__).parent,
    shows="rates of spheres off the axis against theory for small spheres, and against data of a square duct",
    uses=(*off_axis("newtonian", "giesekus", "oldroyd_b", "neo_hookean"), "scripts.studies.focus.scenes"),
    parts=parts,
    statements=statements,
    blocks=blocks,
    page=DOCS / "validation" / "focus.md",
)
