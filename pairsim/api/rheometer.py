"""Files of a rheometer, and the liquid of a case that is fitted to them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pairsim.api.rheometer_files import read_columns
from pairsim.cases.physical import BLOCK
from pairsim.cases.quantities import known_unit, si, suited
from pairsim.physics.liquids import LAWS
from pairsim.physics.liquids.viscous import ViscousLaw
from pairsim.physics.material import Material
from pairsim.physics.rheometry import Fit, Measured, Number, described, dimensions_of, fits, scatter
from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import InputError

ALL = {of.key: of for law in LAWS.values() for of in dimensions_of(law).values() if of is not None}
"""What can be known of a liquid, by its key in the `physical` block."""


@dataclass(frozen=True)
class MeasuredLiquid:
    """The best fit to files of a rheometer."""

    fit: Fit
    data: Measured  # what was measured
    quantities: dict[str, str]  # what goes into `physical` of a case
    block: Any  # value of its key `liquid`
    intervals: dict[str, str]  # of each fitted number, by its key in either
    sentences: list[str]  # what was read, the fit in words, and warnings


def fit_liquid(
    rheology: Path | str | None,
    spectrum: Path | str | None,
    liquid: Any = None,
    section: str | Sequence[str] = (),
    quantities: Mapping[str, Any] | None = None,
) -> MeasuredLiquid:
    """Fit a law to files as of `pairsim.units`, whose other arguments are these, too.

    The liquid may be a law, or a block with its name and numbers that are held; None for what is best by the Bayesian
    information criterion. Quantities of the `physical` block that are those of the liquid are held.

    Raises:
        InputError: A file cannot be used, or has too few points for the law.
    """
    block = dict(liquid) if isinstance(liquid, Mapping) else {"law": liquid}
    law, numbers = block.pop("law", None), block
    if law is not None and law not in LAWS:
        allowed = f"must be the name of a law, whose parameters are fitted: {', '.join(LAWS)}"
        raise InputError("pairsim units", "--liquid", liquid, allowed)
    held = {key: text for key, text in (quantities or {}).items() if key in ALL}
    given = {name: float(value) for name, value in numbers.items()}
    for key, text in held.items():
        try:
            given[key] = si(text, known_unit(ALL[key], numbers))
        except ValueError as error:
            raise InputError("pairsim units", f"{BLOCK}.{key}", text, str(error)) from None
    columns: dict[str, Array] = {}
    said: list[str] = []
    for option, file in (("--rheology", rheology), ("--spectrum", spectrum)):
        if file is not None:
            of_file, read = read_columns(option, Path(file), section)
            columns, said = columns | of_file, said + read
    data = Measured(**columns)
    found = fits(data, [law] if law else None, given)
    if not found:
        known = f" besides {', '.join(given)}" if given else ""
        allowed = f"must be a law with unknown numbers{known}, fewer of them than there are points"
        raise InputError("pairsim units", "--liquid", law, allowed)
    fitted, value, intervals = keys_of(found[0])
    said += sentences(found, data, chosen=law is not None)
    return MeasuredLiquid(found[0], data, {**fitted, **held}, value, intervals, said)


def keys_of(fit: Fit) -> tuple[dict[str, str], Any, dict[str, str]]:
    """The quantities of a `physical` block that a fitted liquid gives, the value of `liquid`, and intervals by key."""
    liquid = fit.liquid
    own = liquid.modes[0] if liquid.modes else liquid.solvent
    pure = {
        name: float(f"{getattr(own, name):.4g}")
        for name, p in own.parameters().items()
        if p.dimension is None and name != own.regularisation
    }
    values = {"eta_0": fit.eta_0, "De": liquid.De, "xi": liquid.xi} | own.numbers
    quantities, intervals = {}, {name: _interval(number) for name, number in fit.numbers.items() if not number.given}
    for name, of in dimensions_of(fit.law).items():
        default = own.parameters()[name].default if name in own.parameters() else None
        if of is not None and values[name] != default:
            factor = of.size(fit.eta_0) if name != "eta_0" else 1.0
            unit, size = suited(factor * values[name], known_unit(of, pure).unit)
            quantities[of.key] = f"{factor * values[name] / size:.4g} {unit}"
            if intervals.pop(name, ""):
                intervals[of.key] = _interval(fit.numbers[name], factor / size)
    if len(liquid.modes) < 2:
        return quantities, {"law": own.name, **pure} if pure else own.name, intervals
    each = [
        {key: fit.values.get(f"{key}_{i + 1}", 1.0) for key in ("time", "weight")} for i in range(len(liquid.modes))
    ]
    modes = [{"law": own.name, **{key: float(f"{v:.4g}") for key, v in mode.items()}, **pure} for mode in each]
    return quantities, {"law": "modes", "modes": modes}, intervals


def _interval(number: Number, factor: float = 1.0) -> str:
    """Where a number, times a factor, is with a probability of 95 %."""
    least, most = factor * number.least, factor * number.most
    if np.isinf(least) and np.isinf(most):
        return "not determined by these data"
    if np.isinf(least):
        return f"at most {most:.4g}"
    return f"at least {least:.4g}" if np.isinf(most) else f"{least:.4g} to {most:.4g}"


def sentences(fits: Sequence[Fit], data: Measured, chosen: bool = False) -> list[str]:
    """The best fit in words, with the intervals of its numbers, and what the data do not tell."""
    best, *others = fits
    quantities, _, intervals = keys_of(best)
    keys = {name: of.key for name, of in dimensions_of(best.law).items() if of is not None and of.key in quantities}
    values = quantities | {name: f"{n.value:.4g}" for name, n in best.numbers.items() if name not in keys}
    numbers = ", ".join(f"{key} = {value} ({intervals.get(key, 'given')})" for key, value in values.items())
    modes = f", {len(best.liquid.modes)} modes" if len(best.liquid.modes) > 1 else ""
    noise = f"{100 * best.deviation:.2g} % where neighbouring points scatter by {100 * scatter(data):.2g} %"
    rest = f"; next best: {others[0].law.label}, {100 * others[0].deviation:.2g} %" if others else ""
    said = [f"fit: {best.law.label}{modes}: {numbers}; intervals of 95 %", f"fit: off by {noise}{rest}"]
    tau_y = _yield_of(best.law)
    if tau_y in best.numbers and np.isfinite(best.numbers[tau_y].least):
        said.append(f"this liquid yields: below a stress of {values[keys[tau_y]]} it is solid")
    return said + [f"warning: {text}" for text in _doubts(best, data, noise, chosen)]


def _yield_of(law: type[Material]) -> str:
    """The name of the parameter of a law that is its yield stress; "" without one."""
    found = (name for name, p in law.parameters().items() if p.dimension is not None and p.dimension.unit == "Pa")
    return next(found, "")


def _doubts(best: Fit, data: Measured, noise: str, chosen: bool) -> Iterator[str]:
    viscous = issubclass(best.law, ViscousLaw)
    if not described(best, data):
        yield f"no law tried describes these data: the best, {best.law.label}, is off by {noise}"
        yielding = [name for name, law in LAWS.items() if _yield_of(law)]
        better = fits(data, yielding) if chosen and data.kinds == {"viscosity"} and not _yield_of(best.law) else []
        if better and described(better[0], data):
            yield f"these data yield: --liquid {better[0].law.name} describes them"
    if (xi := best.numbers.get("xi")) and np.isinf(xi.least):
        yield "these data do not show the viscosity of the solvent: --solvent holds a known one"
    if viscous:
        more = "N1 or moduli tell, and a time that is known is held by --relaxation"
        yield f"a viscosity alone does not tell whether the liquid is elastic: De = 0 is assumed; {more}"
    elif data.kinds == {"viscosity"} and not best.numbers["De"].given:
        yield "no elasticity was measured: relaxation time and N1 follow from the thinning by the law alone"
    elif not data.kinds & {"viscosity", "N1"}:
        laws = "" if chosen else f"; {best.law.label} is taken, and other laws fit as well: choose one by --liquid"
        yield f"moduli do not tell how the viscosity falls with the rate, which a flow curve (--rheology) does{laws}"
