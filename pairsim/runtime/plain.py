"""Plain data: what YAML and JSON files can hold."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

type Plain = str | float | bool | Sequence[Plain] | Mapping[str, Plain] | None
"""Texts, numbers, truth values, None, and lists and mappings of these; the keys of mappings are texts."""
