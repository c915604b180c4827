"""Soft spheres in a Newtonian liquid against theory of first order in Ca_e."""

from pathlib import Path

from book.computing import DOCS
from book.study import Study
from book.uses import in_time, steady

from studies.soft.cases import parts
from studies.soft.judgement import blocks, statements

LAWS = ("newtonian", "neo_hookean")
STUDY = Study(
    folder=Path(__file__).parent,
    shows="dU of weakly soft pairs and the outline of a weakly soft sphere against theory of first order in Ca_e",
    uses=(*dict.fromkeys((*steady(*LAWS), *in_time(*LAWS))), "scripts.studies.soft.bullet"),
    parts=parts,
    statements=statements,
    blocks=blocks,
    page=DOCS / "validation" / "soft.md",
)
