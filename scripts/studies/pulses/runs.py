"""A run of the study: its case, what its rows say of it, and how it becomes a part."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from book.study import Part, Row, computed

type Case = Mapping[str, Any]
type Measure = Callable[[Any], Sequence[Row]]
"""What is measured of the result of a run, at least one row."""
LIMIT = 7200.0  # wall time of a run [s]


def of_cycles(result: Any) -> Sequence[Row]:
    """A row for each gap: its drift over the last whole cycle, as a mean of dU, and within which distances it was.

    `change` is by how much the mean of later cycles may still differ, as memory fades.
    """
    cycles = result.record.get("cycles")
    if not cycles or not cycles["whole"]:
        return [{"gap": 1}]
    same = {"cycles": cycles["whole"], "peak": cycles["dU_peak"], "change": cycles.get("change")}
    rows = list[Row]()
    for i, (drift, error) in enumerate(zip(cycles["drift"], cycles["drift_error"], strict=True)):
        d = result.table["d" if len(cycles["drift"]) == 1 else f"d_{i + 1}"]
        dU = result.table["dU" if len(cycles["drift"]) == 1 else f"dU_{i + 1}"]
        of_gap = {"moved": float(d.iloc[-1] - result.case.gaps[i]), "range": float(d.max() - d.min())}
        of_gap |= {"largest": float(dU.abs().max())}
        mean = {"mean": drift / cycles["cycle"], "half_width": error and error / cycles["cycle"]}
        rows.append({"gap": i + 1, **mean, **of_gap, **same})
    return rows


def of_steady_flow(result: Any) -> Sequence[Row]:
    """A row for each gap: dU at the end of a run in a flow that is constant, and how far the gap moved."""
    last, rows = result.table.iloc[-1], list[Row]()
    for i, d in enumerate(result.case.gaps):
        end = "" if len(result.case.gaps) == 1 else f"_{i + 1}"
        mean = {"mean": last[f"dU{end}"], "half_width": last.get(f"dU_error{end}")}
        rows.append({"gap": i + 1, **mean, "moved": float(last[f"d{end}"] - d)})
    return rows


def of_point(result: Any) -> Sequence[Row]:
    """dU in steady flow at the distance of a curve of one point."""
    (point,) = result.table.to_dict("records")
    return [{"gap": 1, "mean": point["dU"], "half_width": point["dU_error"]}]


@dataclass(frozen=True)
class Run:
    """A run of the study, which is one part of it.

    Attributes:
        topic: What it shows; the name of the part begins with it.
        name: What distinguishes it from the others of its topic.
        case: Its keys.
        about: What its rows say of it beside what is measured.
        measure: What is measured of its result.
        question: What is computed, a run or a curve.
    """

    topic: str
    name: str
    case: Case
    about: Row = field(default_factory=dict)
    measure: Measure = of_cycles
    question: str = "run"

    @property
    def part(self) -> Part:
        """The part that computes it."""
        identity = json.dumps({"measure": self.measure.__name__, **self.case}, sort_keys=True)
        return Part(f"{self.topic}-{self.name}".replace(" ", "-"), identity, self._rows)

    def _rows(self, folder: Path) -> Sequence[Row]:
        result = computed(self.question, self.case, folder, LIMIT)
        about: Row = {"topic": self.topic, "run": self.name, **self.about, **how(result)}
        return [{**about, **row} for row in (self.measure(result) if result.status == "finished" else [{}])]


def how(result: Any) -> Row:
    """How a run ended, and what it took."""
    record = result.record
    size = {"steps": record.steps, "unknowns": record.unknowns, "seconds": record.wall_time}
    return {"status": result.status, "reason": result.reason, **size}


def square(period: float, amplitude: float = 1.0) -> Case:
    """The keys of a square wave of mean 0."""
    return {"shape": "square", "period": period, "amplitude": amplitude}
