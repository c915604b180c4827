"""Hash, folder and captions of every shipped case: what nobody sees change may only change on purpose."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from pairsim.cases.case import SceneCase
from pairsim.cases.identity import default_folder
from pairsim.cases.yaml_file import read_yaml
from pairsim.computing.case_files import fitting, parse_case, read_case
from pairsim.plots.labels import case_parts, common_parts, equation, parameter_label, varying_keys
from pairsim.plots.parameters import ShownCase
from pairsim.questions.registry import QUESTIONS
from pairsim.runtime.errors import InputError
from pairsim.sweeps.files import FILES
from pairsim.sweeps.grid import Grid, grid_from, read_base, read_grid
from pairsim.sweeps.study import read_study
from support.inputs import ROOT

CONFIGS = ROOT / "configs"
DIGITS = 12  # of hashes in the table


def _short(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:DIGITS]


def lines() -> Iterator[str]:
    """Lines of the table: a file, and what its case or cases are called; `scripts` must be on the path."""
    studies = ROOT / "scripts" / "studies"
    files = [(path, path.relative_to(CONFIGS)) for path in sorted(CONFIGS.rglob("*.yaml"))]
    files += [(path, path.relative_to(studies)) for path in sorted(studies.rglob("*.yaml"))]
    for path, place in files:
        name = "/".join(part for part in place.parts if part != "cases")  # which has those of a study
        if "quick" not in place.parts:
            yield from (f"{name}: {line}" for line in _of_file(path))
    for name, content in _of_scripts():
        yield from (f"{name}: {line}" for line in _of_grid(grid_from(CONFIGS / name, dict(content))))


def _of_scripts() -> Iterator[tuple[str, Mapping[str, Any]]]:
    """The sweeps that scripts make of their files."""
    from studies.error_bars.parts import KINDS, cases, read

    for kind in KINDS:
        content, scenes, meshes = read(kind)
        found = [case for name, scene in scenes.items() for case in cases(name, scene, meshes)]
        yield f"error_bars/{kind}.yaml", content | {"cases": found}


def _of_file(path: Path) -> Iterator[str]:
    try:
        data = read_yaml(path)
    except InputError:  # a list
        return
    for kind in dict.fromkeys((path.stem, *fitting(data, FILES)) if path.stem in QUESTIONS else fitting(data, FILES)):
        try:
            if kind == "sweep":
                yield from _of_grid(read_grid(path))
            elif kind == "study":
                yield from _of_grid(read_study(path)[1])
            elif kind == "atlas":
                middle = {key: sum(data[key]) / 2 for key in ("beta", "De", "Ca_e")}
                base = {**read_base(path, data, QUESTIONS["curve"].model).content, **middle, "d": [0.02, 2]}
                yield _of_case(parse_case(QUESTIONS["curve"], base, str(path)))
            else:
                yield _of_case(read_case(QUESTIONS[kind], path))
        except (InputError, KeyError):  # a file of the scripts, or of another kind that has the same keys
            continue
        return


def _of_case(case: SceneCase) -> str:
    folder, captions = default_folder(case.kind, case), _captions(case.resolved())
    return f"{folder}: {captions}"


def _captions(content: Mapping[str, Any]) -> str:
    return ", ".join(case_parts(ShownCase(content), physical="physical" in content))


def _of_grid(grid: Grid) -> Iterator[str]:
    varying = " ".join(grid.varying)
    yield f"sweep of {grid.question.name}, {len(grid.cases)} cases, {grid.key[:DIGITS]}, varying {varying}"
    contents = [each.case.resolved() for each in grid.cases]
    cases = [ShownCase(each) for each in contents]
    physical = all("physical" in each for each in contents)
    told = varying_keys([case.parameters for case in cases])
    shared = ", ".join(common_parts(cases, told, physical, grid.varying))
    yield f"sweep told apart by {' '.join(told)}, else {shared}"
    labels = [parameter_label(key) for key in grid.varying]
    values = [equation(key, each.parameters[key]) for each in grid.cases for key in grid.varying]
    yield f"sweep labels {', '.join(labels)}, equations {_short(repr(values))}"
    yield f"sweep captions {_short(repr([_captions(each) for each in contents]))}"
    yield from (each.folder for each in grid.cases)
