"""scripts/book/statements.py: margins of statements and their verdicts."""

from __future__ import annotations

import sys

import pytest
from support.inputs import ROOT

import pairsim

sys.path.append(str(ROOT / "scripts"))

from book import statements
from book.statements import Judged

PAIR = {"beta": 0.4, "De": 0, "Ca_e": 0.1, "ends": "developed", "length": "auto", "mesh": {"Np": 12}}


@pytest.mark.parametrize(
    ("margins", "verdict"),
    [
        ([(1.0, 0.1), (0.2, 0.1)], "holds"),
        ([(1.0, 0.1), (0.05, 0.1)], "within error"),
        ([(-0.05, 0.1), (1.0, 0.1)], "within error"),
        ([(0.05, 0.1), (-0.2, 0.1)], "does not hold"),
    ],
)
def test_verdicts(margins: list[tuple[float, float]], verdict: str) -> None:
    assert Judged(tuple(margins)).verdict == verdict


def test_margins() -> None:
    values = [(1.0, 0.0), (2.0, 0.5), (4.0, 0.25)]
    assert statements.rising(values).margins == ((1.0, 0.5), (2.0, 0.75))
    assert statements.falling(values).margins == ((-1.0, 0.5), (-2.0, 0.75))
    assert statements.alike(values, within=5.0).margins == ((2.0, 0.25),)
    assert statements.below([(-3.0, 0.1)], limit=4.0).margins == ((1.0, 0.1),)
    assert statements.above(values, limit=0.5).margins == ((0.5, 0.0), (1.5, 0.5), (3.5, 0.25))
    assert statements.negative(values).margins[0] == (-1.0, 0.0)
    assert statements.ratio((4.0, 0.4), (2.0, 0.0)) == (2.0, pytest.approx(0.2))


def test_statements_are_joined_with_their_numbers() -> None:
    both = statements.each([1.0, 2.0], lambda value: statements.positive([(value, 0.1)], "x"), "at {:g}".format)
    assert (both.verdict, both.numbers) == ("holds", "at 1: x 1; at 2: x 2")


def test_a_name_that_all_items_have_is_written_once() -> None:
    def numbers(names: dict[float, str], label: str = "at {:g}") -> str:
        items = statements.each(names, lambda x: statements.positive([(x, 0.1)], names[x]), label.format)
        return items.numbers

    assert numbers({1.0: "x:", 2.0: "x:"}) == "x, at 1: 1; at 2: 2"
    assert numbers({1.0: "x:", 2.0: "y:"}) == "at 1: x: 1; at 2: y: 2"
    assert numbers({1.0: "x:"}, label="") == "x: 1"
    assert statements.each([], lambda x: statements.positive([(x, 0.1)]), str).numbers == ""


@pytest.mark.slow
def test_sign_of_a_curve() -> None:
    curve = pairsim.curve(PAIR, d=[0.05, 0.1, 0.4], max_points=3)
    repels = statements.of_sign(curve, 1, high=0.2)
    assert repels.verdict == "holds"
    assert repels.numbers.startswith("least dU from d = 0.05 to 0.1: ")
    assert statements.of_sign(curve, -1, low=0.05, high=0.1).verdict == "does not hold"
