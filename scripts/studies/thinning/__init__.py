"""Spheres in power-law liquids: drag in a tube, and deformation in a cytometer."""

from pathlib import Path

from book.computing import DOCS
from book.study import Study
from book.uses import steady

from studies.thinning.cases import parts
from studies.thinning.judgement import blocks, statements

STUDY = Study(
    folder=Path(__file__).parent,
    shows="drag and deformation of spheres in power-law liquids, against another code and dclab's table",
    uses=(*steady("newtonian", "power_law", "neo_hookean"), "scripts.studies.thinning.unbounded"),
    parts=parts,
    statements=statements,
    blocks=blocks,
    page=DOCS / "validation" / "thinning.md",
)
