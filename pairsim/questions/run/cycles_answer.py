"""The answer of a run whose flow varies: how distances change over a cycle, and whether cycles are periodic."""

from __future__ import annotations

from collections.abc import Iterator

from pairsim.analysis.time_series import Series
from pairsim.quantities.kinds import LENGTH, TIME, VELOCITY
from pairsim.quantities.text import in_unit
from pairsim.record.columns import DU_ERROR, TAYLOR
from pairsim.record.run_entries import WholeCycles

UNITS_OF_FLOW = {
    "mean": "the mean of |Q| over a cycle",
    "flow_rate": "that of physical.flow_rate",
    "velocity": "that of physical.velocity",
}
WHOLE = {"ramp": "the ramp", "table": "the table"}
MOST_SHAPES = 4  # largest number of Taylor parameters that are listed


def answer_of_cycles(series: Series, entry: WholeCycles) -> list[str]:
    """The answer of a run of two particles or more in a flow that varies."""
    scales = series.scales
    if not entry["whole"]:
        over = WHOLE.get(entry["shape"], "a cycle")
        cycle = in_unit(scales, TIME, entry["cycle"])
        lines = [f"The run ended before {over} was complete, which takes {cycle}; a later time.end is needed."]
    else:
        lines = [_drift(series, entry, i) for i in range(len(series.gaps))]
        lines += _periodic(series, entry)
        lines += [_within(series, entry, gap) for gap in series.gaps]
    lines += _shapes(series, entry)
    if scales is not None:
        unit = in_unit(scales, VELOCITY, 1.0)
        lines.append(f"U_av = {unit} is {UNITS_OF_FLOW[entry['U_av']]}; De, Ca_e and times are based on it.")
    return lines


def _over(series: Series, entry: WholeCycles) -> str:
    """The time over which a drift is given, in words."""
    if not entry["repeats"]:
        return f"over {WHOLE[entry['shape']]} of {in_unit(series.scales, TIME, entry['cycle'])}"
    return f"per cycle of {in_unit(series.scales, TIME, entry['cycle'])}"


def _drift(series: Series, entry: WholeCycles, i: int) -> str:
    """How gap `i`, counted from 0, changes over the last whole cycle."""
    drift, error, scales = entry["drift"][i], entry["drift_error"][i], series.scales
    subject = "The pair" if len(series.gaps) == 1 else f"Gap {i + 1}"
    size = in_unit(scales, LENGTH, abs(drift), error)
    over = _over(series, entry)
    if error is not None and abs(drift) <= error:
        moved = in_unit(scales, LENGTH, drift, error, "+")
        does = f"may separate or come closer: its distance changes by {moved} {over}"
    else:
        does = f"{'separates' if drift > 0 else 'comes closer'} by {size} {over}"
    mean = in_unit(scales, VELOCITY, drift / entry["cycle"], error and error / entry["cycle"], "+")
    held = f", at d{series.gaps[i]} = {in_unit(scales, LENGTH, series.d(series.gaps[i])[0], digits=4)} held"
    estimated = series.table.known(DU_ERROR, series.gaps[i]) is not None
    cells = ", whose error is not known" if error is None else "" if estimated else ", error due to time steps alone"
    which = f"cycle {entry['whole']}, " if entry["repeats"] else ""
    return f"{subject} {does}{held if series.held else ''} ({which}mean of dU {mean}{cells})."


def _periodic(series: Series, entry: WholeCycles) -> Iterator[str]:
    """Whether cycles have become periodic."""
    if not entry["repeats"]:
        return
    if "periodic" not in entry:
        yield "Whether cycles are periodic cannot be known from a single one; a later time.end is needed."
        return
    scales = series.scales
    change = in_unit(scales, VELOCITY, entry["change"])
    part = f"{100 * entry['change'] / entry['dU_peak']:.2g} % of the largest |dU|"
    if entry["periodic"]:
        yield f"Cycles have become periodic: later ones differ by {change} on average, {part}."
    else:
        yield (
            f"Cycles have not become periodic yet: later ones may differ by {change} on average, {part}; a later "
            "time.end is needed."
        )


def _within(series: Series, entry: WholeCycles, gap: str) -> str:
    """The ranges of the distance and of dU of a gap in the last whole cycle."""
    rows, scales = series.last_cycle, series.scales
    d, dU = series.d(gap)[rows], series.dU(gap)[rows]
    low, high = (in_unit(scales, LENGTH, each, digits=5) for each in (d.min(), d.max()))
    slow, fast = (in_unit(scales, VELOCITY, each, None, "+") for each in (dU.min(), dU.max()))
    distances = "" if series.held else f"d{gap} goes from {low} to {high} and "
    return f"Within it {distances}dU{gap} {'goes ' if series.held else ''}from {slow} to {fast}."


def _shapes(series: Series, entry: WholeCycles) -> Iterator[str]:
    """The range of each Taylor parameter in the last whole cycle."""
    rows = series.last_cycle
    said = [
        f"{name} from {values[rows].min():.3g} to {values[rows].max():.3g}"
        for name, values in series.table.each(TAYLOR).items()
        if values[rows].any()
    ]
    if said and len(said) <= MOST_SHAPES:
        yield f"Taylor parameters: {', '.join(said)}."
