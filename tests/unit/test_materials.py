"""The keys `liquid` and `solid`: blocks, keys of the case that say the same, quantities, and messages."""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

import pairsim
from pairsim.cli.app import app
from pairsim.commands import COMMANDS
from pairsim.config.case import Case
from pairsim.config.form_kinds import forms_of
from pairsim.config.identity import default_folder
from pairsim.inputs.case_files import parse_case, read_case
from pairsim.physics.liquids.giesekus import Giesekus
from pairsim.physics.liquids.power_law import PowerLaw
from pairsim.physics.solids.kelvin_voigt import KelvinVoigt
from pairsim.plots.labels import case_parts
from pairsim.runtime.errors import InputError

PAIR: dict[str, Any] = {"beta": 0.4, "Ca_e": 0.1, "d0": 0.1}
MODES = [
    {"law": "giesekus", "alpha": 0.1, "time": 1.0, "weight": 2.0},
    {"law": "fene-p", "L2": 100, "time": 0.1, "weight": 1.0},
]
BENCH = {"tube": "50 um", "flow_rate": "1 ul/min", "modulus": "5 kPa", "particle": "20 um", "distance": "5 um"}
RATE = 1e-9 / 60 * 4 / (3.141592653589793 * 50e-6**2) / 50e-6  # U_av/D_c [1/s]


def case(**keys: Any) -> Case:
    return parse_case(COMMANDS["run"], {**PAIR, **keys}, "test")


@pytest.mark.parametrize(
    ("block", "flat"),
    [
        ({"liquid": {"law": "giesekus", "alpha": 0.3}}, {"alpha": 0.3}),
        ({"liquid": {"law": "giesekus"}}, {}),
        ({"liquid": {"law": "fene-p", "L2": 50}}, {"liquid": "fene-p", "L2": 50}),
        ({"liquid": {"law": "fene-p"}, "L2": 50}, {"liquid": "fene-p", "L2": 50}),
        ({"liquid": {"law": "oldroyd-b", "solvent": "newtonian"}}, {"liquid": "oldroyd-b"}),
        ({"solid": "neo-hookean"}, {}),
        ({"solid": [{"law": "neo-hookean"}, "neo-hookean"]}, {}),
    ],
)
def test_a_block_is_the_same_case_as_keys_that_say_as_much(block: dict[str, Any], flat: dict[str, Any]) -> None:
    one, other = case(De=1, **block), case(De=1, **flat)
    assert default_folder("run", one) == default_folder("run", other)
    assert one.resolved() == other.resolved()
    assert one.liquid_model == other.liquid_model


def test_a_law_without_relaxation_time_needs_no_De() -> None:
    thin = case(liquid={"law": "power-law", "n": 0.6})
    assert thin.liquid_model.solvent == PowerLaw(n=0.6)
    assert not thin.liquid_model.modes
    assert thin.slug == "beta0.4-power-law-n0.6-Cae0.1-d0.1"
    assert default_folder("run", thin) != default_folder("run", case(liquid={"law": "power-law", "n": 0.5}))
    assert default_folder("run", case(liquid="newtonian")) == default_folder("run", case(De=0))


def test_modes_have_a_law_and_a_part_of_the_viscosity_each() -> None:
    liquid = case(De=2, liquid={"law": "modes", "modes": MODES, "solvent": {"law": "carreau", "n": 0.5, "Cu": 1}})
    model = liquid.liquid_model
    assert [(mode.name, mode.time) for mode in model.modes] == [("giesekus", 1.0), ("fene-p", 0.1)]
    assert [mode.weight for mode in model.modes] == pytest.approx([2 / 3, 1 / 3])
    assert model.modes[0].numbers == {"alpha": 0.1}
    assert forms_of(liquid)[0] == "giesekus+fene-p/carreau:moving"
    assert liquid.time.end == 12


def test_each_particle_may_have_a_solid_of_its_own() -> None:
    pair = case(De=0, Ca_e=[0.1, 0.2], solid=["neo-hookean", {"law": "kelvin-voigt", "eta": 3}])
    assert [solid and solid.name for solid in pair.solid_models] == ["neo-hookean", "kelvin-voigt"]
    assert pair.solid_models[1] == KelvinVoigt(0.2, eta=3)
    rigid = case(De=0, Ca_e=[0, 0.2], solid={"law": "kelvin-voigt", "eta": 3})
    assert rigid.solid_models == (None, KelvinVoigt(0.2, eta=3))
    assert case(De=0, solid={"law": "kelvin-voigt", "eta": 3}).time.end > case(De=0).time.end


WRONG: dict[str, tuple[dict[str, Any], str]] = {
    "no number": (
        {"liquid": {"law": "power-law", "n": "thin"}},
        "liquid.n: got 'thin'; must be a finite number at least 0.2 and at most 2",
    ),
    "out of range": ({"liquid": {"law": "carreau", "n": 7, "Cu": 1}}, "liquid.n: got 7; must be a finite number at"),
    "missing in a block": ({"liquid": {"law": "carreau", "n": 0.5}}, "liquid.Cu: is missing; must be given in liquid"),
    "a name alone": (
        {"liquid": "power-law"},
        "liquid.n: is missing; must be given with liquid: {law: power-law, n: ...}",
    ),
    "key of another law": (
        {"liquid": {"law": "power-law", "n": 0.5, "Cu": 1}},
        "liquid.Cu: got 1; unknown key; allowed: law, n",
    ),
    "no such law": ({"liquid": {"law": "bingham"}}, "liquid: got {law: 'bingham'}; must be carreau, fene-p"),
    "no law": ({"liquid": {"n": 0.5}}, "liquid: got {n: 0.5}; must be carreau, fene-p"),
    "no block": ({"liquid": 3}, "liquid: got 3; must be carreau, fene-p"),
    "given twice": (
        {"De": 1, "liquid": {"law": "giesekus", "alpha": 0.3}, "alpha": 0.3},
        "alpha: got 0.3; must be left",
    ),
    "De of a viscous liquid": (
        {"De": 1, "liquid": {"law": "power-law", "n": 0.5}},
        "liquid: got 'power-law'; must be a viscoelastic law at De > 0",
    ),
    "a solvent that stays alone": (
        {"De": 0, "liquid": {"law": "giesekus", "solvent": {"law": "power-law", "n": 0.5}}},
        "De: got 0; must be above 0 with a liquid.solvent",
    ),
    "in the solvent": (
        {"De": 1, "liquid": {"law": "giesekus", "solvent": {"law": "power-law", "n": 9}}},
        "liquid.solvent.n: got 9; must be a finite number",
    ),
    "in a mode": (
        {"De": 1, "liquid": {"law": "modes", "modes": [MODES[0], {**MODES[1], "L2": 1}]}},
        "liquid.modes[1].L2: got 1; must be a finite number above 3",
    ),
    "missing in a mode": (
        {"De": 1, "liquid": {"law": "modes", "modes": [{"law": "fene-p", "time": 1, "weight": 1}, MODES[0]]}},
        "liquid.modes[0].L2: is missing; must be given",
    ),
    "flat beside modes": (
        {"De": 1, "liquid": {"law": "modes", "modes": MODES}, "alpha": 0.3},
        "alpha: got 0.3; must be",
    ),
    "no modes": ({"De": 1, "liquid": {"law": "modes", "modes": []}}, "liquid.modes: got []; must be a list of 2 to 8"),
    "viscosity of a solid": (
        {"De": 0, "solid": {"law": "kelvin-voigt", "eta": -1}},
        "solid.eta: got -1; must be a finite number at least 0",
    ),
    "one solid too many": (
        {"De": 0, "solid": ["neo-hookean"] * 3},
        "must be a law or a list of 2, one for each of the particles",
    ),
    "in the list of solids": (
        {"De": 0, "solid": ["neo-hookean", {"law": "kelvin-voigt", "eta": "soft"}]},
        "solid[1].eta: got 'soft'; must be a finite number",
    ),
}


@pytest.mark.parametrize("name", WRONG)
def test_mistakes_name_the_key_the_value_and_what_is_allowed(name: str) -> None:
    keys, message = WRONG[name]
    with pytest.raises(InputError) as raised:
        case(**keys)
    assert message in str(raised.value)
    assert len(raised.value.mistakes) == 1, str(raised.value)


def test_a_consistency_gives_the_unit_of_viscosity() -> None:
    block = {"physical": {**BENCH, "consistency": "0.5 Pa.s^0.6"}, "liquid": {"law": "power-law", "n": 0.6}}
    thin = parse_case(COMMANDS["run"], block, "test")
    assert thin.scales is not None
    assert thin.scales.viscosity == pytest.approx(0.5 * RATE**-0.4)
    assert thin.Ca_e == pytest.approx(0.5 * RATE**0.6 / 5e3)
    for unit in ("0.5 Pa.s^0.7", "0.5 Pa.s"):
        with pytest.raises(InputError, match=r"physical.consistency: .* must be a consistency above 0"):
            parse_case(COMMANDS["run"], {**block, "physical": {**BENCH, "consistency": unit}}, "test")
    with pytest.raises(InputError, match=r"physical.consistency: is missing; must be given in physical"):
        parse_case(COMMANDS["run"], {**block, "physical": {**BENCH, "viscosity": "1 Pa.s"}}, "test")


def test_quantities_of_laws_become_their_numbers() -> None:
    block = {**BENCH, "viscosity": "2 Pa.s", "time_constant": "20 ms", "viscosity_inf": "20 mPa.s"}
    block |= {"particle_viscosity": "4 Pa.s"}
    keys = {"liquid": {"law": "carreau", "n": 0.5}, "solid": "kelvin-voigt"}
    thin = parse_case(COMMANDS["run"], {"physical": block, **keys}, "test")
    assert thin.liquid_model.solvent.numbers == pytest.approx({"n": 0.5, "Cu": 0.02 * RATE, "a": 2.0, "eta_inf": 0.01})
    assert thin.solid_models[0] == KelvinVoigt(pytest.approx(2 * RATE / 5e3), eta=2.0)
    again = parse_case(COMMANDS["run"], thin.resolved(), "test")
    assert again.resolved() == thin.resolved()
    with pytest.raises(InputError, match=r"physical.time_constant: .* must be left out: the laws of this case need no"):
        parse_case(COMMANDS["run"], {"physical": block, "liquid": "newtonian", "solid": "kelvin-voigt"}, "test")


def test_units_writes_a_case_of_any_law(tmp_path: Path) -> None:
    path = tmp_path / "case.yaml"
    words = "units --tube 50um --particle 20um --flow 1ul/min --modulus 5kPa --liquid power-law --n 0.6"
    given = [*words.split(), "--consistency", "0.5Pa.s^0.6", "--solid", "kelvin-voigt", "--particle-viscosity", "1Pa.s"]
    result = CliRunner().invoke(app, [*given, "-o", str(path)])
    assert result.exit_code == 0, result.output
    assert read_case(COMMANDS["run"], path).liquid_model.solvent == PowerLaw(n=0.6)
    refused = CliRunner().invoke(app, [*words.split()[:-4], "--viscosity", "1Pa.s", "--n", "0.6"])
    assert "--n: got 0.6; must be left out, or be given with" in str(refused.exception)
    refused = CliRunner().invoke(app, [*words.split(), "--viscosity", "1Pa.s"])
    assert "--consistency: is missing" in str(refused.exception)


def test_pictures_name_the_materials() -> None:
    thin = case(liquid={"law": "power-law", "n": 0.6}, solid={"law": "kelvin-voigt", "eta": 2})
    parts = case_parts(thin.resolved())
    assert parts[3:] == ["power law", "$n = 0.6$", "Kelvin-Voigt", r"$\eta_v/\eta_0 = 2$"]
    solvent = {"law": "carreau", "n": 0.5, "Cu": 1}
    many = case(De=1, liquid={"law": "modes", "modes": MODES, "solvent": solvent})
    assert case_parts(many.resolved())[4:] == ["2 modes: Giesekus + FENE-P in Carreau-Yasuda", r"$\xi = 0.09$"]
    assert case_parts(case(De=1).resolved())[3:] == [
        r"$\mathrm{De} = 1$", "Giesekus", r"$\xi = 0.09$", r"$\alpha = 0.2$",
    ]  # fmt: skip


def test_the_law_of_a_case_is_one_object() -> None:
    assert case(De=1, xi=0.2, alpha=0.3).liquid_model.modes == (Giesekus(alpha=0.3),)
    assert case(De=1, xi=0.2).liquid_model.xi == 0.2
    assert case(De=0).liquid_model.newtonian


def test_a_case_can_be_sent_to_another_process_and_is_a_key() -> None:
    sent = case(De=1, liquid={"law": "modes", "modes": MODES}, solid={"law": "kelvin-voigt", "eta": 1})
    received = pickle.loads(pickle.dumps(sent))
    assert received == sent
    assert hash(received) == hash(sent)


def test_a_solvent_has_its_own_viscosity_at_rest() -> None:
    """eta_inf is over that, not over eta_0: the stress of the solvent is xi eta(gamma)."""
    block = {**BENCH, "viscosity": "1 Pa.s", "solvent": "0.1 Pa.s", "relaxation": "2 ms", "viscosity_inf": "1 mPa.s"}
    liquid = {"law": "oldroyd-b", "solvent": {"law": "carreau", "n": 0.5, "Cu": 1}}
    model = parse_case(COMMANDS["run"], {"physical": block, "liquid": liquid}, "test").liquid_model
    assert (model.xi, model.solvent.numbers["eta_inf"]) == pytest.approx((0.1, 0.01))


def test_a_quantity_of_two_laws_is_ambiguous() -> None:
    block = {**BENCH, "viscosity": "1 Pa.s", "relaxation": "2 ms", "time_constant": "5 ms"}
    liquid = {"law": "white-metzner", "n": 0.5, "solvent": {"law": "carreau", "n": 0.5}}
    with pytest.raises(InputError, match=r"would stand for liquid.Cu and liquid.solvent.Cu, which are to be given"):
        parse_case(COMMANDS["run"], {"physical": block, "liquid": liquid}, "test")


def test_a_unit_that_depends_on_a_parameter_needs_it_first() -> None:
    thin = {"physical": {**BENCH, "consistency": "0.5 Pa.s^0.6"}, "liquid": {"law": "power-law"}}
    with pytest.raises(InputError, match=r"^test: liquid.n: is missing; [^\n]*$"):
        parse_case(COMMANDS["run"], thin, "test")
    with pytest.raises(InputError, match=r"must be a consistency above 0 with its unit, such as 0.5 Pa.s\^0.7"):
        parse_case(COMMANDS["run"], {**thin, "liquid": {"law": "power-law", "n": 0.7}}, "test")


def test_parameters_of_a_liquid_without_elasticity_are_kept_for_another_De() -> None:
    cold = case(De=0, liquid={"law": "fene-p", "L2": 50}).resolved()
    assert (cold["liquid"], cold["L2"]) == ("fene-p", 50)


def test_only_soft_particles_delay_a_run() -> None:
    solids = [{"law": "kelvin-voigt", "eta": 100}, "neo-hookean"]
    assert case(De=0, Ca_e=[0, 0.1], solid=solids).time.end == 2
    assert case(De=0, Ca_e=[0.1, 0], solid=solids).time.end == pytest.approx(92)


def test_settings_reach_into_the_group_of_a_law(tmp_path: Path) -> None:
    (tmp_path / "case.yaml").write_text("beta: 0.4\nCa_e: 0.1\nd0: 0.1\nliquid: power-law\n")
    assert read_case(COMMANDS["run"], tmp_path / "case.yaml", ("liquid.n=0.7",)).liquid_model.solvent == PowerLaw(n=0.7)
    thin = pairsim.load({**PAIR, "liquid": {"law": "carreau", "n": 0.5, "Cu": 2}}, liquid={"n": 0.6})
    assert thin.liquid_model.solvent.numbers == {"n": 0.6, "Cu": 2.0, "a": 2.0, "eta_inf": 0.0}
