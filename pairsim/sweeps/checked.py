"""A validated case of a sweep, whichever command computes it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from pairsim.commands import Command
from pairsim.config.cost import Estimate
from pairsim.config.form_kinds import forms_of
from pairsim.config.identity import identity_of, key_of
from pairsim.inputs.case_files import parse_case


@dataclass(frozen=True)
class Checked:
    """A validated case of any command.

    Attributes:
        slug: Beginning of its folder's name.
        resolved: The case with every default, as written to its case file.
        identity: The part of `resolved` that makes two cases the same.
        key: Its hash.
        estimate: Estimated cost.
        forms: Names in the form cache of the compiled forms that it needs.
        columns: Columns of its results in results.csv.
    """

    slug: str
    resolved: dict[str, Any]
    identity: dict[str, Any]
    key: str
    estimate: Estimate
    forms: tuple[str, ...]
    columns: tuple[str, ...]

    @classmethod
    def of(cls, command: Command[Any], data: Mapping[str, Any], source: str, entry: str = "") -> Checked:
        """Validate keys and values.

        Args:
            command: The command that computes the case.
            data: Keys and values, groups nested.
            source: Name of the file in messages.
            entry: Name of the entry of the file in messages.

        Raises:
            InputError: The case has mistakes.
        """
        case = parse_case(command, data, source, entry)
        identity = identity_of(case)
        return cls(
            case.slug,
            case.resolved(),
            identity,
            key_of(command.name, identity),
            command.estimate(case),
            forms_of(case),
            tuple(command.in_sweeps.columns(case)),
        )
