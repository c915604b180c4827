"""Whether dU of random curves is inside its half-widths, and whether their accuracy is kept or said to be missed."""

from pathlib import Path

from book.computing import DOCS
from book.study import Study
from book.uses import steady

from studies.curves.cases import parts
from studies.curves.judgement import blocks, statements

STUDY = Study(
    folder=Path(__file__).parent,
    shows="whether dU of curves drawn at random, in six laws, is inside its half-widths, and their accuracy is kept or "
    "said to be missed",
    uses=steady(),
    parts=parts,
    statements=statements,
    blocks=blocks,
    page=DOCS / "validation" / "curves.md",
)
