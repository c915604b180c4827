"""What `units` and `ask` say of the axis without computing: a length and a Reynolds number, to first order alone."""

from __future__ import annotations

from typing import Any

import pytest

import pairsim as api

TUBE = {"tube": "60 um", "particle": "24 um", "flow_rate": "2 ul/min", "viscosity": "10 mPa.s"}


def said(**quantities: Any) -> list[str]:
    return [note for note in api.units(**(TUBE | quantities)).notes if note.startswith("on the axis: ")]


class TestUnits:
    def test_a_soft_bead_has_a_length_and_a_reynolds_number(self) -> None:
        """pairsim focus: 19.92 mm and 1.2 at 400 Pa (configs/focus.yaml), 5.03 mm and 4.6 at 100 Pa."""
        (line,) = said(modulus="400 Pa")
        assert "a small displacement from the axis falls to a tenth within about 20 mm of tube" in line
        assert "below about 1.1 (here 0.071); to first order, which is accurate to 20 % up to Ca_e = 0.081" in line
        (line,) = said(modulus="100 Pa")
        assert "within about 5.1 mm of tube" in line

    def test_inertia_drives_it_off_where_the_reynolds_number_is_larger(self) -> None:
        (line,) = said(modulus="100 kPa")
        assert "within about 5100 mm of tube, without inertia, which drives it off the axis" in line
        assert "above a Reynolds number of about 0.0045 (here 0.071)" in line

    def test_beyond_first_order_there_is_no_length(self) -> None:
        (line,) = said(modulus="5 kPa", relaxation="20 ms", liquid="giesekus")
        assert "mm" not in line
        assert "are beyond first order, which reaches up to De = 0.047: pairsim focus computes" in line

    @pytest.mark.parametrize(
        "others",
        [
            {},  # rigid, Newtonian
            {"modulus": "400 Pa", "particle": "50 um"},  # larger than those of the table
            {"modulus": "400 Pa", "solid": {"law": "kelvin-voigt", "eta": 1}},
        ],
    )
    def test_nothing_is_said_where_there_is_no_first_order(self, others: dict[str, Any]) -> None:
        assert said(**others) == []

    def test_of_unequal_beads_the_slower_one_is_told(self) -> None:
        (line,) = said(modulus="400 Pa", particle=["24 um", "12 um"])
        (alone,) = said(modulus="400 Pa", particle="12 um")
        assert "each of these beads on its own" in line
        length = alone.partition("within about ")[2].partition(" of tube")[0]
        assert f"within about {length} of tube" in line


def test_an_atlas_adds_it_to_its_answer() -> None:
    answer = api.ask(tube="50um", particle="20um", flow_rate="1ul/min", viscosity="1Pa.s", modulus="5kPa")
    (line,) = (each for each in answer.findings() if each.startswith("On the axis, "))
    assert "a bead on its own focuses: a small displacement from the axis falls to a tenth within about 2.4 mm" in line
