"""Words on pictures: symbols with units, and the parameters of a case."""

from __future__ import annotations

from collections.abc import Collection, Hashable, Mapping, Sequence
from itertools import chain
from pathlib import Path
from typing import Any

from pairsim.cases.case import known_keys
from pairsim.cases.conversion import given_by
from pairsim.cases.experiment import follows_in
from pairsim.cases.keys import GAPS, PARTICLES, Key, Part
from pairsim.cases.laws import Laws, liquid_in
from pairsim.cases.physical import BLOCK, QUANTITIES
from pairsim.cases.quantity_text import PLUS_MINUS, numbers_in_one_unit
from pairsim.cases.yaml_file import flat, read_yaml
from pairsim.physics.declared import LAWS, PARAMETERS
from pairsim.runtime.text import printable


def read_case(file: Path) -> dict[str, Any]:
    """Content of a case.yaml, empty if there is none."""
    return read_yaml(file) if file.is_file() else {}


def plain_text(text: str) -> str:
    """Text that matplotlib can draw and shall not read as TeX."""
    return printable(text).replace("$", r"\$")


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


def tex_number(value: float) -> str:
    """A number with four digits (TeX)."""
    digits, _, power = f"{value:.4g}".partition("e")
    return rf"{digits}\times 10^{{{int(power)}}}" if power else digits


def hashable(value: Any) -> Hashable:
    """A value of a parameter as a key of a mapping."""
    if isinstance(value, list):
        return tuple(map(hashable, value))
    return shown(value) if isinstance(value, dict) else value


def measured(values: Sequence[Any]) -> tuple[list[float], str] | None:
    """Values of a parameter as numbers, and the unit of quantities such as "2 ms"; None if one of them is neither."""
    if all(isinstance(value, int | float) and not isinstance(value, bool) for value in values):
        return list(values), ""
    try:
        return numbers_in_one_unit(values)
    except ValueError:
        return None


def _declared(key: str) -> Key:
    """The declaration of a key; that of its group for one that its model does not know."""
    known = known_keys()
    return known.get(key) or known.get(key.partition(".")[0]) or Key(part=Part.PROBLEM)


def _of_captions() -> list[Key]:
    """The keys of the problem: where cases differ in them is looked for first, and never passed over in silence."""
    return sorted((key for key in known_keys().values() if key.caption), key=lambda key: key.caption)


def symbol(key: str) -> str:
    """A parameter on an axis or in a legend; one of an experiment without a symbol goes without its block's name."""
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


def equation(key: str, value: Any) -> str:
    """A parameter with its value."""
    if value is None:
        return f"no {symbol(key)}"
    if key in ("liquid", "solid"):
        return shown(value)
    with_half_width = isinstance(value, str) and PLUS_MINUS.search(value) is not None
    known = None if with_half_width else measured(value if isinstance(value, list) else [value])
    if key.startswith(BLOCK) and known is not None:
        return f"{symbol(key)} = {shown(list(map(float, known[0])))} {known[1]}"
    if (name := _symbol(key)) and not isinstance(value, str):  # such as 5 kPa +- 20 %
        unit = _declared(key).unit
        return f"${name} = {shown(value)}{unit and rf'\ {unit}'}$"
    return f"{symbol(key)} = {shown(value)}"


def _given_by(case: Mapping[str, Any]) -> set[str]:
    """The keys of captions that the `physical` block of a case gives; De of a Newtonian one, too."""
    of_laws = [each.key for each in Laws.in_case(case).declared()]
    known = {*given_by(case, [*(key.name for key in _of_captions()), *of_laws])}
    return known | ({"De"} if case.get(BLOCK) and not case.get("De") else set())


def case_parts(case: Mapping[str, Any], leave_out: Collection[str] = (), physical: bool = False) -> list[str]:
    """The parameters of a case: blockage, distance, softness, liquid with its law and numbers.

    Keys to leave out vary, or are not fixed for another reason. If `physical`, quantities of the block take the place
    of the numbers that they give.
    """
    block = case.get(BLOCK, {}) if physical else {}
    told = [key for key in block if _in_captions(key, case) and f"{BLOCK}.{key}" not in leave_out]
    quantities = [equation(f"{BLOCK}.{key}", block[key]) for key in told]
    elastic = "De" in leave_out or bool(case.get("De"))
    leave_out = {*leave_out, *(_given_by(case) if physical else ())}
    count = case.get("particles", 2)
    laws, case = Laws.in_case(case), {**case, **_in_groups(case)}
    thinning = laws.liquid.is_viscous and not liquid_in(case).newtonian
    soft = case.get("Ca_e")

    def of(*keys: str) -> list[str]:
        return [equation(key, case[key]) for key in keys if case.get(key) is not None and key not in leave_out]

    numbers = [key for key in _of_captions() if key.symbol and not key.is_default(case.get(key.name, key.default))]
    of_particles = [key.name for key in numbers if key.count == PARTICLES]
    of_gaps = [key.name for key in numbers if key.count == GAPS]
    of_all = [key.name for key in numbers if key.count is None and key.part is not Part.MATERIAL]
    words = {0: "no particles", 1: "1 particle"}.get(count, f"{count} particles")
    parts = [*([] if count == 2 or "particles" in leave_out else [words]), *quantities]
    parts += of(*of_particles) if count else []
    parts += of(*of_gaps) if count > 1 else []
    parts += of(*of_all)
    parts += [] if thinning else of("De")
    if thinning or (elastic and "liquid" in case):
        several = bool(laws.liquid.parts)  # with too many numbers for a caption, but Bn
        name = laws.liquid.model(1.0, case.get("xi", 1.0)).label if several else shown(laws.liquid.name)
        parts += [] if "liquid" in leave_out else [name]
        parts += of("xi") if elastic else []
        parts += _numbers_of("liquid.yielding" if several else "liquid", case, leave_out)
    if "solid" in case and any(soft if isinstance(soft, list | tuple) else [soft]):
        parts += [] if "solid" in leave_out else [shown([each.name for each in laws.solids])]
        parts += _numbers_of("solid", case, leave_out)
    return parts


def _in_groups(case: Mapping[str, Any]) -> dict[str, Any]:
    """The values of those keys of captions that are in groups."""
    places = [key.name.rpartition(".") for key in _of_captions()]
    of_group = [(f"{group}.{last}", case[group].get(last)) for group, _, last in places if group and case.get(group)]
    return {name: value for name, value in of_group if value is not None}


def _in_captions(key: str, case: Mapping[str, Any]) -> bool:
    """Whether a quantity is in captions of a case: not if it gives what is seen, such as the distances of a curve."""
    of = QUANTITIES.get(key)
    return of is None or (of.in_captions and not any(name in case and not _tells_apart(name) for name in of.gives))


def parts_along(case: Mapping[str, Any], name: str, physical: bool) -> list[str]:
    """The parameters of a case, see `case_parts`, but for the one on the axis and the quantity that gives it."""
    able = [each.quantity.key for each in follows_in(Laws.in_case(case)) if name in each.keys]
    return case_parts(case, {name, *(f"{BLOCK}.{key}" for key in able)}, physical)


def _numbers_of(place: str, case: Mapping[str, Any], leave_out: Collection[str]) -> list[str]:
    """The parameters of the law of the liquid or of the solids; none where lines differ in the law."""
    known = [each for each in Laws.in_case(case).declared() if each.key.startswith(place) and each.value is not None]
    return [equation(each.key, each.value) for each in known if not {place, each.key} & {*leave_out}]


def varying_keys(cases: Sequence[Mapping[str, Any]], names: Sequence[str] = ()) -> list[str]:
    """The keys that tell cases apart: each one tells some apart that those before it do not.

    The liquid is therefore not among them where De distinguishes the same cases, nor is a mesh that was chosen for it.
    Distances of a curve are never: the picture shows them.

    Args:
        cases: The cases, by dotted keys.
        names: Keys to compare, in this order; by default all that matter, those of captions first.
    """
    every = [key for key in (*(key.name for key in _of_captions()), *chain(*cases)) if _tells_apart(key)]
    chosen: list[str] = []
    known = 1
    later = {name: key.default for name, key in known_keys().items() if key.since}  # which older cases do not have
    for name in dict.fromkeys(names or every):
        count = len({tuple(hashable(case.get(key, later.get(key))) for key in (*chosen, name)) for case in cases})
        if count > known:
            chosen, known = [*chosen, name], count
    return chosen


def _tells_apart(key: str) -> bool:
    """Whether cases are looked at for differences in a key."""
    return _declared(key).part is not Part.REPORT


def common_parts(
    cases: Sequence[Mapping[str, Any]], varying: Collection[str], physical: bool = False, changed: Collection[str] = ()
) -> list[str]:
    """The parameters that several cases share, as `case_parts`; a law is that of the most elastic one.

    Left out are keys that the picture tells apart (`varying`), and those that vary in further cases (`changed`).
    """
    spelled = list(map(flat, cases))
    known = {key: {hashable(case[key]) for case in spelled if key in case} for key in dict.fromkeys(chain(*spelled))}
    found = {*changed, *(key for key, values in known.items() if len(values) > 1)}
    # A Newtonian one has no law to name.
    fullest = max(cases, key=lambda case: (float(case.get("De") or 0), isinstance(case.get("liquid"), dict)))
    of_laws = [key for key in known if key.startswith(("liquid.", "solid."))]
    names = dict.fromkeys((*(key.name for key in _of_captions()), *of_laws))
    if physical:
        of_block = [f"{BLOCK}.{name}" for name in dict.fromkeys(chain(*(case.get(BLOCK, {}) for case in cases)))]
        given = {key for case in cases for key in _given_by(case)}
        names = dict.fromkeys(name for name in (*of_block, *names) if name not in given)
    unnamed = ", ".join(symbol(key) for key in names if key in found and key not in varying)
    shared = case_parts(fullest, {*varying, *found}, physical)
    return [*shared, *([f"not the same: {unnamed}"] if unnamed else [])]


def parameter_label(key: str, unit: str = "") -> str:
    """Axis label of a parameter of a case, with the unit of its values where they are quantities."""
    return f"{symbol(key)}  [{unit or f'${known_keys().get(key, Key()).unit or "-"}$'}]"
