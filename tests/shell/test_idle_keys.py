"""Keys that have no effect in a case are named; those that only spell out a default are not."""

from __future__ import annotations

import pytest

from pairsim.computing import QUESTIONS
from pairsim.computing.case_files import parse_case

PAIR = {"beta": 0.4, "De": 0, "Ca_e": 0.1, "d0": 0.1}


@pytest.mark.parametrize(
    ("changes", "notes"),
    [
        ({}, []),
        ({"De": 1, "liquid": {"law": "giesekus", "alpha": 0.3}, "xi": 0.5}, []),
        ({"xi": 0.09}, []),
        (
            {"liquid": "oldroyd-b", "xi": 0.5},
            ["liquid: oldroyd-b, xi have no effect: the liquid is Newtonian at De = 0"],
        ),
        ({"particles": 1}, ["d0 has no effect: there is only one particle"]),
        ({"particles": 1, "dU_error": True}, ["d0, dU_error have no effect: there is only one particle"]),
        (
            {"particles": 0, "limits": {"max_gap": 1, "min_gap": 0.002}},
            ["beta, Ca_e, d0, limits.max_gap have no effect: there are no particles"],
        ),
    ],
)
def test_keys_without_effect_are_named(changes: dict[str, object], notes: list[str]) -> None:
    assert parse_case(QUESTIONS["run"], PAIR | changes, "test").notes == notes


def test_curves_name_them_too() -> None:
    case = parse_case(QUESTIONS["curve"], {"beta": 0.4, "De": 0, "Ca_e": 0.1, "d": [0.1], "xi": 0.1}, "test")
    assert case.notes == ["xi has no effect: the liquid is Newtonian at De = 0"]


def test_a_case_read_from_its_folder_names_none() -> None:
    case = parse_case(QUESTIONS["run"], PAIR, "test")
    assert parse_case(QUESTIONS["run"], case.resolved(), "test").notes == []
