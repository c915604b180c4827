"""Files of a rheometer, and the liquid of a case that is fitted to them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pairsim.api.rheometer_files import read_columns
from pairsim.physics.liquids import LAWS
from pairsim.physics.liquids.viscous import ZERO_SHEAR, ViscousLaw
from pairsim.physics.material import Dimension
from pairsim.physics.rheometry import Fit, Measured, described, fits, scatter
from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import InputError


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


def fit_liquid(
    rheology: Path | str | None, spectrum: Path | str | None, law: str | None = None, section: str | None = None
) -> MeasuredLiquid:
    """Fit a law to files as of `pairsim.units`; without one, take what is best by the Bayesian information criterion.

    Raises:
        InputError: A file cannot be used, or has too few points for the law.
    """
    if law is not None and law not in [*LAWS]:
        allowed = f"must be the name of a law, whose parameters are fitted: {', '.join(LAWS)}"
        raise InputError("pairsim units", "--liquid", law, allowed)
    data, read = read_measured(rheology, spectrum, section)
    found = fits(data, [law] if law else None)
    if not found:
        raise InputError("pairsim units", "--liquid", law, "must have fewer parameters than there are points")
    quantities, block = keys_of(found[0])
    return MeasuredLiquid(found[0], data, quantities, block, [*read, *sentences(found, data)])


def read_measured(
    rheology: Path | str | None, spectrum: Path | str | None, section: str | None = None
) -> tuple[Measured, list[str]]:
    """What one or two files hold, and what was read in sentences; see `rheometer_files`.

    Raises:
        InputError: A file cannot be read, or lacks a column or points.
    """
    found: dict[str, Array] = {}
    said: list[str] = []
    for option, file in (("--rheology", rheology), ("--spectrum", spectrum)):
        if file is not None:
            columns, sentences = read_columns(option, Path(file), section)
            found |= columns
            said += sentences
    if "rate" in found:
        found.setdefault("N1", np.full(len(found["rate"]), np.nan))
    return Measured(**found), said


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
