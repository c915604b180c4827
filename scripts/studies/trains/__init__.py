"""Whether growth rates of infinite trains are inside their half-widths, beside those that runs in time show."""

from pathlib import Path

from book.computing import DOCS
from book.study import Study

from studies.trains.cases import OF_RUNS, OF_TRAINS, parts
from studies.trains.judgement import blocks, statements

STUDY = Study(
    folder=Path(__file__).parent,
    shows="whether growth rates of infinite trains are inside their half-widths, and what runs in time show of them",
    uses=tuple(dict.fromkeys(OF_TRAINS + OF_RUNS)),
    parts=parts,
    statements=statements,
    blocks=blocks,
    page=DOCS / "validation" / "trains.md",
)
