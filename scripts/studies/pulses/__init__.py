"""What flows that vary in time do to pairs: exact solutions, symmetries, slow pulses, liquids with a memory."""

from pathlib import Path

from book.computing import DOCS
from book.study import Study

from studies.pulses.cases import parts
from studies.pulses.judgement import statements
from studies.pulses.tables import blocks

SOLVERS = ("curves", "errors", "nonlinear", "steady", "stepping", "transient")
STUDY = Study(
    folder=Path(__file__).parent,
    shows="what flows that vary in time do to pairs, beside exact solutions, symmetries and the limit of slow pulses",
    uses=(
        "pairsim.physics",
        "pairsim.fem",
        *(f"pairsim.solvers.{package}" for package in SOLVERS),
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
    page=DOCS / "explanation" / "pulses.md",
)
