"""Cases: what four numbers leave to defaults, liquids and solids, accuracy, keys without effect, and case.yaml."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
import yaml
from support.inputs import CONFIGS, ROOT

import pairsim
from pairsim.cases.accuracy import SETTINGS
from pairsim.cases.identity import default_folder, identity_of
from pairsim.cases.run_case import Case
from pairsim.computing.case_files import parse_case, read_case
from pairsim.physics.liquids.giesekus import Giesekus
from pairsim.physics.liquids.power_law import PowerLaw
from pairsim.physics.solids.kelvin_voigt import KelvinVoigt
from pairsim.plots.labels import case_parts
from pairsim.plots.parameters import ShownCase
from pairsim.questions.curve import CurveCase
from pairsim.questions.registry import QUESTIONS

PAIR: dict[str, Any] = {"beta": 0.4, "Ca_e": 0.1, "d0": 0.1}
MODES = [
    {"law": "giesekus", "alpha": 0.1, "time": 1.0, "weight": 2.0},
    {"law": "fene-p", "L2": 100, "time": 0.1, "weight": 1.0},
]


def case(**keys: Any) -> Case:
    return parse_case(QUESTIONS["run"], PAIR | keys, "test")


def curve(**keys: Any) -> CurveCase:
    return parse_case(QUESTIONS["curve"], {"beta": 0.4, "De": 0, "Ca_e": 0.1, "d": [0.1]} | keys, "test")


def test_four_numbers_are_a_case() -> None:
    plain = case(De=0)
    assert (plain.betas, plain.Ca_es, plain.gaps) == ((0.4, 0.4), (0.1, 0.1), (0.1,))
    assert (plain.tube_length, plain.xi, plain.ends, plain.mesh.Np) == (pytest.approx(4.9), 0.09, "developed", 40)
    assert plain.liquid_model.newtonian
    elastic = case(De=1).liquid_model
    assert (elastic.structure, elastic.xi, elastic.modes[0].numbers) == ("giesekus", 0.09, {"alpha": 0.2})
    assert plain.slug == "beta0.4-De0-Cae0.1-d0.1"


def test_lists_count_from_upstream() -> None:
    three = case(particles=3, beta=[0.2, 0.3, 0.4], Ca_e=[0, 0.1, 0], d0=[1, 2])
    assert (three.betas, three.gaps, three.cluster) == ((0.2, 0.3, 0.4), (1.0, 2.0), pytest.approx(3.9))


def test_fewer_particles_need_fewer_keys() -> None:
    assert parse_case(QUESTIONS["run"], {"particles": 0, "De": 0}, "test").betas == ()
    assert parse_case(QUESTIONS["run"], {"particles": 1, "De": 0, "beta": 0.4, "Ca_e": 0}, "test").gaps == ()


@pytest.mark.parametrize(
    ("De", "beta", "margin"),
    [(0, 0.2, 2), (0, 0.4, 2), (1, 0.2, 5), (1, 0.4, 3), (5, 0.4, 3), (2, 0.6, 3), (2, 0.1, 6)],
)
def test_auto_leaves_small_particles_in_elastic_liquids_more_tube(De: float, beta: float, margin: float) -> None:
    found = case(De=De, beta=beta)
    assert found.tube_length == pytest.approx(2 * beta + 0.1 + 2 * margin)


@pytest.mark.parametrize(
    ("De", "velocity", "flow", "margin"),
    [(1, 1, 0, 7), (0.2, 1, 0, 3), (0, 1, 0, 2), (1, 1, 1, 3), (2, 0, 1, 14), (50, 1, 0, 60)],
)
def test_auto_leaves_the_wake_of_a_moved_particle_in_the_tube(
    De: float, velocity: float, flow: float, margin: float
) -> None:
    moved = {"particles": 1, "beta": 0.4, "De": De, "Ca_e": 0, "velocity": velocity, "flow": flow}
    assert parse_case(QUESTIONS["curve"], moved, "test").tube_length == pytest.approx(0.4 + 2 * margin)


def test_what_is_usual_may_be_said_and_is_the_same_case() -> None:
    plain = identity_of(case())
    for same in ({"ends": "developed"}, {"length": "auto"}, {"ends": "developed", "length": "auto"}, {"length": None}):
        assert identity_of(case(**same)) == plain
    assert (plain["ends"], plain["length"]) == ("developed", "auto")


def test_a_periodic_tube_is_as_long_as_that_of_the_study() -> None:
    assert case(ends="periodic").tube_length == 20.0
    assert case(particles=3, beta=[0.2, 0.3, 0.4], d0=1, ends="periodic").tube_length == 20.0
    assert parse_case(QUESTIONS["run"], {"particles": 0, "ends": "periodic"}, "test").tube_length == 10.0
    assert case(length=12).tube_length == case(length=12, ends="periodic").tube_length == 12.0


@pytest.mark.parametrize(
    ("keys", "end"),
    [
        ({}, 2.0),
        ({"De": 1.7}, 10.2),  # six relaxation times of the liquid
        ({"Ca_e": [0.1, 0.15]}, 3.0),  # about three of a soft pair with a small gap
        ({"De": 5, "time": {"end": 0.5}}, 0.5),
        ({"De": 5, "time": {"tol": 1e-3}}, 30.0),
        ({"particles": 0, "De": 0.5}, 3.0),
        ({"solid": [{"law": "kelvin-voigt", "eta": 100}, "neo-hookean"], "Ca_e": [0, 0.1]}, 2.0),
        ({"solid": [{"law": "kelvin-voigt", "eta": 100}, "neo-hookean"], "Ca_e": [0.1, 0]}, 92.0),
    ],
)
def test_end_of_a_run_follows_from_the_times_of_liquid_and_soft_particles(keys: dict[str, Any], end: float) -> None:
    assert case(**keys).time.end == pytest.approx(end)


def test_accuracy_sets_what_the_case_leaves_open() -> None:
    fine = case(De=1, accuracy="0.1%")
    own = case(De=1, accuracy="0.1%", mesh={"Np": 20, "growth": 0.2}, time={"end": 1})
    assert (own.mesh.Np, own.mesh.growth, own.mesh.max_size) == (20, 0.2, fine.mesh.max_size)
    assert (own.time.end, own.time.tol) == (1.0, fine.time.tol)
    tolerances = [curve(accuracy=each).tol for each in SETTINGS]
    assert tolerances == sorted(tolerances, reverse=True)


@pytest.mark.parametrize("beta", [0.05, 0.2, 0.8])
@pytest.mark.parametrize("liquid", [{"De": 0}, {"De": 1}, {"De": 1, "liquid": "oldroyd-b"}], ids=str)
def test_higher_accuracy_never_has_larger_cells(liquid: dict[str, object], beta: float) -> None:
    wanted = ("20%", "5%", "2%", "1%", "0.3%", "0.1%", "0.01%")
    cases = [case(**liquid, beta=beta, accuracy=each) for each in wanted]
    for coarse, fine in pairwise(cases):
        assert coarse.mesh.max_size >= fine.mesh.max_size
        assert coarse.mesh.Np <= fine.mesh.Np
        assert coarse.time.tol > fine.time.tol
    assert cases[2].mesh.Np < cases[3].mesh.Np < cases[4].mesh.Np, "between levels the settings are, too"


def test_cells_that_are_given_are_held() -> None:
    assert curve(De=1, accuracy=" .50 %").accuracy == "0.5%"
    assert not curve(De=1, accuracy="0.5%").fixed_cells
    assert curve(De=1, mesh={"Np": 21}).fixed_cells == {"Np"}
    assert curve(De=1, mesh={"max_size": 0.2, "growth": 0.2}).fixed_cells == {"max_size"}
    assert not curve(De=1, mesh={"Np": 21, "adapt": True}).fixed_cells
    resolved = curve(De=1, accuracy="0.5%").resolved()
    assert not parse_case(QUESTIONS["curve"], resolved, "test").fixed_cells, "case.yaml is the same case"
    assert case(dU_error=True).adapts
    assert not case(dU_error=True, mesh={"Np": 21}).adapts
    assert not case().adapts
    assert str(QUESTIONS["run"].estimate(case(dU_error=True))).endswith("is known after a coarse run")


def test_cells_around_small_particles_in_elastic_liquids_are_smaller() -> None:
    def largest(**keys: object) -> float:
        return case(**{"De": 1, **keys}).mesh.max_size

    assert largest(beta=0.1) < largest(beta=0.4) == largest(beta=0.6)
    assert largest(beta=[0.4, 0.1], Ca_e=[0.1, 0.1]) == largest(beta=0.1)
    assert largest(beta=0.1, De=0) == largest(De=0)


HARDENING = ["oldroyd-b", {"law": "fene-p", "L2": 100}, {"law": "giesekus", "alpha": 0}]
HARDENING += [{"law": "ptt-exp", "epsilon": 0.02}]


def test_liquids_that_harden_in_extension_have_more_cells_on_the_particles() -> None:
    """With the cells of the default liquid, errors of Oldroyd-B and FENE-P were 3 % of the peak at De 0.5."""
    default = case(De=0.5).mesh
    assert (default.Np, default.max_size) == (28, 0.05)
    assert all(case(De=0.5, liquid=liquid).mesh.Np > 2 * default.Np for liquid in HARDENING)
    assert case(De=0.5, liquid={"law": "ptt-exp", "epsilon": 0.25}).mesh == default


def test_cells_lie_in_rows_away_from_the_particles() -> None:
    assert 0 < case(De=1).mesh.rows < case(De=0).mesh.rows
    assert case(De=1, mesh={"rows": 0}).mesh.rows == 0


@pytest.mark.parametrize(
    ("block", "short"),
    [
        ({"liquid": {"law": "giesekus", "alpha": 0.2}}, {}),
        ({"liquid": "giesekus"}, {}),
        ({"liquid": {"law": "oldroyd-b", "solvent": "newtonian"}}, {"liquid": "oldroyd-b"}),
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


def test_pictures_name_the_materials() -> None:
    thin = case(liquid={"law": "power-law", "n": 0.6}, solid={"law": "kelvin-voigt", "eta": 2})
    assert case_parts(ShownCase(thin.resolved()))[3:] == [
        "power law",
        "$n = 0.6$",
        "Kelvin-Voigt",
        r"$\eta_v/\eta_0 = 2$",
    ]
    solvent = {"law": "carreau", "n": 0.5, "Cu": 1}
    many = case(De=1, liquid={"law": "modes", "modes": MODES, "solvent": solvent})
    assert case_parts(ShownCase(many.resolved()))[4:] == [
        "2 modes: Giesekus + FENE-P in Carreau-Yasuda",
        r"$\xi = 0.09$",
    ]


@pytest.mark.parametrize("liquid", ["", "liquid: giesekus\n", "liquid: {law: giesekus, alpha: 0.1}\n"])
def test_a_setting_reaches_into_the_group_of_a_law(liquid: str, tmp_path: Path) -> None:
    path = tmp_path / "case.yaml"
    path.write_text(f"beta: 0.4\nCa_e: 0.1\nd0: 0.1\nDe: 1\n{liquid}")
    set_by_hand = read_case(QUESTIONS["run"], path, ("liquid.alpha=0.3",))
    assert set_by_hand.liquid_model.modes == (Giesekus(alpha=0.3),)
    assert pairsim.load(path, liquid={"alpha": 0.3}) == set_by_hand


@pytest.mark.parametrize(
    "path", [*CONFIGS, *(ROOT / "configs" / f"{name}.yaml" for name in ("curve", "critical", "train"))]
)
def test_resolved_case_reads_back_as_itself(path: Path, tmp_path: Path) -> None:
    question = QUESTIONS[path.stem if path not in CONFIGS else "run"]
    resolved = read_case(question, path)
    (tmp_path / "case.yaml").write_text(yaml.safe_dump(resolved.resolved()))
    again = read_case(question, tmp_path / "case.yaml")
    assert again.resolved() == resolved.resolved()
    assert again.notes == []


def test_parameters_of_a_liquid_without_elasticity_are_kept_for_another_De() -> None:
    assert case(De=0, liquid={"law": "fene-p", "L2": 50}).resolved()["liquid"] == {"law": "fene-p", "L2": 50}


def test_index_of_the_examples_names_each() -> None:
    index = (ROOT / "configs" / "README.md").read_text()
    assert all(f"| `{path.name}` |" in index for path in (ROOT / "configs").glob("*.yaml"))


def test_liquids_do_not_share_a_folder() -> None:
    laws = ["giesekus", *HARDENING, {"law": "ptt-exp", "epsilon": 0.25}]
    slugs = {case(De=De, liquid=law).slug for De in (1, 2) for law in laws}
    assert len(slugs) == 2 * len(laws)


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
        ({"particles": 1, "dU_error": True}, ["d0, dU_error have no effect: there is only one particle"]),
        (
            {"particles": 0, "limits": {"max_gap": 1, "min_gap": 0.002}},
            ["beta, Ca_e, d0, limits.max_gap have no effect: there are no particles"],
        ),
    ],
)
def test_keys_without_effect_are_named(changes: Mapping[str, object], notes: list[str]) -> None:
    assert case(**{"De": 0, **changes}).notes == notes
    assert curve(xi=0.1).notes == ["xi has no effect: the liquid is Newtonian at De = 0"]


def test_defaults_of_a_case_follow_changes_of_it() -> None:
    case = pairsim.load({**PAIR, "De": 0.5})
    assert pairsim.load(case, accuracy="5%") == pairsim.load({**PAIR, "De": 0.5, "accuracy": "5%"})
    fixed = pairsim.load(case, mesh={"Np": 30})
    assert (fixed.mesh.Np, fixed.mesh.max_size, fixed.mesh.adapt) == (30, case.mesh.max_size, False)
