"""What is declared of a key beside its field is known everywhere: here of keys that no other file names."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from typing import Annotated, Any

import pytest
from pydantic import Field

from pairsim.atlas.atlas import PARAMETERS, SHIPPED, Atlas
from pairsim.cases.checks import missing_numbers, mistakes_in
from pairsim.cases.coverage import beyond, case_of
from pairsim.cases.identity import identity_of, with_later_keys
from pairsim.cases.keys import Key, Keys, Part, PerGap, PerParticle, keys_of
from pairsim.cases.mistakes import Mistake
from pairsim.cases.run_case import Case
from pairsim.cases.values import Number
from pairsim.computing.case_files import parse_case
from pairsim.computing.question import no_mistakes
from pairsim.plots.labels import case_parts, common_parts, equation, parameter_label, varying_keys
from pairsim.plots.parameters import Parameters, ShownCase
from pairsim.questions.curve import CurveCase
from pairsim.questions.registry import QUESTIONS
from pairsim.runtime.errors import InputError


class Options(Keys):
    size: Number = Field(1.0, description="a size")
    late: Annotated[bool, Key(since="9")] = Field(False, description="a key of a later version")


WEIGHT = Key("W", r"\eta_0 U_{av} D_c", caption=10, slug="W", since="9")


OF_SOFT = Key(identity=lambda each: each.Ca_e != 0, idle=lambda each: "" if each.Ca_e else "rigid")


def _check_pull(each: Weighed) -> str:
    return "must be 0: particles are soft" if any(each.each("pull")) and any(each.Ca_es) else ""


def _check_rope(each: Weighed) -> Iterator[Mistake]:
    yield from (Mistake("rope", rope, "must be taut") for rope in each.each("rope") if rope < 1)


class Weighed(Case):
    """A run with keys of its own: one number a particle, one a gap, and a group."""

    weight: Annotated[PerParticle[Number], WEIGHT] = Field(0.0, description="weight of each particle")
    charge: Annotated[PerParticle[Number] | None, Key(required=True)] = Field(None, description="charge")
    spring: PerGap[Number] = Field(0.0, description="stiffness of a spring across each gap")
    thrust: Annotated[
        Number, Key(identity=lambda each: each.Ca_e != 0, idle=lambda each: "" if each.Ca_e else "rigid")
    ] = Field(0.0, description="a key that matters to soft particles alone")
    pull: Annotated[PerParticle[Number], Key(since="9", models="gravity", check=_check_pull)] = Field(
        0.0, description="a key that others depend on"
    )
    rope: Annotated[PerGap[Number], Key(since="9", first=True, check=_check_rope)] = Field(
        1.0, description="a key that is checked before others"
    )
    options: Options = Options()


def case(**keys: Any) -> Weighed:
    return Weighed.model_validate({"beta": 0.4, "Ca_e": 0.1, "d0": 0.1, "charge": 1, **keys})


@pytest.mark.parametrize(
    ("keys", "wrong"),
    [
        (
            {"particles": 1, "weight": [1, 2]},
            {"weight": "must be a number or a list of 1, one for each of the particles"},
        ),
        ({"weight": [1, 2]}, {}),
        ({"spring": [1, 2]}, {"spring": "must be a number or a list of 1, one for each of the gaps"}),
        ({"particles": 3, "spring": [1, 2], "weight": 1}, {}),
    ],
)
def test_a_list_has_one_value_for_each_particle_or_gap(keys: dict[str, Any], wrong: dict[str, str]) -> None:
    assert {each.key: each.allowed for each in mistakes_in(case(**keys), no_mistakes)} == wrong


def test_a_key_says_what_it_must_be_beside_the_others() -> None:
    def wrong(**keys: Any) -> list[tuple[Any, ...]]:
        return [tuple(each) for each in mistakes_in(case(particles=3, **keys), no_mistakes)]

    assert wrong(pull=2, Ca_e=0) == wrong(pull=[0, 0, 0]) == []
    assert wrong(pull=2) == [("pull", 2, "must be 0: particles are soft")]
    assert wrong(rope=[2, 0.5], pull=2) == [("rope", 0.5, "must be taut")]
    assert [key for key, *_ in wrong(rope=[0.5], pull=2)] == ["rope"]
    assert [key for key, *_ in wrong(spring=[1], rope=0.5)] == ["spring"]


def test_what_a_question_asks_is_checked_too_and_the_number_of_particles_first() -> None:
    def check(each: Weighed) -> Iterator[Mistake]:
        if each.n != 3:
            yield Mistake("particles", each.n, "must be 3")
        yield Mistake("ends", each.ends, "must be others")

    assert [each.key for each in mistakes_in(case(pull=2), check)] == ["particles", "ends"]
    assert [each.key for each in mistakes_in(case(particles=3, pull=2), check)] == ["pull", "ends"]


def test_a_key_brings_into_the_model_what_messages_say_it_leaves_out() -> None:
    def said(model: type[Case], name: str) -> str:
        question = replace(QUESTIONS["run"], model=model)
        with pytest.raises(InputError) as error:
            parse_case(question, {"beta": 0.4, "Ca_e": 0.1, "d0": 0.1, "charge": 1, name: 1}, "case")
        return str(error.value)

    assert ", without inertia" in said(Case, "inertia")
    assert "allowed: beta" in said(Weighed, "gravity_angle")
    assert "a round tube, without inertia (" in said(Weighed, "inertia")


def test_values_are_spread_over_particles_and_gaps() -> None:
    three = case(particles=3, weight=2, spring=[1, 2])
    assert three.each("weight") == (2, 2, 2)
    assert three.each("spring") == (1, 2)
    assert case(particles=1).each("spring") == ()


def test_a_key_that_must_be_given_is_missed_where_there_are_particles() -> None:
    given = {"beta": 0.4, "Ca_e": 0.1, "d0": 0.1}
    assert [each.key for each in missing_numbers(Weighed, given, {})] == ["charge"]
    assert [each.key for each in missing_numbers(Weighed, {"particles": 0}, {})] == []
    assert [each.key for each in missing_numbers(Weighed, {"particles": 1}, {})] == ["beta", "Ca_e", "charge"]


def test_equal_values_in_a_list_are_one_value() -> None:
    assert identity_of(case(weight=[2, 2])) == identity_of(case(weight=2)) != identity_of(case(weight=[2, 3]))


def test_a_key_of_a_later_version_changes_no_hash_where_it_has_its_default() -> None:
    old = identity_of(Case.model_validate({"beta": 0.4, "Ca_e": 0.1, "d0": 0.1}))
    new = identity_of(case())
    assert new == old | {"charge": 1, "spring": 0, "thrust": 0, "options": {"size": 1}}
    assert identity_of(case(weight=[0, 0])) == new
    assert identity_of(case(options={"late": True}))["options"] == {"size": 1, "late": True}


def test_a_key_says_where_it_has_no_effect_and_makes_no_other_case() -> None:
    assert case(thrust=1).notes == []
    assert case(Ca_e=0, thrust=1).notes == ["thrust has no effect: rigid"]
    assert case(particles=0, beta=None, Ca_e=None, d0=None, weight=1).notes == [
        "weight, charge have no effect: there are no particles"
    ]
    assert identity_of(case(thrust=1)) != identity_of(case())
    assert identity_of(case(Ca_e=0, thrust=1)) == identity_of(case(Ca_e=0))


def test_an_atlas_compares_a_key_that_it_does_not_know() -> None:
    class Heavy(CurveCase):
        weight: Annotated[PerParticle[Number], WEIGHT] = Field(0.0, description="weight of each particle")
        patience: Annotated[Number, Key(part=Part.NUMERICS)] = Field(1.0, description="how long is waited")

    atlas = Atlas.load(SHIPPED[0])
    middle = {name: sum(atlas.box[name]) / 2 for name in PARAMETERS}
    theirs = case_of(atlas, Heavy, middle).model_dump(exclude_unset=True)

    def why(**keys: Any) -> list[str]:
        return beyond(Heavy.model_validate(theirs | keys), atlas)

    assert why() == why(weight=[0, 0]) == why(patience=2) == []
    assert why(weight=50) == ["weight is 50, but 0 in the atlas"]
    assert why(weight=[50, 0]) == ["weight is [50.0, 0.0], but 0 in the atlas"]
    assert why(length="auto", ends="developed") == []


def test_captions_axes_and_folders_have_what_a_key_declares() -> None:
    heavy, light = case(weight=2), case(weight=[0, 0])
    assert heavy.slug == "beta0.4-De0-Cae0.1-d0.1-W2"
    assert light.slug == case().slug == "beta0.4-De0-Cae0.1-d0.1"
    assert case(particles=0, beta=None, Ca_e=None, weight=2).slug == "pipe-De0"
    assert case_parts(ShownCase(heavy.resolved()))[2] == r"$W = 2\ \eta_0 U_{av} D_c$"
    assert len(case_parts(ShownCase(case().resolved()))) == len(case_parts(ShownCase(heavy.resolved()))) - 1
    assert parameter_label("weight") == r"$W$  [$\eta_0 U_{av} D_c$]"
    both = [ShownCase(each.resolved()) for each in (heavy, light)]
    assert common_parts(both, [])[-1] == "not the same: $W$"
    assert varying_keys([each.parameters for each in both]) == ["weight"]


@pytest.mark.parametrize("value", ["0.4057 Pa*s**0.6039", "0.4057 Pa.s^0.6039"])
def test_the_power_in_the_unit_of_a_consistency_is_drawn_by_tex(value: str) -> None:
    """Fonts lack the superscripts of which pint makes it."""
    assert equation("physical.consistency", value) == "$K$ = 0.4057 Pa⋅s$^{0.6039}$"
    assert equation("physical.consistency", "0.4 +- 0.1 Pa.s^0.6") == "$K$ = 0.4 ± 0.1 Pa⋅s$^{0.6}$"
    assert parameter_label("physical.consistency", "Pa⋅s⁰⋅⁶⁰³⁹") == "$K$  [Pa⋅s$^{0.6039}$]"


def test_an_older_case_does_not_differ_in_a_key_of_a_later_version() -> None:
    new = case().resolved()
    old = {key: value for key, value in new.items() if key != "weight"}
    assert varying_keys([Parameters(old), Parameters(new)]) == []
    assert varying_keys([Parameters(old), Parameters(new | {"weight": 1.0})]) == ["weight"]
    assert with_later_keys(old, Weighed) == new


def test_what_is_known_of_a_key_does_not_depend_on_what_was_imported() -> None:
    """In a process of its own, in which the questions are listed, and none is imported."""
    code = "import pairsim.questions.registry\nfrom pairsim.plots.labels import symbol, varying_keys\n"
    code += (
        "from pairsim.plots.parameters import Parameters\ncases = [Parameters({'d': i, 'fields': i}) for i in (1, 2)]\n"
    )
    code += "print(symbol('after'), varying_keys(cases))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "$T$ []\n"


def test_a_key_of_several_questions_is_written_alike() -> None:
    models = [question.model for question in QUESTIONS.values()]
    declared = {(name, key.symbol, key.unit) for model in models for name, key in keys_of(model).items()}
    assert len(declared) == len({name for name, _, _ in declared})


def test_a_key_keeps_its_declaration_in_a_class_that_replaces_its_field() -> None:
    class Again(Weighed):
        charge: PerParticle[Number] | None = Field(None, description="another charge")

    assert keys_of(Again)["charge"].required
    assert {"options", "options.size"} <= keys_of(Again).keys()
