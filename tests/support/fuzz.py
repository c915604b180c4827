"""Inputs that a user might type, right and wrong, made from the schema of each kind of file by hypothesis.

Files are written as text, so that they can hold what no YAML writer writes: tags, aliases, octal numbers.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from functools import cache
from itertools import product
from pathlib import Path
from typing import Any

from hypothesis import strategies as st

from pairsim.inputs.case_files import FILES
from pairsim.inputs.schema import json_schema

Tree = dict[str, Any]
"""Keys with their values as text of YAML, groups nested."""

CASES: dict[str, Tree] = {
    "run": {"beta": "0.4", "De": "0", "Ca_e": "0.1", "d0": "0.1"},
    "curve": {"beta": "0.4", "De": "0.5", "Ca_e": "0.1", "d": "[0.1, 0.3]"},
    "critical": {"beta": "0.4", "De": "0.5", "Ca_e": "0.1", "along": "{Ca_e: [0.05, 0.1]}"},
    "shape": {"particles": "1", "beta": "0.4", "De": "0", "Ca_e": "0.1", "along": "[0.05, 0.1]"},
    "sweep": {"base": {"beta": "0.4", "De": "0", "Ca_e": "0.1"}, "grid": {"d0": "[0.1, 0.2]"}},
    "study": {
        "base": {"beta": "0.4", "De": "0", "Ca_e": "0.1", "d0": "0.1"},
        "discretisations": "[{mesh.Np: 8}, {mesh.Np: 11}]",
    },
}
"""The smallest file of each command."""
UNITS: Tree = {"tube": "50 um", "particle": "20 um", "viscosity": "1 Pa.s", "flow_rate": "1 ul/min", "modulus": "5 kPa"}
BOMB = "a0: &a0 [1, 1, 1, 1, 1, 1, 1, 1]\n" + "".join(f"a{i}: &a{i} [{f'*a{i - 1}, ' * 8}]\n" for i in range(1, 9))
PLAIN = ["0", "1", "-1", "2", "0.1", "0.5", "1e-3", "3", "true", "null", "[]", "{}", "[0.1, 0.2]", "auto", "finest"]
NAMES = ["pair", "a.b-c+1", "x" * 100, "é", "sweep"]
FILES_NAMED = ["[other.yaml]", "[my case.yaml]", "[nowhere.yaml]", "[pipe]", "[.]", "[/dev/zero]"]
RANGES = ["{start: 0.1, stop: 0.2, num: 3}", "{start: 0.05, stop: 1, num: 4, spacing: log}", "{start: 1, stop: 2}"]
NUMBERS = [
    *(
        "010",
        "08",
        "1:30",
        "1:30.5",
        "1_000",
        "0x10",
        "0b11",
        "0o17",
        "1e",
        "1e400",
        "-1e400",
        "1e-400",
        "1e308",
        "0,5",
    ),
    *("5e-324", "1e-300", "1.7976931348623157e308", "-0.0", ".inf", "-.inf", ".nan", "99999999999999999999999", "+.5"),
    *("4" * 400, "4" * 5000, "0." + "3" * 4000, "1" + "0" * 308, "-" + "9" * 309, "0e" + "9" * 300),
]
TEXTS = [
    *("wide", "''", "'0.4'", '"\\uD800"', '"\\0"', '"a\\nb\\e[31mc\\r"', "'../x'", "..", ".", "/", "'a b'", "x" * 300),
    *("漢" * 100, "é", "2020-01-01", "2020-13-45", "yes", "no", "~", "<<", "=", "'[bold]x[/bold]'", "'{x}'", "'%s'"),
    *(
        "50 um",
        "5e400 m",
        "1 m**99999",
        "1 (m/mm)**99999*m",
        "1 parsec",
        "-1 um",
        "0 um",
        "1 degC",
        "1 um.um",
        "nan um",
    ),
]
YAML = [
    *("!!bool maybe", "!!timestamp x", "!!int x", "!!float x", "!!binary x", "!!set {a}", "!!omap [a: 1]", "!!null x"),
    *(
        "!!python/object/apply:os.system [touch x]",
        "!x 1",
        "&a [*a]",
        "&a {Np: *a}",
        "*nowhere",
        "{<<: 3}",
        "{<<: [1]}",
    ),
    *(
        "[" * 3000,
        "{a: " * 3000,
        "[" * 30 + "]" * 30,
        "{a: {b: {c: {d: 1}}}}",
        "[[0.1], [0.2]]",
        "[[[]]]",
        "? [1]",
        "- 1",
    ),
    *(
        "|\n  x",
        ">\n  x",
        "\t1",
        "@x",
        "`x",
        "%x",
        "# comment",
        "{a: 1, a: 2}",
        "{1: 2}",
        "{[1]: 2}",
        "[1, 2",
        "}",
        "'x",
    ),
    *(
        '"\\x"',
        "1 # x",
        "[" + "1, " * 2000 + "]",
        "[" + "x, " * 2000 + "]",
        "{" + ", ".join(f"k{i}: 1" for i in range(1200)) + "}",
    ),
]
KEYS = [
    "",
    "lenght",
    "mesh.Np",
    "a.b.c",
    ".",
    "..",
    "x" * 2000,
    "'a\\nb'",
    '"\\uD800"',
    '"\\0"',
    "漢",
    "'[x]'",
    "1",
    "<<",
    "yes",
]
SETTINGS = [
    "mesh.Np=8",
    "beta=0.3",
    "time.end=1e308",
    "Ca_e=[0.1, 0]",
    "=",
    "x",
    "a=",
    "=1",
    "mesh=",
    "mesh.Np",
    "beta.x=1",
]
OPTIONS = [
    *(["--limit", "0"], ["--limit", "9" * 400], ["--shard", "1/2"], ["--shard", "3/2"], ["--shard", f"1/{'9' * 5000}"]),
    *(
        ["--walltime", "1:30"],
        ["--walltime", "9" * 400],
        ["--walltime", "x"],
        ["--case-timeout", "nan"],
        ["--workers", "0"],
    ),
    *(["--case-timeout", "-1"], ["--case-timeout", "1e308"], ["--emit", "slurm"]),
    *(
        ["--emit", "x"],
        ["--progress", "x"],
        ["-o", "a" * 300],
        ["-o", "out"],
        ["-o", "case.yaml"],
        ["-o", "a/b"],
        ["-o", ""],
    ),
    *(
        ["-o", "/dev/null/x"],
        ["-o", "\udcff"],
        ["-o", "a\nb"],
        ["--fast"],
        ["-q"],
        ["--overwrite"],
        ["more.yaml"],
        ["--", "-x"],
    ),
]
OF_ALL = ("-o", "-q", "--progress", "--fast", "more.yaml", "--")  # options of every command that computes, and of none


@dataclass(frozen=True)
class Input:
    """A command line, and the files in the folder where it is typed; a file without text is a pipe."""

    arguments: tuple[str, ...]
    files: dict[str, str | None]


@dataclass(frozen=True)
class Ended:
    """How a command line ended.

    Attributes:
        code: Exit code, negative for a signal.
        out, err: What it printed, shortened.
        length: Characters it printed to stderr.
        new: Files that it wrote.
    """

    code: int
    out: str
    err: str
    length: int
    new: list[str]


class Runner:
    """A process that runs inputs in its forked children."""

    def __init__(self) -> None:
        command = [sys.executable, str(Path(__file__).with_name("fuzz_runner.py"))]
        self._process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)

    def __call__(self, inputs: Sequence[Input]) -> list[Ended]:
        """Run inputs one after another."""
        process = self._process
        assert process.stdin is not None
        assert process.stdout is not None
        process.stdin.write(json.dumps([asdict(given) for given in inputs]) + "\n")
        process.stdin.flush()
        return [Ended(**each) for each in json.loads(process.stdout.readline())]

    def close(self) -> None:
        """End the process."""
        assert self._process.stdin is not None
        self._process.stdin.close()
        self._process.wait(60)


@cache
def allowed(command: str) -> dict[str, list[str]]:
    """For each dotted key of a file, values that it takes, as text of YAML: choices, limits, and what is between."""
    schema = json.loads(json_schema(command))
    found: dict[str, list[str]] = {}

    def taken(part: Any) -> Iterator[str]:
        if not isinstance(part, dict):
            return
        for choice in part.get("anyOf", ()):
            yield from taken(choice)
        yield from (json.dumps(each) for each in (*part.get("enum", ()), part.get("const")) if each is not None)
        yield from ("true", "false") if part.get("type") == "boolean" else ()
        if part.get("type") == "array":
            yield from (f"[{each}]" for each in taken(part.get("items", {})))
            yield from (f"[{', '.join(pair)}]" for pair in product(*map(taken, part.get("prefixItems", ()))) if pair)
        if part.get("type") in ("number", "integer"):
            least = part.get("minimum", part.get("exclusiveMinimum", 0))
            most = part.get("maximum", part.get("exclusiveMaximum", 1000))
            places = [least + share * (most - least) for share in (0, 1e-6, 0.01, 0.5, 1)]
            yield from (f"{round(at) if part['type'] == 'integer' else at:.12g}" for at in places)

    for name, field in schema["properties"].items():
        group = schema.get("$defs", {}).get(field.get("$ref", "").rpartition("/")[2], {})
        for key, described in {
            name: field,
            **{f"{name}.{k}": v for k, v in group.get("properties", {}).items()},
        }.items():
            if key != name or not group:
                found[key] = [*dict.fromkeys(taken(described))] or (NAMES if key == "name" else PLAIN)
    return found


def written(tree: Tree, indent: str = "") -> str:
    """A tree as the text of a file."""
    lines = []
    for key, value in tree.items():
        lines.append(
            f"{indent}{key}:\n{written(value, indent + '  ')}"
            if isinstance(value, dict)
            else f"{indent}{key}: {value}\n"
        )
    return "".join(lines)


def quoted(text: str) -> str:
    """A text in double quotes."""
    return json.dumps(text, ensure_ascii=False)


numbers = st.one_of(st.floats(width=64).map(repr), st.integers().map(str), st.sampled_from(NUMBERS))
texts = st.one_of(st.text(max_size=12).map(quoted), st.text(max_size=6), st.sampled_from(TEXTS))
values = st.one_of(
    st.sampled_from(PLAIN),
    st.sampled_from(RANGES),
    st.sampled_from(FILES_NAMED),
    numbers,
    texts,
    st.sampled_from(YAML),
    st.lists(numbers, max_size=4).map(lambda each: f"[{', '.join(each)}]"),
)


@st.composite
def trees(draw: st.DrawFn, command: str) -> Tree:
    """The smallest file of a command after one to four changes."""
    tree = json.loads(json.dumps(CASES[command]))
    own = allowed(command)
    inner = "run" if command in ("sweep", "study") else command
    for _ in range(draw(st.sampled_from([1, 1, 2, 2, 3, 4, 6]))):
        target, known = tree, own
        if inner != command and draw(st.integers(0, 3)):
            place = "base" if command == "study" else draw(st.sampled_from(["base", "grid", "zip"]))
            if not isinstance(tree.get(place, {}), dict):
                continue
            target, known = tree.setdefault(place, {}), allowed(inner)
        kind = draw(st.integers(0, 19))
        if kind == 0 and target:
            del target[draw(st.sampled_from(list(target)))]
        elif kind == 1:
            target[draw(st.one_of(st.sampled_from(KEYS), st.text(max_size=8).map(quoted)))] = draw(values)
        elif kind == 2 and command != "study":
            group = {key: f"'{value}'" for key, value in UNITS.items()}
            group[draw(st.sampled_from([*UNITS, "distance", "end", "density", "solvent"]))] = draw(values)
            target["physical"] = group
        else:
            key = draw(st.sampled_from(list(known)))
            value = draw(st.sampled_from(known[key]) if draw(st.integers(0, 6)) else values)
            group, _, name = key.rpartition(".")
            if target is not tree and target is not tree.get("base"):
                target[key] = value if value.startswith("[") else f"[{value}, 0.1]"
            elif group and isinstance(target.get(group, {}), dict):
                target.setdefault(group, {})[name] = value
            else:
                target[key] = value
    return tree


@st.composite
def files(draw: st.DrawFn, command: str) -> Input:
    """A command with a changed file, and perhaps options."""
    text = written(draw(trees(command)))
    extra: list[str] = []
    own = OPTIONS if command == "sweep" else [words for words in OPTIONS if words[0] in OF_ALL]
    if draw(st.integers(0, 9)) == 0:
        extra += draw(st.sampled_from(own))
    if draw(st.integers(0, 9)) == 0:
        extra += ["--set", draw(st.one_of(st.sampled_from(SETTINGS), values.map(lambda value: f"beta={value}")))]
    dry = [] if command == "study" or "--emit" in extra else ["--dry-run"]
    named = {"other.yaml": written(CASES["run"]), "my case.yaml": written(CASES["run"]), "pipe": None}
    others = named if command == "sweep" else {}
    return Input((command, "case.yaml", *dry, *without_null(extra)), {"case.yaml": text, **others})


@st.composite
def raw_texts(draw: st.DrawFn) -> Input:
    """A file of any text."""
    text = draw(
        st.one_of(
            st.text(max_size=200),
            st.sampled_from(
                [
                    BOMB + "beta: *a8\n",
                    "",
                    "\ufeffbeta: 0.4",
                    "- 1",
                    "%YAML 9.9\n---\n",
                    "---\n---\n",
                    "a: b: c",
                    "\udcff",
                ]
            ),
            st.text(alphabet="{}[]:,-&*!|>'\"#%@` \n\tab01.<?", max_size=120),
            st.sampled_from(list(CASES)).map(lambda name: written(CASES[name])).flatmap(damaged),
        )
    )
    return Input(
        (draw(st.sampled_from(["run", "curve", "critical", "sweep"])), "case.yaml", "--dry-run"), {"case.yaml": text}
    )


def damaged(text: str) -> st.SearchStrategy[str]:
    """A text of which a part has been replaced."""
    places = st.integers(0, len(text))
    return st.tuples(places, places, st.one_of(st.text(max_size=5), values)).map(
        lambda each: text[: min(each[:2])] + each[2] + text[max(each[:2]) :]
    )


def without_null(words: list[str]) -> list[str]:
    """Words as a command line can have them."""
    return [word.replace("\0", "") for word in words]


@st.composite
def lines(draw: st.DrawFn) -> Input:
    """A command line, with any words."""
    case = written(CASES["run"])
    quantities = st.one_of(
        st.sampled_from(TEXTS), texts, st.sampled_from(["50um", "20 um", "1ul/min", "5kPa", "1Pa.s", "2ms"])
    )
    units = ["--tube", "--particle", "--viscosity", "--flow", "--modulus", "--young", "--relaxation", "--solvent"]
    given = ["50um", "20um", "1Pa.s", "1ul/min", "5kPa", "15kPa", "2ms", "1mPa.s"]
    places = ["case.yaml", "nowhere", "pipe", ".", "/dev/null", "a" * 300, "a\nb", "\udcff", "results", "", "/dev/zero"]
    kind = draw(st.integers(0, 5))
    words: list[str]
    if kind == 0:
        words = ["units"]
        for option, value in zip(units, given, strict=True):
            if draw(st.integers(0, 4)):
                words += [option, draw(quantities) if draw(st.integers(0, 3)) == 0 else value]
    elif kind == 1:
        words = [draw(st.sampled_from(["status", "table"])), draw(st.sampled_from(places))]
    elif kind == 2:
        ends = st.one_of(st.sampled_from(NUMBERS), quantities)
        words = ["travel", draw(st.sampled_from(places)), "--from", draw(ends), "--to", draw(ends)]
    elif kind == 3:
        words = ["schema", draw(st.sampled_from([*FILES, "x"])), "--case", draw(st.sampled_from(places))]
    elif kind == 4:
        command = draw(st.sampled_from(["run", "curve", "critical", "sweep"]))
        words = [command, draw(st.sampled_from(places)), "--dry-run", *draw(st.sampled_from(OPTIONS))]
    else:
        some = st.one_of(
            st.text(max_size=10), st.sampled_from(["run", "init", "sweep", "--help", "--version", "-", "--", "x"])
        )
        words = [*draw(st.lists(some, max_size=4)), "--help"]
    record = draw(
        st.one_of(
            st.sampled_from(["{", "[]", "{}", '{"kind": "curve"}', '{"status": 1, "kind": "run"}']), st.text(max_size=9)
        )
    )
    table = draw(
        st.one_of(st.sampled_from(["", "t,dU\n", "t,dU\n0,x\n", "d,dU\n0.1,1\n0.2,2\n", "\0"]), st.text(max_size=20))
    )
    results: dict[str, str | None] = {
        "results/run.json": record,
        "results/series.csv": table,
        "results/curve.csv": table,
    }
    needed = {name: text for name, text in results.items() if "results" in words}
    return Input(tuple(without_null(words)), {"case.yaml": case, "pipe": None, **needed})


KINDS: dict[str, tuple[Callable[[], st.SearchStrategy[Input]], int]] = {
    "run": (lambda: files("run"), 500),
    "curve": (lambda: files("curve"), 200),
    "critical": (lambda: files("critical"), 200),
    "sweep": (lambda: files("sweep"), 400),
    "study": (lambda: files("study"), 250),
    "text": (raw_texts, 200),
    "line": (lines, 250),
}
"""For each kind of input: what makes it, and how many of 2,000 inputs it has."""
