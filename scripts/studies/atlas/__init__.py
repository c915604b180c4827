"""The atlases that ship against curves, and single distances, from which they were not made."""

from pathlib import Path

from book.computing import DOCS
from book.study import Study
from book.uses import steady

from studies.atlas.cases import parts
from studies.atlas.judgement import blocks, statements

STUDY = Study(
    folder=Path(__file__).parent,
    shows="whether the atlases that ship hold what they were not made of inside their intervals",
    uses=steady("newtonian", "giesekus", "neo_hookean"),
    parts=parts,
    statements=statements,
    blocks=blocks,
    page=DOCS / "validation" / "atlas.md",
)
