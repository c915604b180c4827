"""Flow curves and moduli in the text files that rheometers and spreadsheets write.

Such a file has one table or several, each below a line of headings, in an encoding and with separators and decimal
marks of its own. Tables are found by their headings, see `export_tables`; which of them is read is decided here.
Made after public files in github.com/bsaintmichel/read-rheol (RheoCompass, rSpace, TRIOS), jorge-ramirez-upm/RepTate
(.tts, .osc), KarlClinckspoor/Rheology (RheoWin), imewei/rheojax and 3mcloud/hermes-rheo (TRIOS for LIMS, spreadsheets)
and lunin02118-ops/rheolab (viscometers of Chandler and OFITE).
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from pairsim.lab.rheometer.column_headings import Column, places, spellings
from pairsim.lab.rheometer.export_tables import FEWEST, SEPARATORS, Section, cells_of, heading_of, sections_of
from pairsim.lab.rheometer.fit_checks import CHANGES, agreed, difference, measured_in, no_curve
from pairsim.lab.rheometer.number_formats import NUMBER
from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import Argument, InputError

ENCODINGS = ["utf_8", "utf_16", "utf_16_le", "utf_16_be", "cp1252"]
EASTERN = "gb18030", "cp932"  # recognised by words, as statistics take short tables in them for other encodings
SPREADSHEETS = b"PK\x03\x04", b"\xd0\xcf\x11\xe0"  # first bytes of .xlsx, .ods and .xls
ONE_SIGN = str.maketrans({each: sign for sign, others in spellings().signs.items() for each in others})
REPTATE = "omega[rad/s]\tG'[Pa]\tG''[Pa]"
START_UP = r"(?i)\b(gdot|edot|stress|strain|gamma\w*)\s*="
"""Words in the first line of such a file that is not one of small oscillations."""
NEEDED = {
    "rheology": ("shear rate and viscosity or shear stress", "shear rate [1/s], viscosity [mPa.s]"),
    "spectrum": ("frequency, storage modulus and loss modulus", "frequency [Hz], G' [Pa], G'' [Pa]"),
}
"""What each kind of file needs, and an example of its headings."""
LEAST_SPAN = 2.0  # least ratio of the largest to the least rate: points at about one rate are no curve; chosen
ALIKE = 0.1  # largest median difference of the logarithms of sections of one liquid at the same rates; chosen
LEAST_APART = 0.005  # least difference that is reported; chosen
MOST_NAMED = 8  # largest number of sections, or headings, that a sentence names


class Choice(NamedTuple):
    """The section that is read, and sentences on all others."""

    section: Section
    others: list[str]


def read_columns(kind: str, file: Path, wanted: str | Sequence[str] = ()) -> tuple[dict[str, Array], list[str]]:
    """The quantities of a file in SI units, and sentences on what was read and what was left out.

    Files of the kind "rheology" have rate, viscosity and N1, those of "spectrum" frequency, storage and loss. Where
    several sections are curves of one liquid, that with the widest range of rates is read.

    Args:
        kind: "rheology" or "spectrum".
        file: The file.
        wanted: Parts of names: a section is read only if its name contains one of them. None given: any section.

    Raises:
        InputError: The file is no text, has no table with these columns, several that differ, or too few rows; a row
            does not fit its headings; columns contradict each other.
    """
    try:
        section, others = _choice(kind, text_of(file), [wanted] if isinstance(wanted, str) else wanted)
        columns, agreed_on = agreed(kind, section)
    except ValueError as error:
        raise InputError(str(file), Argument(kind), file.name, str(error)) from None
    values = section.si(columns)
    said = [_read(section, columns, next(iter(values.values()))), *agreed_on, *_left_out(kind, section, columns)]
    values = measured_in(values)
    if "N1" in values:
        said += _without_noise(values)
    said += [f"not read: {each}" for each in others]
    return values, [*(f"read: {file.name}: {sentence}" for sentence in said), *_assumed(file, columns)]


def text_of(file: Path) -> str:
    """The text of a file in any encoding, with lines that end in \\n, one sign for each meaning, and no comment signs.

    Raises:
        ValueError: It cannot be read, or is no text.
    """
    from charset_normalizer import from_bytes

    try:
        content = file.read_bytes()
    except OSError as error:
        raise ValueError(f"must be a readable file ({error.strerror})") from None
    if content.startswith(SPREADSHEETS):
        raise ValueError("must be text: open it in a spreadsheet, and save the sheet with the table as CSV (UTF-8)")
    texts = [content.decode(each, "ignore") for each in EASTERN]
    texts = [each for each in texts if re.search(spellings().east_asian, each)]
    guesses = from_bytes(content, cp_isolation=ENCODINGS)
    texts += map(str, sorted(guesses, key=lambda each: each.encoding != "utf_8"))  # which is seldom anything else
    if not texts:
        raise ValueError("must be text in a recognisable encoding: export the table as CSV in UTF-8")
    text = texts[0].removeprefix("\ufeff").translate(ONE_SIGN)
    text = unicodedata.normalize("NFKC", text).translate(ONE_SIGN).replace("\r\n", "\n").replace("\r", "\n")
    text = re.sub(r"(?m)^[#%]+[ \t]*(?=[^\W\d])", "", text)  # headings that begin with the sign of a comment
    return re.sub(r'(?<![^,;\t\n])"[^"]*"(?![^,;\t\n])', lambda quoted: quoted[0].replace("\n", " "), text)


def _choice(kind: str, text: str, wanted: Sequence[str]) -> Choice:
    """The section to be read, and the others; ValueError if there is none, or if the user has to choose one."""
    lines = text.split("\n")
    reptate = kind == "spectrum" and re.match(r"\w+=[^;\n]*;", text) and not re.search(START_UP, lines[0])
    if reptate and not any(heading_of(kind, line) for line in lines):  # as in most files of RepTate
        count = next((len(line.split()) for line in lines if re.match(r"\s*[.\d]", line)), 0)
        lines[0] = REPTATE + "\tfurther" * (count - 3)
    sections = sections_of(kind, lines, leading=bool(reptate))
    if not sections:
        raise ValueError(_no_table(kind, lines))
    wide = [each for each in sections if (each.misfit and len(each.cells) >= FEWEST) or _is_wide(each)]
    if not (wide := wide or [each for each in sections if each.misfit]):
        raise ValueError(_too_few(kind, lines, sections))
    named = [each for each in wide if not wanted or any(name.lower() in each.name.lower() for name in wanted)]
    if not named:
        has = _list(each.name for each in wide)
        raise ValueError(f"must have a section named {' or '.join(wanted)}, but has {has}")
    if broken := next((each for each in named if each.misfit and not each.foreign), None):
        of = f", in {broken.name}; `section` NAME reads another one" if len(wide) > 1 else ""
        raise ValueError(broken.misfit + of)
    unfit = {each.name: why for each in named if (why := _unfit(each, chosen=bool(wanted)))}
    curves = [each for each in named if each.name not in unfit]
    if not curves:
        if len(wide) == 1:
            raise ValueError(next(iter(unfit.values())))
        raise ValueError(f"has no curve of one liquid: {_list(f'{name} {why}' for name, why in unfit.items())}")
    taken = max(curves, key=lambda each: each.span)
    apart = {each.name: _apart(kind, taken, each) for each in curves if each is not taken}
    if any(not each < ALIKE for each in apart.values()):
        names = _list(f"{each.name}{_by(apart[each.name]) if each is not taken else ''}" for each in curves)
        raise ValueError(f"has {len(curves)} sections that are not alike, and `section` NAME chooses one: {names}")
    others = [f"{_list(f'{name}{_by(each)}' for name, each in apart.items())}; --section NAME reads another one"]
    left = [f"{name}, which {why}" for name, why in unfit.items()]
    return Choice(taken, [*(others if apart else []), *left[:MOST_NAMED], *([taken.aside] if taken.aside else [])])


def _list(names: Iterable[str]) -> str:
    """Names for a sentence, the first ones if there are many."""
    all_ = [*names]
    more = len(all_) - MOST_NAMED
    return "; ".join(all_[:MOST_NAMED]) + (f" and {more} more" if more > 0 else "")


def _is_wide(section: Section) -> bool:
    """Whether the rates of a section span a wide enough range; True, too, if its marks keep it from being read."""
    try:
        return section.span >= np.log(LEAST_SPAN)
    except ValueError:
        return True


def _too_few(kind: str, lines: Sequence[str], sections: Sequence[Section]) -> str:
    """Why sections without enough rows are not read."""
    if not (most := max(each.usable.sum() for each in sections)):
        return _no_table(kind, lines)
    rows = f"at least {FEWEST} rows of positive numbers, with rates that differ by a factor of {LEAST_SPAN:g}"
    has = f"{most}"
    if most >= FEWEST:
        section = max(sections, key=lambda each: each.usable.sum())
        rates = section.numbers.iloc[:, 0][section.usable]
        has = f"{most}, with rates from {rates.min():.4g} to {rates.max():.4g}"
    return f"must have {rows} or more, but has {has}"


def _unfit(section: Section, chosen: bool) -> str:
    """Why a section is not fitted, "" if it can be; a calibration is fitted only if it was chosen by its name."""
    if section.misfit:
        return section.misfit
    if not chosen and re.search(spellings().of_something_else, section.name):
        return "is a calibration, by its name"
    try:
        return no_curve(section)
    except ValueError as error:
        return str(error)


def _apart(kind: str, one: Section, other: Section) -> float:
    """The result of `difference` for two sections; infinite if one of them cannot be read."""
    try:
        return difference(kind, one, other)
    except ValueError:
        return float("inf")


def _by(apart: float) -> str:
    """The difference of a section from the one with the widest range of rates, in words; "" if it is small."""
    if np.isinf(apart):
        return " (cannot be compared)"
    if np.isnan(apart):
        return " (at other rates)"
    factor = np.exp(apart)
    differs = f"{100 * (factor - 1):.2g} %" if factor < CHANGES else f"a factor of {factor:.2g}"
    return "" if apart < LEAST_APART else f" (differs by {differs})"


def _read(section: Section, columns: Mapping[str, Column], rates: Array) -> str:
    """A sentence on the points, their range, and which quantity was read from which column."""
    (_, rate), *others = columns.items()
    of_rate = f"{rates.min():.4g} to {rates.max():.4g} {rate.assumed}"
    if rate.factor != 1:
        of_rate += f" ({rate} in {rate.unit})"
    each = ", ".join(f"{name} in {of.unit or of.assumed or '1'} ({of})" for name, of in others)
    return f"{len(rates)} points, {of_rate}, {each} of {section.name}"


def _left_out(kind: str, section: Section, columns: Mapping[str, Column]) -> Iterator[str]:
    """Sentences on rows that cannot be used, and on columns that are not read but may have a quantity, too."""
    out = section.measured[~section.usable]
    if len(out):
        line, name = out.index[0], str((~out.iloc[0]).idxmax())
        place = columns[name]
        value = section.cells.loc[line, place.place]
        number = re.fullmatch(NUMBER, value) and not re.match(r"-|[0.,]*$", value)
        beyond = "is not below 90 degrees" if section.numbers.loc[line, name] > 0 else "is an overload"
        why = f"'{value}' {beyond if number else 'is not a positive number'}" if value else "is empty"
        yield f"{len(out)} of {len(section.cells)} rows left out; in the first one, line {line}, {place} {why}"
    named = places(kind, section.heading)
    for name in [each for each in columns if each != "frequency"]:  # which many files have in Hz and in rad/s
        for i in sorted(named[name].keys() - {columns[name].place} - section.beside):
            yield f'column {i + 1} "{section.heading[i]}" is not read, although it may be {name}, too'
    if "N1" not in columns:
        for i in named.get("force", ()):
            yield f'column {i + 1} "{section.heading[i]}" is not read: N1 = 2 F/(pi R^2) needs the radius R of the cone'


def _without_noise(values: dict[str, Array]) -> Iterator[str]:
    """Set N1 to NaN up to the largest rate at which it is not positive, where it is noise about zero, and say so."""
    noise = values["rate"][values["N1"] <= 0]
    if len(noise):
        values["N1"] = np.where(values["rate"] > noise.max(), values["N1"], np.nan)
        left = int(np.isfinite(values["N1"]).sum())
        yield f"N1 is not positive at up to {noise.max():.4g} 1/s: {left} of its points, at larger rates, are read"


def _assumed(file: Path, columns: Mapping[str, Column]) -> Iterator[str]:
    """Warnings of units that are missing, or that may be meant in another way."""
    if without := [f"{each}, taken as {each.assumed}" for each in columns.values() if each.assumed and not each.unit]:
        units = f"no unit is given for {', '.join(without)}"
        yield f"warning: {file.name}: {units}; if the unit is another one, write it into the heading, as [mPa.s]"
    rate = next(iter(columns.values()))
    if rate.unit in ("1/s", "s-1") and re.match("f", rate.heading, re.IGNORECASE):
        yield f"warning: {rate} is taken as an angular frequency, in rad/s; if it counts cycles, its unit is Hz"


def _no_table(kind: str, lines: Sequence[str]) -> str:
    """Why a file has no table of its kind."""
    wanted, example = NEEDED[kind]
    headed = [each for each in NEEDED if any(heading_of(each, line) for line in lines)]
    if other := [each for each in headed if each != kind]:
        return f"must have columns of {wanted}, but has those of `{other[0]}`"
    if headed:
        return f"must have rows of positive numbers, without units, below the headings of {wanted}"
    rows = [cells_of(line, separator) for separator in SEPARATORS[:-1] for line in lines]
    named = max(rows, key=lambda row: (len(places(kind, row)), sum(cell[:1].isalpha() for cell in row)))
    has = ", ".join(filter(None, named[:8]))
    return f"must have a line of headings of {wanted}, such as {example}, but has {has or 'nothing'}"
