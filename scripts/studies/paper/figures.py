"""The figures of the paper: what they show, the computations behind them, and what the paper says of them.

The folder `cases` has one for each figure, with its computations (grid files of `pairsim sweep`; for Fig. 2 case files,
of which the mesh is drawn), figure.yaml, which describes the picture, and statements.yaml. The folders of `CHECKS` have
computations alone.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

from book import yaml_files

from pairsim.sweeps.grid import Grid, SweepCase, read_grid
from studies.paper.pictures import Panel

CASES = Path(__file__).with_name("cases")
OWN = ("figure.yaml", "statements.yaml")
"""Files of a folder that are no computations."""
CHECKS = {"finer": "finer meshes", "periodic": "periodic ends", "transients": "in time"}
"""Folders with computations that judge the statements again, with the words for how they do it."""
BESIDE = {"transients": ("fig06/runs", "fig07/markers", "fig09/markers", "fig09/curves")}
"""Computations of figures that a check looks at, too."""
QUICK = yaml_files.read(CASES / "quick.yaml")
"""Settings of the quick form by question."""
FEW = 2
"""Cases that the quick form has of each computation."""


@dataclass(frozen=True)
class Figure:
    """A figure.

    Attributes:
        caption: What it shows.
        panels: Its panels.
        also: Computations that its statements look at besides those that it shows.
        quick: Settings of the quick form for computations that differ from `QUICK`.
    """

    caption: str
    panels: Sequence[Panel]
    also: Sequence[str] = ()
    quick: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)


@dataclass(frozen=True)
class Statement:
    """A statement of the paper.

    Attributes:
        figure: The figure that it is about.
        says: What the paper says.
        check: The expression over results that judges it; see words.py.
        again: That over the fewer cases of other meshes and ends, where it differs.
        in_time: That over runs in time; empty where these do not judge it.
        found: The verdict that docs/paper.md discusses.
    """

    figure: str
    says: str
    check: str
    again: str = ""
    in_time: str = ""
    found: str = "holds"

    def by(self, how: str) -> str:
        """The expression over the results of a check; over those of the figure itself if `how` is empty."""
        return self.in_time if how == "transients" else (how and self.again) or self.check


def _figure(path: Path) -> Figure:
    content = yaml_files.read(path)
    return Figure(**content | {"panels": [Panel(**each) for each in content["panels"]]})


FIGURES = {path.parent.name: _figure(path) for path in sorted(CASES.glob("*/figure.yaml"))}
STATEMENTS = [
    Statement(path.parent.name, **each)
    for path in sorted(CASES.glob("*/statements.yaml"))
    for each in yaml_files.read(path)
]


def computations(name: str) -> list[str]:
    """Computations in the folder of a figure or check, as FIGURE/FILE."""
    return [f"{name}/{path.stem}" for path in sorted((CASES / name).glob("*.yaml")) if path.name not in OWN]


def needed(name: str) -> list[str]:
    """Computations of a figure or check, and those that its picture and statements look at, each once."""
    found = [*computations(name), *BESIDE.get(name, ())]
    if name in FIGURES:
        found += [each for panel in FIGURES[name].panels for each in (*panel.of, *panel.markers)]
        found += FIGURES[name].also
    return list(dict.fromkeys(found))


def is_mesh(computation: str) -> bool:
    """Whether a computation is a case of which the mesh alone is drawn."""
    return computation.startswith("fig02/")


def settings(computation: str, quick: bool) -> tuple[str, ...]:
    """What the quick form replaces in the cases of a computation, as key=value."""
    if not quick or is_mesh(computation):
        return ()
    figure, kind = computation.partition("/")[0], yaml_files.read(CASES / f"{computation}.yaml").get("command", "run")
    own = FIGURES[figure].quick.get(computation) if figure in FIGURES else None
    return tuple(f"{key}={json.dumps(value)}" for key, value in (own or QUICK[kind]).items())


@cache
def grid(computation: str, quick: bool) -> Grid:
    """The cases of a computation."""
    return read_grid(CASES / f"{computation}.yaml", settings(computation, quick))


def chosen(grid: Grid, quick: bool) -> Sequence[SweepCase]:
    """The cases of a computation that are computed."""
    return grid.cases[:FEW] if quick else grid.cases


def identity(name: str, quick: bool) -> str:
    """All that the rows of a figure or check follow from beside the code, as text."""
    files = {each: [yaml_files.read(CASES / f"{each}.yaml"), *settings(each, quick)] for each in needed(name)}
    judged = [(each.says, each.by(name if name in CHECKS else "")) for each in judged_by(name)]
    return json.dumps({"computations": files, "statements": judged, "few": FEW if quick else None}, sort_keys=True)


def judged_by(name: str) -> Iterable[Statement]:
    """The statements of a figure, or those that a check judges."""
    return [each for each in STATEMENTS if each.figure == name or (name in CHECKS and each.by(name))]
