"""The result of a master curve in Python, and its row in the results of a sweep."""

from __future__ import annotations

from contextlib import suppress
from functools import cached_property
from typing import TYPE_CHECKING, Any

from pairsim.cases.differences import difference_in_words
from pairsim.computing.off_axis.lines import lines_beside
from pairsim.computing.question import Tables, Value
from pairsim.computing.result import Result
from pairsim.record.column import names_of
from pairsim.record.columns import DU, DU_INPUTS, DU_SPREAD, EQUILIBRIA_COLUMNS, FORCES, SEPARATE
from pairsim.runtime.errors import InputError
from pairsim.runtime.text import pasteable

if TYPE_CHECKING:
    import pandas as pd

    from pairsim.analysis.curve_in_units import TravelInUnits
    from pairsim.analysis.master_curve import Curve
    from pairsim.analysis.travel import Travel
    from pairsim.questions.curve import CurveCase
    from pairsim.record.record import Record


def result_columns(case: CurveCase) -> tuple[str, ...]:
    """The columns of results.csv: points, zeros, and for each gap the largest |dU| with its distance and errors.

    Moved particles have their forces instead, at the first distance. For a pair whose inputs have half-widths, the
    half-width of the largest |dU| due to these follows; for particles that differ, the standard deviation of dU there
    and the fraction of pairs that separate.
    """
    from pairsim.cases.inputs import inputs_of  # loads numpy

    if case.velocity is not None:
        return ("points", *names_of(case.n, *FORCES))
    names = ["d_peak{}", "d_peak_error{}", "dU_peak{}", "dU_error{}"]
    others = ["zeros", "zeros_error", "stable"] if case.n == 2 else []
    uncertain = case.n == 2 and any(each.half_width for each in inputs_of(case))
    of_gaps = (name.format(gap) for gap in DU.suffixes(case.n) for name in names)
    spread = [DU_SPREAD.name, SEPARATE.name] if case.spread else []
    return ("points", *others, *of_gaps, *([DU_INPUTS.name] if uncertain else []), *spread)


def row_in_sweeps(tables: Tables, record: Record) -> dict[str, Value]:
    """The values of the columns of results.csv; those of zeros are lists in ascending d."""
    import numpy as np

    from pairsim.analysis.master_curve import Curve  # loads numpy

    curve = Curve(tables["curve"], zeros := tables["equilibria"], record)
    values: dict[str, Value] = {"points": curve.table.rows}
    if not values["points"]:
        return values
    forces = [each.name + suffix for each in FORCES for suffix in curve.table.suffixes(each)]
    if forces:
        return values | {name: float(curve.table[name][0]) for name in forces}
    for gap in curve.gaps:
        peak = curve.peak_of(gap)
        found = {"d_peak": peak.d, "d_peak_error": peak.d_error, "dU_peak": peak.dU, "dU_error": peak.error}
        values |= {column + gap: value for column, value in found.items()}
    if curve.by_inputs.known:
        values[DU_INPUTS.name] = float(curve.by_inputs.half_widths(curve.peak.d))
    if curve.unequal is not None:
        at = np.array([curve.peak.d])
        values[DU_SPREAD.name] = float(curve.unequal.deviations(at)[0])
        values[SEPARATE.name] = float(curve.unequal.separate(at)[0])
    shown = {"zeros": "d", "zeros_error": "d_error", "stable": "stable"}
    return values | {name: zeros[column].tolist() for name, column in shown.items() if column in zeros}


class CurveResult(Result):
    """A master curve. `table` is curve.csv, with a row for each point."""

    @cached_property
    def zeros(self) -> pd.DataFrame:
        """The zeros of dU (equilibria.csv): d, stable, slope, peak, d_error and certain."""
        from pairsim.record.tables import frame_of

        found = frame_of(self.tables["equilibria"])
        return found if len(found.columns) else found.reindex(columns=EQUILIBRIA_COLUMNS.named(2))

    @cached_property
    def curve(self) -> Curve:
        """dU as a function of the distance: `dU, half_width = result.curve(d)`."""
        from pairsim.analysis.master_curve import Curve

        return Curve(self.tables["curve"], self.tables["equilibria"], self.record, self.source)

    def dU(self, d: Any, gap: int = 1) -> Any:
        """dU at any distance of the curve [U_av], or as a quantity of pint if the distance has a unit.

        `curve` also returns the half-width of its interval.
        """
        return self.curve(d, gap)[0]

    def travel(self, start: Any, stop: Any) -> Travel | TravelInUnits:
        """Time and length of tube in which the pair moves from one distance to another, as `pairsim travel`.

        Args:
            start: First distance: a number [D_c], a text with a unit such as "5um", or a quantity of pint.
            stop: Last distance.

        Returns:
            Time, length and their half-widths, as quantities of pint if both distances have a unit. Its text is what
            the command prints.

        Raises:
            InputError: A distance is outside the curve, or the pair does not move from the one to the other.
        """
        return self.curve.travel(start, stop)

    def findings(self) -> list[str]:
        """Where particles separate and come closer, and how fast; for an answer of an atlas, also in which liquid."""
        from pairsim.questions.curve.answer import answer_of_curve

        if not self.curve.table.rows:
            return ["No point was solved."]
        difference = ""
        with suppress(InputError):  # without case.yaml, or one of an older version
            difference = difference_in_words(self.case)
        return [*answer_of_curve(self.curve, difference), *lines_beside(self.tables, self.record), *self.record.notes]

    def afterwards(self) -> str:
        regions = self.curve.regions if self.curve.steady and self.curve.table.rows > 1 else []
        moves = any(each.sign and each.start < each.stop for each in regions)
        folder = pasteable(self.source)
        command = f"pairsim travel {folder} --from D --to D" if moves else f"pairsim plot {folder}"
        if self.folder is None:
            command = "travel(start, stop)" if moves else "plot(folder)"
        return f"{command} {'gives the time and tube that a pair needs' if moves else 'draws it'}"
