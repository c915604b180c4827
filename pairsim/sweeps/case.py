"""A validated case of a sweep, whichever command computes it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from pairsim.cases.cost import Estimate
from pairsim.cases.identity import folder_name, identity_of, key_of
from pairsim.computing import Question
from pairsim.computing.case_files import parse_case


@dataclass(frozen=True)
class SweepCase:
    """A validated case of any command.

    Attributes:
        folder: Name of its folder, `<slug>-<beginning of key>`.
        resolved: The case with every default, as written to its case file.
        identity: The part of `resolved` that makes two cases the same.
        key: Its hash.
        estimate: Estimated size and duration.
        columns: Columns of its results in results.csv.
        parameters: Values of the varying keys of its grid.
    """

    folder: str
    resolved: dict[str, Any]
    identity: dict[str, Any]
    key: str
    estimate: Estimate
    columns: tuple[str, ...]
    parameters: dict[str, Any] = field(default_factory=dict)

    @classmethod
    def of(cls, command: Question[Any], data: Mapping[str, Any], source: str, entry: str = "") -> SweepCase:
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
        key = key_of(command.name, identity)
        return cls(
            folder_name(case.slug, key),
            case.resolved(),
            identity,
            key,
            command.estimate(case),
            tuple(command.in_sweeps.columns(case)),
        )
