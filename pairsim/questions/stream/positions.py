"""Reads the positions of beads from a file."""

from __future__ import annotations

import re
from pathlib import Path

from pairsim.cases.quantity_text import A_LENGTH, si
from pairsim.quantities.scales import Scales

HEADING = re.compile(r"[^\[(]*[\[(]\s*(.+?)\s*[\])]\s*")  # such as z [um]


def read_positions(file: Path, scales: Scales | None) -> tuple[float, ...]:
    """Positions of the centres of beads along the tube, ascending [D_c].

    The file has one position per line. A heading may give their unit in brackets; otherwise they are in tube diameters.

    Raises:
        ValueError: The file cannot be read, a line is not a number, or there is a unit but no scales; says what is
            allowed.
    """
    try:
        lines = [line.strip() for line in file.read_text(encoding="utf-8-sig").splitlines() if line.strip()]
    except (OSError, UnicodeDecodeError) as error:
        raise ValueError(
            f"must be a file of positions, one a line ({getattr(error, 'strerror', None) or error})"
        ) from None
    unit = 1.0
    if lines and not _is_number(lines[0]):
        heading = lines.pop(0)
        if (match := HEADING.fullmatch(heading)) is not None and match[1] != "D_c":
            if scales is None:
                raise ValueError("must have positions in tube diameters: a case without a physical block has no units")
            unit = si(f"1 {match[1]}", A_LENGTH) / scales.length
    if wrong := [line for line in lines if not _is_number(line)]:
        raise ValueError(f"must have one number a line, not {wrong[0][:40]!r}")
    return tuple(sorted(unit * float(line) for line in lines))


def _is_number(text: str) -> bool:
    try:
        return abs(float(text)) < float("inf")
    except ValueError:
        return False
