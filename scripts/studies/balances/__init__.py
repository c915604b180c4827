"""Balances of mass, force and energy on written fields, by an independent program."""

from pathlib import Path

from book.computing import DOCS
from book.study import Study
from book.uses import in_time, steady

from studies.balances.cases import parts
from studies.balances.judgement import blocks, statements

LAWS = ("newtonian", "giesekus", "neo_hookean")
STUDY = Study(
    folder=Path(__file__).parent,
    shows="whether fields that are written balance mass, force and energy, by a program that does not import pairsim",
    uses=tuple(
        dict.fromkeys((*steady(*LAWS), *in_time(*LAWS), "pairsim.record", "scripts.studies.balances.field_balances"))
    ),
    parts=parts,
    statements=statements,
    blocks=blocks,
    page=DOCS / "validation" / "balances.md",
)
