"""The pages of the book: tables between marks, made from the results; the prose around them is written by hand."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from textwrap import fill

from markdown_tables import put, table

from pairsim.results.output import write_text
from pairsim.results.units import with_error
from validation_book.comparisons import BOOK, Comparison, Found, references
from validation_book.contents import TITLES

WIDTH = 100  # of lines of prose
PLUS_MINUS = "\N{NO-BREAK SPACE}±\N{NO-BREAK SPACE}"


def write_book() -> None:
    """Write the tables of all pages for which there are results, and that of the index."""
    for path, text in pages().items():
        write_text(BOOK / path, text)


def all_results() -> dict[str, Found]:
    """The present results by the names of their pages, in the order of the book."""
    return {name: Found.read(path) for name in TITLES if (path := BOOK / "results" / f"{name}.json").is_file()}


def pages() -> dict[str, str]:
    """The text of every page by its file, with the tables of the present results."""
    found = all_results()
    texts = {}
    for name, results in found.items():
        text = (BOOK / f"{name}.md").read_text()
        for mark, content in blocks(results).items():
            text = put(text, mark, content)
        texts[f"{name}.md"] = text
    index = put((BOOK / "index.md").read_text(), "index", index_table(found))
    texts["index.md"] = put(index, "sources", source_list())
    return texts


def blocks(found: Found) -> dict[str, str]:
    """What goes between the marks of a page, by the names of the marks."""
    groups: dict[str, list[Comparison]] = {}
    for row in found.comparisons:
        groups.setdefault(row.table, []).append(row)
    result = {name: comparison_table(rows) for name, rows in groups.items()}
    result |= {name: table(each.head, each.rows) for name, each in found.tables.items()}
    return result | {name: f"{fill(text, WIDTH)}\n" for name, text in found.notes.items()}


def cells(row: Comparison) -> list[str]:
    """The cells of a comparison: quantity, value with its interval, reference, difference."""
    value = with_error(row.value, row.error).replace(" +- ", PLUS_MINUS) if row.error else f"{row.value:.7g}"
    return [row.what, row.quantity, value, f"{row.exact:.9g}", difference(row)]


def difference(row: Comparison) -> str:
    """The difference: in percent of the reference, absolute where that is 0."""
    return f"{row.difference:+.1e}" if math.isnan(row.relative) else f"{100 * row.relative:+.2g}\N{NO-BREAK SPACE}%"


def comparison_table(rows: Sequence[Comparison]) -> str:
    """A table of comparisons."""
    return table(["", "quantity", "pairsim", "reference", "difference"], [cells(row) for row in rows])


def index_table(found: Mapping[str, Found]) -> str:
    """The headlines of all subjects, with their sources."""
    lines = []
    for name, results in found.items():
        lines.append([f"**[{TITLES[name]}]({name}.md)**", *[""] * 5])
        for row in results.comparisons:
            if row.headline:
                lines.append([*cells(row), row.source if row.source in references()["sources"] else "see page"])
    return table(["", "quantity", "pairsim", "reference", "difference", "source"], lines)


def source_list() -> str:
    """The sources of references.yaml."""
    return table(
        ["source", "what it is"], [[key, " ".join(text.split())] for key, text in references()["sources"].items()]
    )


def report(name: str, found: Found, seconds: float) -> str:
    """What a computation found, for the terminal."""
    lines = [f"{name}: {len(found.comparisons)} comparisons, {seconds:.0f} s of processor time"]
    for row in found.comparisons:
        sign = "  " if row.good else "! "
        lines.append(sign + ", ".join(cells(row)))
    return "\n".join(lines)


def marks(text: str) -> set[str]:
    """Names of the marks of a page."""
    return set(re.findall(r"<!-- end of ([^>]+) -->", text))
