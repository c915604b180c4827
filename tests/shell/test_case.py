"""Case files: defaults, lists, and the resolved case."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
import yaml
from support.inputs import CONFIGS, ROOT

from pairsim.cases.accuracy import SETTINGS
from pairsim.cases.curve_case import CurveCase
from pairsim.computing import QUESTIONS
from pairsim.computing.case_files import parse_case, read_case
from pairsim.runtime.errors import InputError

MINIMAL = {"beta": 0.4, "De": 0, "Ca_e": 0.1, "d0": 0.1}


def test_four_numbers_are_a_case() -> None:
    case = parse_case(QUESTIONS["run"], MINIMAL, "test")
    assert case.betas == (0.4, 0.4)
    assert case.Ca_es == (0.1, 0.1)
    assert case.gaps == (0.1,)
    assert case.tube_length == 20.0
    assert (case.xi, case.ends, case.mesh.Np) == (0.09, "periodic", 40)
    assert case.liquid_model.newtonian
    elastic = parse_case(QUESTIONS["run"], {**MINIMAL, "De": 1}, "test").liquid_model
    assert (elastic.structure, elastic.xi, elastic.modes[0].numbers) == ("giesekus", 0.09, {"alpha": 0.2})
    assert case.slug == "beta0.4-De0-Cae0.1-d0.1"


def test_lists_count_from_upstream() -> None:
    case = parse_case(
        QUESTIONS["run"],
        {**MINIMAL, "particles": 3, "beta": [0.2, 0.3, 0.4], "Ca_e": [0, 0.1, 0], "d0": [1, 2]},
        "test",
    )
    assert case.betas == (0.2, 0.3, 0.4)
    assert case.gaps == (1.0, 2.0)
    assert case.tube_length == 20.0


@pytest.mark.parametrize(
    ("De", "beta", "margin"),
    [(0, 0.2, 2), (0, 0.4, 2), (1, 0.2, 5), (1, 0.4, 3), (5, 0.4, 3), (2, 0.6, 3), (2, 0.1, 6)],
)
def test_auto_leaves_small_particles_in_elastic_liquids_more_tube(De: float, beta: float, margin: float) -> None:
    case = parse_case(
        QUESTIONS["run"], {**MINIMAL, "De": De, "beta": beta, "ends": "developed", "length": "auto"}, "test"
    )
    assert case.tube_length == pytest.approx(2 * beta + 0.1 + 2 * margin)


@pytest.mark.parametrize(
    ("keys", "end"),
    [
        ({}, 2.0),
        ({"De": 1.7}, 10.2),  # six relaxation times of the liquid
        ({"Ca_e": [0.1, 0.15]}, 3.0),  # about three of a soft pair with a small gap
        ({"De": 5, "time": {"end": 0.5}}, 0.5),
        ({"De": 5, "time": {"tol": 1e-3}}, 30.0),
        ({"particles": 0, "De": 0.5}, 3.0),
    ],
)
def test_end_of_a_run_follows_from_De_and_Ca_e_unless_it_is_given(keys: dict[str, Any], end: float) -> None:
    assert parse_case(QUESTIONS["run"], {**MINIMAL, **keys}, "test").time.end == end


def test_accuracy_sets_what_the_case_leaves_open() -> None:
    case = parse_case(QUESTIONS["run"], {**MINIMAL, "De": 1, "accuracy": "5%"}, "test")
    default = parse_case(QUESTIONS["run"], {**MINIMAL, "De": 1}, "test")
    fine = parse_case(QUESTIONS["run"], {**MINIMAL, "De": 1, "accuracy": "0.1%"}, "test")
    assert case.mesh.Np < default.mesh.Np < fine.mesh.Np
    assert case.mesh.max_size > default.mesh.max_size > fine.mesh.max_size
    assert case.time.tol > default.time.tol > fine.time.tol
    own = parse_case(
        QUESTIONS["run"],
        {**MINIMAL, "De": 1, "accuracy": "0.1%", "mesh": {"Np": 20, "growth": 0.2}, "time": {"end": 1}},
        "test",
    )
    assert (own.mesh.Np, own.mesh.growth, own.mesh.max_size) == (20, 0.2, fine.mesh.max_size)
    assert (own.time.end, own.time.tol) == (1.0, fine.time.tol)
    curves = [
        parse_case(QUESTIONS["curve"], {"beta": 0.4, "De": 0, "Ca_e": 0, "d": [1], "accuracy": a}, "test")
        for a in SETTINGS
    ]
    assert curves[0].tol > curves[1].tol > curves[2].tol


@pytest.mark.parametrize("beta", [0.05, 0.1, 0.2, 0.4, 0.8])
@pytest.mark.parametrize("liquid", [{"De": 0}, {"De": 1}, {"De": 1, "liquid": "oldroyd-b"}], ids=str)
def test_higher_accuracy_never_has_larger_cells(liquid: dict[str, object], beta: float) -> None:
    wanted = ("20%", "5%", "2%", "1%", "0.3%", "0.1%", "0.01%")
    cases = [parse_case(QUESTIONS["run"], {**MINIMAL, **liquid, "beta": beta, "accuracy": a}, "test") for a in wanted]
    for coarse, fine in pairwise(cases):
        assert coarse.mesh.max_size >= fine.mesh.max_size
        assert coarse.mesh.Np <= fine.mesh.Np
        assert coarse.time.tol > fine.time.tol
    assert cases[2].mesh.Np < cases[3].mesh.Np < cases[4].mesh.Np, "between levels the settings are, too"


def test_cells_that_are_given_are_held() -> None:
    def case(**keys: object) -> CurveCase:
        return parse_case(QUESTIONS["curve"], {"beta": 0.4, "De": 1, "Ca_e": 0.1, "d": [0.1], **keys}, "test")

    assert case(accuracy=" .50 %").accuracy == "0.5%"
    assert not case(accuracy="0.5%").held
    assert case(mesh={"Np": 21}).held == {"Np"}
    assert case(mesh={"max_size": 0.2, "growth": 0.2}).held == {"max_size"}
    assert not case(mesh={"Np": 21, "adapt": True}).held
    assert not parse_case(QUESTIONS["curve"], case(accuracy="0.5%").resolved(), "test").held, (
        "case.yaml is the same case"
    )
    run = parse_case(QUESTIONS["run"], {**MINIMAL, "dU_error": True}, "test")
    assert run.adapts
    assert not parse_case(QUESTIONS["run"], {**MINIMAL, "dU_error": True, "mesh": {"Np": 21}}, "test").adapts
    assert not parse_case(QUESTIONS["run"], MINIMAL, "test").adapts


def test_cells_around_small_particles_in_elastic_liquids_are_smaller() -> None:
    def largest(**keys: object) -> float:
        return parse_case(QUESTIONS["run"], {**MINIMAL, "De": 1, **keys}, "test").mesh.max_size

    assert largest(beta=0.1) < largest(beta=0.4) == largest(beta=0.6)
    assert largest(beta=[0.4, 0.1], Ca_e=[0.1, 0.1]) == largest(beta=0.1)
    assert largest(beta=0.1, De=0) == largest(De=0)


@pytest.mark.parametrize(
    "liquid",
    [
        {"liquid": "oldroyd-b"},
        {"liquid": {"law": "fene-p", "L2": 100}},
        {"liquid": {"law": "giesekus", "alpha": 0}},
        {"liquid": {"law": "ptt-exp", "epsilon": 0.02}},
    ],
    ids=str,
)
def test_liquids_that_harden_in_extension_have_more_cells_on_the_particles(liquid: dict[str, object]) -> None:
    """With the cells of the default liquid, errors of Oldroyd-B and FENE-P were 3 % of the peak at De 0.5."""
    giesekus = parse_case(QUESTIONS["run"], {**MINIMAL, "De": 0.5}, "test").mesh
    assert (giesekus.Np, giesekus.max_size) == (28, 0.05)
    assert parse_case(QUESTIONS["run"], {**MINIMAL, "De": 0.5, **liquid}, "test").mesh.Np > 2 * giesekus.Np


@pytest.mark.parametrize(
    "liquid", [{"liquid": {"law": "giesekus", "alpha": 0.2}}, {"liquid": {"law": "ptt-exp", "epsilon": 0.25}}], ids=str
)
def test_liquids_that_do_not_harden_keep_the_default_cells(liquid: dict[str, object]) -> None:
    giesekus = parse_case(QUESTIONS["run"], {**MINIMAL, "De": 0.5}, "test").mesh
    assert parse_case(QUESTIONS["run"], {**MINIMAL, "De": 0.5, **liquid}, "test").mesh == giesekus


def test_cells_lie_in_rows_away_from_the_particles() -> None:
    elastic, viscous = (parse_case(QUESTIONS["run"], {**MINIMAL, "De": De}, "test").mesh.rows for De in (1, 0))
    assert 0 < elastic < viscous
    assert parse_case(QUESTIONS["run"], {**MINIMAL, "De": 1, "mesh": {"rows": 0}}, "test").mesh.rows == 0


def test_a_pipe_needs_no_particles() -> None:
    assert parse_case(QUESTIONS["run"], {"particles": 0, "De": 0}, "test").betas == ()
    assert parse_case(QUESTIONS["run"], {"particles": 1, "De": 0, "beta": 0.4, "Ca_e": 0}, "test").gaps == ()


def test_numbers_without_a_point_are_numbers(tmp_path: Path) -> None:
    path = tmp_path / "case.yaml"
    path.write_text("beta: 4e-1\nDe: 0\nCa_e: 1e-3\nd0: 1E-1\n")
    assert read_case(QUESTIONS["run"], path).Ca_es == (1e-3, 1e-3)


@pytest.mark.parametrize("path", CONFIGS, ids=lambda p: p.stem)
def test_resolved_case_reads_back_as_itself(path: Path, tmp_path: Path) -> None:
    case = read_case(QUESTIONS["run"], path)
    again = tmp_path / "case.yaml"
    again.write_text(yaml.safe_dump(case.resolved()))
    assert read_case(QUESTIONS["run"], again).resolved() == case.resolved()


def test_index_of_the_examples_names_each() -> None:
    index = (ROOT / "configs" / "README.md").read_text()
    for path in (ROOT / "configs").glob("*.yaml"):
        assert f"| `{path.name}` |" in index


@pytest.mark.parametrize("name", ["curve", "critical"])
def test_resolved_cases_of_other_commands_too(name: str, tmp_path: Path) -> None:
    case = read_case(QUESTIONS[name], ROOT / "configs" / f"{name}.yaml")
    again = tmp_path / "case.yaml"
    again.write_text(yaml.safe_dump(case.resolved()))
    assert read_case(QUESTIONS[name], again).resolved() == case.resolved()


def test_liquids_do_not_share_a_folder() -> None:
    cases = [
        {"De": 1},
        {"De": 2},
        {"De": 1, "liquid": {"law": "giesekus", "alpha": 0}},
        {"De": 1, "liquid": "oldroyd-b"},
        {"De": 1, "liquid": {"law": "fene-p", "L2": 50}},
        {"De": 1, "liquid": {"law": "ptt-exp", "epsilon": 0.25}},
    ]
    slugs = {parse_case(QUESTIONS["run"], {**MINIMAL, **changes}, "test").slug for changes in cases}
    assert len(slugs) == len(cases)


def test_a_law_without_relaxation_time_is_newtonian_and_said_to_be() -> None:
    case = parse_case(QUESTIONS["run"], {**MINIMAL, "liquid": "giesekus", "xi": 0.5}, "test")
    assert case.liquid_model.newtonian
    assert case.notes == ["liquid: giesekus, xi have no effect: the liquid is Newtonian at De = 0"]


def test_an_estimate_says_that_the_mesh_of_a_run_is_adapted() -> None:
    run = parse_case(QUESTIONS["run"], {**MINIMAL, "dU_error": True}, "test")
    assert str(QUESTIONS["run"].estimate(run)).endswith("what the run needs is known after a coarse one")


def test_a_huge_softness_is_the_only_mistake_that_is_told_of() -> None:
    """The end of a run follows from Ca_e, and must not be out of range with it."""
    with pytest.raises(InputError) as caught:
        parse_case(QUESTIONS["run"], {"beta": 0.4, "De": 0, "Ca_e": 1e16, "d0": 0.1}, "test")
    assert "Ca_e" in str(caught.value)
    assert "time.end" not in str(caught.value)
