"""Computes and draws the figures of the paper that pairsim follows, and judges what the paper says of them.

usage: scripts/paper FIGURE... [-o DIR] [--quick] [--workers N] [--dry-run] [--table] [--page]

FIGURE is one or more of fig02 to fig17; of finer, periodic and transients, which solve cases again on finer meshes,
with periodic ends and in time, for statements that do not hold; or all. The same command goes on after any kind of end.

configs/paper/FIGURE holds the computations of a figure, which are grid files of `pairsim sweep` (case files, of which
the mesh is drawn, for fig02), figure.yaml, which describes the picture, and statements.yaml: what the paper says, with
expressions that judge it. A figure that shows results of another one computes these, too. Results are in
DIR/FIGURE/FILE (DIR is runs/paper, with --quick runs/paper-quick), pictures of 85 and 170 mm as PDF and PNG in
DIR/pictures, verdicts in DIR/statements.md. --quick computes the same on coarse meshes with few points
(configs/paper/quick.yaml). --dry-run says what is to do and how long it takes, and computes nothing; neither does
--table, which draws and judges the results that are there. --page stores what was found in docs/results/paper and
writes docs/paper.md and its pictures; alone, without a FIGURE, it writes the page from what is stored.

Exit code 0: all cases finished; 2: wrong input; 3: some cases failed, or a picture lacks results; 130: interrupted.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import Any

import pandas as pd
from book import pages, yaml_files
from book.cases import Cases, NotComputed
from book.computing import CONFIGS, DOCS, FAILED, made, pairsim, parser_of
from book.meshes import write_mesh
from paper_pictures import WIDTHS, Panel, draw
from paper_statements import NOT_COMPUTED, judged, transients

from pairsim.plots.style import Page
from pairsim.record.folder import write_text

FOLDER = CONFIGS / "paper"
FIGURES: dict[str, dict[str, Any]] = {
    path.parent.name: yaml_files.read(path) for path in sorted(FOLDER.glob("*/figure.yaml"))
}
"""Descriptions by name, such as fig07: caption, panels, `also` (what statements look at besides), `quick`."""
PANELS = {name: [Panel(**each) for each in figure["panels"]] for name, figure in FIGURES.items()}
STATEMENTS: list[tuple[str, dict[str, str]]] = [
    (path.parent.name, each) for path in sorted(FOLDER.glob("*/statements.yaml")) for each in yaml_files.read(path)
]
"""Figures and what the paper says of them, with the expressions that judge it; see paper_statements.py."""
CHECKS = {"finer": "finer meshes", "periodic": "periodic ends", "transients": "in time"}
"""Folders with computations that check what does not hold."""
KNOWN = [*FIGURES, *CHECKS]
OWN = ("figure.yaml", "statements.yaml")
"""Files of a figure's folder that are no computations."""
PAGE, IMAGES = DOCS / "paper.md", DOCS / "images" / "paper"


def computations(names: Iterable[str]) -> list[str]:
    """Computations in the folders of figures and checks, as FIGURE/FILE."""
    files = [path for name in names for path in sorted((FOLDER / name).glob("*.yaml")) if path.name not in OWN]
    return [f"{path.parent.name}/{path.stem}" for path in files]


def needed(names: Iterable[str]) -> list[str]:
    """Computations of figures and checks, and those that their pictures and statements look at, each once."""
    found = []
    for name in names:
        found += computations([name])
        if name in FIGURES:
            found += [each for panel in PANELS[name] for each in (*panel.of, *panel.markers)]
            found += FIGURES[name].get("also", [])
    return list(dict.fromkeys(found))


def words(name: str, quick: bool) -> list[str]:
    """The command of a computation, and what `--quick` replaces in its cases."""
    path = FOLDER / f"{name}.yaml"
    content = yaml_files.read(path)
    if "beta" in content:
        return ["mesh", str(path)]
    usual = yaml_files.read(FOLDER / "quick.yaml")[content.get("command", "run")]
    settings = FIGURES.get(path.parent.name, {}).get("quick", {}).get(name, usual) if quick else {}
    pairs = [word for key, value in settings.items() for word in ("--set", f"{key}={json.dumps(value)}")]
    return ["sweep", str(path), *pairs]


def compute(name: str, output: Path, quick: bool, *options: str) -> int:
    """Compute what is not there yet of a computation."""
    command, *rest = words(name, quick)
    if command == "sweep":
        return pairsim(command, *rest, "-o", output / name, *options)
    target = output / f"{name}.vtu"
    if not target.is_file() and "--dry-run" not in options:
        write_mesh(Path(*rest), target)
    return 0


def statement_table(output: Path) -> pd.DataFrame:
    """All statements with verdict and numbers, also by the checks where they do not hold."""
    whole = Cases(output, computations(FIGURES))
    others = {name: Cases(output, computations([name])) for name in ("finer", "periodic")}
    others["transients"] = Cases(output, computations(["transients", *FIGURES]))
    rows = []
    for figure, each in STATEMENTS:
        verdict, numbers = judged(each["check"], whole)
        row = {"figure": figure, "the paper says": each["says"], "verdict": verdict, "our figures": numbers}
        for name, cases in others.items() if verdict != "holds" else ():
            expression = each.get("in_time") if name == "transients" else each.get("again", each["check"])
            found, numbers = judged(expression, cases) if expression else (NOT_COMPUTED, "")
            row |= {name: found, f"{name}: figures": numbers} if found != NOT_COMPUTED else {}
        rows.append(row)
    return pd.DataFrame(rows).fillna("")


def effort(output: Path) -> pd.DataFrame:
    """Seconds and errors of every figure with computations of its own."""
    rows, cases = [], Cases(output, computations(KNOWN))
    for name in KNOWN:
        sweeps = [(each, sweep) for each in computations([name]) if (sweep := cases.sweep(each))]
        ended = [case for each, _ in sweeps for case in cases.of(each)]
        total = sum(len(sweep.record.cases) for _, sweep in sweeps)
        errors = [case.table["dU_error"].max() / case.peak for case in ended if case.kind == "curve"]
        row = {
            "figure": name,
            "own cases finished": f"{len(ended)} of {total}" if len(ended) < total else "",
            "s of one core": f"{sum(float(case.result.record.get('wall_time') or 0) for case in ended):.0f}",
            "largest dU_error, % of the peak": f"{100 * max(errors):.2g}" if errors else "",
        }
        rows += [row] if ended else []
    return pd.DataFrame(rows)


def marker_summary(table: pd.DataFrame) -> pd.DataFrame:
    """How far transients end from the curves, at most, by beta and De."""
    values = table[["beta", "De", "dU off", "intervals off"]].astype(float).abs()
    worst = values.groupby(["beta", "De"]).max()
    cells = worst["dU off"].map("{:.2%}".format) + worst["intervals off"].map(" ({:.1f})".format)
    return cells.unstack().fillna("").rename(columns="De {:g}".format).reset_index()


def again(row: pd.Series) -> str:
    """What other computations say of a statement: "the same" as its verdict, and which of them do not."""
    verdicts = row[list(CHECKS)].replace({row["verdict"]: "the same", "": "not judged"})
    if verdicts.nunique() == 1:
        return verdicts.iloc[0]
    others = [f"{words}: {verdicts[name]}" for name, words in CHECKS.items() if verdicts[name] != "the same"]
    return "; ".join(["the same"] * (len(others) < len(CHECKS)) + others)


def noted(table: pd.DataFrame) -> pd.Series:
    """Statements, with their verdicts if these are others than that they hold."""
    notes = table["verdict"].map(lambda verdict: f" **({verdict})**" if verdict not in ("holds", "") else "")
    return table["the paper says"] + notes


def section(name: str, found: pd.DataFrame) -> str:
    """Heading, picture and statements of a figure."""
    own = found[found["figure"] == name]
    numbers = own["our figures"].mask(own["our figures"] == own["our figures"].shift(), "as above")
    table = pd.DataFrame({"the paper says": noted(own), "our figures": numbers})
    number = name.removeprefix("fig").lstrip("0")
    parts = [f"### Fig. {number} {{#{name}}}", pages.prose(f"*{FIGURES[name]['caption']}.*").strip()]
    parts += [f"![Fig. {number}](images/paper/{name}.png)"] * (IMAGES / f"{name}.png").is_file()
    return "\n\n".join([*parts, pages.markdown(table) if len(table) else ""])


def blocks() -> dict[str, str]:
    """What stands between the marks of the page, from the stored tables."""
    tables = pages.stored("paper")
    found, cost = tables["statements"], tables["effort"]
    counts = found["verdict"].value_counts().reindex(["holds", "does not hold", "within error"], fill_value=0)
    no = found[found["verdict"] != "holds"]
    no = no.assign(**{"statement": noted(no.replace("does not hold", "")), "judged again": no.apply(again, axis=1)})
    for table in (no, cost):
        table["figure"] = table["figure"].replace(CHECKS).replace(r"fig0?(\d+)", r"[Fig. \1](#\g<0>)", regex=True)
    return {
        "made": pages.prose(tables["made"]["made"].iloc[0]),
        "counts": "{} hold, {} do not, {} are within error; those without a note below hold.\n".format(*counts),
        "differences": pages.markdown(no[["statement", "figure", "judged again"]]),
        "effort": pages.markdown(cost.loc[:, (cost != "").any()]),
        "markers": pages.markdown(marker_summary(tables["markers"])),
        "figures": "\n".join(section(name, found) for name in FIGURES),
    }


def store(output: Path, quick: bool) -> None:
    """Store the tables of the page; of what was not computed now the stored results stay."""
    cases, found = Cases(output, computations(KNOWN)), statement_table(output)
    tables = {"statements": found[found["verdict"] != NOT_COMPUTED], "effort": effort(output)}
    with suppress(NotComputed):
        tables["markers"] = transients(cases).map("{:.5g}".format)
    keys = {"statements": ["figure", "the paper says"], "effort": ["figure"]}
    pages.save("paper", tables, keys | {"markers": ["beta", "De", "Ca_e", "d_0", "t"]})
    times = [(sweep.folder / "results.csv").stat().st_mtime for name in cases.names if (sweep := cases.sweep(name))]
    how = " With `--quick`, whose coarse meshes prove nothing." if quick else ""
    pages.save("paper", {"made": pd.DataFrame({"made": [made(times) + how]})})


def pictures(names: Iterable[str], output: Path, folder: Path, page: Page, end: str = "") -> list[str]:
    """Draw figures; returns the names of those without results."""
    missing, cases = [], Cases(output, computations(FIGURES))
    for name in (name for name in names if name in FIGURES):
        try:
            print(*draw(PANELS[name], cases, page, folder, name + end), sep="\n")
        except NotComputed as lacking:
            missing.append(name)
            print(f"{name} has no picture yet: {lacking}", file=sys.stderr)
    return missing


def main() -> int:
    """Compute, draw and judge."""
    parser = parser_of("paper", __doc__, "")
    parser.add_argument("figures", nargs="*", metavar="FIGURE", choices=[*KNOWN, "all", []])
    parser.add_argument("--quick", action="store_true", help="coarse meshes, few points")
    parser.add_argument("--dry-run", action="store_true", help="what is to do, with an estimate of the time")
    parser.add_argument("--page", action="store_true", help="store what was found, and write docs/paper.md")
    arguments = parser.parse_args()
    quick = arguments.quick
    output = arguments.output if str(arguments.output) != "." else Path("runs", "paper-quick" if quick else "paper")
    every = (FIGURES if quick else KNOWN) if "all" in arguments.figures else ()  # coarse checks decide nothing
    wanted = [name for name in KNOWN if name in every or name in arguments.figures]
    options = ["--dry-run"] if arguments.dry_run else ["--workers", str(arguments.workers)]
    codes = [0]
    for name in needed(wanted) if not arguments.table else ():
        print(name, flush=True)
        codes.append(compute(name, output, quick, *options))
    if wanted and not arguments.dry_run:
        output.mkdir(parents=True, exist_ok=True)
        for width in WIDTHS:
            missing = pictures(wanted, output, output / "pictures", Page(("png", "pdf"), width), f"-{width}mm")
            codes += [FAILED] * len(missing)
        found = statement_table(output)
        write_text(output / "statements.md", pages.markdown(found))
        for row in found[found["figure"].isin(wanted)].itertuples(index=False):
            print(f"{row[2]:14} {row[0]}  {row[1]}  ({row[3]})")
    if arguments.page and wanted:
        store(output, quick)
        pictures(wanted, output, IMAGES, Page(("png",), 170.0, 130.0))
    if arguments.page:
        pages.write(PAGE, blocks())
    return max(codes)


if __name__ == "__main__":
    sys.exit(main())
