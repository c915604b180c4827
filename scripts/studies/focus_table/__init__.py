"""The table of focusing to first order that ships, pairsim/atlas/focusing.csv."""

from pathlib import Path

from book.computing import DOCS
from book.study import Study
from book.uses import OF_CASES, off_axis

from studies.focus_table.cases import parts
from studies.focus_table.judgement import blocks, statements, table_that_ships

LAWS = ("newtonian", "oldroyd_b", "giesekus", "ptt", "fene_p", "neo_hookean", "mooney_rivlin")
STUDY = Study(
    folder=Path(__file__).parent,
    shows="rates of a bead alone to first order, and how far first order reaches: the table that ships",
    uses=(*off_axis(*LAWS), *OF_CASES, "scripts.studies.focus_table.first_order"),
    parts=parts,
    statements=statements,
    blocks=blocks,
    page=DOCS / "explanation" / "focus.md",
    files=table_that_ships,
)
