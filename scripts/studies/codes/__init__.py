"""Error against processor time of pairsim, an earlier pairsim and pyoomph, in alternation."""

from pathlib import Path

from book.computing import DOCS
from book.study import Study

from studies.codes.judgement import blocks, files, statements
from studies.codes.parts import USES, parts

STUDY = Study(
    folder=Path(__file__).parent,
    shows="error against processor time of a Newtonian pair, by three codes in alternation",
    uses=USES,
    parts=parts,
    statements=statements,
    blocks=blocks,
    page=DOCS / "explanation" / "accuracy.md",
    files=files,
)
