"""Flow curves and moduli in the text files that rheometers and spreadsheets write.

Such a file has one table or several, each below a line of headings, in an encoding and with separators and decimal
marks of its own. Tables are found by their headings, see `rheometer_columns`. Made after public files in
github.com/bsaintmichel/read-rheol (RheoCompass, rSpace, TRIOS), jorge-ramirez-upm/RepTate (.tts, .osc),
KarlClinckspoor/Rheology (RheoWin) and imewei/rheojax (TRIOS for LIMS, spreadsheets).
"""

from __future__ import annotations

import csv
import re
import unicodedata
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise, product
from pathlib import Path

import numpy as np
import pandas as pd

from pairsim.api.rheometer_columns import Column, column, places, words
from pairsim.runtime.arrays import Array
from pairsim.runtime.errors import InputError

ENCODINGS = ["utf_8", "utf_16", "utf_16_le", "utf_16_be", "cp1252"]
EASTERN = "gb18030", "cp932"  # known by their words: to statistics short tables in them look like others
SPREADSHEETS = b"PK\x03\x04", b"\xd0\xcf\x11\xe0"  # first bytes of .xlsx, .ods and .xls
SPACES = r"\t|\s{2,}"
ONE_SPACE = r"\s+(?![^\[(]*[\])])"
SEPARATORS = ("\t", ";", ",", SPACES, ONE_SPACE)
ONE_SIGN = str.maketrans({each: sign for sign, others in words()["signs"].items() for each in others})
NUMBER = r"(?i)[-+]?(\d+[.,]?\d*|[.,]\d+)([ed][-+]?\d+)?"
REPTATE = "omega[rad/s]\tG'[Pa]\tG''[Pa]" + "\tfurther" * 20
STEP_COLUMNS = r"(?i)action name|step name|interval|segment"
TITLES = r"(?im)^(?:\[step\]\n(?!step name)|(?:step name|result|résultat|ergebnis)\b:?[\t;,])(.+)"
INTERVALS = r"(?im)^interval\w*\b[^\t;,]*[\t;,](\d+)"
NEEDED = {
    "--rheology": ("shear rate and viscosity or shear stress", "shear rate [1/s], viscosity [mPa.s]"),
    "--spectrum": ("frequency, storage modulus and loss modulus", "frequency [Hz], G' [Pa], G'' [Pa]"),
}
"""What the file of an option needs, and an example of its headings."""
COLUMNS: Mapping[str, Sequence[tuple[str, ...]]] = {
    "--rheology": [("rate", "viscosity"), ("rate", "stress")],
    "--spectrum": [
        ("frequency", "storage", "loss"),
        *product(["frequency"], ["complex modulus", "storage", "loss", "complex viscosity"], ["factor", "phase"]),
    ],
}
"""The columns that say so, the preferred ones first."""
FEWEST = 5
LEAST_SPAN = 2.0  # largest over least rate: what is measured at about one rate is no curve; chosen
MOST_NAMED = 3  # other sections, or headings, that a sentence names


@dataclass(frozen=True)
class Section:
    """A table of a file, or those rows of it that belong to one step."""

    name: str  # its name, or where it is
    heading: list[str]  # the cells of its line of headings
    places: dict[str, tuple[int, str]]  # place of the column of each quantity, and what its heading says after the name
    near: pd.DataFrame  # rows above and below the headings, which may have units
    cells: pd.DataFrame  # the rows by the number of their line
    numbers: pd.DataFrame  # the columns by quantity, rates first, in their units; NaN where there is no number

    @property
    def usable(self) -> pd.Series[bool]:
        """Whether a row has positive numbers in all columns but that of N1."""
        return (self.numbers.drop(columns="N1", errors="ignore") > 0).all(axis=1)

    def around(self, i: int) -> list[str]:
        """Cells which may have the unit of a column: above and below its heading, and those of the next column."""
        beside = [*self.cells[i + 1].unique()] if i + 1 in self.cells else []
        return [*self.near[i], *([] if any(re.fullmatch(NUMBER, cell) for cell in beside) else [" ".join(beside)])]

    @property
    def span(self) -> float:
        """The logarithm of the largest over the least rate."""
        rates = self.numbers.iloc[:, 0][self.usable]
        return float(np.log(rates.max() / rates.min())) if len(rates) >= FEWEST else 0.0


def read_columns(option: str, file: Path, wanted: str | None = None) -> tuple[dict[str, Array], list[str]]:
    """The quantities that a file holds in SI units, and what was read and left out in sentences.

    Those of --rheology are rate, viscosity and N1, those of --spectrum frequency, storage and loss. The section that is
    read has a name with `wanted` in it, or is the first one of those with the widest range.

    Raises:
        InputError: The file is no text, or has no table with these columns, or too few rows.
    """
    try:
        section, others = _section(option, text_of(file), wanted)
        columns = {
            name: column(name, i, section.heading[i], rest, section.around(i))
            for name, (i, rest) in section.places.items()
        }
    except ValueError as error:
        raise InputError(str(file), option, file.name, str(error)) from None
    usable = section.numbers[section.usable]
    values = {name: usable[name].to_numpy() * each.factor for name, each in columns.items()}
    said = [_read(section, columns, values[usable.columns[0]]), *_left_out(option, section, columns)]
    if "stress" in values:
        values["viscosity"] = values.pop("stress") / values["rate"]
    if "factor" in values or "phase" in values:
        angle = np.radians(values.pop("phase")) if "phase" in values else np.arctan(values.pop("factor"))
        (_, frequency), (of, size) = values.items()
        factors = {"complex viscosity": frequency, "storage": 1 / np.cos(angle), "loss": 1 / np.sin(angle)}
        size = size * factors.get(of, 1.0)
        values = {"frequency": frequency, "storage": size * np.cos(angle), "loss": size * np.sin(angle)}
    if "N1" in values:
        said += _without_noise(values)
    if others:
        more = f" and {len(others) - MOST_NAMED} more" if len(others) > MOST_NAMED else ""
        said.append(f"not read: {'; '.join(others[:MOST_NAMED])}{more}; --section NAME reads another one")
    return values, [*(f"read: {file.name}: {sentence}" for sentence in said), *_assumed(file, columns)]


def text_of(file: Path) -> str:
    """The text of a file in any encoding, with lines that end in \\n, one kind of signs, and no comments.

    Raises:
        ValueError: It cannot be read, or is no text.
    """
    from charset_normalizer import from_bytes

    try:
        content = file.read_bytes()
    except OSError as error:
        raise ValueError(f"must be a file that can be read ({error.strerror})") from None
    if content.startswith(SPREADSHEETS):
        raise ValueError("must be text: open it in a spreadsheet, and save the sheet with the table as CSV (UTF-8)")
    texts = [content.decode(each, "ignore") for each in EASTERN]
    texts = [each for each in texts if re.search(words()["east asian"], each)]
    guesses = from_bytes(content, cp_isolation=ENCODINGS)
    texts += map(str, sorted(guesses, key=lambda each: each.encoding != "utf_8"))  # which is seldom anything else
    if not texts:
        raise ValueError("must be text: export the table as CSV or text")
    text = texts[0].removeprefix("\ufeff").translate(ONE_SIGN)
    text = unicodedata.normalize("NFKC", text).translate(ONE_SIGN).replace("\r\n", "\n").replace("\r", "\n")
    text = re.sub(r"(?m)^#+[ \t]*(?=[^\W\d])", "", text)  # headings that begin with the sign of a comment
    return re.sub(r'(?<![^,;\t\n])"[^"]*"(?![^,;\t\n])', lambda quoted: quoted[0].replace("\n", " "), text)


def _section(option: str, text: str, wanted: str | None) -> tuple[Section, list[str]]:
    """The section to be read, and the names of the others that could be."""
    if option == "--spectrum" and re.match(r"\w+=[^;\n]*;", text):  # RepTate: most of its files have no headings
        text = REPTATE + text[text.find("\n") :]
    lines = text.split("\n")
    sections = [*_sections(option, lines)]
    for each in sections:
        further = each.cells.iloc[:, len(each.heading) :].apply(lambda cells: cells.str.fullmatch(NUMBER)).any(axis=1)
        if further.any():
            why = "and no commas both in numbers and between them"
            raise ValueError(f"must have a heading over each column, {why}: line {further.idxmax()} has more numbers")
    most = max((each.usable.sum() for each in sections), default=0)
    if not most:
        raise ValueError(_no_table(option, lines))
    wide = [each for each in sections if each.span >= np.log(LEAST_SPAN)]
    if not wide:
        rows = f"at least {FEWEST} rows of positive numbers, with rates that differ by a factor of {LEAST_SPAN:g}"
        raise ValueError(f"must have {rows} or more, and has {most}")
    named = [each for each in wide if wanted is None or wanted.lower() in each.name.lower()]
    if not named:
        raise ValueError(f"must have a section named {wanted}, and has {'; '.join(each.name for each in wide)}")
    taken = max(named, key=lambda each: each.span)
    return taken, [each.name for each in wide if each is not taken]


def _cells(line: str, separator: str) -> list[str]:
    """The cells of a line, split at blanks if it does not have the separator."""
    if len(separator) == 1 and separator in line:
        cells = next(csv.reader([line], delimiter=separator))
    else:  # numbers have no spaces in between that would be none
        words = re.search(r"[^\W\d_eEdD]", line)
        cells = re.split((SPACES if len(separator) == 1 else separator) if words else r"\s+", line.strip())
    return [cell.replace("_", " ").replace('"', "''").strip() for cell in cells]


def _heading(option: str, line: str) -> tuple[str, list[str], dict[str, tuple[int, str]]] | None:
    """The separator of a line of headings, its cells, and the columns of an option; None if it is none."""
    separators = SEPARATORS[:-1] if re.search(r"[\t;,]", line) else SEPARATORS
    for separator in separators if re.search(r"[^\W\d_]", line) else ():
        cells = _cells(line, separator)
        if len(cells) > 1 and (found := _places(option, cells)):
            filled = max(i for i, cell in enumerate(cells) if cell) + 1
            return separator, cells[:filled], found
    return None


def _places(option: str, row: Sequence[str]) -> dict[str, tuple[int, str]]:
    """Place of each quantity's column and the rest of its heading; empty if the row is no line of headings."""
    if sum(cell[:1].isdigit() for cell in row) > 1:
        return {}
    named = {name: next(iter(each.items())) for name, each in places(option, row).items()}
    for names in COLUMNS[option]:
        found = {name: named[name] for name in names if name in named}
        if len({i for i, _ in found.values()}) == len(names):
            return found | {name: named[name] for name in ("N1",) if name in named}
    return {}


def _sections(option: str, lines: Sequence[str]) -> Iterator[Section]:
    """All tables with the columns of an option, split by the steps that their rows name."""
    heads = {i: found for i, line in enumerate(lines) if (found := _heading(option, line))}
    repeated = [i for k, i in pairwise(heads) if lines[i] == lines[k] and re.match(r'[\s"]*[-+.\d]', lines[i - 1])]
    heads = {i: found for i, found in heads.items() if i not in repeated}  # as at the top of each printed page
    for start, end in pairwise([*heads, len(lines)]):
        separator, heading, places = heads[start]
        rows = {i + 1: _cells(lines[i], separator) for i in range(start + 1, end) if lines[i].strip(' \t;,"')}
        if heading[0].endswith(":"):  # the name of a block; rows begin with a blank below it, or with their numbers
            rows = {line: ["", *row] if row[0][:1].isdigit() else row for line, row in rows.items()}
        cells = pd.DataFrame.from_dict({start + 1: heading} | rows, orient="index").fillna("").drop(index=start + 1)
        decimal = _decimal([cell for row in rows.values() for cell in row], separator)
        numbers = pd.DataFrame({name: _numbers(cells[i], decimal) for name, (i, _) in places.items()}, cells.index)
        text = pd.Series([_is_text(row) for row in rows.values()], cells.index, dtype=bool)
        measured = numbers.notna().any(axis=1) & ~text
        first = measured.idxmax() if measured.any() else end + 1
        below = (cells[[i for i, _ in places.values()]] != "").any(axis=1) & (cells.index < first)
        last = max(cells.index[below], default=start)
        follows = measured.shift(-1, fill_value=False)
        names = text & follows & (cells.index > last)
        ends = text & ~follows & (cells.index > first)
        step = _step(heading, cells).where(~names, [" ".join(row).strip() for row in rows.values()]).ffill().fillna("")
        above = [_cells(lines[start - 1], separator)] if start else []
        near = pd.concat([cells[below], pd.DataFrame(above)]).fillna("")
        title = _title("\n".join(lines[:start]))
        for of_step, mine in cells[~text & ~ends.cummax() & (cells.index > last)].groupby(step, sort=False):
            name = ", ".join(filter(None, (title, str(of_step))))
            name = f"section '{name}'" if name else f"the table below line {start + 1}"
            yield Section(name, heading, places, near, mine, numbers.loc[mine.index])


def _is_text(row: Sequence[str]) -> bool:
    """Whether a row is a name, or begins another block."""
    filled = [cell for cell in row if cell]
    return filled[0].startswith("[") or filled[0].endswith(":") or (len(filled) == 1 and filled[0][0].isalpha())


def _step(heading: Sequence[str], cells: pd.DataFrame) -> pd.Series[str]:
    """The steps that rows name: in a column of its own (rSpace), or before the number of the point (RheoWin)."""
    for i, name in enumerate(heading):
        if re.fullmatch(STEP_COLUMNS, name):
            return cells[i].where(cells[i] != "")
    return "step " + cells[0].str.extract(r"^(\d+)\|\d+$", expand=False)


def _title(above: str) -> str:
    """The name that stands before a table, "" if there is none."""
    titles, intervals = re.findall(TITLES, above), re.findall(INTERVALS, above)
    return ", ".join([each.strip(" \t;,") for each in titles[-1:]] + [f"interval {i}" for i in intervals[-1:]])


def _decimal(cells: Sequence[str], separator: str) -> str:
    """The decimal mark of a table; ValueError where its commas may be decimal marks or thousands."""
    numbers = [cell for cell in cells if re.fullmatch(NUMBER, cell)]
    commas = [cell for cell in numbers if "," in cell]
    if len(commas) <= sum("." in cell for cell in numbers):
        return "."
    if separator != ";" and all(re.fullmatch(r"[-+]?[1-9]\d{0,2},\d{3}", cell) for cell in commas):
        raise ValueError(f"has {commas[0]}, which may be one or a thousand; export it with decimal points")
    return ","


def _numbers(cells: pd.Series[str], decimal: str) -> pd.Series[float]:
    """Cells as numbers, NaN where there is none; marks of thousands are read in numbers with decimals.

    Raises:
        ValueError: A column as 1.500, 950, which neither rises nor falls: the mark may be of thousands.
    """
    other = "," if decimal == "." else "."
    thousands = cells.str.fullmatch(rf"\d{{1,3}}([ '{other}]\d{{3}})+\{decimal}\d+")
    plain = cells.where(~thousands, cells.str.replace(rf"[ '{other}]", "", regex=True))
    plain = plain.where(plain.str.fullmatch(NUMBER)).str.translate(str.maketrans(decimal + other + "dD", ".?ee"))
    numbers: pd.Series[float] = pd.to_numeric(plain, errors="coerce").astype(float)
    marked = cells[numbers.notna() & cells.str.contains(decimal, regex=False)]
    steps = np.diff(numbers.dropna())
    mixed = marked.str.fullmatch(r"[1-9]\d{0,2}[.,]\d{3}").all() and cells.str.fullmatch(r"\d{3}").any()
    if len(marked) and mixed and (steps > 0).any() and (steps < 0).any():
        raise ValueError(f"has {marked.iloc[0]}, which may be one or a thousand; export it without such marks")
    return numbers


def _read(section: Section, columns: Mapping[str, Column], rates: Array) -> str:
    """The points, their range, and what was read of which column."""
    (_, rate), *others = columns.items()
    of_rate = f"{rates.min():.4g} to {rates.max():.4g} {rate.assumed}"
    if rate.factor != 1:
        of_rate += f" ({rate} in {rate.unit})"
    each = ", ".join(f"{name} in {of.unit or of.assumed or '1'} ({of})" for name, of in others)
    return f"{len(rates)} points, {of_rate}, {each} of {section.name}"


def _left_out(option: str, section: Section, columns: Mapping[str, Column]) -> Iterator[str]:
    """The rows that cannot be used, and the columns that look as if they could be."""
    out = section.numbers[~section.usable].drop(columns="N1", errors="ignore")
    if len(out):
        line, of_first = out.index[0], out.iloc[0]
        place = columns[str((~(of_first > 0)).idxmax())]
        value = section.cells.loc[line, place.place]
        why = f"'{value}' is no positive number" if value else "is empty"
        yield f"{len(out)} of {len(section.cells)} rows left out; in the first one, line {line}, {place} {why}"
    named = places(option, section.heading)
    for name in [each for each in columns if each != "frequency"]:  # which many files have in Hz and in rad/s
        for i in named[name].keys() - {columns[name].place}:
            yield f'column {i + 1} "{section.heading[i]}" is not read, which may be {name}, too'
    if "N1" not in columns:
        for i in named.get("force", ()):
            yield f'column {i + 1} "{section.heading[i]}" is not read: N1 = 2 F/(pi R^2) needs the radius R of the cone'


def _without_noise(values: dict[str, Array]) -> Iterator[str]:
    """N1 is NaN up to the largest rate at which it is not positive: what is measured there is noise about zero."""
    noise = values["rate"][values["N1"] <= 0]
    if len(noise):
        values["N1"] = np.where(values["rate"] > noise.max(), values["N1"], np.nan)
        left = int(np.isfinite(values["N1"]).sum())
        yield f"N1 is not positive at up to {noise.max():.4g} 1/s: {left} of its points, at larger rates, are read"


def _assumed(file: Path, columns: Mapping[str, Column]) -> Iterator[str]:
    """Warnings of units that are not given, or may be meant in another way."""
    if without := [f"{each}, taken as {each.assumed}" for each in columns.values() if each.assumed and not each.unit]:
        units = f"no unit is given of {', '.join(without)}"
        yield f"warning: {file.name}: {units}; if it is another one, write it into the heading, as [mPa.s]"
    rate = next(iter(columns.values()))
    if rate.unit in ("1/s", "s-1") and re.match("f", rate.heading, re.IGNORECASE):
        yield f"warning: {rate} is taken as an angular frequency, in rad/s; if it counts cycles, its unit is Hz"


def _no_table(option: str, lines: Sequence[str]) -> str:
    """Why a file has no table of an option."""
    wanted, example = NEEDED[option]
    headed = [each for each in NEEDED if any(_heading(each, line) for line in lines)]
    if other := [each for each in headed if each != option]:
        return f"must have columns of {wanted}, and has those of {other[0]}"
    if headed:
        return f"must have rows of positive numbers, without units, below the headings of {wanted}"
    rows = [_cells(line, separator) for separator in SEPARATORS[:-1] for line in lines]
    named = max(rows, key=lambda row: (len(places(option, row)), sum(cell[:1].isalpha() for cell in row)))
    has = ", ".join(filter(None, named[:8]))
    return f"must have a line of headings of {wanted}, such as {example}, and has {has or 'nothing'}"
