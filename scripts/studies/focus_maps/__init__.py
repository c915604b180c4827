"""Maps of the beads and pairs that stay on the axis, and of how fast they return to it."""

from pathlib import Path

from book.computing import DOCS
from book.study import Study
from book.uses import OF_CASES, off_axis

from studies.focus_maps.cases import parts
from studies.focus_maps.judgement import blocks, statements
from studies.focus_maps.picture import pictures

STUDY = Study(
    folder=Path(__file__).parent,
    shows="which beads and pairs stay on the axis over softness, elasticity, size and distance, and how fast they do",
    uses=(*off_axis("newtonian", "giesekus", "neo_hookean"), *OF_CASES),
    parts=parts,
    statements=statements,
    blocks=blocks,
    page=DOCS / "explanation" / "focus-maps.md",
    files=pictures,
)
