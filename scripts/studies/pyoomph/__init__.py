"""Pairs in a Newtonian and in a Giesekus liquid against pyoomph."""

from pathlib import Path

from book.computing import DOCS
from book.study import Study
from book.uses import steady

from studies.pyoomph.cases import parts
from studies.pyoomph.judgement import blocks, pictures, statements

STUDY = Study(
    folder=Path(__file__).parent,
    shows="dU and Taylor parameters of pairs in a Newtonian and in a Giesekus liquid, one from rest, against pyoomph",
    uses=steady("newtonian", "neo_hookean"),
    parts=parts,
    statements=statements,
    blocks=blocks,
    page=DOCS / "validation" / "pyoomph.md",
    files=pictures,
)
