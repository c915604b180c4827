"""Wall time against error: the cost of each accuracy and the error it leaves, beside the paper's discretisation."""

from pathlib import Path

from book.computing import DOCS
from book.study import Study

from studies.accuracy.judgement import blocks, files, statements
from studies.accuracy.parts import USES, parts

STUDY = Study(
    folder=Path(__file__).parent,
    shows="what each accuracy costs and leaves, beside the discretisation of the paper",
    uses=USES,
    parts=parts,
    statements=statements,
    blocks=blocks,
    page=DOCS / "explanation" / "accuracy.md",
    files=files,
)
