"""Which statements of the paper hold, and the page that says so."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import pandas as pd
from book import pages
from book.case_parts import complete
from book.computing import DOCS
from book.made import made
from book.statements import Judged
from book.study import Part

from studies.paper.figures import CHECKS, FIGURES, STATEMENTS
from studies.paper.parts import NOT_COMPUTED

PICTURES = DOCS / "images" / "paper"
VERDICTS = ("holds", "does not hold", "within error")
PLURALS = {"holds": "hold", "does not hold": "do not hold"}
FIGURE = ["figure", "says"]


def verdicts(results: pd.DataFrame, how: str = "") -> pd.DataFrame:
    """All statements with the verdict and the numbers that their figure has, or a check; empty without."""
    known = pd.DataFrame([{"figure": each.figure, "says": each.says, "found": each.found} for each in STATEMENTS])
    rows = results.reindex(columns=["kind", "by", *FIGURE, "verdict", "numbers"])
    rows = rows[(rows["kind"] == "statement") & (rows["by"].astype(object).fillna("") == how)]
    found = known.merge(rows[[*FIGURE, "verdict", "numbers"]], how="left", on=FIGURE)
    return found.fillna("")


def number(figure: str) -> str:
    """A figure as it is cited."""
    return f"Fig. {int(figure.removeprefix('fig'))}"


def statements(results: pd.DataFrame, parts: Sequence[Part]) -> dict[str, Judged]:
    """What the study states, judged by what is stored."""
    effort = results[results["kind"] == "effort"]
    lacking = effort["cases"] - effort["finished"]
    names = ", ".join(effort.loc[lacking > 0, "part"])
    found = complete(results, parts)
    found["every case has finished"] = Judged(
        ((0.5 - float(lacking.sum()), 0.0),), f"{lacking.sum():.0f} have not{': ' if names else ''}{names}"
    )
    for figure, table in verdicts(results).groupby("figure"):
        own = results[(results["part"] == figure) & (results["kind"] == "statement")]
        if own.empty:
            continue
        counts = table["verdict"].replace(PLURALS).astype(str).value_counts()
        text = f"of {len(table)} " + ", ".join(f"{count} {verdict!s}" for verdict, count in counts.items())
        if own["coarse"].astype(bool).all():  # which decides nothing
            known = float((table["verdict"] != NOT_COMPUTED).sum())
            found[f"{number(str(figure))}: its statements can be judged"] = Judged(((known - 0.5, 0.0),), text)
            continue
        other = table[table["verdict"] != table["found"]]
        text += "".join(("; " + other["verdict"].replace("", NOT_COMPUTED) + ": " + other["says"]).tolist())
        stated = f"{number(str(figure))}: what the paper says holds, but for what docs/paper.md discusses"
        found[stated] = Judged(((0.5 - len(other), 0.0),), text)
    return found


def again(row: pd.Series) -> str:
    """What other computations say of a statement: "the same" as its verdict, and which of them do not."""
    found = row[list(CHECKS)].replace({row["verdict"]: "the same", "": "not judged"})
    if found.nunique() == 1:
        return str(found.iloc[0])
    others = [f"{words}: {found[name]}" for name, words in CHECKS.items() if found[name] != "the same"]
    return "; ".join(["the same"] * (len(others) < len(CHECKS)) + others)


def noted(table: pd.DataFrame) -> pd.Series:
    """Statements, with their verdicts if these are others than that they hold."""
    notes = table["verdict"].map(lambda verdict: f" **({verdict})**" if verdict not in ("holds", "") else "")
    return table["says"] + notes


def link(name: str) -> str:
    """A figure as a link to its section; the words for a check."""
    return CHECKS.get(name) or f"[{number(name)}](#{name})"


def differences(results: pd.DataFrame, found: pd.DataFrame) -> pd.DataFrame:
    """The statements that do not hold, and what other computations say of them."""
    others = {how: verdicts(results, how)["verdict"] for how in CHECKS}
    table = found.assign(**others)
    table = table[table["verdict"] != "holds"]
    text = noted(table.assign(verdict=table["verdict"].replace("does not hold", "")))
    columns = {"statement": text, "figure": table["figure"].map(link), "judged again": table.apply(again, axis=1)}
    return pd.DataFrame(columns)


def effort(results: pd.DataFrame) -> pd.DataFrame:
    """Seconds and errors of every figure with computations of its own."""
    rows = results[(results["kind"] == "effort") & (results["cases"] > 0)]
    lines = {
        "figure": rows["part"].map(link),
        "own cases finished": [
            f"{done:.0f} of {all_:.0f}" if done < all_ else ""
            for done, all_ in zip(rows["finished"], rows["cases"], strict=True)
        ],
        "s of one core": rows["seconds"].map("{:.0f}".format),
        "largest dU_error, % of the peak": [
            "" if pd.isna(error) else f"{100 * error:.2g}" for error in rows["largest_error"].astype(float)
        ],
    }
    table = pd.DataFrame(lines)
    return table.loc[:, (table != "").any()]


def markers(results: pd.DataFrame) -> pd.DataFrame:
    """How far transients end from the curves, at most, by beta and De."""
    rows = results[results["kind"] == "marker"]
    values = rows[["beta", "De", "dU off", "intervals off"]].astype(float).abs()
    worst = values.groupby(["beta", "De"]).max()
    cells = worst["dU off"].map("{:.2%}".format) + worst["intervals off"].map(" ({:.1f})".format)
    return cells.unstack().fillna("").rename(columns="De {:g}".format).reset_index()


def outside(results: pd.DataFrame) -> str:
    """How many transients end outside the interval of their curve."""
    rows = results.loc[results["kind"] == "marker", "intervals off"].astype(float).abs()
    return f"In {(rows > 1).sum()} of {len(rows)} runs it exceeds it, by up to {100 * (rows.max() - 1):.0f} %."


def section(name: str, found: pd.DataFrame) -> str:
    """Heading, picture and statements of a figure."""
    own = found[found["figure"] == name]
    numbers = own["numbers"].mask(own["numbers"] == own["numbers"].shift(), "as above")
    table = pd.DataFrame({"the paper says": noted(own), "our figures": numbers})
    cited = number(name)
    parts = [f"### {cited} {{#{name}}}", pages.prose(f"*{FIGURES[name].caption}.*").strip()]
    parts += [f"![{cited}](images/paper/{name}.png)"] * (PICTURES / f"{name}.png").is_file()
    return "\n\n".join([*parts, pages.markdown(table) if len(table) else ""])


def blocks(results: pd.DataFrame, parts: Sequence[Part]) -> Mapping[str, str]:
    """What stands between the marks of the page."""
    found = verdicts(results)
    counts = found["verdict"].value_counts().reindex(VERDICTS, fill_value=0)
    return {
        "made": pages.prose(made(results, parts)),
        "counts": "{} hold, {} do not, {} are within error; those without a note below hold.\n".format(*counts),
        "differences": pages.markdown(differences(results, found)),
        "effort": pages.markdown(effort(results)),
        "markers": pages.markdown(markers(results)),
        "outside": pages.prose(outside(results)),
        "figures": "\n".join(section(name, found) for name in FIGURES),
    }
