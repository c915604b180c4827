"""Scenes with one particle, drawn at random, each at two accuracies and finer: the parts of the study.

A scene is computed at each of `ACCURACIES`, and once more for a reference with twice the cells in a longer tube. The
first scene of all questions in all liquids comes first, shapes last, as they take longest; then the second scene, and
so on: wherever the computation ends, all have about as many.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from book import draws
from book.study import Part, Row, computed

import pairsim
from pairsim.solvers.goals import GOALS

LIQUIDS = ("newtonian", "power-law", "giesekus", "oldroyd-b", "fene-p", "ptt-exp")
SCENES = 8  # of each question in each liquid
ACCURACIES = "1%", "0.1%"
COARSE, COARSE_FINE = "5%", "1%"
"""The accuracies of cases and of references of the quick form."""
# A mesh that was not adapted is that of the least accuracy with cells of its own: its reference has cells smaller by
# this factor, and so about twice as many.
FINER = 1.5
LONGER = 1.5  # length of tube of a reference with developed ends, over that of its cases
LIMIT = 2400.0  # wall time of a case [s]: a part takes no more than 40 minutes


@dataclass(frozen=True)
class Asked:
    """A question about one particle.

    Attributes:
        name: Its name in the study.
        question: The question that is computed.
        seed: What its scenes are drawn with.
        rigid: Probability that the particle is rigid.
        keys: What its cases have beside the scene.
        fine: Accuracy of its references: 0.05 % where 0.02 % would take up to ten minutes and 5 GB, and be missed.
    """

    name: str
    question: str
    seed: int
    rigid: float
    keys: dict[str, Any] = field(hash=False)
    fine: str

    def scenes(self, count: int) -> dict[str, dict[str, Any]]:
        """So many scenes in each liquid, by names such as "00-newtonian"; the liquids take turns."""
        ranges: dict[str, Any] = {"De": (0.1, 1.0), "Ca_e": (0.005, 0.1), "beta": (0.2, 0.6)}
        drawn = draws.scenes(self.seed, count * len(LIQUIDS), LIQUIDS, rigid=self.rigid, **ranges)
        return {name: scene | self.keys for name, scene in drawn.items()}


QUESTIONS = (
    Asked("dragged", "curve", 85, 1.0, {"velocity": 1, "flow": 0}, "0.02%"),
    Asked("single", "curve", 86, 0.33, {}, "0.05%"),
    Asked("pressure", "pressure", 84, 0.0, {}, "0.02%"),
    Asked("shape", "shape", 83, 0.0, {}, "0.05%"),
)


def parts(quick: bool) -> list[Part]:
    """All parts, or a handful of coarse ones in two liquids."""
    accuracies = (COARSE,) if quick else ACCURACIES
    chosen, count = (("newtonian", "giesekus"), 1) if quick else (LIQUIDS, SCENES)
    drawn = {asked: list(asked.scenes(count).items()) for asked in QUESTIONS}
    return [
        _part(asked, name, scene, accuracy, is_reference)
        for first in range(0, count * len(LIQUIDS), len(LIQUIDS))
        for asked in QUESTIONS
        for name, scene in drawn[asked][first : first + len(LIQUIDS)]
        if name.partition("-")[2] in chosen
        for accuracy, is_reference in _solutions(accuracies, COARSE_FINE if quick else asked.fine)
    ]


def _solutions(accuracies: Sequence[str], fine: str) -> list[tuple[str, bool]]:
    """The accuracies of the solutions of a scene, and whether each is the reference."""
    return [*((accuracy, False) for accuracy in accuracies), (fine, True)]


def _part(asked: Asked, name: str, scene: Mapping[str, Any], accuracy: str, is_reference: bool) -> Part:
    """A scene at an accuracy."""
    number, _, liquid = name.partition("-")
    case, kind = {**scene, "accuracy": accuracy}, "reference" if is_reference else "case"
    about: Row = {"question": asked.name, "liquid": liquid, "scene": int(number), "kind": kind, "accuracy": accuracy}
    how = {"finer": FINER, "longer": LONGER} if is_reference else {}
    identity = json.dumps({"command": asked.question, "kind": kind, **how, **case}, sort_keys=True)
    return Part(f"{asked.name}-{name}+{accuracy}", identity, partial(_rows, asked.question, case, about))


def _rows(question: str, case: Mapping[str, Any], about: Row, folder: Path) -> list[Row]:
    """The rows of a part: one for each printed quantity with a half-width, or one that says how the case ended."""
    solve = _reference if about["kind"] == "reference" else computed
    result = solve(question, case, folder, LIMIT)
    scene: Row = {name: case[name] for name in ("beta", "De", "Ca_e", "ends")}
    cost = {"unknowns": result.record.unknowns or 0, "rounds": _rounds(result), "seconds": result.record.wall_time or 0}
    start = {**about, **scene, **cost}
    if not len(result.table):
        return [{**start, "ended": result.reason or result.status}]
    (printed,) = result.table.to_dict("records")
    rows = list[Row]()
    for goal in GOALS:
        said = any(each.startswith("accuracy: ") and f" {goal.error_column} " in each for each in result.warnings)
        ends = [end for end in ("", "_1") if goal.error_column + end in printed]
        for error in (printed[goal.error_column + end] for end in ends):
            value = printed.get(f"{goal.name}_1", printed.get(goal.name))
            rows.append(
                {**start, "quantity": goal.name, "value": value, "half_width": error, "said": said, "ended": None}
            )
    return rows


def _reference(question: str, case: Mapping[str, Any], folder: Path, seconds: float) -> Any:
    """The result of a case with finer cells in a longer tube."""
    checked = pairsim.load(case, kind=question)
    length = {"length": float(f"{LONGER * checked.tube_length:.3g}")} if checked.ends == "developed" else {}
    result = computed(question, {**case, **length}, folder, seconds)
    if result.status != "finished" or _rounds(result):
        return result
    finer = {"Np": round(FINER * checked.mesh.Np), "max_size": float(f"{checked.mesh.max_size / FINER:.3g}")}
    return computed(question, {**case, **length, "mesh": finer}, folder.with_name(f"{folder.name}-finer"), seconds)


def _rounds(result: Any) -> int:
    """How often the mesh of a result was adapted."""
    meshes: Sequence[Mapping[str, int]] = result.record.get("adaptation", {}).get("meshes", ())
    return sum(each["rounds"] for each in meshes)
