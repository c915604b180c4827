"""Whether the printed quantities of one particle are inside their half-widths, and kept or said."""

from pathlib import Path

from book.computing import DOCS
from book.study import Study

from studies.quantities.cases import parts
from studies.quantities.judgement import blocks, statements

STUDY = Study(
    folder=Path(__file__).parent,
    shows="whether each quantity that shape, pressure and curve print of one particle is inside its half-width, and "
    "its accuracy is kept or said to be missed",
    uses=(
        "pairsim.physics",
        "pairsim.fem",
        *(f"pairsim.solvers.{package}" for package in ("curves", "errors", "nonlinear", "steady")),
        *(f"pairsim.solvers.{module}" for module in ("goals", "mesh_transfer", "meshed_scene", "parameters")),
        *(f"pairsim.solvers.{module}" for module in ("pressure_drop", "problems", "solution")),
        "pairsim.cases.accuracy",
        "pairsim.computing.problems",
        "pairsim.computing.accuracy",
        "pairsim.computing.steady",
    ),
    parts=parts,
    statements=statements,
    blocks=blocks,
    page=DOCS / "validation" / "quantities.md",
)
