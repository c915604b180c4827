"""Meshes that follow from the error wanted: it is kept, the estimate holds, and what could not be kept is known."""

from __future__ import annotations

from dataclasses import replace

import pytest

from pairsim.commands import COMMANDS
from pairsim.drivers.adaptive import LineOfScales
from pairsim.drivers.problems import steady_problem
from pairsim.fem.meshes.size_field import AdaptedSizes
from pairsim.inputs.case_files import parse_case
from pairsim.physics.solids import soft
from pairsim.solvers.curves import adaptation
from pairsim.solvers.curves.adaptation import ROUNDS, AdaptiveBranch, Scale, reference_scale
from pairsim.solvers.parameters import Parameters

TUBE = {"beta": 0.4, "d": [0.4], "ends": "developed", "length": "auto"}


def adaptive(allowed: float, **keys: object) -> tuple[AdaptiveBranch, Parameters]:
    case = parse_case(COMMANDS["curve"], TUBE | keys, "test")
    first = Parameters(case.places[0], case.solid_models, case.liquid_model)
    problem = steady_problem(case, first.gaps[0])
    return AdaptiveBranch(problem, first, case.mesh_error, allowed=lambda _: allowed), first


@pytest.mark.slow
def test_a_newtonian_error_is_kept_by_smaller_cells() -> None:
    truth, allowed = 6.785e-3, 4e-5  # 0.6 %; N_p 40 (docs/explanation/error-estimate.md)
    branch, first = adaptive(allowed, De=0, Ca_e=0.1, d=[0.1], mesh={"Np": 12})
    coarse = branch.snapshots
    point = branch.at(first)
    assert point.estimate.dU_error[0] <= allowed
    assert abs(point.held_dUs[0] - truth) <= point.estimate.dU_error[0]
    assert 1 <= max(branch.rounds.values()) <= ROUNDS
    assert branch.unknowns[(0.1,)] == branch.fine.constraints.size
    branch.at(replace(first, gaps=(0.12,)))
    branch.recall(coarse)  # on cells that are no more
    assert branch.fine.parameters == first
    assert branch.fine.constraints.size > len(coarse[0].y)
    branch.close()


@pytest.mark.slow
def test_a_viscoelastic_error_is_kept_by_smaller_cells_where_they_count() -> None:
    """De 2, rigid: dU is known to .05 % (docs/explanation/decisions.md); equal cells of 27,000 unknowns leave .4 %."""
    truth, allowed = 3.107e-3, 0.01 * 2.8e-3
    branch, first = adaptive(allowed, De=2, Ca_e=0, accuracy="1.01%")
    point = branch.at(first)
    assert point.estimate.dU_error[0] <= allowed
    assert abs(point.held_dUs[0] - truth) <= point.estimate.dU_error[0]
    assert branch.fine.constraints.size < 24_000
    assert isinstance(branch.problem.mesh.sizes, AdaptedSizes)
    other = branch.at(replace(first, gaps=(0.3,)))  # of another nominal distance: the cells move with the particles
    assert other.dU_errors[0] <= allowed
    branch.close()


@pytest.mark.slow
def test_all_cells_become_smaller_where_the_signed_part_of_the_error_prevails() -> None:
    """De .5: where the scatter comes from says nothing of that part, which falls fast with the size of all cells."""
    truth, allowed = -3.8815e-4, 1.1e-5  # docs/explanation/decisions.md
    branch, first = adaptive(allowed, De=0.5, Ca_e=0.1, d=[0.2], accuracy="1.01%")
    point = branch.at(first)
    assert max(branch.rounds.values()) == 1
    assert branch.problem.mesh.sizes is None
    assert abs(point.held_dUs[0] - truth) <= point.estimate.dU_error[0] <= allowed
    branch.close()


def test_what_cannot_be_kept_ends_with_the_error_reached(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(adaptation, "ROUNDS", 1)
    branch, first = adaptive(1e-9, De=0, Ca_e=0.1, d=[0.1], mesh={"Np": 6})
    before = branch.fine.constraints.size
    point = branch.at(first)
    assert point.dU_errors[0] > 1e-9
    assert branch.fine.constraints.size > 2 * before
    branch.close()


@pytest.mark.slow
def test_the_scale_of_a_single_point_is_that_of_the_curve_it_lies_on() -> None:
    case = parse_case(COMMANDS["curve"], TUBE | {"De": 0, "Ca_e": 0.02, "d": [0.8]}, "test")
    first = Parameters(case.places[0], case.solid_models, case.liquid_model)
    scale, scout = reference_scale(steady_problem(case, 0.8), first, case.places)
    assert scale.at == ((0.8,), (0.4,), (0.2,), (0.1,))
    assert scout.parameters == first
    scout.close()
    assert scale.dU == pytest.approx(1.103e-3, rel=0.05), "that of N_p 40, at d = .1"


@pytest.mark.slow
def test_a_zero_is_improved_where_it_is() -> None:
    keys = {"beta": 0.2, "De": 0, "Ca_e": 0.1, "d": [0.1], "mesh": {"Np": 16}}
    case = parse_case(COMMANDS["curve"], TUBE | keys, "test")
    first, most = Parameters(case.places[0], case.solid_models, case.liquid_model), [1.0]
    problem = steady_problem(case, 0.05)
    branch = AdaptiveBranch(problem, first, False, allowed=lambda _: most[0], zeros_only=True)
    rough = branch.zero(0.045, 0.08, 0.055)
    assert branch.improved(rough) is rough
    most[0] = rough.dU_errors[0] / 3
    better = branch.improved(rough)
    assert max(branch.rounds.values()) >= 1
    assert better.dU_errors[0] < most[0]
    assert abs(better.dU) < 1e-11
    assert better.d == pytest.approx(0.05542, rel=0.01), "accuracy: 0.7%"
    branch.close()


def test_the_scale_between_two_parameters_is_a_power_law() -> None:
    a, b = (Parameters((0.1,), soft(Ca_e, Ca_e)) for Ca_e in (0.01, 0.1))
    line = LineOfScales(((a, Scale(1e-4, ((0.1,),))), (b, Scale(1e-3, ((0.1,),)))))
    assert line.at(a) == pytest.approx(1e-4)
    assert line.at(replace(a.with_Ca_e(0.03), gaps=(0.5,))) == pytest.approx(3e-4)
    assert LineOfScales(line.ends[:1]).at(b) == 1e-4
