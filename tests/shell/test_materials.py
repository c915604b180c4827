"""The keys `liquid` and `solid`: blocks, quantities, and messages."""

from __future__ import annotations

import pickle
import re
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

import pairsim
from pairsim.cases.case import Case
from pairsim.cases.identity import default_folder
from pairsim.cli.app import app
from pairsim.computing import QUESTIONS
from pairsim.computing.case_files import parse_case, read_case
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
    return parse_case(QUESTIONS["run"], {**PAIR, **keys}, "test")


@pytest.mark.parametrize(
    ("block", "short"),
    [
        ({"liquid": {"law": "giesekus", "alpha": 0.2}}, {}),
        ({"liquid": {"law": "giesekus"}}, {}),
        ({"liquid": "giesekus"}, {}),
        ({"liquid": {"law": "oldroyd-b", "solvent": "newtonian"}}, {"liquid": "oldroyd-b"}),
        ({"solid": "neo-hookean"}, {}),
        ({"solid": [{"law": "neo-hookean"}, "neo-hookean"]}, {}),
    ],
)
def test_a_block_is_the_same_case_as_a_shorter_one(block: dict[str, Any], short: dict[str, Any]) -> None:
    one, other = case(De=1, **block), case(De=1, **short)
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
    assert model.structure == "giesekus+fene-p/carreau"
    assert liquid.time.end == 12


def test_each_particle_may_have_a_solid_of_its_own() -> None:
    pair = case(De=0, Ca_e=[0.1, 0.2], solid=["neo-hookean", {"law": "kelvin-voigt", "eta": 3}])
    assert [solid and solid.name for solid in pair.solid_models] == ["neo-hookean", "kelvin-voigt"]
    assert pair.solid_models[1] == KelvinVoigt(0.2, eta=3)
    rigid = case(De=0, Ca_e=[0, 0.2], solid={"law": "kelvin-voigt", "eta": 3})
    assert rigid.solid_models == (None, KelvinVoigt(0.2, eta=3))
    assert case(De=0, solid={"law": "kelvin-voigt", "eta": 3}).time.end > case(De=0).time.end


def test_a_consistency_gives_the_unit_of_viscosity() -> None:
    block = {"physical": {**BENCH, "consistency": "0.5 Pa.s^0.6"}, "liquid": {"law": "power-law", "n": 0.6}}
    thin = parse_case(QUESTIONS["run"], block, "test")
    assert thin.scales is not None
    assert thin.scales.viscosity == pytest.approx(0.5 * RATE**-0.4)
    assert thin.Ca_e == pytest.approx(0.5 * RATE**0.6 / 5e3)


def test_quantities_of_laws_become_their_numbers() -> None:
    block = {**BENCH, "viscosity": "2 Pa.s", "time_constant": "20 ms", "viscosity_inf": "20 mPa.s"}
    block |= {"particle_viscosity": "4 Pa.s"}
    keys = {"liquid": {"law": "carreau", "n": 0.5}, "solid": "kelvin-voigt"}
    thin = parse_case(QUESTIONS["run"], {"physical": block, **keys}, "test")
    assert thin.liquid_model.solvent.numbers == pytest.approx({"n": 0.5, "Cu": 0.02 * RATE, "a": 2.0, "eta_inf": 0.01})
    assert thin.solid_models[0] == KelvinVoigt(pytest.approx(2 * RATE / 5e3), eta=2.0)
    again = parse_case(QUESTIONS["run"], thin.resolved(), "test")
    assert again.resolved() == thin.resolved()


def test_units_writes_a_case_of_any_law(tmp_path: Path) -> None:
    path = tmp_path / "case.yaml"
    words = "units --tube 50um --particle 20um --flow 1ul/min --modulus 5kPa --liquid power-law --n 0.6"
    given = [*words.split(), "--consistency", "0.5Pa.s^0.6", "--solid", "kelvin-voigt", "--particle-viscosity", "1Pa.s"]
    result = CliRunner().invoke(app, [*given, "-o", str(path)])
    assert result.exit_code == 0, result.output
    assert read_case(QUESTIONS["run"], path).liquid_model.solvent == PowerLaw(n=0.6)


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
    assert case(De=1, xi=0.2, liquid={"law": "giesekus", "alpha": 0.3}).liquid_model.modes == (Giesekus(alpha=0.3),)
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
    model = parse_case(QUESTIONS["run"], {"physical": block, "liquid": liquid}, "test").liquid_model
    assert (model.xi, model.solvent.numbers["eta_inf"]) == pytest.approx((0.1, 0.01))


def test_a_unit_that_depends_on_a_parameter_needs_it_first() -> None:
    thin = {"physical": {**BENCH, "consistency": "0.5 Pa.s^0.6"}, "liquid": {"law": "power-law"}}
    with pytest.raises(InputError, match=r"^test: liquid.n: is missing; [^\n]*$"):
        parse_case(QUESTIONS["run"], thin, "test")
    with pytest.raises(InputError, match=r"must be a consistency above 0 with its unit, such as 0.5 Pa.s\^0.7"):
        parse_case(QUESTIONS["run"], {**thin, "liquid": {"law": "power-law", "n": 0.7}}, "test")


def test_parameters_of_a_liquid_without_elasticity_are_kept_for_another_De() -> None:
    cold = case(De=0, liquid={"law": "fene-p", "L2": 50}).resolved()
    assert cold["liquid"] == {"law": "fene-p", "L2": 50}


def test_only_soft_particles_delay_a_run() -> None:
    solids = [{"law": "kelvin-voigt", "eta": 100}, "neo-hookean"]
    assert case(De=0, Ca_e=[0, 0.1], solid=solids).time.end == 2
    assert case(De=0, Ca_e=[0.1, 0], solid=solids).time.end == pytest.approx(92)


def test_settings_reach_into_the_group_of_a_law(tmp_path: Path) -> None:
    (tmp_path / "case.yaml").write_text("beta: 0.4\nCa_e: 0.1\nd0: 0.1\nliquid: power-law\n")
    case = read_case(QUESTIONS["run"], tmp_path / "case.yaml", ("liquid.n=0.7",))
    assert case.liquid_model.solvent == PowerLaw(n=0.7)
    thin = pairsim.load({**PAIR, "liquid": {"law": "carreau", "n": 0.5, "Cu": 2}}, liquid={"n": 0.6})
    assert thin.liquid_model.solvent.numbers == {"n": 0.6, "Cu": 2.0, "a": 2.0, "eta_inf": 0.0}


@pytest.mark.parametrize("liquid", ["", "liquid: giesekus\n", "liquid: {law: giesekus, alpha: 0.1}\n"])
def test_a_setting_of_a_parameter_needs_no_block(liquid: str, tmp_path: Path) -> None:
    path = tmp_path / "case.yaml"
    path.write_text(f"beta: 0.4\nCa_e: 0.1\nd0: 0.1\nDe: 1\n{liquid}")
    set_by_hand = read_case(QUESTIONS["run"], path, ("liquid.alpha=0.3",))
    assert set_by_hand.liquid_model.modes == (Giesekus(alpha=0.3),)
    assert pairsim.load(path, liquid={"alpha": 0.3}) == set_by_hand


def test_a_parameter_beside_its_law_is_a_mistake_that_shows_the_block() -> None:
    for keys, block in [
        ({"alpha": 0.1}, "liquid: {law: giesekus, alpha: 0.1}"),
        ({"liquid": "ptt-exp", "epsilon": 0.1}, "liquid: {law: ptt-exp, epsilon: 0.1}"),
        ({"solid": "kelvin-voigt", "eta": 2}, "solid: {law: kelvin-voigt, eta: 2}"),
    ]:
        with pytest.raises(InputError, match=re.escape(f"unknown key; it is a parameter of the law: write {block}")):
            case(De=1, **keys)
