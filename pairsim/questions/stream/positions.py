"""Reads the positions of beads from a file."""

from __future__ import annotations

import re
from pathlib import Path

from pairsim.cases.quantity_text import A_LENGTH, si
from pairsim.quantities.scales import Scales
from pairsim.runtime.text import decoded

HEADING = re.compile(r"[^\[(]*[\[(]\s*(.+?)\s*[\])]\s*|[^\W\d_]+\s*(?:/|\bin\b)\s*([^\W\d_]+)")  # z [um], z/um


def read_positions(file: Path, scales: Scales | None) -> tuple[float, ...]:
    """Positions of the centres of beads along the tube, ascending [D_c].

    The file has one position per line. A heading gives their unit; without one they are in tube diameters.

    Raises:
        ValueError: The file cannot be read, a line is not a number, there is a unit but no scales, or scales but no
            unit in the heading; says what is allowed.
    """
    try:
        lines = [line.strip() for line in decoded(file.read_bytes()).splitlines() if line.strip()]
    except OSError as error:
        raise ValueError(f"must be a file of positions, one a line ({error.strerror or error})") from None
    unit = 1.0
    if lines and re.search(r"[^\W\d_]", lines[0]) and not _is_number(lines[0]):
        heading = lines.pop(0)
        match = HEADING.fullmatch(heading)
        name = "" if match is None else match[1] or match[2]
        if not name and scales is not None:
            raise ValueError(f"must have the unit in its heading, such as z [um] or z [D_c], not {heading[:40]!r}")
        if name and name != "D_c":
            if scales is None:
                raise ValueError("must have positions in tube diameters: a case without a physical block has no units")
            unit = si(f"1 {name}", A_LENGTH) / scales.length
    if wrong := [line for line in lines if not _is_number(line)]:
        raise ValueError(f"must have one number a line, not {wrong[0][:40]!r}")
    return tuple(sorted(unit * float(line) for line in lines))


def _is_number(text: str) -> bool:
    try:
        return abs(float(text)) < float("inf")
    except ValueError:
        return False
