"""Error bars of dU against errors: of quasi-steady solutions in listed or random scenes, of curves, or of runs in time.

usage: scripts/error_bars [-o runs/error_bars] [--random | --curves | --runs] [--only WORD] [--workers N] [--table]

Solves every scene of configs/error_bars/scenes.yaml on three meshes, with the error, and integrates every case of
runs.yaml at two values of `accuracy`; both also on two fine meshes of different kinds, which give the truth. Some three
hours, and twenty minutes for runs; the same command goes on after any kind of end. An error is judged if the two truths
agree to a fifth of it, and if it is not below .02 % of the largest |dU|. On half of the scenes the factors are fixed
with which the bars cover 95 % of the errors, on the others they are judged.

With --random curves of one point, drawn with the seed of random.yaml, are solved with default settings, and finely for
the truth; some two hours. An error is judged, however small, if the half-width of the truth is below a third of that by
default. A single particle has no dU: its velocity is judged. With --curves the same is done at all distances of the
curves of curves.yaml, in liquids that thin without a memory; some twenty minutes.

Writes every error to scenes.csv, random.csv, curves.csv or runs.csv in the output folder, and the judgement to the .md
beside it.

Exit code 0: all was solved and judged; 1: a scene could not be solved.
"""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from book import draws, pages, yaml_files
from book.cases import Case, Cases
from book.computing import CONFIGS, pairsim, parser_of

from pairsim.cases.yaml_file import yaml_text
from pairsim.record.folder import write_text

FINE = ("fine.1", "fine.2")
TIMES = 10
"""Times at which runs are judged."""
KNOWN, NEGLIGIBLE, COVERED = 0.2, 2e-4, 0.95
LIMIT = 1200  # wall time of a case [s]
TRUTH = 1 / 3  # largest half-width of the truth of random scenes, over that by default
DE_CLASSES = {"0": 0.0, "to .5": 0.5, "to 1": 1.0, "to 2": 2.0, "to 3": 3.0}
"""Classes of random scenes by the largest De."""


def read(kind: str) -> tuple[dict[str, Any], dict[str, Any], dict[str, Any]]:
    """What all scenes of a file of configs/error_bars have, the scenes, and the meshes of each."""
    content = yaml_files.read(CONFIGS / "error_bars" / f"{kind}.yaml")
    meshes = content.pop("meshes")
    scenes = content.pop("scenes", {})
    for draw in content.pop("draws", ()):
        scenes |= draws.scenes(**draw)
    return content, scenes, meshes


def cases(name: str, scene: Mapping[str, Any], meshes: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
    """A scene on all meshes."""
    liquid = "viscoelastic" if scene.get("De", 0) else "newtonian"
    for kind, keys in meshes.get(liquid, meshes.get("any", {})).items():
        case = {"name": f"{name}+{kind}", **scene, **keys}
        if "any" in meshes:
            yield case
        elif "d" in scene:
            places = sorted({*keys.get("d", ()), scene["d"]})
            yield case | {"d": places, "max_points": len(places)}
        else:
            yield case | {"output.times": [round(scene["time"]["end"] * k / TIMES, 10) for k in range(1, TIMES + 1)]}


def sorted_out(output: Path, scenes: Mapping[str, Any]) -> Iterator[tuple[str, dict[str, Case]]]:
    """Finished cases by scene and mesh, of scenes whose truth is there."""
    found: dict[str, dict[str, Case]] = {}
    for case in Cases(output.parent, []).of(output.name):
        scene, _, kind = case.folder.name.rpartition("-")[0].partition("+")
        found.setdefault(scene, {})[kind] = case
    for name in (name for name in scenes if set(FINE) <= found.get(name, {}).keys()):
        same = (found.get(other, {}).get("peak") for other in scenes if alone(scenes[other]) == alone(scenes[name]))
        yield name, {"peak": peak} | found[name] if (peak := next(filter(None, same), None)) else found[name]


def alone(scene: Mapping[str, Any]) -> dict[str, Any]:
    """A scene without its distance; scenes that differ in that alone may share the curve of the peak."""
    return {key: value for key, value in scene.items() if key != "d"}


def points(case: Case) -> pd.DataFrame:
    """dU and what is said of it: the last point of a curve with a row for every gap, or a run at `TIMES`."""
    if case.kind == "run":
        nearest = [int((case.table["t"] - t).abs().argmin()) for t in case.parameters["output.times"]]
        named = {"t": "at", "mesh": "remeshings"}
        return case.table.iloc[nearest].rename(columns=named).reset_index(drop=True).assign(cancels=False)
    last, gaps = case.table.iloc[-1], case.parameters["particles"] - 1
    ends = [""] if gaps == 1 else [f"_{gap + 1}" for gap in range(gaps)]
    table = pd.DataFrame({"at": range(1, gaps + 1), "dU": [last[f"dU_held{end}"] for end in ends]})
    table["dU_correction"] = [last[f"dU_correction{end}"] for end in ends]
    table["dU_error"] = [last[f"dU_error{end}"] - last[f"ends_error{end}"] for end in ends]  # all have the same tube
    table["peak"] = [case.table[f"dU_held{end}"].abs().max() for end in ends]
    return table.assign(cancels=not last["corrected"])


def errors_of(name: str, kinds: Mapping[str, Case]) -> Iterator[pd.DataFrame]:
    """The errors of a scene on every mesh that is not fine, and what is said of them."""
    found = {kind: points(case) for kind, case in kinds.items()}
    first, second = (found[kind]["dU"] for kind in FINE)
    peak = found["peak"]["peak"] if "peak" in found else kinds[FINE[0]].peak
    columns = ["scene", "kind", "at", "dU", "dU_correction", "dU_error", "cancels", "remeshings", "peak"]
    for kind in (kind for kind in found if kind not in (*FINE, "peak")):
        table = found[kind].assign(scene=name, kind=kind, peak=peak).reindex(columns=columns)
        yield table.assign(error=(first + second) / 2 - table["dU"], known=(first - second).abs())


def groups(judged: pd.DataFrame) -> dict[str, pd.DataFrame]:
    """Errors by what is said of them: those that fix factors (of every second scene), the others, and by liquid."""
    law = judged["scene"].str.split("-").str[0]
    found = {"fixing": judged[judged["fixes"]], "judging": judged[~judged["fixes"]]}
    found |= {kind: judged[law == kind] for kind in ("newtonian", "giesekus")}
    found["other laws"] = judged[~law.isin(["newtonian", "giesekus"])]
    return found | {"De 2": judged[judged["De"] == 2]}


def bars(judged: pd.DataFrame) -> pd.DataFrame:
    """How often dU_error covers the error, as it is and with a factor, and how it compares with the error."""
    ratios = judged["dU_error"] / judged["error"].abs()
    needed = (1 / ratios[judged["fixes"]]).sort_values()
    fixed = needed.iloc[math.ceil(COVERED * len(needed)) - 1] if len(needed) else math.nan
    lines = []
    for bar, factor in (("dU_error", 1.0), ("dU_error, fixed", fixed)):
        for group, part in groups(judged).items():
            own = ratios[part.index]
            line = {"bar": bar, "scenes": group, "factor": f"{factor:.2f}", "errors": len(own)}
            if len(own):
                line["covered"] = f"{100 * (factor * own >= 1).mean():.0f} %"
                line |= {"within [.5, 2]": f"{100 * own.between(0.5, 2).mean():.0f} %", "median": f"{own.median():.2f}"}
                line["least to largest"] = f"{own.min():.2g} to {own.max():.2g}"
                line["factor times median"] = f"{factor * own.median():.1f}"
            lines.append(line)
    return pd.DataFrame(lines).fillna("")


def by_scene(errors: pd.DataFrame) -> pd.DataFrame:
    """Verdicts by scene and mesh, with the median of what is said over the error."""
    judged = errors[errors["verdict"].isin(["held", "missed"])]
    counts = pd.crosstab([errors["scene"], errors["kind"]], errors["verdict"])
    ratio = (judged["dU_error"] / judged["error"].abs()).groupby([judged["scene"], judged["kind"]])
    text = ratio.agg(lambda part: f"{part.median():.2f} ({part.min():.2g} to {part.max():.2g})")
    counts["dU_error/error"] = text.reindex(counts.index).fillna("")
    return counts.reset_index()


def page(errors: pd.DataFrame) -> str:
    """The judgement."""
    judged = errors[errors["verdict"].isin(["held", "missed"])]
    added = judged[~judged["cancels"]]
    better = (added["error"].abs() < (added["error"] + added["dU_correction"]).abs()).sum()
    text = f"{len(judged)} errors are judged. dU_correction is added in {len(added)}, and makes dU better in {better}."
    missed = judged.loc[judged["verdict"] == "missed", ["scene", "kind", "at", "error", "dU_error"]]
    missed = missed.map(lambda cell: f"{cell:.3g}" if isinstance(cell, float) else cell)
    return "\n".join([pages.prose(text), *map(pages.markdown, (bars(judged), by_scene(errors), missed))])


def finer_errors(output: Path, scenes: Mapping[str, Any]) -> pd.DataFrame:
    """What default settings say of each scene and how far it is from the truth, a row for each distance and gap.

    Scenes without a steady state, or with a truth that was not found, have one row with the reason.
    """
    found: dict[str, dict[str, Any]] = {}
    for result in Cases(output.parent, []).sweep(output.name).cases:
        scene, _, kind = result.folder.name.rpartition("-")[0].partition("+")
        found.setdefault(scene, {})[kind] = result
    rows = []
    for name, kinds in found.items():
        scene = scenes[name]
        row = {"scene": name, "law": name.split("-", 1)[1].rpartition("-")[0], "N": scene.get("particles", 2)}
        row |= {"De": scene.get("De", 0.0), "soft": scene["Ca_e"] != 0}
        ended = [f"{kind}: {each.reason or each.status}" for kind, each in kinds.items() if each.status != "finished"]
        if ended or len(kinds) < len(("default", "fine")):
            rows.append(row | {"half_width": math.nan, "ended": ", ".join(ended or ["not computed"])})
            continue
        default, fine = kinds["default"], kinds["fine"]
        peak = default.record.get("adaptation", {}).get("reference_dU", math.nan)
        row |= {"ends": Case(default).parameters["ends"], "ended": ""}
        row |= {name: default.record.get(name) for name in ("wall_time", "unknowns")}
        for said, true in zip(*(each.table.to_dict("records") for each in (default, fine)), strict=True):
            values = [(key, key.replace("dU", "dU_error")) for key in said if re.fullmatch(r"dU(_\d+)?", key)]
            for key, half_width in values or [("U_1", "U_error_1")]:
                one = {"d": said.get("d"), "at": key, "value": said[key], "half_width": abs(said[half_width])}
                rows.append(row | one | {"peak": peak, "error": true[key] - said[key], "known": abs(true[half_width])})
    return pd.DataFrame(rows)


def finer_page(errors: pd.DataFrame) -> str:
    """How many errors are inside the interval alone, and inside it and that of the truth together."""
    answered = errors[errors["half_width"].notna()]
    classes = pd.cut(answered["De"], [-1.0, *DE_CLASSES.values()], labels=list(DE_CLASSES))
    kinds = {"De": classes, "particles": answered["soft"].map({True: "soft", False: "rigid"})}
    parts = [("all", answered)]
    several = ["scene"] if (answered.groupby("scene")["d"].nunique() > 1).any() else []
    for kind, by in ({key: answered[key] for key in ("law", "N", "ends", *several)} | kinds).items():
        parts += [(f"{kind} {name}", part) for name, part in answered.groupby(by, observed=True)]
    lines = []
    for name, part in parts:
        error, half_width = part["error"].abs(), part["half_width"]
        known = part["known"] <= TRUTH * half_width
        line = {"points": name, "scenes": part["scene"].nunique(), "errors": len(part)}
        line["inside both"] = f"{100 * (error <= half_width + part['known']).mean():.0f} %"
        line |= {"judged": known.sum(), "inside": f"{100 * (error <= half_width)[known].mean():.0f} %"}
        line["half-width over error, median"] = f"{(half_width / error).median():.1f}"
        line["largest error over half-width"] = f"{(error / half_width).max():.2f}"
        line["half-width over peak, median"] = f"{100 * (half_width / part['peak']).median():.2f} %"
        lines.append(line)
    missed = answered[answered["error"].abs() > answered["half_width"]]
    missed = missed[["scene", "d", "at", "value", "error", "half_width", "known", "peak"]]
    missed = missed.map(lambda cell: f"{cell:.3g}" if isinstance(cell, float) else cell)
    ended = errors.loc[errors["half_width"].isna(), ["scene", "De", "ended"]]
    return "\n".join(pages.markdown(table) for table in (pd.DataFrame(lines), missed, ended))


def main() -> int:
    """Compute, then judge."""
    parser = parser_of("error_bars", __doc__, "runs/error_bars")
    parser.add_argument("--only", default="", metavar="WORD", help="scenes whose name contains it")
    kinds = parser.add_mutually_exclusive_group()
    for other, words in (("runs", "runs in time"), ("random", "scenes drawn at random"), ("curves", "whole curves")):
        kinds.add_argument(f"--{other}", dest="kind", action="store_const", const=other, help=f"{words} instead")
    parser.set_defaults(kind="scenes")
    arguments = parser.parse_args()
    kind = arguments.kind
    content, scenes, meshes = read(kind)
    output: Path = arguments.output / (f"{kind}-{arguments.only}" if arguments.only else kind)
    code, file = 0, output.parent / f"{output.name}.yaml"
    if not arguments.table:
        chosen = {name: scene for name, scene in scenes.items() if arguments.only in name}
        grid = content | {"cases": [case for name, scene in chosen.items() for case in cases(name, scene, meshes)]}
        output.parent.mkdir(parents=True, exist_ok=True)
        write_text(file, yaml_text(grid))
        alone_each = ("--case-timeout", LIMIT)
        code = pairsim("sweep", file, "-o", output, *alone_each, "--workers", arguments.workers)
    if kind in ("random", "curves"):
        drawn = finer_errors(output, scenes)
        write_text(output.parent / f"{kind}.csv", drawn.to_csv(index=False))
        write_text(output.parent / f"{kind}.md", finer_page(drawn))
        print(finer_page(drawn))
        return int(code != 0)
    found = [table for name, kinds in sorted_out(output, scenes) for table in errors_of(name, kinds)]
    if found:
        errors = pd.concat(found, ignore_index=True)
        errors["fixes"] = errors["scene"].isin(list(scenes)[::2])
        errors["De"] = errors["scene"].map(lambda name: scenes[name]["De"])
        error = errors["error"].abs()
        undecided = error < NEGLIGIBLE * errors["peak"], errors["known"] > KNOWN * error
        # Whether the interval holds the truth, as far as can be told.
        held = [*undecided, error <= errors["dU_error"]]
        errors["verdict"] = np.select(held, ["negligible", "undecided", "held"], "missed")
        write_text(output.parent / f"{kind}.csv", errors.to_csv(index=False))
        write_text(output.parent / f"{kind}.md", page(errors))
        print(page(errors))
    return int(code != 0)


if __name__ == "__main__":
    sys.exit(main())
