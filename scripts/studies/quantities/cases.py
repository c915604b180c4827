"""Scenes with one particle, drawn at random, each at two accuracies and finer: the parts of the study.

A scene is computed at each of `ACCURACIES`, and once more for a reference with twice the cells. The first scene of all
questions in all liquids comes first, then the second, and so on: wherever the computation ends, all have about as many.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from book import draws
from book.study import Part, Row, computed

import pairsim
from pairsim.solvers.goals import GOALS

LIQUIDS = ("newtonian", "power-law", "giesekus", "oldroyd-b", "fene-p", "ptt-exp")
SCENES = 8  # of each question in each liquid
ACCURACIES, FINE = ("1%", "0.1%"), "0.02%"
COARSE = ("5%",), "1%"
"""The same of the quick form."""
# A mesh that was not adapted is that of the least accuracy with cells of its own: its reference has cells smaller by
# this factor, and so about twice as many.
FINER = 1.5
LIMIT = 1800.0  # wall time of a case [s]
SEED = 83


@dataclass(frozen=True)
class Asked:
    """A question about one particle.

    Attributes:
        name: Its name in the study.
        question: The question that is computed.
        rigid: Probability that the particle is rigid.
        keys: What its cases have beside the scene.
    """

    name: str
    question: str
    rigid: float
    keys: Mapping[str, Any]

    def scenes(self, count: int, seed: int) -> dict[str, dict[str, Any]]:
        """So many scenes in each liquid, by names such as "00-newtonian"; the liquids take turns."""
        ranges: dict[str, Any] = {"De": (0.1, 1.0), "Ca_e": (0.005, 0.1), "beta": (0.2, 0.6)}
        drawn = draws.scenes(seed, count * len(LIQUIDS), "", LIQUIDS, particles=1, rigid=self.rigid, **ranges)
        return {name.removesuffix("-N1"): scene | self.keys for name, scene in drawn.items()}


QUESTIONS = (
    Asked("shape", "shape", 0.0, {}),
    Asked("pressure", "pressure", 0.0, {}),
    Asked("dragged", "curve", 1.0, {"velocity": 1, "flow": 0}),
    Asked("single", "curve", 0.33, {}),
)


def parts(quick: bool) -> list[Part]:
    """All parts, or a handful of coarse ones in two liquids."""
    found = [asked.scenes(1 if quick else SCENES, SEED + i) for i, asked in enumerate(QUESTIONS)]
    accuracies, fine = COARSE if quick else (ACCURACIES, FINE)
    chosen = ("newtonian", "giesekus") if quick else LIQUIDS
    return [
        part
        for scenes in zip(*(each.items() for each in found), strict=True)
        for asked, (name, scene) in zip(QUESTIONS, scenes, strict=True)
        if name.partition("-")[2] in chosen
        for part in _of_scene(asked, name, scene, accuracies, fine)
    ]


def _of_scene(
    asked: Asked, name: str, scene: Mapping[str, Any], accuracies: Sequence[str], fine: str
) -> Iterator[Part]:
    """The parts of a scene: at each accuracy, and its reference."""
    number, _, liquid = name.partition("-")
    about = {"question": asked.name, "liquid": liquid, "scene": int(number)}
    for accuracy in (*accuracies, fine):
        case = {**scene, "accuracy": accuracy}
        kind = "reference" if accuracy == fine else "case"
        identity = json.dumps({"command": asked.question, "kind": kind, **case}, sort_keys=True)
        own = partial(_rows, asked.question, case, about | {"kind": kind, "accuracy": accuracy})
        yield Part(f"{asked.name}-{name}+{accuracy}", identity, own)


def _rows(question: str, case: Mapping[str, Any], about: Row, folder: Path) -> list[Row]:
    """The rows of a part: one for each printed quantity with a half-width, or one that says how the case ended."""
    result = computed(question, case, folder, LIMIT)
    if about["kind"] == "reference" and result.status == "finished" and not _rounds(result):
        mesh = pairsim.load(case, kind=question).mesh
        finer = {"Np": round(FINER * mesh.Np), "max_size": float(f"{mesh.max_size / FINER:.3g}")}
        result = computed(question, {**case, "mesh": finer}, folder.with_name(f"{folder.name}-finer"), LIMIT)
    scene: Row = {name: case[name] for name in ("beta", "De", "Ca_e", "ends")}
    cost = {"unknowns": result.record.unknowns or 0, "rounds": _rounds(result), "seconds": result.record.wall_time or 0}
    start = {**about, **scene, **cost}
    if not len(result.table):
        return [{**start, "ended": result.reason or result.status}]
    (printed,) = result.table.to_dict("records")
    rows = []
    for goal in GOALS:
        said = any(each.startswith("accuracy: ") and f" {goal.error_column} " in each for each in result.warnings)
        ends = [end for end in ("", "_1") if goal.error_column + end in printed]
        for error in (printed[goal.error_column + end] for end in ends):
            value = printed.get(f"{goal.name}_1", printed.get(goal.name))
            rows.append(
                {**start, "quantity": goal.name, "value": value, "half_width": error, "said": said, "ended": None}
            )
    return rows


def _rounds(result: Any) -> int:
    """How often the mesh of a result was adapted."""
    meshes: Sequence[Mapping[str, int]] = result.record.get("adaptation", {}).get("meshes", ())
    return sum(each["rounds"] for each in meshes)
