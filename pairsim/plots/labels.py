"""Words on pictures: symbols with units, the parameters of a case, and ticks of logarithmic axes."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from pathlib import Path
from typing import Any

import yaml
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter, StrMethodFormatter

from pairsim.physics.materials.polymer import PARAMETERS
from pairsim.results.columns import column
from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import InputError

SYMBOLS = {
    "beta": r"\beta",
    "De": r"\mathrm{De}",
    "Ca_e": r"\mathrm{Ca}_e",
    "d0": "d_0",
    "xi": r"\xi",
    "alpha": r"\alpha",
    "epsilon": r"\epsilon",
    "L2": "L^2",
    "mesh.Np": "N_p",
}
LAWS = {
    "newtonian": "Newtonian",
    "giesekus": "Giesekus",
    "oldroyd-b": "Oldroyd-B",
    "ptt-linear": "linear PTT",
    "ptt-exp": "exponential PTT",
    "fene-p": "FENE-P",
}
WIDE = 8.0  # ratio of values from which their axis is logarithmic
NOISE = 1e-9  # what varies less than this is constant to rounding, and not blown up to fill its panel


def read_case(file: Path) -> dict[str, Any]:
    """Content of a case.yaml, empty if there is none."""
    if not file.is_file():
        return {}
    try:
        case = yaml.safe_load(file.read_text(encoding="utf-8"))
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise InputError(str(file), "", None, f"is not YAML ({error})") from error
    return case if isinstance(case, dict) else {}


def plain_text(text: str) -> str:
    """Text that matplotlib shall not read as TeX."""
    return text.replace("$", r"\$")


def shown(value: Any) -> str:
    """A value of a parameter; a list of equal entries is one of them."""
    if isinstance(value, list | tuple):
        entries = list(value)
        return shown(entries[0]) if len(set(map(str, entries))) == 1 else ", ".join(map(shown, entries))
    if isinstance(value, str):
        return LAWS.get(value, plain_text(value))
    return f"{value:.4g}" if isinstance(value, float) else plain_text(str(value))


def symbol(key: str) -> str:
    """A parameter on an axis or in a legend."""
    return f"${SYMBOLS[key]}$" if key in SYMBOLS else plain_text(key)


def equation(key: str, value: Any) -> str:
    """A parameter with its value."""
    if key == "liquid":
        return shown(value)
    return f"${SYMBOLS[key]} = {shown(value)}$" if key in SYMBOLS else f"{plain_text(key)} = {shown(value)}"


def case_parts(case: Mapping[str, Any], leave_out: Collection[str] = ()) -> list[str]:
    """The parameters of a case: blockage, distance, softness, liquid with its law and numbers.

    Args:
        case: Content of case.yaml, defaults filled in.
        leave_out: Keys that vary, or that are not fixed for another reason.
    """
    count = case.get("particles", 2)
    parts = [] if count == 2 or "particles" in leave_out else ["no particles" if not count else f"{count} particles"]

    def add(*keys: str) -> None:
        parts.extend(equation(key, case[key]) for key in keys if case.get(key) is not None and key not in leave_out)

    if count:
        add("beta", "Ca_e")
    if count > 1:
        add("d0")
    add("De")
    if "De" in leave_out or case.get("De"):
        parts.extend([equation("liquid", case["liquid"])] if "liquid" in case and "liquid" not in leave_out else [])
        add("xi", *(key for key, laws in PARAMETERS.items() if case.get("liquid") in laws))
    return parts


def axis_label(names: list[str], more: str = "") -> str:
    """Axis label of some columns, which share their unit, with more words between symbols and unit."""
    entries = [column(name) for name in names]
    symbols = ", ".join(f"${entry.symbol}$" for entry in entries[:3]) + (", ..." if len(entries) > 3 else "")
    return f"{symbols}{more}  [${entries[0].unit or '-'}$]"


def parameter_label(key: str) -> str:
    """Axis label of a parameter of a case."""
    return f"{symbol(key)}  [${'D_c' if key == 'd0' else '-'}$]"


def spread(axis: Axes, name: str, values: Iterable[float]) -> None:
    """A logarithmic axis with plain numbers for values that span a wide range, else a linear one with few ticks.

    Args:
        axis: The panel.
        name: "x" or "y".
        values: What is drawn along it.
    """
    known = list(values)
    low, high = min(known), max(known)
    direction: Axis = axis.xaxis if name == "x" else axis.yaxis
    if low > 0 and high / low >= WIDE:
        (axis.set_xscale if name == "x" else axis.set_yscale)("log")
        steps = (1.0, 2.0, 5.0) if high / low < 300 else (1.0,)
        direction.set_major_locator(LogLocator(subs=steps))
        direction.set_major_formatter(StrMethodFormatter("{x:g}"))
        direction.set_minor_formatter(NullFormatter())
    else:
        direction.set_major_locator(MaxNLocator(5))


def finish(axis: Axes, x: str, y: str, values: list[Array]) -> None:
    """Labels, the line y = 0 where values change sign, and a range that does not blow rounding up.

    Args:
        axis: The panel.
        x: Label of the abscissa.
        y: Label of the ordinate.
        values: What is drawn.
    """
    filled = [entry for entry in values if len(entry)]
    low, high = min((float(v.min()) for v in filled), default=0.0), max((float(v.max()) for v in filled), default=1.0)
    if high - low < NOISE:
        middle = (low + high) / 2
        axis.set_ylim(middle - 1e-6, middle + 1e-6)
    if low < 0 < high:
        axis.axhline(0, color="0.55", linewidth=0.6, zorder=0.5)
    axis.set(xlabel=x, ylabel=y)
