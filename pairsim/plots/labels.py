"""Words on pictures: symbols with units, the parameters of a case, and ticks of logarithmic axes."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter, StrMethodFormatter

from pairsim.config.materials import declared_in, is_viscous, liquid_block, liquid_of, solid_blocks
from pairsim.config.yaml_file import read_yaml
from pairsim.physics import declared
from pairsim.physics.declared import LAWS
from pairsim.results.columns import column
from pairsim.runtime.arrays import Array

SYMBOLS = {"beta": r"\beta", "d0": "d_0", "mesh.Np": "N_p", **declared.SYMBOLS}
WIDE = 8.0  # ratio of values from which their axis is logarithmic
NOISE = 1e-9  # what varies less than this is constant to rounding, and not blown up to fill its panel


def read_case(file: Path) -> dict[str, Any]:
    """Content of a case.yaml, empty if there is none."""
    return read_yaml(file) if file.is_file() else {}


def plain_text(text: str) -> str:
    """Text that matplotlib shall not read as TeX."""
    return text.replace("$", r"\$")


def shown(value: Any) -> str:
    """A value of a parameter; a list of equal entries is one of them."""
    if isinstance(value, list | tuple):
        entries = list(value)
        return shown(entries[0]) if len(set(map(str, entries))) == 1 else ", ".join(map(shown, entries))
    if isinstance(value, str):
        return LAWS[value].label if value in LAWS else plain_text(value)
    if isinstance(value, Mapping):
        return ", ".join(f"{k} {shown(v)}" if k != "law" else shown(v) for k, v in value.items())
    return f"{value:.4g}" if isinstance(value, float) else plain_text(str(value))


def symbol(key: str) -> str:
    """A parameter on an axis or in a legend."""
    name = _symbol(key)
    return f"${name}$" if name else plain_text(key)


def _symbol(key: str) -> str:
    """The symbol of a parameter, also of a law's in its group, such as liquid.n; empty if it has none."""
    of_law = key.startswith(("liquid.", "solid."))
    return SYMBOLS.get(key.rpartition(".")[2] if of_law else key, "")


def equation(key: str, value: Any) -> str:
    """A parameter with its value."""
    if key in ("liquid", "solid"):
        return shown(value)
    name = _symbol(key)
    return f"${name} = {shown(value)}$" if name else f"{plain_text(key)} = {shown(value)}"


def case_parts(case: Mapping[str, Any], leave_out: Collection[str] = ()) -> list[str]:
    """The parameters of a case: blockage, distance, softness, liquid with its law and numbers.

    Args:
        case: Content of case.yaml, defaults filled in.
        leave_out: Keys that vary, or that are not fixed for another reason.
    """
    count = case.get("particles", 2)
    words = {0: "no particles", 1: "1 particle"}.get(count, f"{count} particles")
    parts = [] if count == 2 or "particles" in leave_out else [words]

    def add(*keys: str) -> None:
        parts.extend(equation(key, case[key]) for key in keys if case.get(key) is not None and key not in leave_out)

    if count:
        add("beta", "Ca_e")
    if count > 1:
        add("d0")
    elastic = "De" in leave_out or bool(case.get("De"))
    laws: list[str] = []
    if not is_viscous(case) or liquid_of(case).newtonian:
        add("De")
    else:
        laws = ["liquid"]
    if elastic and "liquid" in case:
        laws = ["liquid"]
    soft = case.get("Ca_e")
    laws += ["solid"] if "solid" in case and any(soft if isinstance(soft, list | tuple) else [soft]) else []
    for place in laws:
        if place not in leave_out:
            parts.append(_liquid_label(case) if place == "liquid" else shown([b["law"] for _, b in solid_blocks(case)]))
        if place == "liquid" and elastic:
            add("xi")
        if place in leave_out or (place == "liquid" and liquid_block(case).keys() & {"modes", "solvent"}):
            continue  # not those of all lines, or too many numbers for a caption
        own = [each for each in declared_in(case) if each.key.startswith("solid") == (place == "solid")]
        parts += [equation(e.key, e.value) for e in own if e.value is not None and e.key not in leave_out]
    return parts


def _liquid_label(case: Mapping[str, Any]) -> str:
    """The name of the liquid: of its law, or of those of all its modes and of its solvent."""
    block = liquid_block(case)
    if block.keys() & {"modes", "solvent"}:
        return liquid_of({"xi": 1.0, **case, "De": 1.0}).label
    return shown(block["law"])


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
