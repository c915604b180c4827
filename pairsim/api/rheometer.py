"""Files of a rheometer, and the liquid of a case that is fitted to them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pairsim.cases.quantities import unit_in_si
from pairsim.physics.liquids import LAWS
from pairsim.physics.liquids.viscous import ZERO_SHEAR, ViscousLaw
from pairsim.physics.material import Dimension
from pairsim.physics.rheometry import Fit, Measured, described, fits, scatter
from pairsim.physics.solids.solid import MODULUS
from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import InputError

RATE = Dimension("rate", "a rate", "shear rate or angular frequency", "1/s", "1 1/s", lambda value, _: value)
FILES = {
    "--rheology": {
        "rate": (r"rate|gamma", RATE),
        "viscosity": (r"visc|^eta", ZERO_SHEAR),
        "N1": (r"n_?1|normal", MODULUS),
    },
    "--spectrum": {
        "frequency": (r"freq|omega", RATE),
        "storage": (r"storage|^g'(?!')|^gp\b", MODULUS),
        "loss": (r"loss|^g''|^gpp\b", MODULUS),
    },
}
"""The columns in the file of each option: what their heads begin with or contain, and what is in them."""
OPTIONAL = "N1"
FEWEST = 5


@dataclass(frozen=True)
class MeasuredLiquid:
    """The best fit to files of a rheometer; `quantities` and `block` go into `physical` and `liquid` of a case."""

    fit: Fit
    data: Measured
    quantities: dict[str, str]
    block: Any
    sentences: list[str]

    def draw(self, path: Path) -> None:
        """Draw points and lines of the flow curve and of the moduli into a PNG file."""
        from pairsim.plots.rheometry import draw_fit

        draw_fit(self.fit, self.data, path)


def fit_liquid(rheology: Path | str | None, spectrum: Path | str | None, law: str | None = None) -> MeasuredLiquid:
    """Fit a law to files as of `pairsim.units`; without one, take what is best by the Bayesian information criterion.

    Raises:
        InputError: A file cannot be used, or has too few points for the law.
    """
    if law is not None and law not in [*LAWS]:
        allowed = f"must be the name of a law, whose parameters are fitted: {', '.join(LAWS)}"
        raise InputError("pairsim units", "--liquid", law, allowed)
    data = read_measured(rheology, spectrum)
    found = fits(data, [law] if law else None)
    if not found:
        raise InputError("pairsim units", "--liquid", law, "must have fewer parameters than there are points")
    quantities, block = keys_of(found[0])
    return MeasuredLiquid(found[0], data, quantities, block, sentences(found, data))


def read_measured(rheology: Path | str | None, spectrum: Path | str | None) -> Measured:
    """What one or two files hold; columns are told by their heads, units stand in brackets, SI without.

    Raises:
        InputError: A file cannot be read, or lacks a column or points.
    """
    found: dict[str, Array] = {}
    for option, file in zip(FILES, (rheology, spectrum), strict=True):
        if file is not None:
            found |= _columns(option, Path(file))
    if "rate" in found:
        found.setdefault("N1", np.full(len(found["rate"]), np.nan))
    return Measured(**found)


def _columns(option: str, file: Path) -> dict[str, Array]:
    import pandas as pd

    try:
        table = pd.read_csv(file, comment="#", sep=None, engine="python", skipinitialspace=True)
    except (OSError, ValueError, pd.errors.ParserError) as error:
        raise InputError(str(file), option, None, f"must be a CSV file with a line of heads ({error})") from None
    found: dict[str, Array] = {}
    for name, (pattern, dimension) in FILES[option].items():
        if head := next((h for h in map(str, table) if re.search(pattern, h.strip().lower())), None):
            values = pd.to_numeric(table[head], errors="coerce").to_numpy(dtype=float)
            found[name] = values * _unit(head, dimension, file)
    needed = [name for name in FILES[option] if name != OPTIONAL]
    if missing := [name for name in needed if name not in found]:
        heads = ", ".join(map(str, table.columns))
        raise InputError(str(file), option, heads, f"must have columns of {', '.join(needed)}; add {missing[0]}")
    valid = np.all([found[name] > 0 for name in needed], axis=0)
    if valid.sum() < FEWEST:
        raise InputError(str(file), option, int(valid.sum()), f"must have at least {FEWEST} rows of positive numbers")
    return {name: values[valid] for name, values in found.items()}


def _unit(head: str, dimension: Dimension, file: Path) -> float:
    """The unit in the brackets of a head, in SI units; a frequency in Hz is one of rad/s."""
    unit = re.search(r"[\[(]([^\])]+)[\])]", head)
    if unit is None:
        return 1.0
    text = unit[1].strip().replace("⋅", ".").replace("rad/s", "1/s")
    if text.lower() == "hz":
        return float(2 * np.pi)
    try:
        return unit_in_si(text, dimension)
    except ValueError as error:
        raise InputError(str(file), head, unit[1], str(error)) from None


def keys_of(fit: Fit) -> tuple[dict[str, str], Any]:
    """The quantities of a `physical` block that a fitted liquid gives, and the value of `liquid`."""
    liquid, eta_0 = fit.liquid, fit.eta_0
    lone = len(liquid.modes) < 2
    own = liquid.modes[0] if liquid.modes else liquid.solvent
    measured = own.measured if isinstance(own, ViscousLaw) else ZERO_SHEAR
    quantities = {measured.key: _quantity(eta_0, measured, own.numbers)}
    if liquid.modes:
        quantities |= {"relaxation": f"{liquid.De:.4g} s", "solvent": f"{liquid.xi * eta_0:.4g} Pa.s"}
    pure = {}
    for name, p in own.parameters().items():
        if p.dimension is None:
            pure[name] = float(f"{getattr(own, name):.4g}")
        elif getattr(own, name) != p.default:
            factor = eta_0 if p.dimension.unit == "Pa*s" else 1.0
            quantities[p.dimension.key] = _quantity(factor * getattr(own, name), p.dimension, own.numbers)
    if lone:
        return quantities, {"law": own.name, **pure} if pure else own.name
    modes = [{"law": own.name, "time": m.time, "weight": m.weight} for m in liquid.modes]
    rounded = [{key: float(f"{v:.4g}") if key != "law" else v for key, v in mode.items()} | pure for mode in modes]
    return quantities, {"law": "modes", "modes": rounded}


def _quantity(value: float, dimension: Dimension, numbers: dict[str, Any]) -> str:
    return f"{value:.4g} {dimension.unit.format(**numbers).replace('*', '.')}"


def sentences(fits: Sequence[Fit], data: Measured) -> list[str]:
    """The best fit in words, with the intervals of its numbers, and whether it describes the data."""
    best, *others = fits
    modes = f", {len(best.liquid.modes)} modes" if len(best.liquid.modes) > 1 else ""
    numbers = [f"{_name(best, key)} = {n.value:.3g} ({n.least:.3g} to {n.most:.3g})" for key, n in best.numbers.items()]
    said = [f"fit: {best.law.label}{modes}: {', '.join(numbers)}"]
    noise = f"{100 * best.deviation:.2g} % where neighbouring points scatter by {100 * scatter(data):.2g} %"
    rest = f"; next best: {others[0].law.label}, {100 * others[0].deviation:.2g} %" if others else ""
    said.append(f"fit: off by {noise}{rest}")
    if not described(best, data):
        said.append(f"warning: no law tried describes these data: the best, {best.law.label}, is off by {noise}")
    return said


def _name(fit: Fit, key: str) -> str:
    """A fitted number with its unit."""
    if key == "eta_0":
        unit = fit.law.measured.unit if issubclass(fit.law, ViscousLaw) else ZERO_SHEAR.unit
        return f"{key} [{unit.format(n='n').replace('*', '.')}]"
    word, _, i = key.partition("_")
    if word in ("ratio", "weight") and i.isdigit():
        return f"lambda_{int(i) + 1}/lambda_{i}" if word == "ratio" else f"weight_{int(i) + 1}/weight_1"
    declared = fit.law.parameters().get(key)
    in_seconds = declared is not None and declared.dimension is not None and declared.dimension.unit == "s"
    return "lambda [s]" if key == "De" else f"{key} [s]" if in_seconds else key
