"""The dimensionless numbers and scales of an experiment: `units`."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import TYPE_CHECKING, Any

from pairsim.api.cases import load
from pairsim.cases.case import SceneCase
from pairsim.cases.physical import Physical
from pairsim.cases.units_report import DEFAULTS, UnitsReport, units_report
from pairsim.computing import QUESTIONS

if TYPE_CHECKING:
    import pandas as pd


class Units:
    """What `pairsim units` says of an experiment.

    Attributes:
        case: The case, to be given to `run` or another function.
        report: Numbers, scales, whether inertia is negligible, defaults used and warnings.
        written: The keys of the case that were given or follow from what was.
    """

    def __init__(self, case: SceneCase, report: UnitsReport, written: Mapping[str, Any]) -> None:
        self.case, self.report, self.written = case, report, written

    @cached_property
    def table(self) -> pd.DataFrame:
        """The dimensionless numbers and the scales: name, value and meaning."""
        import pandas as pd

        return pd.DataFrame([*self.report.numbers, *self.report.scales], columns=["name", "value", "meaning"])

    @property
    def notes(self) -> list[str]:
        """Whether inertia is negligible, defaults used, and warnings."""
        used = [f"default used: {each}" for each in self.report.defaults]
        return [self.report.inertia, *used, *(f"warning: {each}" for each in self.report.warnings)]

    def __repr__(self) -> str:
        return "\n".join([self.table.to_string(index=False, header=False), *self.notes])


def units(*, kind: str = "run", **given: Any) -> Units:
    """Compute the dimensionless numbers and scales of an experiment, as `pairsim units` does.

    Args:
        kind: The command that the case is for.
        given: The keys of a `physical` block, each a text with its unit such as `tube="50um"`, and other keys of a
            case, such as `liquid={"law": "power-law", "n": 0.6}`. Without a modulus the particles are rigid.

    Returns:
        Numbers, scales, defaults and warnings, and the case.

    Raises:
        InputError: A quantity is missing, or is wrong.

    Example:
        >>> beads = pairsim.units(tube="50um", particle="20um", flow_rate="1ul/min", viscosity="1Pa.s", modulus="5kPa")
        >>> pairsim.run(beads.case)
    """
    quantities = {key: given.pop(key) for key in Physical.model_fields if key in given}
    written = dict(given)
    if isinstance(sizes := quantities.get("particle"), list):
        written.setdefault("particles", len(sizes))
    if not quantities.keys() & {"modulus", "young"}:
        written.setdefault("Ca_e", 0)
    if "distance" not in quantities and kind in QUESTIONS:
        written = {**QUESTIONS[kind].model.usual_distances, **written}
    case = load({**written, "physical": DEFAULTS | quantities}, kind=kind)
    return Units(case, units_report(case, quantities), {"physical": quantities, **written})
