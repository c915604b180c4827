"""What flows that vary in time do to pairs: exact solutions, symmetries, slow pulses, liquids with a memory."""

from pathlib import Path

from book.computing import DOCS
from book.study import Study
from book.uses import in_time, steady

from studies.pulses.cases import parts
from studies.pulses.judgement import statements
from studies.pulses.tables import blocks

STUDY = Study(
    folder=Path(__file__).parent,
    shows="what flows that vary in time do to pairs, beside exact solutions, symmetries and the limit of slow pulses",
    uses=(
        *dict.fromkeys((*steady(), *in_time())),
        *(f"pairsim.questions.run.{name}" for name in ("computation", "ends", "written")),
    ),
    parts=parts,
    statements=statements,
    blocks=blocks,
    page=DOCS / "explanation" / "pulses.md",
)
