"""Files of a rheometer, and the liquid of a case that is fitted to them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pairsim.cases.physical import BLOCK, QUANTITIES
from pairsim.cases.quantity_text import si, suited
from pairsim.lab.rheometer.export_files import read_columns
from pairsim.lab.rheometer.law_fits import (
    Fit,
    Number,
    as_good,
    described,
    dimensions_of,
    each_fit,
    fits,
    ranked,
    tried,
)
from pairsim.lab.rheometer.measured import Measured, at_rest, scatter
from pairsim.physics.liquids import LAWS
from pairsim.physics.liquids.viscous import ViscousLaw
from pairsim.physics.material import Material
from pairsim.quantities.kinds import STRESS
from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import Argument, InputError

ROUNDED = 1e-4  # part of a number that is lost where it is rounded to four digits
PLUS_MINUS = " +- "
APART = 0.1  # logarithm of the ratio of two viscosities at rest above which files do not agree; chosen
UNKNOWN = 10.0  # ratio of the ends of an interval above which a number is said to be hardly known; chosen
ALL = {of.key: of for law in LAWS.values() for of in dimensions_of(law).values() if of is not None}
"""The measurable quantities of liquids, by their keys in the `physical` block."""


@dataclass(frozen=True)
class MeasuredLiquid:
    """The best fit to files of a rheometer."""

    fit: Fit
    data: Measured  # what was measured
    quantities: dict[str, str]  # what goes into `physical` of a case
    fitted: frozenset[str]  # the keys of those that were fitted
    block: Any  # value of its key `liquid`
    intervals: dict[str, str]  # of each fitted number without a half-width there, by its key in `physical` or `liquid`
    sentences: list[str]  # what was read, the fit in words, and warnings


class Listener:
    """Receives what is found while files are read and fitted; this base class ignores it."""

    def answer(self, sentence: str) -> None:
        """A sentence of the answer."""

    def progress(self, sentence: str) -> None:
        """A sentence on what is being done."""


def fit_liquid(
    rheology: Path | str | None,
    spectrum: Path | str | None,
    liquid: Any = None,
    section: str | Sequence[str] = (),
    quantities: Mapping[str, str] | None = None,
    listener: Listener | None = None,
) -> MeasuredLiquid:
    """Fit a law to the files of a rheometer.

    Args:
        rheology, spectrum, section, listener: As for `pairsim.units`.
        liquid: The name of a law, or a block with it and with numbers that keep their values; None for the best law by
            the Bayesian information criterion.
        quantities: Those of the `physical` block; those of the liquid among them keep their values.

    Raises:
        InputError: A file cannot be used, or has too few points for the law.
        KeyboardInterrupt: The fit was interrupted; the listener has received the best law so far.
    """
    listener = listener or Listener()
    block = dict(liquid) if isinstance(liquid, Mapping) else {"law": liquid}
    law, numbers = block.pop("law", None), block
    if law is not None and law not in LAWS:
        allowed = f"must be the name of a law, whose parameters are fitted: {', '.join(LAWS)}"
        raise InputError("pairsim units", Argument("liquid"), liquid, allowed)
    held = {key: text for key, text in (quantities or {}).items() if key in ALL and text is not None}
    given = {name: float(value) for name, value in numbers.items()}
    for key, text in held.items():
        try:
            given[key] = si(text, ALL[key].with_parameters(numbers))
        except ValueError as error:
            raise InputError("pairsim units", f"{BLOCK}.{key}", text, str(error)) from None
    columns: dict[str, Array] = {}
    said: list[str] = []
    for kind, file in (("rheology", rheology), ("spectrum", spectrum)):
        if file is not None:
            of_file, read = read_columns(kind, Path(file), section)
            columns, said = columns | of_file, said + read
    data, found = Measured(**columns), list[Fit]()
    if names := tried(data, [law] if law else None, given):
        for sentence in said:
            listener.answer(sentence)
        found = _fitted(data, names, given, listener)
    if not found:
        known = f" besides {', '.join(given)}" if given else ""
        allowed = f"must be a law with unknown numbers{known}, of which there are fewer than points"
        raise InputError("pairsim units", Argument("liquid"), law, allowed)
    fitted, value, intervals = keys_of(found[0])
    of_fit = sentences(found, data, chosen=law is not None)
    for sentence in of_fit:
        listener.answer(sentence)
    of_case = {**fitted, **held}
    intervals = {key: each for key, each in intervals.items() if PLUS_MINUS not in of_case.get(key, "")}
    return MeasuredLiquid(
        found[0], data, of_case, frozenset(fitted.keys() - held.keys()), value, intervals, said + of_fit
    )


def _fitted(data: Measured, names: list[str], given: Mapping[str, float], listener: Listener) -> list[Fit]:
    """The fits of laws, the best first, with their intervals."""
    found = dict[str, Fit]()
    try:
        if len(names) > 1:
            listener.progress(f"fit: trying {', '.join(names)}")
        for fit in each_fit(data, names, given):
            found[fit.law.name] = fit
            listener.progress(f"fit: {_label(fit)}: off by {_percent(fit.deviation)}")
        if fits := ranked(found.values()):
            listener.progress(f"fit: intervals of {_label(fits[0])}")
            _ = fits[0].numbers
    except KeyboardInterrupt:
        listener.answer(_stopped(ranked(found.values()), [name for name in names if name not in found]))
        raise
    return fits


def _stopped(found: Sequence[Fit], left: Sequence[str]) -> str:
    """A sentence on the best law so far when fits are interrupted."""
    if not found:
        return "fit: stopped before the first law was fitted"
    best = found[0]
    numbers = ", ".join(f"{key} = {value}" for key, value in _values(best).items())
    rest = f"; not tried: {', '.join(left)}" if left else ""
    known = f"{_label(best)}: {numbers}; off by {_percent(best.deviation)}, intervals are not known"
    return f"fit: stopped; the best so far is {known}{rest}; --liquid {best.law.name} fits this law alone"


def _label(fit: Fit) -> str:
    return fit.law.label + (f", {len(fit.liquid.modes)} modes" if len(fit.liquid.modes) > 1 else "")


def _percent(deviation: float) -> str:
    return f"{100 * deviation:.2g} %"


@dataclass(frozen=True)
class _Key:
    """A number of a fitted liquid as a quantity of a case."""

    key: str  # in the `physical` block
    number: float
    unit: str
    factor: float  # the number over that of the fit

    @property
    def value(self) -> str:
        """The number with its unit."""
        return f"{self.number:.4g} {self.unit}"

    def with_half_width(self, number: Number | None) -> str:
        """The number with its unit and, where a case takes one, a half-width: the wider side of its interval.

        A half-width is left out that is no smaller than the number, or is lost in its rounding.
        """
        if number is None or number.given or not QUANTITIES[self.key].uncertain:
            return self.value
        half = self.factor * max(number.most - number.value, number.value - number.least)
        if not ROUNDED * self.number < half < self.number:
            return self.value
        return f"{self.number:.4g}{PLUS_MINUS}{float(f'{half:.2g}'):g} {self.unit}"  # 100 rather than 1e+02


def _keys(fit: Fit) -> dict[str, _Key]:
    """The quantities of a `physical` block that a fitted liquid gives, by the name of its number."""
    own, liquid, found = _own(fit), fit.liquid, dict[str, _Key]()
    values = {"eta_0": fit.eta_0, "De": liquid.De, "xi": liquid.xi} | own.numbers
    for name, of in dimensions_of(fit.law).items():
        default = own.parameters()[name].default if name in own.parameters() else None
        if of is not None and values[name] != default:
            factor = of.size(fit.eta_0) if name != "eta_0" else 1.0
            unit, size = suited(factor * values[name], of.with_parameters(_pure(fit)).unit)
            found[name] = _Key(of.key, factor * values[name] / size, unit, factor / size)
    return found


def _own(fit: Fit) -> Any:
    """The law of a fitted liquid with its numbers."""
    return fit.liquid.modes[0] if fit.liquid.modes else fit.liquid.solvent


def _pure(fit: Fit) -> dict[str, float]:
    """The numbers of a law that have no unit, to four digits, without that of its regularisation."""
    own = _own(fit)
    return {
        name: float(f"{getattr(own, name):.4g}")
        for name, p in own.parameters().items()
        if p.dimension is None and name != own.regularisation
    }


def _values(fit: Fit) -> dict[str, str]:
    """The numbers of a fitted liquid, quantities with their units first."""
    keys = _keys(fit)
    others = {name: f"{value:.4g}" for name, value in fit.values.items() if name not in keys}
    return {each.key: each.value for each in keys.values()} | others


def keys_of(fit: Fit) -> tuple[dict[str, str], Any, dict[str, str]]:
    """The quantities of a `physical` block that a fitted liquid gives, the value of `liquid`, and intervals in words.

    Quantities have half-widths where a case takes them.
    """
    keys, pure, modes, law = _keys(fit), _pure(fit), fit.liquid.modes, fit.law.name
    quantities = {each.key: each.with_half_width(fit.numbers.get(name)) for name, each in keys.items()}
    intervals = dict[str, str]()
    for name, number in fit.numbers.items():
        if not number.given:
            key = keys.get(name)
            intervals[key.key if key else name] = _interval(number, key.factor if key else 1.0)
    if len(modes) < 2:
        return quantities, {"law": law, **pure} if pure else law, intervals
    each = [{key: fit.values.get(f"{key}_{i + 1}", 1.0) for key in ("time", "weight")} for i in range(len(modes))]
    block = [{"law": law, **{key: float(f"{v:.4g}") for key, v in mode.items()}, **pure} for mode in each]
    return quantities, {"law": "modes", "modes": block}, intervals


def _interval(number: Number, factor: float = 1.0) -> str:
    """The interval of 95 % of a number, times a factor, in words."""
    least, most = factor * number.least, factor * number.most
    if np.isinf(least) and np.isinf(most):
        return "not determined by these data"
    if np.isinf(least):
        return f"at most {most:.4g}"
    return f"at least {least:.4g}" if np.isinf(most) else f"{least:.4g} to {most:.4g}"


def sentences(fits: Sequence[Fit], data: Measured, chosen: bool = False) -> list[str]:
    """The best fit in words, with the intervals of its numbers, and warnings of what the data do not determine."""
    best, *others = fits
    _, _, intervals = keys_of(best)
    numbers = ", ".join(f"{key} = {value} ({intervals.get(key, 'given')})" for key, value in _values(best).items())
    noise = f"{_percent(best.deviation)} where neighbouring points scatter by {_percent(scatter(data))}"
    rest = f"; next best: {_label(others[0])}, {_percent(others[0].deviation)}" if others else ""
    said = [f"fit: {_label(best)}: {numbers}; intervals of 95 %", f"fit: off by {noise}{rest}"]
    tau_y = _yield_of(best.law)
    if tau_y in best.numbers and np.isfinite(best.numbers[tau_y].least):
        said.append(f"this liquid yields: below a stress of {_keys(best)[tau_y].value} it is solid")
    return said + [f"warning: {text}" for text in _doubts(best, others, data, noise, chosen)]


def _yield_of(law: type[Material]) -> str:
    """The name of the parameter of a law that is its yield stress; "" without one."""
    found = (name for name, p in law.parameters().items() if p.dimension is not None and p.dimension.kind == STRESS)
    return next(found, "")


def _doubts(best: Fit, others: Sequence[Fit], data: Measured, noise: str, chosen: bool) -> Iterator[str]:
    viscous, label = issubclass(best.law, ViscousLaw), best.law.label
    if not described(best, data):
        if chosen:
            yield f"{label}, the only law tried, does not describe these data: it is off by {noise}"
        else:
            yield f"no law tried describes these data: the best, {label}, is off by {noise}"
        yielding = [name for name, law in LAWS.items() if _yield_of(law)]
        better = fits(data, yielding) if chosen and data.kinds == {"viscosity"} and not _yield_of(best.law) else []
        if better and described(better[0], data):
            yield f"these data yield: --liquid {better[0].law.name} describes them"
    if (xi := best.numbers.get("xi")) and np.isinf(xi.least):
        yield "these data do not determine the viscosity of the solvent: --solvent fixes a known one"
    steady, dynamic = at_rest(data.rate, data.viscosity), at_rest(data.frequency, _complex_viscosity(data))
    if steady and dynamic and abs(np.log(steady / dynamic)) > APART:
        yield (
            f"the files do not agree: the viscosity at rest is {steady:.4g} Pa.s by the flow curve and {dynamic:.4g} "
            "Pa.s by the moduli, which must be equal in any liquid; temperature or concentration may differ"
        )
    time, slowest = best.numbers.get("De"), float(min(x.min() for _, x, _ in data.curves))
    if time is not None and time.value * slowest > 1 and time.most > UNKNOWN * time.least:
        yield (
            f"the relaxation time, {time.value:.3g} s, is poorly determined, and longer than these data can show, "
            f"which begin at {slowest:.3g} 1/s; --relaxation fixes a known one"
        )
    alike = [fit.law for fit in as_good(best, others)] if described(best, data) and not viscous else []
    taken = f"{label} is taken, and {_and([law.label for law in alike])} {'fit' if alike[1:] else 'fits'} as well"
    choose = f"{taken}: --liquid {' or '.join(law.name for law in alike)} chooses one" if alike else ""
    if viscous:
        more = "N1 or moduli would show it, and --relaxation gives a known relaxation time"
        yield f"the viscosity alone does not show whether the liquid is elastic: De = 0 is assumed; {more}"
    elif data.kinds == {"viscosity"} and not best.numbers["De"].given:
        yield "no elasticity was measured: relaxation time and N1 are inferred from the thinning, by the law alone"
    elif not data.kinds & {"viscosity", "N1"}:
        more = f"; {choose}" if choose else ""
        yield f"moduli do not show how the viscosity falls with the rate, but a flow curve (--rheology) does{more}"
    elif choose:
        yield choose


def _complex_viscosity(data: Measured) -> Array:
    """The size of the complex viscosity at the frequencies [Pa s], (m,)."""
    return np.asarray(np.hypot(data.storage, data.loss) / data.frequency)


def _and(names: Sequence[str]) -> str:
    *first, last = [*names] or [""]
    return f"{', '.join(first)} and {last}" if first else last
