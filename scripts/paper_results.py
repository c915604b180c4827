"""Figures of configs/paper, and the results that they are drawn from."""

from __future__ import annotations

import csv
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
import yaml
from pydantic import BaseModel, ConfigDict, Field
from scipy.interpolate import PchipInterpolator

from pairsim.plots.lines import Line, lines_of, read_zeros
from pairsim.results import answer
from pairsim.results.folders import read_record
from pairsim.results.output import read_series
from pairsim.results.xdmf import FieldFrame, read_frame, read_times
from pairsim.runtime.arrays import Array
from pairsim.sweeps.ledger import read_sweep
from pairsim.sweeps.reader import flat

CONFIGS = Path(__file__).resolve().parent.parent / "configs" / "paper"
DESCRIPTION = "figure.yaml"
"""The picture of a figure; every other file of its folder is a computation."""
NEGLIGIBLE = 0.01
"""Zeros whose |dU| up to the next one is below this part of the peak are left out."""
RANGE = 4.0
"""Ratio of the largest and the smallest distance of a curve from which it counts as one over a range."""
SAME = 1e-9  # relative difference of parameters that are the same


class Panel(BaseModel):
    """A panel of a picture.

    Attributes:
        kind: What is drawn.
        of: Computations as FIGURE/FILE, such as fig07/curves.
        markers: Computations of independent transients, drawn as markers.
        where: Parameters that the drawn cases have; a list allows several values.
        by: The parameter that tells the lines apart.
        y: Columns, or the name of a field.
        d: Distance of the fields [D_c]; 0: the last time of a run.
        window: Ranges of both axes: x from and to, y from and to.
        in_G_p: Whether the field is that in the particles, in units of G_p; else it is that in the liquid.
        own_scale: Whether a field has colours of its own, not those of the other panels.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)
    kind: Literal["curves", "runs", "critical", "fields", "shapes", "mesh"]
    of: tuple[str, ...]
    markers: tuple[str, ...] = ()
    where: dict[str, Any] = Field(default_factory=dict)
    by: str = ""
    y: tuple[str, ...] = ("dU",)
    d: float = 0.0
    window: tuple[float, float, float, float] | None = None
    in_G_p: bool = False
    own_scale: bool = False


class Figure(BaseModel):
    """A figure of the paper.

    Attributes:
        caption: What it shows.
        panels: Its panels.
        also: Computations that its statements look at, beside those of its panels.
        quick: Settings of its own for `--quick`, by computation, in place of those of the command.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)
    caption: str
    panels: tuple[Panel, ...]
    also: tuple[str, ...] = ()
    quick: dict[str, dict[str, Any]] = Field(default_factory=dict)

    @property
    def of_meshes(self) -> bool:
        """Whether it shows meshes, and no results."""
        return self.panels[0].kind == "mesh"

    @property
    def needs(self) -> tuple[str, ...]:
        """Computations that its panels show, and those of `also`."""
        shown = [name for panel in self.panels for name in (*panel.of, *panel.markers)]
        return tuple(dict.fromkeys([*shown, *self.also]))


def figures() -> dict[str, Figure]:
    """All figures by name, such as fig07, in the order of the paper."""
    files = sorted(CONFIGS.glob(f"*/{DESCRIPTION}"))
    return {path.parent.name: Figure.model_validate(yaml.safe_load(path.read_text())) for path in files}


def computations(name: str) -> list[str]:
    """Computations of a figure's own folder, as FIGURE/FILE."""
    return [f"{name}/{path.stem}" for path in sorted((CONFIGS / name).glob("*.yaml")) if path.name != DESCRIPTION]


class NotComputed(Exception):
    """A result is not there, or its case has not finished."""


@dataclass(frozen=True)
class CaseResult:
    """The result of one case.

    Attributes:
        folder: Its folder.
        parameters: Its parameters, groups with dots.
        seconds: Wall time.
    """

    folder: Path
    parameters: Mapping[str, Any]
    seconds: float

    @property
    def record(self) -> dict[str, Any]:
        """The content of run.json."""
        return read_record(self.folder)

    def frame(self, place: float) -> FieldFrame:
        """The fields at a distance, or at the last time for 0.

        Raises:
            NotComputed: They were not written.
        """
        places = read_times(self.folder)
        hits = np.flatnonzero(np.isclose(places, place)) if place else np.arange(len(places))
        if not hits.size:
            raise NotComputed(f"{self.folder} has no fields at {place:g}")
        return read_frame(self.folder, int(hits[-1]))


@dataclass(frozen=True)
class Transient(CaseResult):
    """A run in time; `table` is series.csv."""

    @cached_property
    def table(self) -> Mapping[str, Array]:
        """Columns by name."""
        return read_series(self.folder / "series.csv")

    def last(self, name: str) -> float:
        """A column at the end."""
        return float(self.table[name][-1])


class Extremum(NamedTuple):
    """A point of a curve."""

    d: float
    dU: float
    error: float


@dataclass(frozen=True)
class Curve(CaseResult):
    """A quasi-steady curve; `table` is curve.csv."""

    @cached_property
    def line(self) -> Line:
        """Its points."""
        return lines_of(self.folder, self.parameters, curve=True)[0]

    @property
    def table(self) -> Mapping[str, Array]:
        """Columns by name."""
        return self.line.table

    @property
    def d(self) -> Array:
        """Distances of the points."""
        return self.table["d"]

    @cached_property
    def zeros(self) -> tuple[answer.Zero, ...]:
        """Zeros of dU and whether they are stable."""
        return read_zeros(self.folder)

    def at(self, name: str, d: Any) -> Any:
        """A column between the points: dU by its Hermite interpolant, others by a monotone one over log d."""
        if name == "dU":
            fine, values, _ = self.line.smooth()
            return np.interp(np.log(d), np.log(fine), values)
        return PchipInterpolator(np.log(self.d), self.table[name])(np.log(d))

    @property
    def peak(self) -> float:
        """Largest |dU|."""
        return float(np.abs(self.table["dU"]).max())

    @property
    def largest_interval(self) -> float:
        """Largest dU_error, relative to the peak."""
        return float(self.table["dU_error"].max()) / self.peak

    def extreme(self, sign: int, beyond: float = 0.0) -> Extremum:
        """The point of the largest dU (sign 1) or of the smallest one (-1) beyond a distance."""
        places = np.flatnonzero(self.d > beyond)
        i = places[int(np.argmax(sign * self.table["dU"][places]))]
        return Extremum(float(self.d[i]), float(self.table["dU"][i]), float(self.table["dU_error"][i]))

    def zero(self, *, stable: bool) -> Zero:
        """The first zero of a kind that separates a |dU| of more than `NEGLIGIBLE` of the peak from the rest."""
        path = self.folder / "equilibria.csv"
        with path.open(encoding="utf-8", newline="") as file:
            for row in csv.DictReader(file):
                if (row["stable"] == "true") == stable and float(row["peak"] or 1) >= NEGLIGIBLE:
                    return Zero(float(row["d"]), float(row["d_error"] or 0))
        return Zero(float("nan"), 0.0)


@dataclass(frozen=True)
class Zero:
    """A zero of dU: its distance, NaN if there is none, and the error of that."""

    d: float
    error: float


@dataclass(frozen=True)
class Marker:
    """The end of a transient beside the curve of its case.

    Attributes:
        run: The transient.
        curve: The curve.
    """

    run: Transient
    curve: Curve

    @property
    def d(self) -> float:
        """The distance that the pair has reached."""
        return self.run.last("d")

    @property
    def rest(self) -> float:
        """dU of the transient minus that of the curve."""
        return self.run.last("dU") - float(self.curve.at("dU", self.d))

    @property
    def interval(self) -> float:
        """dU_error of the curve there."""
        return float(self.curve.at("dU_error", self.d))


@dataclass(frozen=True)
class Critical(CaseResult):
    """Critical distances; `rows` is critical.csv."""

    @cached_property
    def rows(self) -> list[dict[str, Any]]:
        """Its rows, numbers as numbers."""
        import pandas as pd

        return pd.read_csv(self.folder / "critical.csv").to_dict("records")  # type: ignore[return-value]


class Results:
    """The results in an output folder of `scripts/paper`.

    Args:
        output: The folder.
        folders: Folders of configs/paper whose computations count; those of all figures by default.
    """

    def __init__(self, output: Path, folders: Sequence[str] = ()) -> None:
        self.output = output
        self.names = [each for name in folders or figures() for each in computations(name)]
        self._known: dict[str, list[CaseResult]] = {}

    def record(self, name: str) -> dict[str, Any] | None:
        """The ledger of a computation, None before it has begun."""
        return read_sweep(self.output / name) if (self.output / name / "sweep.json").is_file() else None

    def cases(self, name: str, where: Mapping[str, Any] | None = None) -> list[Any]:
        """Finished cases of a computation that have some parameters.

        Args:
            name: The computation, such as fig07/curves.
            where: Values, or lists of allowed values, by key.
        """
        if name not in self._known:
            self._known[name] = list(self._read(name))
        return [case for case in self._known[name] if matches(case.parameters, where or {})]

    def _read(self, name: str) -> Iterator[CaseResult]:
        record = self.record(name)
        if record is None:
            return
        kind = {"run": Transient, "curve": Curve, "critical": Critical}[record["command"]]
        for entry in record["cases"]:
            if entry["status"] == "finished":
                folder = self.output / name / entry["folder"]
                case = flat(yaml.safe_load((folder / "case.yaml").read_text()))
                yield kind(folder, case, float(read_record(folder).get("wall_time") or 0.0))

    def all_of(self, kind: type[CaseResult], **where: Any) -> list[Any]:
        """All finished cases of a kind, in all folders."""
        return [case for name in self.names for case in self.cases(name, where) if isinstance(case, kind)]

    def curves(self, **where: Any) -> list[Curve]:
        """The curves over a range of distances that have some parameters."""
        return [case for case in self.all_of(Curve, **where) if case.d[-1] > RANGE * case.d[0]]

    def curve(self, **where: Any) -> Curve:
        """The one of them with the most points.

        Raises:
            NotComputed: There is none.
        """
        if not (found := self.curves(**where)):
            raise NotComputed(", ".join(f"{key} {value:g}" for key, value in where.items()))
        return max(found, key=lambda case: len(case.d))

    def curve_with_fields(self, place: float, **where: Any) -> Curve:
        """A curve that has some parameters and fields at a distance.

        Raises:
            NotComputed: There is none.
        """
        for case in self.all_of(Curve, **where):
            if np.isclose(read_times(case.folder), place).any():
                return case
        raise NotComputed(f"fields at {place:g}, " + ", ".join(f"{key} {value:g}" for key, value in where.items()))

    def runs(self, **where: Any) -> list[Transient]:
        """All runs that have some parameters."""
        return self.all_of(Transient, **where)

    def run(self, **where: Any) -> Transient:
        """The run that has some parameters and ends last.

        Raises:
            NotComputed: There is none.
        """
        if not (found := self.runs(**where)):
            raise NotComputed("run with " + ", ".join(f"{key} {value:g}" for key, value in where.items()))
        return max(found, key=lambda case: case.last("t"))

    def critical(self, De: float) -> Critical:
        """Critical distances at a Deborah number.

        Raises:
            NotComputed: They are not there.
        """
        if not (found := self.all_of(Critical, De=De)):
            raise NotComputed(f"critical distances at De {De:g}")
        return found[0]

    def markers(self) -> list[Marker]:
        """All transients of the figures' markers that have a curve.

        Raises:
            NotComputed: There is none.
        """
        found = []
        for name in (name for name in self.names if name.endswith("/markers")):
            for run in self.cases(name):
                same_case = {key: run.parameters[key] for key in ("beta", "De", "Ca_e")}
                curves = [case for case in self.all_of(Curve, **same_case) if case.d[0] <= run.last("d") <= case.d[-1]]
                if curves:
                    found.append(Marker(run, max(curves, key=lambda case: len(case.d))))
        if not found:
            raise NotComputed("no transient with its curve")
        return found


def matches(case: Mapping[str, Any], where: Mapping[str, Any]) -> bool:
    """Whether a case has the given parameters."""
    return all(any(same(case.get(key), value) for value in listed(wanted)) for key, wanted in where.items())


def listed(value: Any) -> Sequence[Any]:
    """A list of one for a single value."""
    return value if isinstance(value, list | tuple) else [value]


def same(value: Any, wanted: Any) -> bool:
    """Whether two values of a parameter are the same; a list of equal entries is one of them."""
    if isinstance(value, list) and value and not isinstance(wanted, list):
        return all(same(each, wanted) for each in value)
    if isinstance(value, int | float) and isinstance(wanted, int | float):
        return abs(value - wanted) <= SAME * abs(wanted)
    return bool(value == wanted)
