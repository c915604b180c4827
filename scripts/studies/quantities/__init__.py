"""Whether quantities printed of one particle are inside half-widths, and their accuracy kept or said to be missed."""

from pathlib import Path

from book.computing import DOCS
from book.study import Study
from book.uses import steady

from studies.quantities.cases import parts
from studies.quantities.judgement import blocks, statements

STUDY = Study(
    folder=Path(__file__).parent,
    shows="whether each quantity that shape, pressure and curve print of one particle is inside its half-width, and "
    "its accuracy is kept or said to be missed",
    uses=(*steady(), "pairsim.computing.along", "pairsim.questions.shape", "pairsim.questions.pressure"),
    parts=parts,
    statements=statements,
    blocks=blocks,
    page=DOCS / "validation" / "quantities.md",
)
