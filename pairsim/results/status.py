"""How a case stands, from its run.json, for `pairsim status`."""

from __future__ import annotations

from pathlib import Path

from rich.console import Group
from rich.text import Text

from pairsim.results.folders import valid_record

COLOURS = {"finished": "green", "failed": "red", "interrupted": "yellow", "running": "cyan"}
"""Of cases, by status."""


def case_status(directory: Path, working: bool) -> Group:
    """Status, message, wall time and warnings of a folder, for the terminal.

    Args:
        directory: The folder.
        working: Whether a command is writing to it now.

    Raises:
        InputError: run.json is missing or invalid.
    """
    record = valid_record(directory)
    status, reason, message = (str(record.get(key, "")) for key in ("status", "reason", "message"))
    if status == "running" and not working:
        status, message = "interrupted", "the command was killed; a run can be continued with pairsim run --resume"
    style = COLOURS.get(status, "")
    parts = [
        Text(f"{directory}: {status}" + (f" ({reason})" if reason else ""), style=style),
        *([Text(message)] if message else []),
        Text(f"{record.get('wall_time', 0.0):.3g} s of wall time, by: {record.get('command', '')}", style="dim"),
        *(Text(f"warning: {warning}") for warning in record.get("warnings", [])),
    ]
    return Group(*parts)
