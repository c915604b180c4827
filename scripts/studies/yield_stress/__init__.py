"""Liquids with a yield stress: a sphere alone, and what yield stress, softness, size and thinning do to pairs."""

from pathlib import Path

from book.computing import DOCS
from book.study import Study
from book.uses import in_time, solvers, steady

from studies.yield_stress.cases import parts
from studies.yield_stress.judgement import blocks, statements

LAWS = ("newtonian", "bingham", "giesekus", "yielding", "neo_hookean")
STUDY = Study(
    folder=Path(__file__).parent,
    shows="drag in Bingham liquids, and what a publication says of pairs in gels that yield",
    uses=(*dict.fromkeys((*steady(*LAWS), *in_time(*LAWS), *solvers("errors"))),),
    parts=parts,
    statements=statements,
    blocks=blocks,
    page=DOCS / "how-to" / "yield-stress.md",
)
