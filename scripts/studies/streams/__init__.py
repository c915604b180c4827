"""What streams of beads do, against exact results and what others have found."""

from pathlib import Path

from book.computing import DOCS
from book.study import Study

from studies.rows.cases import OF_MODELS
from studies.streams.cases import parts
from studies.streams.judgement import blocks, statements

STUDY = Study(
    folder=Path(__file__).parent,
    shows="whether streams of beads do what others have found of them",
    uses=(*OF_MODELS, "pairsim.analysis.arrivals", "pairsim.analysis.drops", "pairsim.questions.stream"),
    parts=parts,
    statements=statements,
    blocks=blocks,
    page=DOCS / "validation" / "streams.md",
)
