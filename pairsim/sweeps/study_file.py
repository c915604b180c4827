"""Study files: one case in many discretisations, all validated before the first one is computed."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from pairsim.config.case import Case, SceneCase
from pairsim.config.case_file import check_keys
from pairsim.config.curve_case import CurveCase
from pairsim.config.values import is_finite
from pairsim.config.yaml_file import place_of
from pairsim.results.columns import series_columns
from pairsim.runtime.errors import InputError
from pairsim.sweeps.grid import Grid, SweepCase, flat, grid_from, read_base, value_at

OWN = ("command", "repeat")  # keys of a discretisation that do not belong to its case
TABLE = "study.csv"
MODELS: dict[str, type[SceneCase]] = {"run": Case, "curve": CurveCase}
ZERO = "d_cr"
"""Quantity of a curve that is not a column: the zero of dU with the largest peak."""

Refuse = Callable[[str, Any, str], None]


@dataclass(frozen=True)
class Study:
    """A validated study file.

    Attributes:
        name: Name of the study.
        grids: For each command, a grid with a case for each of its discretisations.
        order: For each discretisation, in the order of the file, its command and index in the grid of the command.
        varying: Dotted keys in which the discretisations differ, including `command` if there are two.
        quantity: The quantity that is compared: a column, or d_cr.
        over: Whether `at` lists times ("t") or distances ("d").
        at: Times [D_c/U_av] or distances [D_c] of the comparison; empty for the end of a run or a single particle.
        exact: Exact values of the quantity at `at`, None if unknown.
        reference: Index of the discretisation used as reference; None for the one with the most unknowns.
        repeat: Number of repetitions of each discretisation, in the order of the file.
    """

    name: str
    grids: dict[str, Grid]
    order: tuple[tuple[str, int], ...]
    varying: tuple[str, ...]
    quantity: str
    over: Literal["t", "d"]
    at: tuple[float, ...]
    exact: tuple[float, ...] | None
    reference: int | None
    repeat: tuple[int, ...]

    def repetition(self, i: int) -> dict[str, Grid]:
        """The grids of the i-th repetition, counted from 0, by command."""
        wanted = {
            command: [k for (own, k), n in zip(self.order, self.repeat, strict=True) if own == command and n > i]
            for command in self.grids
        }
        return {command: self.grids[command].part(kept) for command, kept in wanted.items() if kept}

    @property
    def column(self) -> str:
        """The column that is evaluated at `at`."""
        return "dU" if self.quantity == ZERO else self.quantity

    @property
    def cases(self) -> list[tuple[str, SweepCase]]:
        """Command and case of every discretisation, in the order of the file."""
        return [(command, self.grids[command].cases[i]) for command, i in self.order]

    def settings(self, command: str, case: SweepCase) -> dict[str, Any]:
        """The values of a discretisation for the varying keys."""
        return {key: command if key == "command" else value_at(case.checked.resolved, key) for key in self.varying}


def columns(case: SweepCase) -> list[str]:
    """Columns of the results of a case that can be compared in a study."""
    return series_columns(case.checked.resolved.get("particles", 2))[1:]


def read_study(path: Path, data: dict[str, Any], settings: tuple[str, ...] = ()) -> Study:
    """Validate the content of a study file.

    Args:
        path: Path of the file.
        data: Its content.
        settings: key=value settings that replace keys in every case.

    Raises:
        InputError: The file has a mistake; gives file, key, value and what is allowed.
    """

    def refuse(key: str, value: Any, allowed: str) -> None:
        place = place_of(data, key.partition(":")[0])
        raise InputError(str(path), key, value, allowed, line=place.line if place else None)

    check_keys(data, "study", str(path))
    commands = _commands(data, refuse)
    entries = data["discretisations"]
    base = read_base(path, {key: data[key] for key in ("name", "base") if key in data})
    over = _over(data, set(commands), refuse)
    at = _places(data, over, base.get("particles", 2), refuse)
    grids, order = _grids(path, data, (base, commands, over, at), settings, refuse)
    cases = [grids[command].cases[i] for command, i in order]
    keys = dict.fromkeys(key for entry in entries for key in flat(entry) if key not in ("name", *OWN))
    resolved = [case.checked.resolved for case in cases]
    varying = [key for key in keys if any(value_at(r, key) != value_at(resolved[0], key) for r in resolved)]
    varying[:0] = ["command"] if len(grids) > 1 else []

    allowed = sorted({name for case in cases for name in columns(case)})
    if set(grids) == {"curve"} and all(r.get("particles", 2) == 2 for r in resolved):
        allowed.append(ZERO)
    quantity = data.get("quantity", "dU" if "dU" in allowed else allowed[0])
    if quantity not in allowed:
        refuse("quantity", quantity, f"must be one of {', '.join(allowed)}")
    count = 1 if quantity == ZERO else max(len(at), 1)
    exact = None
    if "exact" in data:
        wanted = f"must be {count} number{'s, one for each of at' if count > 1 else ''}"
        exact = _numbers(data["exact"], "exact", wanted, refuse)
        if len(exact) != count:
            refuse("exact", data["exact"], wanted)
    reference = data.get("reference", "finest")
    if "exact" in data and "reference" in data:
        refuse("reference", reference, "must be left out if exact is given")
    if reference != "finest" and not (type(reference) is int and 0 <= reference < len(entries)):
        refuse("reference", reference, f"must be finest, or the index of a discretisation from 0 to {len(entries) - 1}")
    chosen = None if reference == "finest" else reference
    name = next(iter(grids.values())).name
    return Study(name, grids, tuple(order), tuple(varying), quantity, over, at, exact, chosen, _repeat(data, refuse))


def _commands(data: Mapping[str, Any], refuse: Refuse) -> list[str]:
    """The command of every discretisation."""
    default, entries = data.get("command", "run"), data.get("discretisations")
    if not isinstance(default, str) or default not in MODELS:
        refuse("command", default, "must be run or curve")
    if not isinstance(entries, list) or len(entries) < 2 or not all(isinstance(entry, dict) for entry in entries):
        refuse("discretisations", entries, "must be a list of two or more, such as - {mesh.Np: 20, time.tol: 1e-4}")
    assert isinstance(entries, list)
    for i, entry in enumerate(entries):
        own = entry.get("command", default)
        if not isinstance(own, str) or own not in MODELS:
            refuse(f"discretisations[{i}]: command", entry["command"], "must be run or curve")
    return [entry.get("command", default) for entry in entries]


def _repeat(data: Mapping[str, Any], refuse: Refuse) -> tuple[int, ...]:
    """Number of repetitions of each discretisation: its own `repeat`, else that of the file."""
    own = [(f"discretisations[{i}]: repeat", entry.get("repeat")) for i, entry in enumerate(data["discretisations"])]
    counts = [("repeat", data.get("repeat", 1)), *((key, n) for key, n in own if n is not None)]
    for key, count in counts:
        if type(count) is not int or not 1 <= count <= 100:
            refuse(key, count, "must be a whole number from 1 to 100")
    return tuple(counts[0][1] if n is None else n for _, n in own)


def _over(data: Mapping[str, Any], commands: set[str], refuse: Refuse) -> Literal["t", "d"]:
    """Whether results are compared at times or at distances."""
    over = data.get("over", "d" if "curve" in commands else "t")
    if over not in ("t", "d") or (over == "t" and "curve" in commands):
        refuse(
            "over", over, f"must be {'d' if 'curve' in commands else 't (times) or d (distances that the run passes)'}"
        )
    return "t" if over == "t" else "d"


def _places(data: Mapping[str, Any], over: str, particles: Any, refuse: Refuse) -> tuple[float, ...]:
    """The times or distances of `at`."""
    at = _numbers(data.get("at", []), "at", "must be a number above 0, or a list of them", refuse)
    if any(place <= 0 for place in at):
        refuse("at", data["at"], "must be above 0")
    if over == "d" and at and particles == 1:
        refuse("at", data["at"], "must be left out: there is only one particle")
    if over == "d" and not at and particles != 1:
        refuse("at", None, "is missing; must be the distances at which dU is compared")
    return at


def _grids(
    path: Path,
    data: Mapping[str, Any],
    checked: tuple[dict[str, Any], list[str], str, tuple[float, ...]],
    settings: tuple[str, ...],
    refuse: Refuse,
) -> tuple[dict[str, Grid], list[tuple[str, int]]]:
    """The grid of each command, and for each discretisation its command and index."""
    base, commands, over, at = checked
    cases: dict[str, list[dict[str, Any]]] = {}
    order = []
    for entry, command in zip(data["discretisations"], commands, strict=True):
        wanted = {"d": list(at)} if command == "curve" else {"output.times": list(at)} if over == "t" else {}
        wanted = wanted if at else {}
        given = [*flat(entry), *(setting.partition("=")[0].strip() for setting in settings)]
        for key in wanted:
            if any(name == key or name.startswith(f"{key}.") for name in given):
                refuse(f"discretisations: {key}", None, "must be left out: it follows from at")
        own = cases.setdefault(command, [])
        order.append((command, len(own)))
        own.append({**wanted, **{key: value for key, value in entry.items() if key not in OWN}})
    grids = {}
    for command, own in cases.items():
        # A base shared by both commands may have keys that only the other command knows.
        other = {key for name in cases if name != command for key in MODELS[name].model_fields}
        kept = {k: v for k, v in base.items() if k not in other or k in MODELS[command].model_fields}
        content = {"name": data.get("name", path.stem), "base": kept, "command": command, "cases": own}
        grids[command] = grid_from(path, content, settings)
        if grids[command].duplicates:
            refuse("discretisations", None, f"must all differ; {grids[command].duplicates} are equal to an earlier one")
    return grids, order


def _numbers(value: Any, key: str, allowed: str, refuse: Refuse) -> tuple[float, ...]:
    values = value if isinstance(value, list) else [value]
    if not all(map(is_finite, values)):
        refuse(key, value, allowed)
    return tuple(map(float, values))
