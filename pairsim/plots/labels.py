"""Words on pictures: symbols with units, and the parameters of a case."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from itertools import chain
from pathlib import Path

from pairsim.cases.case import known_keys
from pairsim.cases.conversion import given_by
from pairsim.cases.experiment import follows_in
from pairsim.cases.keys import GAPS, PARTICLES, Key, Part
from pairsim.cases.physical import BLOCK, QUANTITIES
from pairsim.cases.quantity_text import PLUS_MINUS, has_half_width
from pairsim.cases.yaml_file import read_yaml
from pairsim.physics.declared import PARAMETERS
from pairsim.plots.parameters import Parameters, ShownCase, measured, plain_text, shown
from pairsim.runtime.plain import Plain

TIMES = re.compile(r"(?<=[A-Za-z])[.*](?=[A-Za-z])")
"""The sign between units, as in Pa.s."""
POWER = re.compile(r"[⁰¹²³⁴⁵⁶⁷⁸⁹⁻]+(?:⋅[⁰¹²³⁴⁵⁶⁷⁸⁹]+)?|(?:\*\*|\^)(?P<plain>-?\d+(?:\.\d+)?)")
"""A power of a unit, as pint or a case file writes it."""
DIGITS = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻⋅", "0123456789-.")


def read_case(file: Path) -> ShownCase:
    """The case of a case.yaml, empty if there is none."""
    return ShownCase(read_yaml(file) if file.is_file() else {})


def tex_number(value: float) -> str:
    """A number with four digits (TeX)."""
    digits, _, power = f"{value:.4g}".partition("e")
    return rf"{digits}\times 10^{{{int(power)}}}" if power else digits


def _declared(key: str) -> Key:
    """The declaration of a key; for one that no model knows, that of its group."""
    known = known_keys()
    return known.get(key) or known.get(key.partition(".")[0]) or Key(part=Part.PROBLEM)


def _of_captions() -> list[Key]:
    """The keys of captions, in their order: cases are compared by these first, and a difference is always named."""
    return sorted((key for key in known_keys().values() if key.caption), key=lambda key: key.caption)


def symbol(key: str) -> str:
    """A parameter on an axis or in a legend; a quantity without a symbol is named without its block."""
    if name := _symbol(key):
        return f"${name}$"
    return plain_text(key.removeprefix(f"{BLOCK}.").replace("_", " ") if key.startswith(BLOCK) else key)


def _symbol(key: str) -> str:
    """The symbol of a key, of a parameter of a law such as liquid.n, or of a quantity; empty if it has none."""
    group, _, last = key.rpartition(".")
    if key.startswith(("liquid.", "solid.")):
        return PARAMETERS[last].parameter.symbol if last in PARAMETERS else ""
    if group == BLOCK:
        return QUANTITIES[last].symbol if last in QUANTITIES else ""
    return known_keys().get(key, Key()).symbol


def equation(key: str, value: object) -> str:
    """A parameter with its value."""
    if value is None:
        return f"no {symbol(key)}"
    if key in ("liquid", "solid"):
        return shown(value)
    if key.startswith(BLOCK):
        return f"{symbol(key)} = {_quantity(value)}"
    if (name := _symbol(key)) and not isinstance(value, str):
        unit = _declared(key).unit
        return f"${name} = {shown(value)}{unit and rf'\ {unit}'}$"
    return f"{symbol(key)} = {shown(value)}"


def _quantity(value: object) -> str:
    """A quantity, or several in one unit."""
    several = isinstance(value, list | tuple)
    known = measured(list(value) if isinstance(value, list | tuple) else [value])
    if not several and has_half_width(value):
        return _with_powers(TIMES.sub("\N{DOT OPERATOR}", PLUS_MINUS.sub("±", shown(value))))
    if known is None:
        return shown(value)
    return f"{shown(list(map(float, known[0])))} {_with_powers(known[1])}"


def _with_powers(unit: str) -> str:
    """A unit whose powers are TeX: fonts lack most of the superscripts of Unicode, and so the power of K."""
    return POWER.sub(lambda power: f"$^{{{power['plain'] or power[0].translate(DIGITS)}}}$", unit)


def _given_by(case: ShownCase) -> set[str]:
    """The keys of captions that follow from the `physical` block of a case; De of a Newtonian one, too."""
    of_laws = [each.key for each in case.laws.declared()]
    known = {*given_by(case.content, [*(key.name for key in _of_captions()), *of_laws])}
    return known | ({"De"} if case.quantities and not case.De else set())


def case_parts(case: ShownCase, leave_out: Collection[str] = (), physical: bool = False) -> list[str]:
    """The parameters of a case: blockage, distance, softness, liquid with its law and numbers.

    Keys to leave out vary, or are not fixed for another reason. If `physical`, quantities of the block take the place
    of the numbers that follow from them.
    """
    block = case.quantities if physical else {}
    told = [key for key in block if _in_captions(key, case) and f"{BLOCK}.{key}" not in leave_out]
    quantities = [equation(f"{BLOCK}.{key}", block[key]) for key in told]
    elastic = "De" in leave_out or bool(case.De)
    left_out = {*leave_out, *(_given_by(case) if physical else ())}
    values = {key: _value(case, key.name) for key in _of_captions() if key.symbol}
    numbers = [key for key, value in values.items() if value is not None and not key.is_default(value)]
    of_particles = [key.name for key in numbers if key.count == PARTICLES]
    of_gaps = [key.name for key in numbers if key.count == GAPS]
    of_all = [key.name for key in numbers if key.count is None and key.part is not Part.MATERIAL]
    words = {0: "no particles", 1: "1 particle"}.get(case.particles, f"{case.particles} particles")
    return [
        *([] if case.particles == 2 or "particles" in left_out else [words]),
        *quantities,
        *(_numbers(case, of_particles, left_out) if case.particles else []),
        *(_numbers(case, of_gaps, left_out) if case.particles > 1 else []),
        *_numbers(case, of_all, left_out),
        *_parts_of_liquid(case, elastic, left_out),
        *_parts_of_solids(case, left_out),
    ]


def _numbers(case: ShownCase, keys: Sequence[str], left_out: Collection[str]) -> list[str]:
    """The equations, such as "De = 1", of those keys that a case has."""
    known = {key: _value(case, key) for key in keys if key not in left_out}
    return [equation(key, value) for key, value in known.items() if value is not None]


def _value(case: ShownCase, key: str) -> Plain:
    """The value of a key, which may be in a group; None where a case has none."""
    group, _, last = key.rpartition(".")
    inside = case.content.get(group) if group else case.content
    return inside.get(last) if isinstance(inside, Mapping) else None


def _parts_of_liquid(case: ShownCase, elastic: bool, left_out: Collection[str]) -> list[str]:
    """De, or the law of the liquid with its numbers; an elastic liquid has both."""
    law = case.laws.liquid
    thinning = law.is_viscous and not case.liquid.newtonian
    parts = [] if thinning else _numbers(case, ["De"], left_out)
    if not (thinning or (elastic and "liquid" in case.content)):
        return parts
    several = bool(law.parts)  # with too many numbers for a caption, except Bn
    if "liquid" not in left_out:
        parts.append(case.liquid_at(De=1.0).label if several else shown(law.name))
    parts += _numbers(case, ["xi"], left_out) if elastic else []
    return parts + _numbers_of("liquid.yielding" if several else "liquid", case, left_out)


def _parts_of_solids(case: ShownCase, left_out: Collection[str]) -> list[str]:
    """The law of soft particles with its numbers, where it is not the default one."""
    if "solid" not in case.content or not any(case.Ca_es):
        return []
    names = [] if "solid" in left_out else [shown([each.name for each in case.laws.solids])]
    return names + _numbers_of("solid", case, left_out)


def _in_captions(key: str, case: ShownCase) -> bool:
    """Whether a quantity is in captions of a case: not if the picture shows it, such as the distances of a curve."""
    of = QUANTITIES.get(key)
    return of is None or (
        of.in_captions and not any(name in case.content and not _tells_apart(name) for name in of.gives)
    )


def parts_along(case: ShownCase, name: str, physical: bool) -> list[str]:
    """The parameters of a case, see `case_parts`, without the one on the axis and the quantity that gives it."""
    able = [each.quantity.key for each in follows_in(case.laws) if name in each.keys]
    return case_parts(case, {name, *(f"{BLOCK}.{key}" for key in able)}, physical)


def _numbers_of(place: str, case: ShownCase, leave_out: Collection[str]) -> list[str]:
    """The parameters of the law of the liquid or of the solids; none where lines differ in the law."""
    known = [each for each in case.laws.declared() if each.key.startswith(place) and each.value is not None]
    return [equation(each.key, each.value) for each in known if not {place, each.key} & {*leave_out}]


def varying_keys(cases: Sequence[Parameters], names: Sequence[str] = (), first: Sequence[str] = ()) -> list[str]:
    """The keys that tell cases apart: each one tells some apart that those before it do not.

    The liquid is therefore not among them where De distinguishes the same cases, nor is a mesh that was chosen for it.
    Distances of a curve never are: the picture shows them.

    Args:
        cases: The cases.
        names: Keys to compare, in this order; by default all that matter, those of captions first.
        first: Keys to compare before these.
    """
    every = [key for key in (*(key.name for key in _of_captions()), *chain(*cases)) if _tells_apart(key)]
    chosen: list[str] = []
    known = 1
    later = Parameters({name: key.default for name, key in known_keys().items() if key.since})  # not in older cases
    whole = [later | case for case in cases]
    for name in dict.fromkeys((*first, *(names or every))):
        count = len({case.at((*chosen, name)) for case in whole})
        if count > known:
            chosen, known = [*chosen, name], count
    return chosen


def _tells_apart(key: str) -> bool:
    """Whether cases are compared in a key."""
    return _declared(key).part is not Part.REPORT


def common_parts(
    cases: Sequence[ShownCase], varying: Collection[str], physical: bool = False, changed: Collection[str] = ()
) -> list[str]:
    """The parameters that several cases share, as `case_parts`; a law is that of the most elastic one.

    Left out are keys that the picture tells apart (`varying`), and those that vary in further cases (`changed`).
    """
    every = dict.fromkeys(chain(*(case.parameters for case in cases)))
    known = {key: {case.parameters[key] for case in cases if key in case.parameters} for key in every}
    found = {*changed, *(key for key, values in known.items() if len(values) > 1)}
    # A Newtonian one has no law to name.
    fullest = max(cases, key=lambda case: (case.De, isinstance(case.content.get("liquid"), dict)))
    of_laws = [key for key in known if key.startswith(("liquid.", "solid."))]
    names = dict.fromkeys((*(key.name for key in _of_captions()), *of_laws))
    if physical:
        of_block = [f"{BLOCK}.{name}" for name in dict.fromkeys(chain(*(case.quantities for case in cases)))]
        given = {key for case in cases for key in _given_by(case)}
        names = dict.fromkeys(name for name in (*of_block, *names) if name not in given)
    unnamed = ", ".join(symbol(key) for key in names if key in found and key not in varying)
    shared = case_parts(fullest, {*varying, *found}, physical)
    return [*shared, *([f"not the same: {unnamed}"] if unnamed else [])]


def parameter_label(key: str, unit: str = "") -> str:
    """Axis label of a parameter of a case, with the unit of its values where they are quantities."""
    return f"{symbol(key)}  [{_with_powers(unit) or f'${known_keys().get(key, Key()).unit or "-"}$'}]"
