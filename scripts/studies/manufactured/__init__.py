"""Manufactured solutions of the viscoelastic liquid on a moving mesh: observed orders in space and in time."""

from pathlib import Path

from book.computing import DOCS
from book.study import Study
from book.uses import in_time, solvers

from studies.manufactured.cases import parts
from studies.manufactured.judgement import blocks, statements

OWN = tuple(f"scripts.studies.manufactured.{name}" for name in ("run", "fields"))
STUDY = Study(
    folder=Path(__file__).parent,
    shows="the orders of convergence in space and in time of a Giesekus liquid on a moving mesh",
    uses=(*in_time("newtonian", "giesekus"), *solvers("errors"), *OWN),
    parts=parts,
    statements=statements,
    blocks=blocks,
    page=DOCS / "validation" / "manufactured.md",
)
