"""Plain data, which YAML and JSON files hold."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

type Plain = str | float | bool | Sequence[Plain] | Mapping[str, Plain] | None
"""Texts, numbers, truth values, nothing, and lists and groups of these. Groups have texts as keys."""
