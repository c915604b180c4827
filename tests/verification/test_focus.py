"""Particles displaced from the axis: exact zeros, drag, limits of small particles, and inertia in a duct."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import pytest
from studies.focus.scenes import disturbed, disturbed_scene, resistance, scene

from pairsim.fem.azimuthal import motion
from pairsim.fem.azimuthal.elimination import elimination_order, node_of_unknowns
from pairsim.fem.azimuthal.scene import DisturbedScene
from pairsim.laws import Field, StructuredLaw, operations
from pairsim.physics.conformation import exponential
from pairsim.physics.liquids import NEWTONIAN, Liquid
from pairsim.physics.liquids.giesekus import Giesekus
from pairsim.physics.liquids.liquid import single
from pairsim.physics.liquids.oldroyd_b import OldroydB
from pairsim.physics.solids import soft
from pairsim.physics.solids.kelvin_voigt import KelvinVoigt
from pairsim.physics.solids.solid import Solid
from pairsim.solvers.focus.errors import half_widths
from pairsim.solvers.focus.inertia import by_inertia, stable_up_to
from pairsim.solvers.focus.modes import slowest_modes
from pairsim.solvers.focus.rates import DIVERGED, MOST_ITERATIONS, Displacement, disturb, scene_at


@dataclass(frozen=True)
class Thixotropic(StructuredLaw):
    """Dl/Dt = 1 - l - gamma l with the viscosity (1 + l)/2."""

    label = "thixotropic"
    transported: ClassVar[tuple[Field, ...]] = (Field("lambda", 2, transported=True, rest=1.0),)

    def viscosity_at(self, gamma2: Any, *state: Any) -> Any:
        return (1 + state[0]) / 2

    def rates(self, gamma2: Any, *state: Any) -> tuple[Any, ...]:
        return (1 - state[0] - operations.sqrt(gamma2) * state[0],)

    def in_steady_shear(self, gamma2: Any) -> tuple[Any, ...]:
        return (1 / (1 + operations.sqrt(gamma2)),)

    @property
    def memory(self) -> Any:
        return 1.0


# Not in its class, by which laws are found: this is no law of a user.
Thixotropic.name = "thixotropic"
RIGID = (None,)
THIXOTROPIC = single(Thixotropic())
GIESEKUS = single(Giesekus(alpha=0.2), De=0.3)


class TestExactZeros:
    def test_a_rigid_sphere_in_a_newtonian_liquid_stays_where_it_is(self) -> None:
        assert abs(disturbed((0.4,), RIGID).rates[0, 0]) < 1e-8

    @pytest.mark.parametrize(("betas", "gaps"), [((0.4, 0.4), (0.1,)), ((0.3, 0.4, 0.3), (0.2, 0.2))])
    def test_rigid_rows_that_mirror_themselves_have_opposite_rates(
        self, betas: tuple[float, ...], gaps: tuple[float, ...]
    ) -> None:
        rates = disturbed(betas, RIGID * len(betas), gaps=gaps).rates
        assert np.abs(rates).max() > 0.1
        assert np.abs(rates + rates[::-1, ::-1]).max() < 1e-8

    def test_reversing_flow_and_order_of_an_unequal_pair_reverses_the_rates(self) -> None:
        one, other = (disturbed(betas, RIGID * 2, gaps=(0.2,), Np=14).rates for betas in ((0.3, 0.4), (0.4, 0.3)))
        assert np.abs(one + other[::-1, ::-1]).max() < 2e-3 * np.abs(one).max()

    @pytest.mark.parametrize(
        ("solids", "liquid"),
        [(RIGID, NEWTONIAN), (soft(0.03), NEWTONIAN), (soft(0.02), GIESEKUS), (RIGID, THIXOTROPIC)],
    )
    def test_a_scene_displaced_with_wall_and_inflow_is_in_equilibrium(
        self, solids: tuple[Solid | None, ...], liquid: Liquid
    ) -> None:
        with scene((0.4,), solids, liquid) as solver:
            found = disturbed_scene(solver)
            x = whole(found, "eta", [motion.translation(len(phase.mesh.points)) for phase in found.phases])
            for name, (residual, terms) in equations(found, found.A @ x, abs(found.A) @ abs(x)).items():
                assert residual < 1e-12 * terms, name

    @pytest.mark.parametrize(
        ("solids", "liquid", "tolerance"),
        [(soft(0.03), NEWTONIAN, 1e-9), (soft(0.02), GIESEKUS, 3e-4), (RIGID, THIXOTROPIC, 1e-9)],
    )
    def test_a_scene_rotated_with_wall_and_inflow_is_in_equilibrium(
        self, solids: tuple[Solid | None, ...], liquid: Liquid, tolerance: float
    ) -> None:
        """The disturbance of the conformation is nodal, of which the scene has the logarithm."""
        with scene((0.4,), solids, liquid) as solver:
            found = disturbed_scene(solver)
            _, full = solver.state()
            x = whole(found, "eta", [motion.rotation(phase.mesh.points) for phase in found.phases])
            numbering, liquid_phase = found.phases[0].numbering, solver.scene.liquid
            z, r = liquid_phase.nodal("u", full).T
            numbering.nodal("u", x)[:] = np.column_stack([-r, z, -z])
            residual = found.A @ x
            if liquid.modes:
                numbering.nodal("chi", x)[:] = turned(liquid_phase.nodal("s", full))
            if liquid.has_memory:
                # The mesh has the velocity of the particle, which turns as well.
                moved = whole(found, "eta", [motion.translation(len(phase.mesh.points)) for phase in found.phases])
                assert found.memory is not None
                residual = found.A @ x + solver.observe().U[0] * (found.memory @ moved)
            for name, (left, terms) in equations(found, residual, abs(found.A) @ abs(x)).items():
                assert left < tolerance * terms, name


def turned(s: np.ndarray) -> np.ndarray:
    """Relative disturbance of the conformation exp(s) by a unit rotation, at nodes."""

    def matrices(values: list[np.ndarray]) -> np.ndarray:
        zz, zr, rr, tt, zt, rt = np.broadcast_arrays(*values)
        return np.moveaxis(np.array([[zz, zr, zt], [zr, rr, rt], [zt, rt, tt]]), 2, 0)

    zz, zr, rr, tt = exponential(s).T
    change = matrices([-2 * zr, zz - rr, 2 * zr, 0 * zz, tt - zz, -zr])
    inverse = matrices([*exponential(-s / 2).T, np.zeros(1), np.zeros(1)])
    found = inverse @ change @ inverse
    return np.column_stack([found[:, i, j] for i, j in ((0, 0), (0, 1), (1, 1), (2, 2), (0, 2), (1, 2))])


def whole(found: DisturbedScene, name: str, values: list[np.ndarray]) -> np.ndarray:
    """Full vector with one field in all phases."""
    parts = [np.zeros(phase.numbering.size) for phase in found.phases]
    for phase, part, each in zip(found.phases, parts, values, strict=True):
        phase.numbering.nodal(name, part)[:] = each
    return np.concatenate(parts)


def equations(found: DisturbedScene, residual: np.ndarray, terms: np.ndarray) -> dict[str, tuple[float, float]]:
    """Largest residual of the equations of each field, and the largest of their terms."""
    T, fields = found.constraints.T, found.constraints.fields
    left, size = np.abs(T @ residual), abs(T) @ terms
    # A rigid particle that is turned with its surface has a torque about another axis than that of its test function.
    return {
        name: (left[at].max(), size[at].max()) for name, at in fields.items() if name not in ("lateral", "rotation")
    }


class TestSmallSpheres:
    def test_drag_of_a_displaced_sphere_tends_to_that_without_walls(self) -> None:
        """1/K = 1 - 1.8044 beta + O(beta^3), the first reflection of a lateral force on the axis (project, exact)."""
        lateral, rotation = resistance(0.05, Np=20)
        assert abs(1 / lateral - (1 - 1.8044 * 0.05)) < 2e-4
        assert abs(rotation - 1) < 5e-4

    @pytest.mark.parametrize(("width", "drag"), [(0.05, 1.0871), (0.1, 1.1936), (0.15, 1.3204), (0.2, 1.4720)])
    def test_drag_is_that_in_a_square_duct(self, width: float, drag: float) -> None:
        """Data of Harding's ILFHC (MIT licence) for diameter over width; the tube is 1.094 times as wide."""
        assert resistance(width / 1.094, Np=10)[0] == pytest.approx(drag, rel=4e-3)

    def test_a_sphere_rotates_with_half_the_vorticity(self) -> None:
        assert disturbed((0.05,), RIGID, Np=14).rotation[0, 0] == pytest.approx(8, abs=5e-3)

    @pytest.mark.parametrize(("alpha", "xi"), [(0.0, 0.09), (0.2, 0.5), (1.0, 0.5)])
    def test_rate_of_a_rigid_sphere_tends_to_that_of_a_second_order_liquid(self, alpha: float, xi: float) -> None:
        """a = -16 (1 + 11 alpha/9)(1 - xi) De beta^2 over the drag coefficient, up to terms of order beta^2."""
        De = 0.002
        law = Giesekus(alpha=alpha) if alpha else OldroydB()
        parts = []
        for beta in (0.05, 0.1):
            rate = disturbed((beta,), RIGID, single(law, De, xi), Np=20).rates[0, 0]
            limit = -16 * (1 + 11 * alpha / 9) * (1 - xi) * De * beta**2
            parts.append(rate / limit * resistance(beta, Np=20)[0])
        assert (4 * parts[0] - parts[1]) / 3 == pytest.approx(1, abs=2e-3)

    def test_rate_of_a_soft_sphere_tends_to_that_of_an_elastic_solid(self) -> None:
        """a = -(100/9) Ca_e beta^2 (1 + O(beta^3)), for any incompressible solid."""
        parts = [disturbed((beta,), soft(1e-3), Np=20).rates[0, 0] / (-100 / 9 * 1e-3 * beta**2) for beta in (0.1, 0.2)]
        assert (8 * parts[0] - parts[1]) / 7 == pytest.approx(1, abs=2e-3)
        assert parts[1] == pytest.approx(1 + 7.6 * 0.2**3, abs=6e-3)

    def test_a_soft_sphere_deforms_and_rolls_as_in_simple_shear(self) -> None:
        """In the shear rate g = 16 per displacement: D = 5/4 Ca_e g, and the material rotates with g/2."""
        beta, Ca_e = 0.05, 1e-3
        with scene((beta,), soft(Ca_e), Np=14) as solver:
            found = disturb(solver)
            space = disturbed_scene(solver)
            body, phase = solver.scene.bodies[0], space.phases[1]
            start = space.phases[0].numbering.size
            eta = phase.numbering.nodal("eta", found.fields[start:, 0])[body.nodes]
            angle = body.outline.node_angles
            bulge = (eta - motion.translation(len(angle))) @ [1.0, 0.0, 0.0] * np.cos(angle)
            bulge += (eta[:, 1] - 1) * np.sin(angle)
        exact = -5 / 4 * Ca_e * 16 * beta / 2 * np.sin(2 * angle)
        assert np.abs(bulge - exact).max() < 0.02 * np.abs(exact).max()
        assert found.rotation[0, 0] == pytest.approx(8, abs=0.01)


def test_disturbed_velocity_at_fixed_points_is_that_of_the_displaced_flow() -> None:
    """Where everything is displaced by e_x the velocity changes by minus its derivative, 16 r in developed flow."""
    with scene((0.4,), RIGID) as solver:
        found = disturbed_scene(solver)
        points = found.phases[0].mesh.points
        everything = found.velocity(whole(found, "eta", [motion.translation(len(points))]))
        particle = found.velocity(disturb(solver).fields[:, 0])
        far = np.abs(points[:, 0]) > 1.4
    assert np.abs(everything[far] - np.outer(points[far, 1], [16.0, 0, 0])).max() < 2e-3
    assert np.abs(particle[solver.scene.nodes.wall]).max() < 1e-12
    assert np.abs(particle[far]).max() < 1e-2 < np.abs(particle).max()


class TestMaterials:
    def test_the_spline_on_the_outline_and_the_cells_inside_agree_how_material_rolls(self) -> None:
        with scene((0.4,), soft(0.05), Np=20) as solver:
            (body,) = solver.scene.bodies
            h, _ = solver.state()
            outside, inside = motion.turning(body, h), motion.rolling_inside(body, h)[body.nodes]
        assert np.abs(outside - motion.rotation(body.outline.nodes)).max() > 0.01, "the particle is deformed"
        assert np.abs(outside - inside).max() < 2e-3 * np.abs(outside).max()

    def test_a_viscosity_of_the_solid_slows_its_rotation(self) -> None:
        elastic, without, viscous = (
            disturbed((0.4,), (solid,))
            for solid in (*soft(0.02), KelvinVoigt(0.02, eta=0.0), KelvinVoigt(0.02, eta=50.0))
        )
        assert without.rates == pytest.approx(elastic.rates, rel=1e-8)
        assert viscous.rotation < 0.95 * elastic.rotation

    def test_memory_counts_where_particles_move_as_fast_as_the_liquid_forgets(self) -> None:
        """A displacement that decays leaves stresses behind: a little at a product of 0.02, nothing at 1e-4."""
        for De, least, most in ((0.3, 1e-3, 0.05), (0.003, 0.0, 1e-3)):
            found = disturbed((0.4,), RIGID, single(Giesekus(alpha=0.2), De))
            assert found.converged
            assert least <= abs(found.rates / found.at_rest - 1) < most

    def test_soft_particles_in_a_viscoelastic_liquid_return_faster_than_each_alone(self) -> None:
        liquid = single(Giesekus(alpha=0.2), 0.1)
        both, rigid, newtonian = (
            disturbed((0.4,), solids, law).rates[0, 0]
            for solids, law in ((soft(0.01), liquid), (RIGID, liquid), (soft(0.01), NEWTONIAN))
        )
        assert both < min(rigid, newtonian) < 0
        assert both == pytest.approx(rigid + newtonian, rel=0.1)


@pytest.mark.parametrize(("width", "rate"), [(0.05, 0.944), (0.1, 0.774), (0.15, 0.626), (0.2, 0.498)])
def test_inertia_drives_spheres_off_the_axis_as_in_a_square_duct(width: float, rate: float) -> None:
    """Data of ILFHC as above, in units of U_max/H Re_max (diameter/width)^3/4; a tube agrees to 3 %."""
    with scene((width / 1.094,), RIGID) as solver, Displacement(solver) as displacement:
        found = by_inertia(displacement).rates[0, 0]
    assert found / width**3 == pytest.approx(rate, rel=0.03)
    assert found / width**3 < rate


@pytest.mark.parametrize(
    ("betas", "gaps", "solids", "liquid"),
    [((0.4,), (), soft(0.02), NEWTONIAN), ((0.4, 0.4), (0.2,), RIGID * 2, GIESEKUS)],
)
def test_the_rates_are_those_of_the_slowest_modes_of_all_that_changes(
    betas: tuple[float, ...],
    gaps: tuple[float, ...],
    solids: tuple[Solid | None, ...],
    liquid: Liquid,
) -> None:
    """Modes of displacements, stresses and shapes together, in which the displacement of the mesh is of no account.

    Those of the stress decay many times faster here: the slowest ones are the same without any of them beside.
    """
    with scene(betas, solids, liquid, gaps) as solver:
        found, slowest = disturb(solver), slowest_modes(disturbed_scene(solver), len(betas))
    assert found.converged
    assert np.abs(np.sort_complex(slowest.rates) - np.sort_complex(found.growth)).max() < 1e-6


def test_a_liquid_that_forgets_more_slowly_than_displacements_change_has_no_rates_of_its_own(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """With a memory that acts a hundredfold the rates grow in each iteration, at last with their square."""
    memory, iterations = DisturbedScene.load_of_rates, list[float]()

    def hundredfold(self: DisturbedScene, y: Any, rates: Any) -> Any:
        iterations.append(float(np.abs(rates).max()))
        return 100 * memory(self, y, rates)

    monkeypatch.setattr(DisturbedScene, "load_of_rates", hundredfold)
    with np.errstate(over="raise"):
        found = disturbed((0.4,), RIGID, GIESEKUS)
    assert not found.converged
    assert found.rates == found.at_rest
    assert len(iterations) < MOST_ITERATIONS
    assert max(iterations) <= DIVERGED * abs(found.at_rest[0, 0])


@pytest.mark.parametrize(
    ("betas", "gaps", "solids", "liquid"),
    [((0.5,), (), soft(0.01), NEWTONIAN), ((0.4, 0.4), (0.2,), RIGID * 2, GIESEKUS)],
)
def test_half_widths_contain_the_rates_on_small_cells(
    betas: tuple[float, ...], gaps: tuple[float, ...], solids: tuple[Solid | None, ...], liquid: Liquid
) -> None:
    exact = disturbed(betas, solids, liquid, gaps, Np=28).rates
    with scene(betas, solids, liquid, gaps, Np=14) as solver, Displacement(solver) as displacement:
        widths = half_widths(displacement).rates
    assert (np.abs(displacement.found.rates - exact) < widths).all()
    assert widths.max() < 0.03 * np.abs(exact).max()


def test_softness_keeps_a_sphere_on_the_axis_up_to_a_reynolds_number() -> None:
    with scene((0.4,), soft(0.02)) as solver, Displacement(solver) as displacement:
        rates, by_Re = displacement.found.rates, by_inertia(displacement).rates
    assert stable_up_to(rates, by_Re) == pytest.approx(-rates[0, 0] / by_Re[0, 0], rel=1e-9)
    assert 4 < stable_up_to(rates, by_Re) < 5
    assert stable_up_to(-rates, by_Re) == 0
    assert stable_up_to(rates, -by_Re) == np.inf


def test_inertia_of_nearly_rigid_particles_is_that_of_rigid_ones() -> None:
    """Their momentum is in the balance of a surface in one, and in that of a volume in the other."""
    found = []
    for solids in (RIGID * 2, soft(1e-6, 1e-6)):
        with scene((0.4, 0.4), solids, gaps=(0.2,)) as solver, Displacement(solver) as displacement:
            found.append(by_inertia(displacement).rates)
    assert np.abs(found[0] - found[1]).max() < 1e-3 * np.abs(found[0]).max()


class TestResidual:
    @pytest.mark.parametrize("solids", [RIGID, soft(0.02)])
    def test_solutions_leave_none_whether_or_not_matrices_are_made_for_it(
        self, solids: tuple[Solid | None, ...]
    ) -> None:
        with scene((0.4,), solids, GIESEKUS) as solver, Displacement(solver) as displaced:
            there = scene_at(solver, solver.y, like=displaced.scene)
            load = np.abs(displaced.scene.load()).max()
            for each in (displaced.scene, there):
                assert np.abs(each.residual(displaced.y, displaced.found.rates)).max() < 1e-7 * load

    def test_all_unknowns_of_a_node_are_eliminated_one_after_the_other(self) -> None:
        with scene((0.4,), soft(0.02), GIESEKUS) as solver:
            found = scene_at(solver, solver.y)
            order, node = elimination_order(found), node_of_unknowns(found)
        assert order is not None
        assert np.array_equal(np.sort(order), np.arange(len(node)))
        runs = np.flatnonzero(np.diff(node[order])) + 1
        assert len(runs) + 1 == len(np.unique(node))
