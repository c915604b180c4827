"""Whether the columns of a table agree with each other, and whether a table is a curve of one liquid."""

from __future__ import annotations

import re
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pandas as pd

from pairsim.lab.rheometer.column_headings import UNITS, Column, factor_of
from pairsim.lab.rheometer.export_tables import Section
from pairsim.runtime.arrays import Array

USUAL = {
    "rate": ("1/s", "1/min"),
    "frequency": ("rad/s", "Hz"),
    "viscosity": ("Pa.s", "mPa.s", "P"),
    "complex viscosity": ("Pa.s", "mPa.s", "P"),
    "stress": ("Pa", "kPa", "mPa", "dyn/cm^2"),
    "complex modulus": ("Pa", "kPa", "MPa"),
    "storage": ("Pa", "kPa", "MPa"),
    "loss": ("Pa", "kPa", "MPa"),
}
"""Units that a column without one may have."""
MODULUS = "modulus of storage and loss"  # |G*| from G' and G'', which no column has


class Relation(NamedTuple):
    """Two products of columns that must be equal."""

    powers: Mapping[str, int]  # power of each column in the ratio of the first product to the second one
    first: str
    second: str


RELATIONS = {
    "rheology": [Relation({"rate": 1, "viscosity": 1, "stress": -1}, "shear rate times viscosity", "the stress")],
    "spectrum": [
        Relation(
            {"frequency": 1, "complex viscosity": 1, MODULUS: -1},
            "frequency times complex viscosity",
            "the modulus of G' and G''",
        ),
        Relation({"complex modulus": 1, MODULUS: -1}, "the complex modulus", "the modulus of G' and G''"),
        Relation({"storage": 1, "factor": 1, "loss": -1}, "storage modulus times loss factor", "the loss modulus"),
    ],
}
FEW = 3  # least number of rows with which columns are compared
SAME = 0.1  # largest logarithm of the ratio of such products; chosen: corrections are larger
SURE = 0.03  # the same where a missing unit follows from it; chosen
HELD = {"stress": 0.002, "rate": 0.01}  # relative difference below which values are of one setting; chosen
ABOUT = 0.05  # the same for rates while an instrument adjusts them; chosen
CHANGES = 2.0  # ratio of the largest to the least value at one setting from which it counts as changing; chosen
MOST_KELVIN = 5.0  # range of temperatures over which a curve still counts as one of a single liquid; chosen


def agreed(kind: str, section: Section) -> tuple[dict[str, Column], list[str]]:
    """The columns that are read, and sentences on missing units, which are inferred from the other columns.

    Raises:
        ValueError: Columns contradict each other, or a unit is not understood.
    """
    columns, said = section.columns, list[str]()
    for relation in RELATIONS[kind]:
        all_ = {**columns}
        for name in relation.powers.keys() & section.further.keys():
            with suppress(ValueError):
                all_[name] = section.column(name)
        needed = {*relation.powers, *(("storage", "loss") if MODULUS in relation.powers else ())} - {MODULUS}
        if not needed <= all_.keys():
            continue
        in_order = sorted(needed, key=lambda name: all_[name].place)
        if found := _unit_by(relation, section, {name: all_[name] for name in in_order}):
            name, column = found
            columns = columns | {name: column}
            said.append(f"{column} has no unit: {relation.first} is {relation.second} with {column.unit}")
    return columns, said


def _unit_by(relation: Relation, section: Section, columns: Mapping[str, Column]) -> tuple[str, Column] | None:
    """The name of a column that is read without a unit, and the column with the unit that follows from a relation.

    None if there is no such column.

    Raises:
        ValueError: The relation does not hold.
    """
    numbers = {name: section.numbers_of(name).to_numpy() * of.factor for name, of in columns.items()}
    if MODULUS in relation.powers:
        numbers[MODULUS] = np.hypot(numbers["storage"], numbers["loss"])
    with np.errstate(invalid="ignore", divide="ignore"):
        ratio = np.sum([power * np.log(numbers[name]) for name, power in relation.powers.items()], axis=0)
    lines, ratio = section.cells.index[np.isfinite(ratio)], ratio[np.isfinite(ratio)]
    if len(ratio) < FEW:
        return None
    off = float(np.median(ratio))
    of_columns = " and ".join(map(str, columns.values()))
    if np.median(np.abs(ratio - off)) > SAME:
        low, high = np.exp(np.quantile(ratio, (0.1, 0.9)))
        between = f"{relation.first} is {low:.3g} to {high:.3g} times {relation.second}"
        raise ValueError(f"must have columns that belong together: {between} ({of_columns})")
    allowed = SAME + sum(_rounding(section.cells.loc[lines, of.place]) for of in columns.values())
    if (apart := np.abs(ratio - off) > allowed).any():
        line, factor = lines[apart][0], np.exp((ratio - off)[apart][0])
        raise ValueError(
            f"must have columns that belong together: in line {line} {relation.first} is {factor:.3g} times "
            f"what it is in other rows, relative to {relation.second} ({of_columns})"
        )
    without = [name for name, of in columns.items() if not of.unit and name != "factor"]
    if len(without) > 1:  # rates and frequencies without a unit are mostly in 1/s
        without = [name for name in without if name not in ("rate", "frequency")]
    if len(without) == 1 and (power := relation.powers.get(without[0])):
        (name,) = without
        unit = next((each for each in USUAL[name] if abs(np.log(_size(name, each)) + off / power) < SURE), "")
        if unit:
            read = name in section.places
            return (name, replace(columns[name], unit=unit, factor=_size(name, unit))) if read else None
    if abs(off) > SAME:
        lacking = " and ".join(str(columns[name]) for name in without)
        what = f"write the unit of {lacking} into the heading" if lacking else "a unit or a column is wrong"
        wrong = f"{relation.first} is {np.exp(off):.3g} times {relation.second}"
        raise ValueError(f"must have columns that agree: {wrong} ({of_columns}); {what}")
    return None


def _rounding(cells: pd.Series[str]) -> Array:
    """Relative rounding errors by the digits of numbers, such as 0.05 for those of two digits, (rows,)."""
    digits = (
        cells.str.replace(r"(?i)[ed].*", "", regex=True).str.replace(r"\D", "", regex=True).str.lstrip("0").str.len()
    )
    return np.asarray(5 * 10.0 ** -digits.clip(lower=1))


def _size(quantity: str, unit: str) -> float:
    """The size of a unit in the SI unit of a quantity."""
    factor = factor_of(unit, UNITS.get(quantity, "Pa"))
    assert factor is not None
    return factor


def no_curve(section: Section) -> str:
    """Why a section cannot be the flow curve, or the moduli, of one liquid; "" if it can.

    Raises:
        ValueError: Marks in the numbers may separate thousands.
    """
    numbers = section.numbers[section.usable].drop(columns="N1", errors="ignore")
    x, over = numbers.iloc[:, 0], "shear rate" if "rate" in numbers else "frequency"
    if (part := float((np.abs(np.log(x / x.median())) < ABOUT).mean())) > 0.5:
        return f"has {part:.0%} of its rows at about one {over}, {x.median():.3g}, as in a hold or a start-up"
    if "rate" in numbers:
        stress = numbers["stress"] if "stress" in numbers else numbers["viscosity"] * x
        if _part_that_changes(stress, x, HELD["stress"]) > 0.5:
            return f"has shear rates that change by a factor of {CHANGES:g} or more at one stress, as in creep"
    for name, y in numbers.iloc[:, 1:].items():
        if _part_that_changes(x, y, HELD["rate"]) > 0.5:
            why = "with time, temperature or history"
            return f"has values of {name} that change by a factor of {CHANGES:g} or more at one {over}, {why}"
    if (range_ := _kelvin(section)) > MOST_KELVIN:
        return f"has temperatures that differ by {range_:.0f} K"
    return ""


def _part_that_changes(setting: pd.Series[float], values: pd.Series[float], held: float) -> float:
    """The fraction of rows at whose setting, held within a relative difference, the values change."""
    alike = values.groupby(np.round(np.log(setting) / held))
    changes = alike.transform("max") >= CHANGES * alike.transform("min")
    return float(changes.mean()) if len(changes) else 0.0


def _kelvin(section: Section) -> float:
    """The range of temperatures [K] of the rows that are used, without the outermost tenths; 0 if none are known."""
    if "temperature" not in section.further:
        return 0.0
    place, _ = section.further["temperature"]
    with suppress(ValueError):
        found = section.numbers_of("temperature")[section.usable].dropna()
        unit = " ".join([section.heading[place], *section.near[place]])
        size = 5 / 9 if re.search(r"(?i)(°|\b)f\b|fahrenheit", unit) else 1.0
        return size * float(np.ptp(np.quantile(found, (0.1, 0.9)))) if len(found) else 0.0
    return 0.0


def measured_in(values: dict[str, Array]) -> dict[str, Array]:
    """Rate, viscosity and N1, or frequency, storage and loss, from the columns that are read in SI units."""
    values = {**values}
    if "stress" in values:
        values["viscosity"] = values.pop("stress") / values["rate"]
    if "factor" in values or "phase" in values:
        angle = np.radians(values.pop("phase")) if "phase" in values else np.arctan(values.pop("factor"))
        (_, frequency), (of, size) = values.items()
        factors = {"complex viscosity": frequency, "storage": 1 / np.cos(angle), "loss": 1 / np.sin(angle)}
        size = size * factors.get(of, 1.0)
        return {"frequency": frequency, "storage": size * np.cos(angle), "loss": size * np.sin(angle)}
    return values


def difference(kind: str, one: Section, other: Section) -> float:
    """The median difference of the logarithms of two sections at the same rates; NaN if their rates do not overlap.

    Raises:
        ValueError: One of them has columns that contradict each other, a unit that is not understood, or marks that may
            separate thousands.
    """
    both = [measured_in(each.si(agreed(kind, each)[0])) for each in (one, other)]
    (x, *ys), (x_other, *ys_other) = ([y for name, y in each.items() if name != "N1"] for each in both)
    order = np.argsort(x_other)
    inside = (x >= x_other.min()) & (x <= x_other.max())
    if not inside.any():
        return float("nan")
    log_x, log_other = np.log(x[inside]), np.log(x_other[order])
    apart = [
        np.log(y[inside]) - np.interp(log_x, log_other, np.log(y_other[order]))
        for y, y_other in zip(ys, ys_other, strict=True)
    ]
    return float(np.median(np.abs(np.concatenate(apart))))
