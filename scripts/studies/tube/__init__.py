"""The flow without particles of every viscoelastic law, in one dimension and on the mesh."""

from pathlib import Path

from book.computing import DOCS
from book.study import Study
from book.uses import in_time

from studies.tube.cases import parts
from studies.tube.judgement import blocks, statements

STUDY = Study(
    folder=Path(__file__).parent,
    shows="the flow of every law in the tube without particles, steady and in time, against solutions of another kind",
    uses=(*in_time("newtonian", "giesekus", "oldroyd_b", "ptt", "fene_p"), "scripts.studies.tube.pipe"),
    parts=parts,
    statements=statements,
    blocks=blocks,
    page=DOCS / "validation" / "tube.md",
)
