"""Computes the validation book, docs/validation: values of pairsim beside exact solutions, benchmarks and other codes.

usage: scripts/validation PAGE ... | all [-o runs/validation] [--workers N] [--quick] [--pages]

configs/validation/book.yaml has the pages: their cases, and what is compared. Values are stored in
docs/results/validation, from which the tables of the pages are made, pictures in docs/validation/images. With --pages
nothing is computed. With --quick cells are coarse and cases few, and only the output folder is written to. The exit
code is 1 if a difference is larger than allowed.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from typing import Any

import pandas as pd
from book.computing import parser_of
from book.pages import RESULTS, filled, markdown
from validation_book.page import BOOK, PAGES, REFERENCES, Page

from pairsim.quantities.text import with_error
from pairsim.record.folder import write_text

PLUS_MINUS = "\N{NO-BREAK SPACE}±\N{NO-BREAK SPACE}"


def stored(name: str) -> dict[str, pd.DataFrame]:
    """The stored tables of a page by name."""
    return {path.stem: pd.read_csv(path) for path in sorted((RESULTS / "validation" / name).glob("*.csv"))}


def judged(tables: Mapping[str, pd.DataFrame]) -> pd.DataFrame:
    """All values that have a reference: the difference in `percent` of it, and whether it is as small as allowed."""
    found = pd.concat([pd.DataFrame(columns=["value", "reference", "allowed"]), *tables.values()])
    found = found.dropna(subset=["value", "reference"])
    size = found["reference"].abs()
    difference = found["value"] - found["reference"]
    good = difference.abs() <= found["allowed"] * size.where(size > 0, 1.0)
    return found.assign(percent=100 * difference / size.where(size > 0), good=good)


def shown(table: pd.DataFrame, declared: Mapping[str, Any]) -> pd.DataFrame:
    """A table as on its page: values beside their references, and the differences in % of these.

    A reference that is the same in all rows is in the head; that of the column before is not repeated.
    """
    if "compare" not in declared:
        return table
    keys, before = declared.get("keys", []), pd.Series(dtype=float)
    rows = table[keys].drop_duplicates(ignore_index=True) if keys else pd.DataFrame(index=[0])
    parts: list[Any] = [rows.map(lambda key: f"{key:g}" if isinstance(key, float) else str(key))]
    for column, how in declared["compare"].items():
        own = table[table["column"] == column]
        here = rows.merge(own, how="left", on=keys) if keys else own.reset_index(drop=True)
        reference, known = here["reference"], here["reference"].dropna().unique()
        numbers = zip(here["value"], here["error"], strict=True)
        cells = [cell(value, error, how.get("shown", ".7g")) for value, error in numbers]
        if how.get("plain") or not known.any():
            parts.append(pd.Series(cells, name=f"{column} ({known[0]:g})" if len(known) else column))
            continue
        parts.append(pd.Series(cells, name=column))
        alone = len(known) == 1 and len(here) > 1
        if not alone and not reference.equals(before):
            parts.append(reference.map(lambda each: cell(each, 0, ".9g")))
        percent = 100 * (here["value"] - reference) / reference.abs().where(reference != 0)
        head = f"difference from {known[0]:.9g}, %" if alone else "difference, %"
        parts.append(percent.map(lambda each: cell(each, 0, "+.2g")).rename(head))
        before = reference
    return pd.concat(parts, axis=1)


def cell(value: float, error: float, form: str) -> str:
    """A number, with its error if it has one; empty for NaN."""
    if error > 0:
        return with_error(value, error).replace(" +- ", PLUS_MINUS)
    return "" if pd.isna(value) else format(value, form)


def index() -> pd.DataFrame:
    """How far the values of each page are from their references, and what these are."""
    lines = []
    for name, page in PAGES.items():
        title = (BOOK / f"{name}.md").read_text().splitlines()[0].removeprefix("# ")
        found = judged(stored(name)).sort_values("percent", key=abs, na_position="first")
        line = {"": f"[{title}]({name}.md)", "values": str(len(found) or "")}
        if len(found):
            line["median difference, %"] = f"{found['percent'].abs().median():.2g}"
            line["largest, %"] = f"{abs(found['percent'].iloc[-1]):.2g} ({found['column'].iloc[-1]})"
        hows = [how for table in page["tables"].values() for how in (table, *table.get("compare", {}).values())]
        groups = (REFERENCES["groups"].get(str(how.get("to")).partition(": ")[0], how) for how in hows)
        known = dict.fromkeys(each["source"] for each in groups if "source" in each)
        lines.append(line | {"reference": "; ".join(REFERENCES["sources"][source] for source in known)})
    head = ["", "values", "median difference, %", "largest, %", "reference"]
    return pd.DataFrame(lines, columns=head).fillna("")


def blocks(name: str, tables: Mapping[str, pd.DataFrame]) -> dict[str, str]:
    """What stands between the marks of a page."""
    return {each: markdown(shown(table, PAGES[name]["tables"][each])) for each, table in tables.items()}


def pages() -> dict[str, str]:
    """The text of every page by its file, with the tables of the stored results."""
    made = {name: blocks(name, stored(name)) for name in PAGES} | {"index": {"index": markdown(index())}}
    return {f"{name}.md": filled((BOOK / f"{name}.md").read_text(), each) for name, each in made.items()}


def compute(page: Page) -> bool:
    """Compute a page, print its tables, and store them unless it is quick; whether all is as close as allowed."""
    page.folder.mkdir(parents=True, exist_ok=True)
    tables = page.tables()
    wrong = judged(tables).query("not good")
    print(page.name, *blocks(page.name, tables).values(), sep="\n")
    print("Larger than allowed:", wrong.to_string() if len(wrong) else "nothing.")
    for name, table in {} if page.quick else tables.items():
        path = RESULTS / "validation" / page.name / f"{name}.csv"
        path.parent.mkdir(parents=True, exist_ok=True)
        write_text(path, table.to_csv(index=False, float_format="%.12g"))
    return wrong.empty


def main() -> int:
    """Compute, and write the pages."""
    parser = parser_of("validation", __doc__, "runs/validation")
    parser.add_argument("names", nargs="+", metavar="PAGE", choices=["all", *PAGES], help=", ".join(PAGES))
    parser.add_argument("--quick", action="store_true", help="coarse cells and few cases, nothing but DIR is written")
    parser.add_argument("--pages", action="store_true", help="write the pages from stored results")
    arguments = parser.parse_args()
    output, quick = arguments.output, arguments.quick
    names = () if arguments.pages else PAGES if "all" in arguments.names else arguments.names
    pictures = output if quick else BOOK / "images"
    good = [compute(Page(name, output / name, pictures, quick, arguments.workers)) for name in names]
    for path, text in {} if quick else pages().items():
        write_text(BOOK / path, text)
    return int(not all(good))


if __name__ == "__main__":
    sys.exit(main())
