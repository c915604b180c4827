"""Rigid spheres on the axis in a Newtonian liquid against multipole solutions with the images of the wall."""

from pathlib import Path

from book.computing import DOCS
from book.study import Study
from book.uses import steady

from studies.rigid.cases import parts
from studies.rigid.judgement import blocks, statements

STUDY = Study(
    folder=Path(__file__).parent,
    shows="rigid spheres that are free, dragged, held, and in pairs, against exact multipole solutions",
    uses=steady("newtonian"),
    parts=parts,
    statements=statements,
    blocks=blocks,
    page=DOCS / "validation" / "rigid.md",
)
