"""Whether dU of unequal pairs by the atlases that ship is inside its half-widths."""

from pathlib import Path

from book.computing import DOCS
from book.study import Study
from book.uses import steady

from studies.unequal_atlas.cases import parts
from studies.unequal_atlas.judgement import blocks, statements

STUDY = Study(
    folder=Path(__file__).parent,
    shows="whether dU of pairs that differ in size and stiffness is inside the half-widths of the atlases that ship",
    uses=steady(),
    parts=parts,
    statements=statements,
    blocks=blocks,
    page=DOCS / "validation" / "unequal-pairs.md",
)
