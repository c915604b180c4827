"""Finished cases of sweeps, found by their parameters."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import yaml
from scipy.interpolate import PchipInterpolator

import pairsim
from pairsim.api.statements import Value
from pairsim.runtime.arrays import Array

SAME = 1e-9  # relative difference of parameters that are the same
NEGLIGIBLE = 0.01
"""Zeros whose |dU| up to the next one is below this part of the peak are left out."""


class NotComputed(Exception):
    """A result is not there, or its case has not finished."""


class Case:
    """A finished case.

    Args:
        result: What `pairsim.open` finds in its folder.

    Attributes:
        result: The same.
        parameters: All keys of the case, groups with dots.
    """

    def __init__(self, result: Any) -> None:
        self.result, self.kind, self.folder = result, result.kind, Path(result.folder)
        content = yaml.safe_load((self.folder / "case.yaml").read_text())
        self.parameters: dict[Any, Any] = pd.json_normalize(content).to_dict("records")[0]

    @property
    def table(self) -> pd.DataFrame:
        """Its main table."""
        return self.result.table

    def column(self, name: str) -> Array:
        """A column of it."""
        return self.table[name].to_numpy()

    def last(self, name: str) -> float:
        """The last entry of a column."""
        return float(self.table[name].iloc[-1])

    @property
    def d(self) -> Array:
        """Distances of the points of a curve."""
        return self.column("d")

    @cached_property
    def peak(self) -> float:
        """The largest |dU|."""
        return float(np.abs(self.column("dU")).max())

    def at(self, name: str, d: Any) -> Any:
        """A column of a curve between its points: dU by its own interpolant, others by a monotone one."""
        if name == "dU":
            return self.result.dU(np.clip(d, self.d[0], self.d[-1]))
        return PchipInterpolator(np.log(self.d), self.column(name))(np.log(d))

    def dU(self, d: float) -> Value:
        """dU of a curve at a distance, with its error."""
        return float(self.at("dU", d)), float(self.at("dU_error", d))

    def extreme(self, sign: int, beyond: float = 0.0) -> tuple[float, Value]:
        """Distance and value of the largest dU of a curve (sign 1) or of the smallest one (-1) beyond a distance."""
        part = self.table[self.table["d"] > beyond]
        row = part.iloc[int((sign * part["dU"]).argmax())]
        return float(row["d"]), (float(row["dU"]), float(row["dU_error"]))

    def zero(self, *, stable: bool) -> Value:
        """The first zero of a kind with a |dU| of more than `NEGLIGIBLE` of the peak beyond it; NaN without one."""
        zeros = self.result.zeros
        found = zeros[(zeros["stable"].astype(bool) == stable) & (zeros["peak"].fillna(1.0) >= NEGLIGIBLE)]
        return (float(found["d"].iloc[0]), float(found["d_error"].fillna(0).iloc[0])) if len(found) else (np.nan, 0.0)

    def frame(self, place: float) -> Any:
        """The fields at a distance, or at the last time for 0.

        Raises:
            NotComputed: They were not written.
        """
        from pairsim.results.xdmf import read_frame, read_times

        places = read_times(self.folder)
        hits = np.flatnonzero(np.isclose(places, place)) if place else np.arange(len(places))
        if not hits.size:
            raise NotComputed(f"{self.folder} has no fields at {place:g}")
        return read_frame(self.folder, int(hits[-1]))


class Cases:
    """The finished cases of sweeps in a folder.

    Args:
        output: The folder.
        names: Its sweeps, relative to it.
    """

    def __init__(self, output: Path, names: Sequence[str]) -> None:
        self.output, self.names = output, names
        self._known: dict[str, list[Case]] = {}

    def sweep(self, name: str) -> Any:
        """A sweep, None before it has begun."""
        return pairsim.open(self.output / name) if (self.output / name / "sweep.json").is_file() else None

    def of(self, name: str, where: Mapping[str, Any] | None = None) -> list[Case]:
        """Finished cases of a sweep that have some parameters: values, or lists of allowed values, by key."""
        if name not in self._known:
            sweep = self.sweep(name)
            ended = sweep.cases if sweep else []
            self._known[name] = [Case(result) for result in ended if result.status == "finished"]
        return [case for case in self._known[name] if matches(case.parameters, where or {})]

    def some(self, kind: str, **where: Any) -> Iterator[Case]:
        """All cases of a command that have some parameters."""
        yield from (case for name in self.names for case in self.of(name, where) if case.kind == kind)

    def all(self, kind: str, **where: Any) -> list[Case]:
        """The same, at least one.

        Raises:
            NotComputed: There is none.
        """
        if not (found := list(self.some(kind, **where))):
            raise NotComputed(f"{kind} with " + ", ".join(f"{key} {value}" for key, value in where.items()))
        return found

    def curve(self, **where: Any) -> Case:
        """The curve over a range of distances with the most points that has some parameters."""
        curves = [case for case in self.all("curve", **where) if case.d[-1] > 4 * case.d[0]]
        if not curves:
            raise NotComputed(f"curve with {where}")
        return max(curves, key=lambda case: len(case.d))

    def curve_with_fields(self, d: float, **where: Any) -> Case:
        """A curve that has some parameters and fields at a distance."""
        for case in self.all("curve", **where):
            if np.isclose(case.result.distances, d).any():
                return case
        raise NotComputed(f"fields at {d:g} with {where}")

    def run(self, **where: Any) -> Case:
        """The run that has some parameters and ends last."""
        return max(self.all("run", **where), key=lambda case: case.last("t"))


def matches(case: Mapping[Any, Any], where: Mapping[str, Any]) -> bool:
    """Whether a case has the given parameters."""
    return all(any(same(case.get(key), value) for value in listed(wanted)) for key, wanted in where.items())


def listed(value: Any) -> Sequence[Any]:
    """A list of one for a single value."""
    return value if isinstance(value, list | tuple) else [value]


def first(value: Any) -> Any:
    """The first of a list, or the single value."""
    return listed(value)[0]


def same(value: Any, wanted: Any) -> bool:
    """Whether two values of a parameter are the same; a list of equal entries is one of them."""
    if isinstance(value, list) and value and not isinstance(wanted, list):
        return all(same(each, wanted) for each in value)
    if isinstance(value, int | float) and isinstance(wanted, int | float):
        return abs(value - wanted) <= SAME * abs(wanted)
    return bool(value == wanted)
