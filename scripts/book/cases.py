"""Finished cases of computations, found by their parameters."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from scipy.interpolate import PchipInterpolator

from book import yaml_files
from book.statements import Value
from pairsim.record.xdmf import FieldFrame, read_frame
from pairsim.runtime.arrays import Array


class NotComputed(Exception):
    """A result is not there, or its case has not finished."""


class Case:
    """A finished case, from what `pairsim.open` finds in its folder.

    `parameters` are all keys of the case, groups with dots; a list of equal entries is one of them.
    """

    def __init__(self, result: Any) -> None:
        self.result, self.kind, self.folder = result, result.kind, Path(result.folder)
        content = yaml_files.read(self.folder / "case.yaml")
        self.parameters: dict[Any, Any] = pd.json_normalize(content).to_dict("records")[0]
        for key, value in self.parameters.items():
            if isinstance(value, list) and len(value) > 1 and value[1:] == value[:-1]:
                self.parameters[key] = value[0]

    @property
    def table(self) -> pd.DataFrame:
        """Its main table."""
        return self.result.table

    def last(self, name: str) -> float:
        """The last entry of a column."""
        return float(self.table[name].iloc[-1])

    @property
    def d(self) -> Array:
        """Distances of the points of a curve."""
        return self.table["d"].to_numpy()

    @property
    def peak(self) -> float:
        """The largest |dU|."""
        return float(self.table["dU"].abs().max())

    def at(self, name: str, d: Any) -> Any:
        """A column of a curve between its points: dU by its own interpolant, others by a monotone one."""
        if name == "dU":
            return self.result.dU(np.clip(d, self.d[0], self.d[-1]))
        return PchipInterpolator(np.log(self.d), self.table[name])(np.log(d))

    def dU(self, d: float) -> Value:
        """dU of a curve at a distance, with its error."""
        return float(self.at("dU", d)), float(self.at("dU_error", d))

    def frame(self, place: float = 0.0) -> FieldFrame:
        """The fields at a distance of a curve or a time of a run; at the last one for 0. `NotComputed` without them."""
        places = self.result.places
        hits = np.flatnonzero(np.isclose(places, place)) if place else np.arange(len(places))
        if not hits.size:
            raise NotComputed(f"{self.folder} has no fields at {place:g}")
        return read_frame(self.folder, int(hits[-1]))


class Cases:
    """Finished cases of computations.

    Args:
        results: The results of computations by their names; only finished ones count.
    """

    def __init__(self, results: Mapping[str, Sequence[Any]]) -> None:
        self.names = list(results)
        self._of = {
            name: [Case(each) for each in found if each.status == "finished"] for name, found in results.items()
        }

    def of(self, name: str, where: Mapping[str, Any] | None = None) -> list[Case]:
        """Cases of a computation that have some parameters, as in `matches`; none if there is no such computation."""
        return [case for case in self._of.get(name, ()) if matches(case.parameters, where or {})]

    def all(self, kind: str, **where: Any) -> list[Case]:
        """All cases of a question that have some parameters; `NotComputed` if there is none."""
        if found := [case for name in self.names for case in self.of(name, where) if case.kind == kind]:
            return found
        raise NotComputed(f"{kind} with {where}")

    def curves(self, fields: float = 0.0, **where: Any) -> list[Case]:
        """The curve with the most points for each combination of values of those parameters that are lists.

        Only curves count that have fields at the distance `fields` or, if this is 0, go over a range of distances.
        `NotComputed` if there is none for a combination.
        """
        known = []
        for curve in self.all("curve"):
            if np.isclose(curve.result.places, fields).any() if fields else curve.d[-1] > 4 * curve.d[0]:
                known.append(curve)
        return [max(group, key=lambda curve: len(curve.table)) for group in grouped(known, where)]

    def runs(self, **where: Any) -> list[Case]:
        """The run that ends last for each combination of values of those parameters that are lists, as for `curves`."""
        return [max(group, key=lambda run: run.last("t")) for group in grouped(self.all("run"), where)]


def grouped(cases: Sequence[Case], where: Mapping[str, Any]) -> Iterator[list[Case]]:
    """The cases, at least one, for each combination of values of those parameters that are lists, or `NotComputed`."""
    for values in product(*map(listed, where.values())):
        one = dict(zip(where, values, strict=True))
        if not (group := [case for case in cases if matches(case.parameters, one)]):
            raise NotComputed(f"a case with {one}")
        yield group


def matches(case: Mapping[Any, Any], where: Mapping[str, Any]) -> bool:
    """Whether a case has the given parameters: values, or lists of allowed values, by key."""
    return all(case.get(key) in listed(wanted) for key, wanted in where.items())


def listed(value: Any) -> Sequence[Any]:
    """A list of one for a single value."""
    return value if isinstance(value, list | tuple) else [value]
