"""What streams of beads do, against exact results and what others have found."""

from pathlib import Path

from book.computing import DOCS
from book.study import Study

from studies.rows.cases import OF_MODELS
from studies.streams.cases import parts
from studies.streams.judgement import blocks, statements

COMPUTED = tuple(f"pairsim.questions.stream.{module}" for module in ("computation", "found", "statistics", "work"))
"""What a stream is computed by, beside the model of rows; not its words and its picture."""

STUDY = Study(
    folder=Path(__file__).parent,
    shows="whether streams of beads do what others have found of them",
    uses=(*OF_MODELS, "pairsim.analysis.arrivals", "pairsim.analysis.drops", *COMPUTED),
    parts=parts,
    statements=statements,
    blocks=blocks,
    page=DOCS / "validation" / "streams.md",
)
