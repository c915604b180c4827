"""Computes and draws the figures of the paper that pairsim follows, and judges what the paper says of them.

usage: scripts/paper FIGURE... [-o DIR] [--quick] [--workers N] [--dry-run] [--table] [--page]

FIGURE is one or more of fig02 to fig17; of finer, periodic and transients, which solve cases again on finer meshes,
with periodic ends and in time, for statements that do not hold; or all. The same command goes on after any kind of end.

configs/paper/FIGURE holds the computations of a figure, which are grid files of `pairsim sweep` (case files of `pairsim
mesh` for fig02), figure.yaml, which describes the picture, and statements.yaml: what the paper says, with expressions
that judge it. A figure that shows results of another one computes these, too. Results are in DIR/FIGURE/FILE (DIR is
runs/paper, with --quick runs/paper-quick), pictures of 85 and 170 mm as PDF and PNG in DIR/pictures, verdicts in
DIR/statements.md. --quick computes the same on coarse meshes with few points (configs/paper/quick.yaml). --dry-run says
what is to do and how long it takes, and computes nothing; neither does --table, which draws and judges the results that
are there. --page stores what was found in docs/results/paper and writes docs/paper.md and its pictures; alone, without
a FIGURE, it writes the page from what is stored.

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
import yaml
from book import pages
from book.cases import Cases, NotComputed, first
from book.computing import CONFIGS, DOCS, made, pairsim, parser_of
from paper_pictures import WIDTHS, Panel, draw
from paper_statements import NOT_COMPUTED, judged, markers

from pairsim.plots.style import Page
from pairsim.results.output import write_text

FOLDER = CONFIGS / "paper"
FIGURES: dict[str, dict[str, Any]] = {
    path.parent.name: yaml.safe_load(path.read_text()) for path in sorted(FOLDER.glob("*/figure.yaml"))
}
"""Descriptions by name, such as fig07: caption, panels, `also` (what statements look at besides), `quick`."""
STATEMENTS: list[tuple[str, dict[str, str]]] = [
    (path.parent.name, each)
    for path in sorted(FOLDER.glob("*/statements.yaml"))
    for each in yaml.safe_load(path.read_text())
]
"""Figures and what the paper says of them (`says`), how it is judged (`check`), and how by runs (`in_time`)."""
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


def panels(name: str) -> list[Panel]:
    """The panels of a figure."""
    return [Panel(**each) for each in FIGURES[name]["panels"]]


def needed(names: Iterable[str]) -> list[str]:
    """Computations of figures and checks, and those that their pictures and statements look at, each once."""
    found = []
    for name in names:
        found += computations([name])
        if name in FIGURES:
            found += [each for panel in panels(name) for each in (*panel.of, *panel.markers)]
            found += FIGURES[name].get("also", [])
    return list(dict.fromkeys(found))


def words(name: str, quick: bool) -> list[str]:
    """The command of a computation, and what `--quick` replaces in its cases."""
    content = yaml.safe_load((FOLDER / f"{name}.yaml").read_text())
    if "beta" in content:
        return ["mesh", str(FOLDER / f"{name}.yaml")]
    own = FIGURES.get(name.partition("/")[0], {}).get("quick", {}).get(name)
    usual = yaml.safe_load((FOLDER / "quick.yaml").read_text())[content.get("command", "run")]
    settings = (usual if own is None else own) if quick else {}
    pairs = [word for key, value in settings.items() for word in ("--set", f"{key}={json.dumps(value)}")]
    return ["sweep", str(FOLDER / f"{name}.yaml"), *pairs]


def compute(name: str, output: Path, quick: bool, *options: str) -> int:
    """Compute what is not there yet of a computation."""
    command, *rest = words(name, quick)
    if command == "mesh":
        target = output / f"{name}.vtu"
        target.parent.mkdir(parents=True, exist_ok=True)
        return 0 if target.is_file() else pairsim(command, *rest, "-o", target)
    return pairsim(command, *rest, "-o", output / name, *options)


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
            expression = each.get("in_time") if name == "transients" else each["check"]
            found, numbers = judged(expression, cases) if expression else (NOT_COMPUTED, "")
            row |= {name: found, f"{name}: figures": numbers} if found != NOT_COMPUTED else {}
        rows.append(row)
    return pd.DataFrame(rows).fillna("")


def effort(output: Path) -> pd.DataFrame:
    """Cases, seconds, points or steps, and errors of every figure with computations of its own."""
    rows, cases = [], Cases(output, computations(KNOWN))
    for name in KNOWN:
        sweeps = {each: cases.sweep(each) for each in computations([name])}
        ended = [case for each, sweep in sweeps.items() if sweep for case in cases.of(each)]
        total = sum(len(sweep.record["cases"]) for sweep in sweeps.values() if sweep)
        if not ended:
            continue
        curves = [case for case in ended if case.kind == "curve"]
        errors = [curve.table[["dU_error", "ends_error"]].max() / curve.peak for curve in curves]
        worst = pd.DataFrame(errors).max() if errors else {"dU_error": "", "ends_error": ""}
        rows.append(
            {
                "figure": name,
                "own cases finished": f"{len(ended)} of {total}",
                "accuracy": ", ".join(sorted({str(case.parameters["accuracy"]) for case in ended})),
                "s of one core": f"{sum(float(case.result.record.get('wall_time') or 0) for case in ended):.0f}",
                "points or steps": str(sum(len(case.table) for case in ended)),
                "largest dU_error, % of the peak": percent(worst["dU_error"]),
                "ends_error, % of the peak": percent(worst["ends_error"]),
            }
        )
    return pd.DataFrame(rows)


def percent(value: float | str) -> str:
    """A part in percent; empty stays empty."""
    return value if isinstance(value, str) else f"{100 * value:.2g}"


def marker_table(output: Path) -> pd.DataFrame:
    """All transients beside the curves of their cases."""
    rows = []
    for run, curve in markers(Cases(output, computations(FIGURES)), least=0):
        keys = {name: f"{first(run.parameters[key]):g}" for name, key in MARKED.items()}
        d, value = run.last("d"), float(curve.at("dU", run.last("d")))
        rest = run.last("dU") - value
        row = keys | {"t": f"{run.last('t'):g}", "d": f"{d:.4f}", "dU of the transient": f"{run.last('dU'):.4e}"}
        row |= {"dU of the curve": f"{value:.4e}", "difference, % of the peak": f"{100 * rest / curve.peak:.2f}"}
        rows.append(row | {"difference in intervals": f"{rest / curve.dU(d)[1]:.1f}"})
    return pd.DataFrame(rows)


def marker_summary(table: pd.DataFrame) -> pd.DataFrame:
    """How many transients there are by beta and De, and how far they end from the curves."""
    off = [name for name in table.columns if name.startswith("difference")]
    values = table.assign(**{name: table[name].astype(float).abs() for name in off}).sort_values(["beta", "De"])
    grouped = values.groupby(["beta", "De"], sort=False)
    worst = grouped[off].max().rename(columns=lambda name: f"largest {name}")
    return worst.assign(transients=grouped.size()).reset_index()


MARKED = {"beta": "beta", "De": "De", "Ca_e": "Ca_e", "d_0": "d0"}


def title(name: str) -> str:
    """Fig. 7 of fig07, linked to its section; what a folder of checks is for."""
    return CHECKS.get(name) or f"[Fig. {name.removeprefix('fig').lstrip('0')}](#{name})"


def section(name: str, found: pd.DataFrame) -> str:
    """Heading, picture and statements of a figure."""
    number = name.removeprefix("fig").lstrip("0")
    own = found.loc[found["figure"] == name, ["the paper says", "verdict", "our figures"]]
    own["verdict"] = own["verdict"].replace("does not hold", "**does not hold**")
    parts = [f"### Fig. {number} {{#{name}}}", pages.prose(f"*{FIGURES[name]['caption']}.*").strip()]
    if (IMAGES / f"{name}.png").is_file():
        parts.append(f"![Fig. {number}](images/paper/{name}.png)")
    return "\n\n".join([*parts, pages.markdown(own)] if len(own) else [*parts, ""])


def blocks() -> dict[str, str]:
    """What stands between the marks of the page, from the stored tables."""
    tables = pages.stored("paper")
    found, cost = tables["statements"], tables["effort"]
    counts = found["verdict"].value_counts().reindex(["holds", "does not hold", "within error"], fill_value=0)
    no = found[found["verdict"] != "holds"].rename(columns={"the paper says": "statement", **CHECKS})
    no["figure"], cost["figure"] = no["figure"].map(title), cost["figure"].map(title)
    return {
        "made": pages.prose(tables["made"]["made"].iloc[0]),
        "counts": "{} hold, {} do not, {} are within error.\n".format(*counts),
        "differences": pages.markdown(no[["statement", "figure", "verdict", *CHECKS.values()]]),
        "effort": pages.markdown(cost),
        "markers": pages.markdown(marker_summary(tables["markers"])),
        "figures": "\n".join(section(name, found) for name in FIGURES),
    }


def store(output: Path, quick: bool) -> None:
    """Store the tables of the page, and draw its pictures; of what was not computed now the stored results stay."""
    cases = Cases(output, computations(KNOWN))
    times = [sweep.record["updated"] for name in cases.names if (sweep := cases.sweep(name))]
    how = " With `--quick`, whose coarse meshes prove nothing." if quick else ""
    found = statement_table(output)
    found = found[found["verdict"] != NOT_COMPUTED]
    kept = {"statements": ["figure", "the paper says"], "effort": ["figure"], "markers": [*MARKED, "t"]}
    pages.save("paper", {"statements": found, "effort": effort(output), "markers": marker_table(output)}, kept)
    pages.save("paper", {"made": pd.DataFrame({"made": [made(times) + how]})})
    for name in FIGURES:
        with suppress(NotComputed):
            draw(panels(name), cases, Page(("png",), 170.0, 130.0), IMAGES, name)


def present(names: Iterable[str], output: Path) -> list[str]:
    """Draw figures and judge their statements; returns the names of figures without results."""
    missing, cases = [], Cases(output, computations(FIGURES))
    for name in (name for name in names if name in FIGURES):
        try:
            for width in WIDTHS:
                written = draw(
                    panels(name), cases, Page(("png", "pdf"), width), output / "pictures", f"{name}-{width}mm"
                )
                print(*written, sep="\n")
        except NotComputed as lacking:
            missing.append(name)
            print(f"{name} has no picture yet: {lacking}", file=sys.stderr)
    found = statement_table(output)
    write_text(output / "statements.md", pages.markdown(found))
    for row in found[found["figure"].isin(names)].itertuples(index=False):
        print(f"{row[2]:14} {row[0]}  {row[1]}  ({row[3]})")
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
        if not (arguments.dry_run and words(name, quick)[0] == "mesh"):
            codes.append(compute(name, output, quick, *options))
    if wanted and not arguments.dry_run:
        output.mkdir(parents=True, exist_ok=True)
        codes += [3 for _ in present(wanted, output)]
    if arguments.page and wanted:
        store(output, quick)
    if arguments.page:
        pages.write(PAGE, blocks())
    return max(codes)


if __name__ == "__main__":
    sys.exit(main())
