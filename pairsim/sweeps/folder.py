"""The folder of a sweep: what it computes is in sweep.json, how its cases stand is in their folders.

sweep.json is written once, when the sweep begins, and says nothing of how it goes on.
"""

from __future__ import annotations

import json
import os
import platform
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pairsim.cases.yaml_file import yaml_text
from pairsim.computing.question import Value
from pairsim.questions.registry import QUESTIONS
from pairsim.results.folder import plain, read_record, write_json, write_text
from pairsim.runtime.errors import BranchEnd, InputError
from pairsim.runtime.locks import command_line, is_locked
from pairsim.runtime.version import __version__
from pairsim.sweeps.grid import Grid

STOP = ".stop"  # file in the folder of a sweep whose presence stops it
STATUSES = ("pending", "running", "finished", "failed")
ENDED = ("finished", "failed")


@dataclass(frozen=True)
class CaseState:
    """How a case stands."""

    folder: str  # its name
    status: str = "pending"  # "pending", "running", "finished" or "failed"
    reason: str = ""  # as in run.json
    message: str = ""  # as in run.json
    warnings: Sequence[str] = ()  # what its run.json warns of
    values: Mapping[str, Value] = field(default_factory=dict)  # what it gives to results.csv


def read_state(directory: Path, key: str, values: bool = True) -> CaseState:
    """How a case stands, by its folder, with its tables if `values` are wanted.

    A folder with the hash of another case says nothing; one of version 0.2 has none.
    """
    record = read_record(directory)
    status = record.get("status")
    if record.get("key", key) != key or status not in ("running", *ENDED):
        return CaseState(directory.name)
    known = QUESTIONS[record["kind"]].values(directory) if values and status in ENDED else {}
    words = record.get("reason", ""), record.get("message", "")
    return CaseState(directory.name, str(status), *words, record.get("warnings", ()), known)


def begin(directory: Path, grid: Grid) -> dict[str, Any]:
    """Write sweep.json and grid.yaml into a folder, unless they are there; returns the content of sweep.json.

    Raises:
        InputError: The folder belongs to another grid, or is not that of a sweep.
        OSError: The files cannot be written.
    """
    if (directory / "sweep.json").is_file():
        earlier = _read(directory)
        if earlier.get("grid") != grid.key:
            version = earlier.get("versions", {}).get("pairsim", __version__)
            whose = "of another grid" if version == __version__ else f"by pairsim {version}, whose keys differ"
            raise InputError(str(directory), "-o", None, f"must be a folder for this grid, but has a sweep {whose}")
        return earlier
    if any(not path.name.startswith(".") for path in directory.iterdir()):
        raise InputError(str(directory), "-o", None, "must be a new or empty folder, or one of a sweep")
    cases = [{"folder": case.folder, "key": case.key, "parameters": case.parameters} for case in grid.cases]
    content: dict[str, Any] = plain(
        {
            "name": grid.name,
            "command": grid.question.name,
            "grid": grid.key,
            "varying": grid.varying,
            "parameters": [*dict.fromkeys((*grid.varying, *grid.question.in_sweeps.parameters))],
            "columns": grid.columns,
            "command_line": command_line(),
            "working_folder": os.getcwd(),
            "machine": {"node": platform.node(), "system": platform.platform()},
            "versions": {"pairsim": __version__, "python": platform.python_version()},
            "cases": cases,
        }
    )
    text = "".join(f"# --set {each}\n" for each in grid.settings) + yaml_text(plain(grid.content))
    write_json(directory / "sweep.json", content)
    write_text(directory / "grid.yaml", text)
    return content


def _read(directory: Path) -> dict[str, Any]:
    path = directory / "sweep.json"
    try:
        content: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        [(case["folder"], case["key"], case["parameters"]) for case in content["cases"]]
    except FileNotFoundError:
        raise InputError(str(directory), "", None, "must be the folder of a sweep, but has no sweep.json") from None
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InputError(str(path), "", None, f"must be that of a sweep of this version ({error})") from error
    return content


def read_sweep(directory: Path, values: bool = True) -> dict[str, Any]:
    """What sweep.json has, and how each case stands: all of `CaseState` in its entry, and `counts` by status.

    The tables of the cases are read if `values` are wanted.

    Raises:
        InputError: The folder is not that of a sweep.
    """
    content = _read(directory)
    working = is_locked(directory)
    for case in content["cases"]:
        case.update(vars(read_state(directory / case["folder"], case["key"], values)))
        if case["status"] == "running" and not working:  # it was killed
            case["status"] = "pending"
    count = Counter(case["status"] for case in content["cases"])
    return content | {"counts": {status: count[status] for status in STATUSES}}


def rows_of(content: Mapping[str, Any]) -> tuple[list[str], list[list[Any]]]:
    """Columns and rows of results.csv: a row for each case of `read_sweep` that has ended, in the order of the grid."""
    parameters, columns = content["parameters"], content["columns"]
    rows = [
        [
            *(case[key] for key in ("folder", "status", "reason")),
            *(case["parameters"].get(key) for key in parameters),
            *(case["values"].get(key) for key in columns),
            "; ".join(case["warnings"]),
        ]
        for case in content["cases"]
        if case["status"] in ENDED
    ]
    return ["folder", "status", "reason", *parameters, *columns, "warnings"], rows


def without_result(cases: Sequence[Mapping[str, Any]]) -> list[Mapping[str, Any]]:
    """Those of the cases of `read_sweep` that failed, or in which there is no steady state."""
    return [case for case in cases if case["status"] == "failed" or case["reason"] == BranchEnd.reason]
