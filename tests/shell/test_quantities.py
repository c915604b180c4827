"""What is declared of a kind or of a quantity is known everywhere: here of a quantity that no other file names."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from pairsim.cases.identity import alike
from pairsim.cases.inputs import drawn, inputs_of
from pairsim.cases.laws import Laws
from pairsim.cases.physical import QUANTITIES
from pairsim.cases.physical_keys import Physical
from pairsim.cases.quantity_text import si
from pairsim.cases.run_case import Case
from pairsim.computing.case_files import parse_case
from pairsim.plots.labels import case_parts
from pairsim.plots.parameters import ShownCase
from pairsim.quantities import kinds
from pairsim.quantities.kinds import PERCENTAGE, PURE, Kind
from pairsim.quantities.measurable import Measurable
from pairsim.quantities.scales import Scales
from pairsim.quantities.text import in_unit
from pairsim.questions.registry import QUESTIONS
from pairsim.runtime.errors import InputError

SCALES = Scales(50e-6, 8e-3, 0.5)
KINDS = {name: kind for name, kind in vars(kinds).items() if isinstance(kind, Kind)}
SOLVENT = Measurable(
    "solvent_part", PERCENTAGE, "part of the solvent", "9 %", r"\phi", gives=("xi",), uncertain=True, times=0.5
)
"""Twice what xi is."""


class Block(Physical):
    solvent_part: Any = None


class Trial(Case):
    physical: Block | None = None


@pytest.fixture
def trial(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(QUANTITIES, SOLVENT.key, SOLVENT)


def case(part: str, more: dict[str, str] | None = None, **keys: Any) -> Trial:
    block = {"tube": "50 um", "particle": "20 um", "velocity": "8 mm/s", "modulus": "5 kPa", "viscosity": "0.5 Pa.s"}
    block |= {"relaxation": "5 ms", "distance": "5 um", "solvent_part": part, **(more or {})}
    question = replace(QUESTIONS["run"], model=Trial)
    return parse_case(question, {"physical": block, "liquid": "giesekus", **keys}, "trial.yaml")


@pytest.mark.parametrize("kind", KINDS.values(), ids=KINDS)
def test_a_kind_has_both_directions(kind: Kind) -> None:
    """From SI units to a number, and from this to the unit in which it is shown."""
    assert kind.factor(SCALES) * kind.number(0.3, SCALES) == pytest.approx(0.3 * kind.per_si)
    assert kind.factor(None) == 1


@pytest.mark.usefixtures("trial")
def test_a_percentage_gives_its_number_and_is_an_input_with_its_half_width() -> None:
    made = case("10 +- 2 %")
    assert made.xi == pytest.approx(0.05)
    found = {each.key: each for each in inputs_of(made)}["solvent_part"]
    assert (found.value, found.half_width, found.unit, found.size) == (10, 2, "%", 1)
    assert {name: change for name, change in found.changes.items() if change} == {"xi": pytest.approx(0.005)}
    _, numbers = drawn(made, 1000)
    assert np.std(numbers["xi"]) == pytest.approx(0.005, rel=0.1), "half of its half-width"
    assert r"$\phi$ = 10 ± 2 %" in case_parts(ShownCase(made.resolved()), physical=True)


@pytest.mark.usefixtures("trial")
@pytest.mark.parametrize(
    ("part", "keys", "wrong"),
    [
        ("10", {}, r"physical\.solvent_part: got '10'; must be a percentage between -100 % and 100 %"),
        ("-10 %", {}, r"physical\.solvent_part: got '-10 %'; this is xi = -0\.05; allowed: number from 0"),
        ("10 %", {"xi": 0.1}, r"xi: got 0\.1; must be left out, or be 0\.05, as given by physical\.solvent_part"),
    ],
)
def test_mistakes_in_a_percentage_name_it(part: str, keys: dict[str, Any], wrong: str) -> None:
    with pytest.raises(InputError, match=wrong):
        case(part, **keys)


@pytest.mark.usefixtures("trial")
def test_two_quantities_that_give_one_key_contradict_each_other() -> None:
    with pytest.raises(InputError, match=r"physical\.solvent: .*must be left out if physical\.solvent_part is given"):
        case("10 %", {"solvent": "50 mPa.s"})


@pytest.mark.usefixtures("trial")
def test_a_percentage_that_is_exact_has_no_half_width(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(QUANTITIES, SOLVENT.key, replace(SOLVENT, uncertain=False))
    assert case("10 %").xi == pytest.approx(0.05)
    with pytest.raises(InputError, match=r"must be given without \+-"):
        case("10 +- 2 %")


@pytest.mark.usefixtures("trial")
def test_percentages_that_are_alike_make_one_case() -> None:
    assert alike(case("10 %")) == alike(case("10.0%")) != alike(case("10 +- 2 %"))


def test_laws_are_known_before_and_after_a_case_is_validated() -> None:
    """Of what is read nothing need be right; what a law declares is the same."""
    block = {"law": "ptt-exp", "epsilon": 0.2, "solvent": {"law": "carreau", "n": 0.5, "Cu": 2}}
    read = Laws.in_case({"liquid": block, "solid": ["kelvin-voigt", "neo-hookean"]})
    keys = {"beta": 0.4, "De": 1.0, "Ca_e": 0.1, "d0": 0.1, "liquid": block}
    made = Case.model_validate(keys)
    names = ["liquid.epsilon", *(f"liquid.solvent.{name}" for name in ("n", "Cu", "a", "eta_inf"))]
    assert [each.key for each in read.declared()] == [*names, "solid[0].eta"]
    assert [each.key for each in made.declared_parameters] == names
    assert [each.value for each in made.declared_parameters] == [0.2, 0.5, 2, None, None]
    assert (made.is_viscous, made.slowest_time, made.laws.liquid.parts[0].name) == (False, 1, "carreau")
    wrong = Laws.in_case({"liquid": {"law": ["carreau"], "n": "x"}, "solid": 3})
    assert (wrong.liquid.name, list(wrong.declared()), wrong.liquid.is_viscous) == ("", [], False)


def test_a_case_owns_its_experiment() -> None:
    block = {"tube": "50 um", "particle": "20 um", "velocity": "8 mm/s", "modulus": "5 kPa", "viscosity": "0.5 Pa.s"}
    made = parse_case(QUESTIONS["run"], {"physical": block | {"distance": "5 um"}}, "case.yaml")
    assert made.experiment is not None
    assert made.experiment.numbers == pytest.approx({"beta": made.beta, "Ca_e": made.Ca_e, "d": made.d0})
    assert (made.scales, made.experiment.mistakes, made.remarks) == (SCALES, [], [])
    assert Case.model_validate({"beta": 0.4, "Ca_e": 0.1, "d0": 0.1}).experiment is None


@pytest.mark.parametrize("text", ["2 1/s", "120 1/min", "2 s^-1", "2 Hz"])
def test_rates_are_written_with_a_fraction_too(text: str) -> None:
    rate = Measurable("build_up", kinds.RATE, "rate at which structure builds up", "0.5 1/s")
    assert si(text, rate) == pytest.approx(2.0)


def test_a_pure_number_of_an_experiment_has_no_unit_after_it() -> None:
    assert in_unit(Scales(60e-6, 1e-2, 1e-2), PURE, 0.25) == "0.25"
