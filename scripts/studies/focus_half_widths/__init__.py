"""Half-widths of rates off the axis against finer meshes, in random scenes."""

from pathlib import Path

from book.computing import DOCS
from book.study import Study
from book.uses import off_axis

from studies.focus_half_widths.cases import parts
from studies.focus_half_widths.judgement import blocks, statements

STUDY = Study(
    folder=Path(__file__).parent,
    shows="whether what pairsim focus finds is inside its half-widths in random scenes",
    uses=off_axis("newtonian", "giesekus", "ptt", "fene_p", "oldroyd_b", "neo_hookean"),
    parts=parts,
    statements=statements,
    blocks=blocks,
    page=DOCS / "validation" / "focus.md",
)
