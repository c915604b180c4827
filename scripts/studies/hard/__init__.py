"""How cases at the edge of what works end."""

from pathlib import Path

from book.computing import DOCS
from book.study import Study
from book.uses import in_time, steady

from studies.hard.judgement import blocks, statements
from studies.hard.parts import parts

STUDY = Study(
    folder=Path(__file__).parent,
    shows="how cases at the edge of what works end: with an answer, without a steady state, or for which reason",
    uses=tuple(dict.fromkeys((*steady(), *in_time()))),
    parts=parts,
    statements=statements,
    blocks=blocks,
    page=DOCS / "explanation" / "limits.md",
)
