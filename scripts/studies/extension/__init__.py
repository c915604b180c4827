"""A soft sphere in unbounded uniaxial extension, whose finite deformation is known exactly."""

from pathlib import Path

from book.computing import DOCS
from book.study import Study
from book.uses import in_time, solvers

from studies.extension.cases import parts
from studies.extension.judgement import blocks, pictures, statements

OWN = tuple(f"scripts.studies.extension.{name}" for name in ("spheroid", "smooth_sphere"))
STUDY = Study(
    folder=Path(__file__).parent,
    shows="the stretch of a soft sphere in extension, steady, in time and at its fold, against the exact spheroid",
    uses=(*in_time("newtonian", "neo_hookean"), *solvers("steady"), *OWN),
    parts=parts,
    statements=statements,
    blocks=blocks,
    page=DOCS / "validation" / "extension.md",
    files=pictures,
)
