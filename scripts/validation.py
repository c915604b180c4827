"""Computes the validation book, docs/validation: values of pairsim beside exact solutions, benchmarks and other codes.

usage: scripts/validation SUBJECT ... | all [-o runs/validation] [--quick] [--pages]

Each subject (a module of validation_book) writes its numbers to docs/validation/results/SUBJECT.json, from which the
tables of the pages are made, and its pictures. With --pages nothing is computed. With --quick cells are coarse and
points few, and only DIR is written to. The exit code is 1 if a difference is larger than allowed.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterable
from dataclasses import replace
from importlib import import_module
from pathlib import Path

import pandas as pd
from book.computing import parser_of
from book.pages import filled, markdown, prose
from validation_book.comparisons import BOOK, Comparison, Found, Setting, references

from pairsim.results.output import write_text
from pairsim.results.units import with_error

TITLES = {
    "sphere-in-tube": "Sphere dragged through a tube",
    "rigid": "Rigid spheres in the tube",
    "soft": "Soft spheres, first order in Ca_e",
    "extension": "A soft sphere in extension",
    "tube": "Flow of all laws in the tube",
    "manufactured": "Manufactured solutions",
    "pyoomph": "Soft pairs against pyoomph",
    "balances": "Balances on written fields",
    "giesekus-pairs": "Rigid pairs in Giesekus liquids",
    "thinning": "Spheres in power-law liquids",
}
"""Subjects in the order of the book: their pages, results and modules have these names."""
PLUS_MINUS, SPACE = "\N{NO-BREAK SPACE}±\N{NO-BREAK SPACE}", "\N{NO-BREAK SPACE}"


def compute(name: str, output: Path, *, quick: bool) -> Found:
    """Compute a subject and write its results: of a quick computation to the output folder, else to the book."""
    folder = output / name
    results, pictures = (output, folder) if quick else (BOOK / "results", BOOK / "images")
    for each in (folder, results, pictures):
        each.mkdir(parents=True, exist_ok=True)
    module = import_module(f"validation_book.{name.replace('-', '_')}")
    found: Found = module.compute(Setting(quick, folder, pictures))
    rounded = [replace(row, value=float(f"{row.value:.12g}")) for row in found.comparisons]
    found = replace(found, comparisons=rounded)
    write_text(results / f"{name}.json", found.text())
    return found


def all_results() -> dict[str, Found]:
    """The present results by the names of their pages, in the order of the book."""
    return {name: Found.read(path) for name in TITLES if (path := BOOK / "results" / f"{name}.json").is_file()}


def pages() -> dict[str, str]:
    """The text of every page by its file, with the tables of the present results."""
    results = all_results()
    texts = {f"{name}.md": filled((BOOK / f"{name}.md").read_text(), blocks(found)) for name, found in results.items()}
    sources = [(key, " ".join(text.split())) for key, text in references()["sources"].items()]
    index = {"index": headlines(results), "sources": markdown(pd.DataFrame(sources, columns=["source", "what it is"]))}
    return texts | {"index.md": filled((BOOK / "index.md").read_text(), index)}


def blocks(found: Found) -> dict[str, str]:
    """What goes between the marks of a page, by the names of the marks."""
    rows = pd.DataFrame([{"of": row.table} | cells(row) for row in found.comparisons], columns=["of", *HEAD])
    made = {name: markdown(part[HEAD]) for name, part in rows.groupby("of", sort=False)}
    made |= {name: markdown(pd.DataFrame(each["rows"], columns=each["head"])) for name, each in found.tables.items()}
    return {str(name): text for name, text in made.items()} | {name: prose(text) for name, text in found.notes.items()}


HEAD = ["", "quantity", "pairsim", "reference", "difference"]


def cells(row: Comparison) -> dict[str, str]:
    """A line of a table: the difference is in percent of the reference, absolute where that is 0."""
    value = with_error(row.value, row.error).replace(" +- ", PLUS_MINUS) if row.error else f"{row.value:.7g}"
    relative = f"{100 * row.relative:+.2g}{SPACE}%"
    difference = f"{row.difference:+.1e}" if math.isnan(row.relative) else relative
    return dict(zip(HEAD, (row.what, row.quantity, value, f"{row.exact:.9g}", difference), strict=True))


def headlines(results: dict[str, Found]) -> str:
    """The headlines of all subjects, with their sources."""
    lines = []
    for name, found in results.items():
        lines.append({"": f"**[{TITLES[name]}]({name}.md)**"})
        for row in (row for row in found.comparisons if row.headline):
            lines.append(cells(row) | {"source": row.source if row.source in references()["sources"] else ""})
    return markdown(pd.DataFrame(lines, columns=[*HEAD, "source"]).fillna(""))


def report(name: str, rows: Iterable[Comparison]) -> None:
    """Print what a computation found."""
    print(name, *("  " * row.good + "! " * (not row.good) + ", ".join(cells(row).values()) for row in rows), sep="\n")


def main() -> int:
    """Compute, and write the pages."""
    parser = parser_of("validation", __doc__, "runs/validation")
    parser.add_argument("subjects", nargs="+", metavar="SUBJECT", choices=["all", *TITLES], help=", ".join(TITLES))
    parser.add_argument("--quick", action="store_true", help="coarse cells and few points, nothing but DIR is written")
    parser.add_argument("--pages", action="store_true", help="write the pages from existing results")
    arguments = parser.parse_args()
    good = True
    for name in TITLES if "all" in arguments.subjects else arguments.subjects:
        if not arguments.pages:
            found = compute(name, arguments.output, quick=arguments.quick)
            report(name, found.comparisons)
            good = good and all(row.good for row in found.comparisons)
    for path, text in () if arguments.quick else pages().items():
        write_text(BOOK / path, text)
    return int(not good)


if __name__ == "__main__":
    sys.exit(main())
