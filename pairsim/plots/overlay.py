"""Several runs or several curves in one picture."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from pairsim.physics.declared import FLAT
from pairsim.plots.encoding import Encoding, hashable
from pairsim.plots.labels import case_parts, read_case, symbol
from pairsim.plots.lines import Line, draw_lines, lines_of
from pairsim.plots.style import Page, printing
from pairsim.results.folders import kind_of
from pairsim.runtime.errors import InputError

FIRST = ("beta", "De", "Ca_e", "d0", "particles", "liquid", "xi", *FLAT)
"""Keys that a difference is looked for in before all others."""
NOT_COMPARED = ("name", "output", "fields", "physical", "time.end", "limits")
FOLDER = "folder"


def flat(case: dict[str, Any], above: str = "") -> dict[str, Any]:
    """The keys of a case with a dot for each level; the name of a law stands for its group."""
    found: dict[str, Any] = {}
    for name, value in case.items():
        if isinstance(value, dict):
            found |= flat(value, f"{above}{name}.")
        else:
            found[above.removesuffix(".") if name == "law" else above + name] = value
    return found


def varying_keys(cases: Sequence[dict[str, Any]]) -> list[str]:
    """The keys that tell cases apart: each one tells some apart that those before it do not.

    So the liquid is not named where De tells as much, nor a mesh that was chosen for it.
    """
    names = [key for key in (*FIRST, *(key for case in cases for key in case)) if not key.startswith(NOT_COMPARED)]
    chosen: list[str] = []
    known = 1
    for name in dict.fromkeys(names):
        count = len({tuple(hashable(case.get(key)) for key in (*chosen, name)) for case in cases})
        if count > known:
            chosen, known = [*chosen, name], count
    return chosen


def overlay(
    folders: Sequence[Path], out: Path, page: Page, group: str | None = None, panels: str | None = None
) -> list[Path]:
    """Draw `runs` or `curves`: dU of all folders in the same panels; what differs is in the legend.

    Args:
        folders: Two or more folders, all of runs or all of curves.
        out: Folder of the picture.
        page: What it is drawn for.
        group: The key that chooses colours, the first that differs by default.
        panels: The key whose values have a panel each.

    Raises:
        InputError: A folder is of another kind, or has nothing to draw yet.
    """
    kinds: dict[Path, str] = {folder: kind_of(folder) for folder in folders}
    for folder, kind in kinds.items():
        if kind not in ("run", "curve"):
            raise InputError(str(folder), "", kind, "must be a run or a curve to be laid over others")
        if kind != kinds[folders[0]]:
            raise InputError(str(folder), "", kind, f"must be a {kinds[folders[0]]}, as {folders[0]} is")
    whole = [read_case(folder / "case.yaml") for folder in folders]
    cases = list(map(flat, whole))
    keys = varying_keys(cases)
    names = [str(folder) for folder in folders]
    if len(set(names)) < len(names):
        raise InputError("pairsim plot", "", names[0], "must be named once")
    told_apart = len({tuple(hashable(case.get(key)) for key in keys) for case in cases}) == len(cases)
    if not told_apart or Encoding.of(cases, keys, group, panels).untold:
        cases, keys = [case | {FOLDER: name} for case, name in zip(cases, names, strict=True)], [FOLDER]
    lines: list[Line] = []
    curve = kinds[folders[0]] == "curve"
    for folder, case in zip(folders, cases, strict=True):
        found = lines_of(folder, case, curve=curve)
        if not found:
            raise InputError(str(folder), "", None, "has no line to draw: no rows yet, or no curve over one distance")
        lines += found
    # A Newtonian one has no law to name.
    fullest = max(whole, key=lambda case: (float(case.get("De", 0)), isinstance(case.get("liquid"), dict)))
    return draw_overlay(lines, keys, fullest, out, page, "curves" if curve else "runs", group, panels)


@printing()
def draw_overlay(
    lines: Sequence[Line],
    keys: Sequence[str],
    case: dict[str, Any],
    out: Path,
    page: Page,
    stem: str,
    group: str | None = None,
    panels: str | None = None,
) -> list[Path]:
    """Draw lines whose cases differ in some keys.

    Args:
        lines: At least one.
        keys: What differs.
        case: A case, for what does not.
        out: Folder of the picture.
        page: What it is drawn for.
        stem: Name of the files without their endings.
        group: The key that chooses colours.
        panels: The key whose values have a panel each.

    Raises:
        InputError: `group` or `panels` does not differ.
    """
    gaps = ["gap"] if any("gap" in line.parameters for line in lines) else []
    encoding = Encoding.of([line.parameters for line in lines], [*keys, *gaps], group, panels)
    unseen = [f"all values of {symbol(name)}" for name in encoding.untold]
    figure = draw_lines(page, lines, encoding, [*case_parts(case, keys), *unseen])
    return page.save(figure, out, stem)
