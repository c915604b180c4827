"""Grid files: a base case and the keys to vary. All cases are validated before the first one is computed."""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

from pairsim.cases.case import SceneCase
from pairsim.cases.identity import alike, folder_name, identity_of, key_of
from pairsim.cases.keys import keys_of
from pairsim.cases.mistakes import Mistake, input_error
from pairsim.cases.physical import BLOCK
from pairsim.cases.values import is_name
from pairsim.cases.yaml_file import DEFAULT_LAWS, flat, read_yaml
from pairsim.computing.question import Question
from pairsim.questions.registry import QUESTIONS
from pairsim.record.columns import COST
from pairsim.runtime.errors import InputError
from pairsim.runtime.plain import Plain
from pairsim.runtime.text import as_typed
from pairsim.sweeps.draft import Draft
from pairsim.sweeps.files import parse_file
from pairsim.sweeps.grid_file import SweepFile, check_sweep


@dataclass(frozen=True)
class SweepCase:
    """A validated case of a sweep.

    Attributes:
        case: The case.
        key: Hash of everything that distinguishes two cases.
        folder: Name of its folder, `<slug>-<beginning of key>`.
        parameters: The values of the keys that vary in the grid, and of those that results.csv always has.
    """

    case: SceneCase
    key: str
    folder: str
    parameters: Mapping[str, Plain]


@dataclass(frozen=True)
class Grid:
    """A validated grid file."""

    name: str  # of the sweep
    question: Question[Any]  # the question that each case asks
    cases: tuple[SweepCase, ...]  # without duplicates, in the order of the file
    varying: tuple[str, ...]  # dotted keys that take more than one value, in the order of the file
    duplicates: int  # number of cases left out as duplicates
    excluded: int  # number of entries that `exclude` matches
    content: Mapping[str, Plain]  # of the file, with the base case included
    settings: tuple[str, ...] = ()  # key=value, applied to every case

    @property
    def key(self) -> str:
        """Hash of the set of cases."""
        return hashlib.sha256("\n".join(sorted(case.key for case in self.cases)).encode()).hexdigest()

    @property
    def columns(self) -> tuple[str, ...]:
        """Result columns of all cases, in the order of their first appearance."""
        shown = self.question.in_sweeps
        own = (name for each in self.cases for name in shown.columns(each.case))
        return tuple(dict.fromkeys((*own, *(column.name for column in COST))))


def read_grid(path: Path, settings: Sequence[str] = ()) -> Grid:
    """Read a grid file and validate every case, after settings key=value have replaced keys in it.

    Raises:
        InputError: The file or a case has mistakes; lists file, entry, key, value and what is allowed.
    """
    return grid_from(path, read_yaml(path), settings)


def grid_from(path: Path, data: Mapping[str, Plain], settings: Sequence[str] = (), listed: str = "cases") -> Grid:
    """Validate every case of the content of a grid file, as `read_grid` does.

    Args:
        path: The file, which messages name; paths in it are relative to its folder.
        data: Its content.
        settings: See `read_grid`.
        listed: The name of the key `cases` in messages, if the caller has made it from another key.
    """
    file = parse_file("sweep", SweepFile, check_sweep, data, str(path))
    question = QUESTIONS[file.command]
    base = read_base(path, data, question.model)
    found: dict[str, tuple[SceneCase, Draft]] = {}
    varied: dict[str, None] = {}
    errors: list[InputError] = []
    used, entries, excluded = set[int](), 0, 0
    for name, changes, combined in _entries(path, data, file, listed):
        try:
            draft = base.changed(changes, settings)
            if combined and (hits := {i for i, rule in enumerate(file.exclude) if draft.matches(rule)}):
                used |= hits
                excluded += 1
                continue
            entries += 1
            case = draft.checked(question, str(path), name)
        except InputError as error:
            errors.append(error)
            continue
        varied |= dict.fromkeys(changes if combined else flat(changes))
        found.setdefault(alike(case), (case, draft))
    if errors:
        raise _all_of(errors, entries)
    wrong = [
        Mistake(f"exclude[{i}]", rule, "must match at least one entry of the grid")
        for i, rule in enumerate(file.exclude)
        if i not in used
    ]
    if not found:
        wrong.append(Mistake("exclude", None, "must leave at least one case"))
    if wrong:
        raise input_error(wrong, data, str(path))
    varying, cases = _with_parameters(varied, [*found.values()], question.in_sweeps.parameters)
    name, content = file.name or path.stem, {**data, "base": {**base.content}}
    return Grid(name, question, cases, varying, entries - len(found), excluded, content, tuple(settings))


def read_base(path: Path, data: Mapping[str, Plain], model: type[SceneCase]) -> Draft:
    """The draft of the base of a grid or study file with valid content; `base` may be the name of a case file.

    Raises:
        InputError: That case file cannot be read.
    """
    base = data.get("base")
    content = _case_file(path, data, "base", base) if isinstance(base, str) else base
    return Draft.base(model, content if isinstance(content, Mapping) else {})


def _entries(
    path: Path, data: Mapping[str, Plain], file: SweepFile, listed: str
) -> Iterator[tuple[str, Mapping[str, Plain], bool]]:
    """Yield the entries of a file: its name in messages, the changes to the base, and whether it is of grid and zip."""
    # Keys are taken from the data, where they know their lines, unlike those of the validated file.
    axes = [[{key: each} for each in file.grid[key]] for key in _keys_in(data.get("grid"))]
    groups = data.get("zip")
    for group, columns in zip(groups if isinstance(groups, list) else [groups], file.zip, strict=False):
        axes.append([dict(zip(_keys_in(group), row, strict=True)) for row in zip(*columns.values(), strict=True)])
    for parts in product(*axes) if axes else ():
        changes = {key: each for part in parts for key, each in part.items()}
        yield "entry " + ", ".join(f"{key} = {value}" for key, value in changes.items()), changes, True
    cases = data.get("cases")
    for i, given in enumerate(cases if isinstance(cases, list) else ()):
        if isinstance(given, str):
            name = Path(given).stem
            content = _case_file(path, data, f"cases[{i}]", given)
            yield f"{listed}[{i}]", {**({"name": name} if is_name(name) else {}), **content}, False
        elif isinstance(given, Mapping):
            yield f"{listed}[{i}]", given, False


def _keys_in(group: Plain) -> list[str]:
    """The keys of a group of the file; none if it is not a group."""
    return list(group) if isinstance(group, Mapping) else []


def _case_file(path: Path, data: Mapping[str, Plain], key: str, given: str) -> Mapping[str, Plain]:
    """The content of a case file that a key of a grid file names."""
    if not (path.parent / given).exists():
        raise input_error([Mistake(key, given, "no such file")], data, str(path))
    return read_yaml(path.parent / given)


def _all_of(errors: Sequence[InputError], cases: int) -> InputError:
    """Combine the mistakes of all cases into one error, each once; those that all share are said of "every case"."""
    mistakes: dict[Any, InputError] = {}
    count: Counter[Any] = Counter()
    for each in (mistake for error in errors for mistake in error.mistakes):
        same = each.file, each.line, each.key, as_typed(each.value), each.allowed
        count[same] += 1
        mistakes.setdefault(same, each)
    for same, each in mistakes.items():
        each.others = ()
        each.entry = "every case" if count[same] == cases > 1 else each.entry
    return InputError.of_all(mistakes.values())


def _with_parameters(
    varied: Iterable[str], found: Sequence[tuple[SceneCase, Draft]], always: Sequence[str]
) -> tuple[tuple[str, ...], tuple[SweepCase, ...]]:
    """The keys that vary in a sweep, and its cases with the values of these keys.

    Args:
        varied: Dotted keys that the grid file varies; of these, the ones whose values differ are returned.
        found: The cases, each with the draft that it was made from.
        always: Keys that are parameters of each case whether they vary or not.
    """
    values: list[Mapping[str, Plain]] = []
    for case, draft in found:
        resolved = case.resolved()
        values.append({**resolved, **draft.spelled, **flat(resolved)})
    keys = dict.fromkeys(varied)
    if any(key.startswith(BLOCK) for key in keys):  # the numbers computed from it vary, too
        declared = keys_of(type(found[0][0]))
        given = {key for _, draft in found for key in draft.gives()}
        single = {key for key in given if declared[key].count is None}
        points = {key for each in values for key in single if isinstance(each.get(key), list)}  # of a curve
        keys |= dict.fromkeys(key for key in declared if key in given - points)
    for law in (law for law in DEFAULT_LAWS if law in keys):
        keys |= dict.fromkeys(key for each in values for key in each if key.startswith(f"{law}."))
    varying = tuple(key for key in keys if any(each.get(key) != values[0].get(key) for each in values))
    wanted = dict.fromkeys((*varying, *always))
    hashes = [key_of(case.kind, identity_of(case)) for case, _ in found]
    cases = (
        SweepCase(case, key, folder_name(case.slug, key), {name: each.get(name) for name in wanted})
        for key, (case, _), each in zip(hashes, found, values, strict=True)
    )
    return varying, tuple(cases)
