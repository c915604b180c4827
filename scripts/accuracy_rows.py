"""Rows of the studies of `scripts/accuracy`, and how their values are printed."""

from __future__ import annotations

import csv
import math
from pathlib import Path

import yaml

from pairsim.config.accuracy import is_level

Rows = list[dict[str, str]]


def rows_of(study: Path) -> Rows:
    """Rows of study.csv of a study, empty if the file does not exist."""
    if not (study / "study.csv").is_file():
        return []
    with (study / "study.csv").open(newline="") as file:
        return list(csv.DictReader(file))


def graded_rows(study: Path) -> Rows:
    """Rows of a study on the cells that it names, graded as `accuracy` grades them."""
    return [row for row in rows_of(study) if is_level(row["accuracy"]) and not has_equal_cells(row)]


def has_equal_cells(row: dict[str, str]) -> bool:
    """Whether arcs, or cells across the tube, are equal where `accuracy` grades them."""
    return any(float(row.get(f"mesh.{name}") or "nan") == 1 for name in ("grading", "row_grading"))


def number(row: dict[str, str], key: str) -> float:
    """Numerical value of a cell, NaN if it is empty."""
    return float(row.get(key) or "nan")


def short(value: float) -> str:
    """Format a number with two significant digits, or as an integer from 100 on."""
    return f"{value:.0f}" if value >= 100 else f"{value:.2g}"


def percent(value: float) -> str:
    """Format a fraction in percent; empty for NaN."""
    return "" if math.isnan(value) else f"{100 * value:.2g}"


def base(study: Path) -> dict[str, float]:
    """Keys that all discretisations of a study have in common."""
    return dict(yaml.safe_load(study.read_text())["base"])


def key(row: dict[str, str]) -> tuple[str, str]:
    """Keys that identify the mesh of a row."""
    return row["mesh.Np"], row["mesh.max_size"]
