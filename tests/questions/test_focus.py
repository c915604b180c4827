"""`pairsim focus`: whether particles stay on the axis, in a table, in words and in a picture."""

from __future__ import annotations

from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest
import yaml
from support.commands import Pairsim

import pairsim as api
from pairsim.computing.off_axis.answer import answer_of_focus
from pairsim.computing.off_axis.columns import TABLE
from pairsim.quantities.scales import Scales
from pairsim.record.table import Table
from pairsim.solvers.focus.stability import Verdict, growth_half_width, verdict_of, with_half_width

BEAD = {"beta": 0.4, "De": 0, "Ca_e": 0.02}
PAIR = {"particles": 2, "beta": 0.4, "De": 0, "Ca_e": 0, "d": 0.2}


def load(case: dict[str, Any], **more: Any) -> Any:
    return api.load(case, kind="focus", **more)


class TestPlaces:
    def test_the_values_of_the_case_are_one_place(self) -> None:
        (place,) = (each.parameters for each in load(BEAD).places)
        assert (place.gaps, place.Ca_es) == ((), (0.02,))
        (pair,) = (each.parameters for each in load(PAIR).places)
        assert (pair.gaps, pair.Ca_es) == ((0.2,), (0.0, 0.0))

    def test_softness_ascends_and_rigid_particles_stay_rigid(self) -> None:
        case = load(PAIR, Ca_e=[0, 0.1], along={"Ca_e": [0.05, 0.01]})
        assert [place.parameters.Ca_es for place in case.places] == [(0, 0.01), (0, 0.05)]

    def test_distances_of_all_gaps_begin_with_the_largest_which_sets_the_tube(self) -> None:
        case = load({**PAIR, "particles": 3, "d": None}, along={"d": {"start": 0.1, "stop": 0.3, "num": 2}})
        assert [place.parameters.gaps for place in case.places] == [(0.3, 0.3), (0.1, 0.1)]
        assert case.tube_length == load({**PAIR, "particles": 3, "d": 0.3}).tube_length
        assert case.range_of_d == (0.1, 0.3)

    def test_distances_may_have_units(self) -> None:
        bench = {"tube": "50um", "particle": "20um", "flow_rate": "1ul/min", "viscosity": "1Pa.s", "modulus": "5kPa"}
        case = load({"particles": 2, "physical": bench, "along": {"physical.distance": ["5 um", "10 um"]}})
        assert [place.parameters.gaps for place in case.places] == [pytest.approx((0.2,)), pytest.approx((0.1,))]

    def test_De_is_followed_in_its_liquid(self) -> None:
        case = load({**BEAD, "De": 0.1, "along": {"De": [0.2, 0.3]}})
        assert [place.parameters.De for place in case.places] == [0.2, 0.3]
        assert max(case.values_of_De) == 0.3


class TestVerdict:
    @pytest.mark.parametrize(
        ("growth", "half_width", "verdict"),
        [
            ([-0.1], 0.01, Verdict.FOCUSES),
            ([0.1], 0.01, Verdict.LEAVES),
            ([-0.1], 0.2, Verdict.UNDECIDED),
            ([-0.1], np.inf, Verdict.UNDECIDED),
            ([1e-13], 0.0, Verdict.NEUTRAL),
            ([0.1j, -0.1j], 0.01, Verdict.OSCILLATES),
            ([-0.05 + 0.1j, -0.05 - 0.1j], 0.01, Verdict.FOCUSES),
            ([0.001, -0.1], 0.01, Verdict.UNDECIDED),
        ],
    )
    def test_it_is_that_of_the_mode_that_grows_most(
        self, growth: list[complex], half_width: float, verdict: Verdict
    ) -> None:
        assert verdict_of(np.array(growth), half_width) == verdict

    def test_the_half_width_of_a_double_rate_is_that_of_its_square_root(self) -> None:
        """Rates of a reversible pair are +-sqrt(a_11^2 - a_12^2), which may vanish or not within the half-widths."""
        pair = np.array([[0.1, 0.1], [-0.1, -0.1]])
        assert growth_half_width(pair, np.full((2, 2), 1e-4)) == pytest.approx(np.sqrt(4e-5), rel=0.1)
        assert growth_half_width(pair[:1, :1], np.array([[0.01]])) == 0.01
        assert growth_half_width(pair, np.full((2, 2), np.inf)) == np.inf


class TestReynoldsNumber:
    def test_its_half_width_is_that_of_both_rates_over_the_slope(self) -> None:
        one = [np.array([[each]]) for each in (-0.05, 0.01, 1e-3, 2e-4)]
        assert with_half_width(*one) == pytest.approx((5, 0.2))

    def test_there_is_none_where_inertia_does_not_drive_particles_off(self) -> None:
        Re, error = with_half_width(*(np.array([[each]]) for each in (-0.05, -0.01, 1e-3, 2e-4)))
        assert (Re, np.isnan(error)) == (np.inf, True)


def table(n: int = 1, **columns: Any) -> Table:
    """A table of one row or more, with numbers that play no part where none are given."""
    usual = dict.fromkeys(TABLE.named(n), 0.0) | {"growth_error": 1e-3, "Re_c": np.nan}
    usual |= {name: 1.8 for name in usual if name in ("U_1", "U_2", "U_3", "U_L", "U_T")}
    rows = max(len(each) for each in columns.values() if isinstance(each, list))
    found = {**usual, **columns}
    if "Re" not in columns:
        del found["Re"]
    arrays = {name: np.array(v if isinstance(v, list) else [v] * rows) for name, v in found.items()}
    return Table(arrays, TABLE)


class TestAnswer:
    def test_a_bead_focuses_within_a_length_of_tube_below_a_reynolds_number(self) -> None:
        found = table(verdict=["focuses"], tube=500.0, tube_least=470.0, tube_most=530.0, Re_c=0.83, Re=0.02)
        assert answer_of_focus(found, [Scales(60e-6, 1e-2, 1e-2)]) == [
            "The particle focuses: a small displacement from the axis falls to a tenth within 30 +- 2 mm of tube, "
            "as long as the Reynolds number is below about 0.83 (here 0.02)."
        ]

    def test_a_wide_range_is_told_by_its_ends(self) -> None:
        found = table(verdict=["leaves"], tube=23.0, tube_least=16.6, tube_most=39.2)
        (line,) = answer_of_focus(found, None)
        assert line.endswith("grows tenfold within 23 D_c (17 D_c to 39 D_c) of tube.")

    def test_inertia_drives_it_off_where_the_reynolds_number_is_larger(self) -> None:
        (line,) = answer_of_focus(table(verdict=["focuses"], tube=500.0, Re_c=0.83, Re=2.0), None)
        assert "without inertia; but from a Reynolds number of about 0.83 on inertia drives particles off" in line
        assert line.endswith("and here it is 2.")

    def test_the_reynolds_number_has_its_half_width_where_that_is_seen(self) -> None:
        known = {"verdict": ["focuses"], "tube": 500.0, "Re_c": 0.83}
        (line,) = answer_of_focus(table(**known, Re_c_error=0.12), None)
        assert line.endswith("below about 0.83 +- 0.12.")
        (line,) = answer_of_focus(table(**known, Re_c_error=0.01), None)
        assert line.endswith("below about 0.83.")

    def test_neighbours_of_one_verdict_have_one_line(self) -> None:
        verdicts, d = ["oscillates", "leaves", "leaves", "oscillates"], [0.02, 0.04, 0.06, 0.1]
        found = table(2, verdict=verdicts, d=d, tube=[np.nan, 200.0, 300.0, np.nan], frequency_1=0.1)
        lines = answer_of_focus(found, None)
        assert [line.partition(":")[0] for line in lines] == [
            "The pair oscillates about the axis at d = 0.02, once in 113 D_c of tube",
            "The pair does not stay on the axis at d = 0.04 to 0.06",
            "The pair oscillates about the axis at d = 0.1, once in 113 D_c of tube",
        ]

    def test_what_is_not_certain_and_what_is_exactly_zero_is_said(self) -> None:
        (line,) = answer_of_focus(table(3, verdict=["undecided"], growth=-0.0004), None)
        assert line.startswith("Whether the row of 3 stays on the axis is not certain: ")
        assert "axis is (-0.4 +- 1.0)e-3 U_av/D_c" in line
        (line,) = answer_of_focus(table(verdict=["neutral"]), None)
        assert "in a liquid without memory is reversible, and inertia decides" in line

    def test_memory_is_told_where_it_changes_more_than_the_error(self) -> None:
        known = {"verdict": ["focuses"], "tube": 500.0, "a_11": -0.1, "at_rest_11": -0.11}
        assert len(answer_of_focus(table(**known, a_error_11=0.02), None)) == 1
        _, line = answer_of_focus(table(**known, a_error_11=0.005), None)
        assert line.endswith("a_11 = -0.1, and -0.11 without this memory.")


@pytest.mark.slow
def test_a_soft_bead_focuses_at_the_rate_that_was_found_on_fine_cells(tmp_path: Path, pairsim: Pairsim) -> None:
    """At beta 0.4 and Ca_e 0.02 N_p 40 has -0.050118; inertia takes it off at Re = -a/(da/dRe)."""
    case = {**BEAD, "along": {"Ca_e": [0.01, 0.02]}, "mesh": {"Np": 14}}
    (tmp_path / "bead.yaml").write_text(yaml.safe_dump(case))
    done = pairsim("focus", "bead.yaml", "-o", "out")
    assert done.returncode == 0, done.stderr
    assert "The particle focuses at Ca_e = 0.01 to Ca_e = 0.02: a small displacement" in done.stderr
    assert (tmp_path / "out" / "focus.png").is_file()
    row = api.open(tmp_path / "out").table.iloc[-1]
    assert abs(row["a_11"] + 0.050118) < row["a_error_11"] < 5e-4
    assert row["growth"] == row["a_11"] == row["rate_1"]
    assert row["tube"] == pytest.approx(np.log(10) * row["U_1"] / 0.050118, rel=5e-3)
    assert row["Re_c"] == pytest.approx(4.65, abs=0.05)
    assert pairsim("table", "out").stdout.startswith("Ca_e,De,U_1 [U_av],U_error_1 [U_av],verdict,growth [U_av/D_c],")


@pytest.mark.slow
def test_fields_have_what_a_displacement_adds_to_the_flow(tmp_path: Path) -> None:
    """It vanishes at the wall, has one direction on the axis, and inside a soft bead is that of rolling material."""
    found = api.focus({**BEAD, "fields": True}, folder=tmp_path / "out", mesh={"Np": 10}).check()
    assert found.places.tolist() == [0.02]
    grid = found.fields(0.02)
    (z, r, _), velocity = grid.points.T, grid.point_data["velocity_disturbance_1"]
    assert np.abs(velocity[r > 0.5 - 1e-9]).max() < 1e-9
    assert np.abs(velocity[r < 1e-9] @ [1, 0, 0]).max() < 1e-6
    assert np.abs(velocity[r < 1e-9] @ [0, 1, 1]).max() < 1e-6
    inside = np.isnan(grid.point_data["pressure_disturbance_1"])
    assert 0 < inside.sum() < len(r)
    a = float(found.table["a_11"].iloc[0])
    centre = np.flatnonzero(inside & (r < 1e-9))[np.abs(z[inside & (r < 1e-9)]).argmin()]
    turning = (velocity[inside, 0] / np.where(r[inside] > 0.05, r[inside], np.nan))[r[inside] > 0.05]
    assert velocity[centre, 1] == pytest.approx(a + np.nanmedian(-turning) * z[centre], abs=0.05)
    assert np.nanmedian(-turning) == pytest.approx(7.6, abs=0.4)
    assert [path.name for path in found.plot(tmp_path / "pictures")] == ["disturbance.png"]


@pytest.mark.slow
def test_a_rigid_pair_in_a_newtonian_liquid_oscillates_or_leaves_the_axis() -> None:
    """Its rates mirror themselves: there is a window of distances in which a_12 passes through zero."""
    found = api.focus({**PAIR, "beta": 0.3, "d": None, "along": {"d": [0.05, 0.3]}}, mesh={"Np": 10}).check()
    table = found.table
    assert table["d"].tolist() == [0.05, 0.3]
    assert table["verdict"].tolist() == ["leaves", "oscillates"]
    assert np.abs(table["a_11"] + table["a_22"]).max() < 1e-8
    assert np.abs(table["a_12"] + table["a_21"]).max() < 1e-8
    assert table["growth"][0] == pytest.approx(0.020, abs=1e-3)
    assert table["Re_c"].tolist() == [0, 0]


class TestFollowed:
    BENCH: ClassVar[dict[str, Any]] = {
        "tube": "60 um",
        "particle": "24 um",
        "flow_rate": "2 ul/min",
        "viscosity": "10 mPa.s",
        "modulus": "100 Pa",
        "density": "1000 kg/m^3",
    }

    def test_a_quantity_changes_liquid_softness_and_units(self) -> None:
        case = load({"particles": 1, "physical": self.BENCH}, along={"physical.flow_rate": ["2 ul/min", "1 ul/min"]})
        slow, fast = case.places
        assert fast.parameters.Ca_es[0] == pytest.approx(2 * slow.parameters.Ca_es[0])
        assert slow.scales is not None
        assert fast.scales is not None
        assert fast.scales.velocity == pytest.approx(2 * slow.scales.velocity)

    def test_a_number_of_a_law_is_followed_in_its_liquid(self) -> None:
        case = load({**BEAD, "De": 0.1, "along": {"liquid.alpha": [0.1, 0.4]}})
        assert [place.parameters.liquid.modes[0].numbers["alpha"] for place in case.places] == [0.1, 0.4]

    def test_diameters_have_a_scene_with_cells_of_its_own_each(self) -> None:
        case = load(BEAD, along={"beta": [0.4, 0.2]})
        assert [scene.betas for scene in case.scenes] == [(0.2,), (0.4,)]
        assert [scene.mesh for scene in case.scenes] == [load(BEAD, beta=beta).mesh for beta in (0.2, 0.4)]

    @pytest.mark.slow
    def test_rates_over_beta_are_those_of_each_bead(self, tmp_path: Path) -> None:
        mesh = {"Np": 8}
        found = api.focus({**BEAD, "along": {"beta": [0.2, 0.4]}}, folder=tmp_path / "out", mesh=mesh).check()
        assert found.table["followed"].tolist() == [0.2, 0.4]
        alone = api.focus(BEAD, mesh=mesh).check()
        assert found.table["growth"].iloc[-1] == pytest.approx(alone.table["growth"].iloc[0], rel=1e-9)
        (line, *_) = found.findings()
        assert line.startswith("The particle focuses at beta = 0.2 to 0.4: ")
        assert found.record.points == 2
        assert [path.name for path in found.plot(tmp_path / "pictures")] == ["focus.png"]

    @pytest.mark.slow
    def test_each_flow_rate_has_its_own_units_and_reynolds_number(self, tmp_path: Path) -> None:
        along = {"physical.flow_rate": ["1 ul/min", "2 ul/min"]}
        case = {"particles": 1, "physical": self.BENCH, "along": along, "fields": True}
        found = api.focus(case, folder=tmp_path / "out", mesh={"Np": 8}).check()
        slow, fast = found.table["Re"]
        assert fast == pytest.approx(2 * slow)
        in_seconds, numbers = found.physical["growth"], found.table["growth"]
        assert in_seconds[1] / in_seconds[0] == pytest.approx(2 * numbers[1] / numbers[0])
        assert f"(here {slow:.2g} to {fast:.2g})" in found.answer
        assert found.fields("2000 nl/min").field_data["t"] == found.fields(2).field_data["t"] == [2]
        with pytest.raises(api.InputError, match="ul/min"):
            found.fields("2 um")


def test_an_answer_that_ends_early_says_where_it_was_found() -> None:
    """Beads have no steady shape at Ca_e 5: what is found at 0.1 does not hold there."""
    found = api.focus({**BEAD, "along": {"Ca_e": [0.1, 5]}}, mesh={"Np": 8})
    assert any(line.startswith("The particle focuses at Ca_e = 0.1: ") for line in found.findings())
