"""The data of a result that is not read from a folder."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from pairsim.record.folder import write_text, write_yaml
from pairsim.record.record import Record
from pairsim.record.run_entries import KIND

if TYPE_CHECKING:
    from pairsim.cases.case import SceneCase
    from pairsim.runtime.arrays import Array


@dataclass(frozen=True)
class Content:
    """The data of a result.

    Attributes:
        tables: The columns of its tables, by the name of the table.
        record: Its record, the content of run.json.
        case: The case; None if that of a folder is not valid in this version.
        files: Further files by their names in a folder, such as fields.
    """

    tables: Mapping[str, Mapping[str, Array]]
    record: Record
    case: SceneCase | None
    files: Mapping[str, bytes] = field(default_factory=dict)

    def write(self, folder: Path, kind: str) -> None:
        """Write it into a new folder, as the results of a question.

        Raises:
            OSError: A file cannot be written.
        """
        from pairsim.record.table_files import table_text  # loads numpy

        for name, table in self.tables.items():
            if table:
                write_text(folder / f"{name}.csv", table_text(table, zip(*table.values(), strict=True)))
        (Record.of({KIND: kind}) | self.record).write(folder)
        if self.case is not None:
            write_yaml(folder / "case.yaml", self.case.resolved())
        for name, content in self.files.items():
            (folder / name).parent.mkdir(exist_ok=True)
            (folder / name).write_bytes(content)


def files_in(folder: Path) -> dict[str, bytes]:
    """All files of a folder by their names in it."""
    found = (path for path in folder.rglob("*") if path.is_file())
    return {str(path.relative_to(folder)): path.read_bytes() for path in found}
