"""Whether half-widths hold the errors on given meshes, coarse and fine, and those of runs in time."""

from pathlib import Path

from book.computing import DOCS
from book.study import Study
from book.uses import in_time, solvers, steady

from studies.error_bars.judgement import blocks, statements
from studies.error_bars.parts import parts

STUDY = Study(
    folder=Path(__file__).parent,
    shows="whether half-widths hold the errors of dU on given meshes, coarse and fine, and of all quantities of runs",
    uses=tuple(dict.fromkeys((*steady(), *in_time(), *solvers("errors")))),
    parts=parts,
    statements=statements,
    blocks=blocks,
    page=DOCS / "explanation" / "error-estimate.md",
)
