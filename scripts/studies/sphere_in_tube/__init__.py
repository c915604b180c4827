"""A sphere dragged through a tube, the benchmark of viscoelastic flows."""

from pathlib import Path

from book.computing import DOCS
from book.study import Study
from book.uses import steady

from studies.sphere_in_tube.cases import parts
from studies.sphere_in_tube.judgement import blocks, pictures, statements

STUDY = Study(
    folder=Path(__file__).parent,
    shows="drag on a sphere in a tube against the classical value, and on three meshes in an Oldroyd-B liquid",
    uses=steady("newtonian", "oldroyd_b"),
    parts=parts,
    statements=statements,
    blocks=blocks,
    page=DOCS / "validation" / "sphere-in-tube.md",
    files=pictures,
)
