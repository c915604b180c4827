"""The figures of the paper that pairsim follows, and whether what the paper says of them holds."""

from pathlib import Path

from book.computing import DOCS
from book.study import Study

from studies.paper.judgement import PICTURES, blocks, statements
from studies.paper.parts import USES, parts

STUDY = Study(
    folder=Path(__file__).parent,
    shows="Figs. 2 to 17 of the paper, and which of its statements about them hold",
    uses=USES,
    parts=parts,
    statements=statements,
    blocks=blocks,
    page=DOCS / "paper.md",
    pictures=PICTURES,
)
