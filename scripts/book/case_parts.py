"""Parts that are cases: each is computed by a command, and its rows are those of its table."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

import pandas as pd

from book.statements import Judged
from book.study import Part, Row, computed

LIMIT = 2400.0  # wall time of a case [s]


def grid(**values: Sequence[Any]) -> list[dict[str, Any]]:
    """All combinations of the values of some keys; dots stand for groups, as in `pairsim --set`."""
    return [dict(zip(values, each, strict=True)) for each in product(*values.values())]


def case_of(base: Mapping[str, Any], **changes: Any) -> dict[str, Any]:
    """A case with other values of some keys; keys of groups are written with dots or with two underscores."""
    case = json.loads(json.dumps(base))
    for name, value in changes.items():
        *groups, key = name.replace("__", ".").split(".")
        place = case
        for group in groups:
            place = place.setdefault(group, {})
        place[key] = value
    return dict(case)


def case_part(
    name: str,
    question: str,
    case: Mapping[str, Any],
    columns: Sequence[str],
    about: Row,
    *,
    entries: Sequence[str] = (),
    limit: float = LIMIT,
) -> Part:
    """A part that is one case.

    Args:
        name: The name of the part.
        question: The question that is computed, such as "curve".
        case: Keys and values.
        columns: Columns of its table that are stored; those that the table lacks are left out.
        about: Entries of all of its rows, such as the values by which parts are told apart.
        entries: Entries of its run.json that are stored, in all of its rows.
        limit: Wall time after which it is stopped [s].

    Returns:
        A part whose rows are those of the table, with `ended` empty; or a single row whose `ended` says why there are
        none.
    """
    identity = json.dumps({"command": question, **case}, sort_keys=True)
    ask = partial(_rows, question=question, columns=columns, entries=entries, limit=limit)
    return Part(name, identity, lambda folder: ask(folder, case=case, about=about))


def cases_part(
    name: str,
    question: str,
    cases: Sequence[tuple[Row, Mapping[str, Any]]],
    columns: Sequence[str],
    *,
    entries: Sequence[str] = (),
    limit: float = LIMIT,
) -> Part:
    """A part that is several cases, such as a line over a parameter, each given with the entries of all of its rows.

    Other arguments are those of `case_part`.
    """
    identity = json.dumps([{"command": question, **case} for _, case in cases], sort_keys=True)
    ask = partial(_rows, question=question, columns=columns, entries=entries, limit=limit)

    def rows(folder: Path) -> list[Row]:
        found = list[Row]()
        for i, (about, case) in enumerate(cases):
            found += ask(folder.with_name(f"{folder.name}-{i}"), case=case, about=about)
        return found

    return Part(name, identity, rows)


def _rows(
    folder: Path,
    *,
    question: str,
    case: Mapping[str, Any],
    columns: Sequence[str],
    about: Row,
    entries: Sequence[str],
    limit: float,
) -> list[Row]:
    """The rows of a case."""
    result = computed(question, case, folder, limit)
    same = {**about, **{name: result.record.get(name) for name in entries}}
    if not len(result.table):
        return [{**same, "ended": result.reason or result.status}]
    return [
        {**same, **{name: row[name] for name in columns if name in row}, "ended": None}
        for row in result.table.to_dict("records")
    ]


def all_computed(results: pd.DataFrame, parts: Sequence[Part]) -> Judged:
    """The statement that all parts are computed."""
    done = results["part"].nunique()
    return Judged(((done - len(parts) + 0.5, 0.0),), f"{done} of {len(parts)} parts")


def complete(results: pd.DataFrame, parts: Sequence[Part]) -> dict[str, Judged]:
    """The statements that all parts are computed, and that every case has an answer."""
    found = {"all is computed": all_computed(results, parts)}
    if "ended" in results:
        left = results[results["ended"].notna()]
        names = ", ".join(left["part"] + " (" + left["ended"].astype(str) + ")")
        text = f"{len(left)} without{': ' if names else ''}{names}"
        found["every case has an answer"] = Judged(((0.5 - len(left), 0.0),), text)
    return found
