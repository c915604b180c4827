"""Critical distances of rigid pairs in Giesekus liquids against the statements of a publication."""

from pathlib import Path

from book.computing import DOCS
from book.study import Study
from book.uses import steady

from studies.giesekus_pairs.cases import parts
from studies.giesekus_pairs.judgement import blocks, statements

STUDY = Study(
    folder=Path(__file__).parent,
    shows="whether the critical distance of rigid pairs in a Giesekus liquid falls with De, the mobility and beta",
    uses=steady("newtonian", "giesekus"),
    parts=parts,
    statements=statements,
    blocks=blocks,
    page=DOCS / "validation" / "giesekus-pairs.md",
)
