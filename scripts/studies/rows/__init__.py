"""Whether rows of beads that differ move as the model of rows predicts."""

from pathlib import Path

from book.computing import DOCS
from book.study import Study

from studies.rows.cases import OF_MODELS, OF_RUNS, parts
from studies.rows.judgement import blocks, statements

STUDY = Study(
    folder=Path(__file__).parent,
    shows="whether rows of beads that differ move in full as by the model of rows that streams have",
    uses=tuple(dict.fromkeys(OF_RUNS + OF_MODELS)),
    parts=parts,
    statements=statements,
    blocks=blocks,
    page=DOCS / "validation" / "rows.md",
)
