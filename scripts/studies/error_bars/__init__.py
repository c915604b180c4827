"""Whether the half-widths of dU hold its errors."""

from pathlib import Path

from book.computing import DOCS
from book.study import Study
from book.uses import in_time, solvers, steady

from studies.error_bars.judgement import blocks, statements
from studies.error_bars.parts import parts

STUDY = Study(
    folder=Path(__file__).parent,
    shows="whether half-widths of dU hold its errors: on several meshes, at random, along curves and in time",
    uses=tuple(dict.fromkeys((*steady(), *in_time(), *solvers("errors")))),
    parts=parts,
    statements=statements,
    blocks=blocks,
    page=DOCS / "explanation" / "error-estimate.md",
)
