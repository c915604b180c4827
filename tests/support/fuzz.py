"""Inputs that a user might type, right and wrong: made by hypothesis from schemas of files and options of commands."""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cache
from typing import Any

import yaml
from hypothesis import strategies as st
from typer.main import get_command

from pairsim.cli.app import app
from pairsim.inputs.schema import json_schema

Tree = dict[str, Any]

CASES: dict[str, Tree] = {
    "run": {"beta": 0.4, "De": 0, "Ca_e": 0.1, "d0": 0.1},
    "curve": {"beta": 0.4, "De": 0.5, "Ca_e": 0.1, "d": [0.1, 0.3]},
    "critical": {"beta": 0.4, "De": 0.5, "Ca_e": 0.1, "along": {"Ca_e": [0.05, 0.1]}},
    "shape": {"particles": 1, "beta": 0.4, "De": 0, "Ca_e": 0.1, "along": [0.05, 0.1]},
    "sweep": {"base": {"beta": 0.4, "De": 0, "Ca_e": 0.1}, "grid": {"d0": [0.1, 0.2]}},
    "study": {
        "base": {"beta": 0.4, "De": 0, "Ca_e": 0.1, "d0": 0.1},
        "discretisations": [{"mesh.Np": 8}, {"mesh.Np": 11}],
    },
}
"""The smallest file of each command."""
TYPED = ("run", "curve", "critical", "shape", "sweep", "study", "units", "travel", "table", "status", "schema")
"""Commands whose options are typed at random: those that compute nothing, or have --dry-run or nothing to do."""
PLACES = ("case.yaml", "nowhere", "pipe", ".", "/dev/null", "/dev/zero", "a" * 300, "a\nb", "\udcff", "results", "")
QUANTITIES = ("50um", "20 um", "1ul/min", "5kPa", "1Pa.s", "1 parsec", "-1 um", "5e400 m", "1 m**99999", "nan um")
WORDS = (
    "010",
    "1:30",
    "0x10",
    "1e400",
    ".inf",
    "4" * 5000,
    "0,5",
    "yes",
    "2020-13-45",
    "../x",
    "\0",
    "x=1",
    "mesh.Np=8",
)
SNIPPETS = (
    *("!!python/object/apply:os.system [touch x]", "!!bool x", "!x 1", "&a [*a]", "*nowhere", "{<<: 3}", "<<: [1]\n"),
    *(
        "[" * 3000,
        "{a: " * 3000,
        "? [1]",
        "|\n  x",
        "\t1",
        "{a: 1, a: 2}",
        "'x",
        '"\\uD800"',
        '"\\0"',
        "\ufeff",
        "\udcff",
    ),
    *("---\n", "%YAML 9.9\n", "{" + ", ".join(f"k{i}: 1" for i in range(1200)) + "}", "4" * 400, "x" * 2000),
)
"""Parts of a YAML file that no writer of YAML writes."""

scalars = st.one_of(
    st.none(), st.booleans(), st.integers(), st.floats(), st.text(max_size=12), st.sampled_from(WORDS + QUANTITIES)
)
anything = st.recursive(
    scalars,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=6,
)


@dataclass(frozen=True)
class Input:
    """A command line, and the files in the folder where it is typed; a file without text is a pipe."""

    arguments: tuple[str, ...]
    files: dict[str, str | None]


@cache
def schema_of(command: str) -> Tree:
    """The JSON schema of the file of a command."""
    return json.loads(json_schema(command))


def numbers(command: str) -> list[tuple[str, float, float]]:
    """Keys whose values are numbers, or may be, with their limits; those of groups are dotted."""
    schema = schema_of(command)
    refs = {
        f"{name}.": each["$ref"].rpartition("/")[2] for name, each in schema["properties"].items() if "$ref" in each
    }
    parts = {"": schema} | {at: schema["$defs"][name] for at, name in refs.items()}
    keys = [(at + name, each) for at, part in parts.items() for name, each in part["properties"].items()]
    known = [(key, value) for key, each in keys for value in (each, *each.get("anyOf", ()))]
    return [(key, value["minimum"], value["maximum"]) for key, value in known if {"minimum", "maximum"} <= value.keys()]


def allowed(schema: Tree, definitions: Tree) -> st.SearchStrategy[Any]:
    """Values that a JSON schema allows; texts with a pattern or a format of their own are not always among them."""
    if "$ref" in schema:
        return st.deferred(lambda: allowed(definitions[schema["$ref"].rpartition("/")[2]], definitions))
    for key in ("anyOf", "oneOf"):
        if key in schema:
            return st.one_of([allowed(each, definitions) for each in schema[key]])
    if "enum" in schema or "const" in schema:
        return st.sampled_from(schema.get("enum", [schema.get("const")]))
    least, most = schema.get("minimum", schema.get("exclusiveMinimum", 0)), schema.get("maximum", 1000)
    match schema.get("type"):
        case "null":
            return st.none()
        case "boolean":
            return st.booleans()
        case "integer":
            return st.integers(int(least), int(schema.get("exclusiveMaximum", most)))
        case "number":
            return st.floats(least, schema.get("exclusiveMaximum", most)) | st.sampled_from([least, most])
        case "array":
            if "prefixItems" in schema:
                return st.tuples(*(allowed(each, definitions) for each in schema["prefixItems"])).map(list)
            return st.lists(allowed(schema.get("items", {}), definitions), max_size=4)
        case "object" if "properties" in schema:
            keys = {name: allowed(each, definitions) for name, each in schema["properties"].items()}
            required = {name: keys.pop(name) for name in schema.get("required", ())}
            return st.fixed_dictionaries(required, optional=keys)
        case "string":
            return st.sampled_from(["1%", "0.5%", "auto", "pair", "é", *QUANTITIES]) | st.text(max_size=8)
    return anything


def changed(command: str, tree: Tree) -> st.SearchStrategy[Tree]:
    """A file of a command after some changes: other values, mostly allowed ones, unknown keys, and keys left out."""
    schema = schema_of(command)
    keys = schema["properties"]
    right = st.sampled_from(sorted(keys)).flatmap(
        lambda key: st.tuples(st.just(key), allowed(keys[key], schema.get("$defs", {})))
    )
    wrong = st.tuples(
        st.sampled_from([*sorted(keys), "lenght", "mesh.Np", "", "physical"]) | st.text(max_size=8), anything
    )
    left_out = st.tuples(st.sampled_from(sorted(tree)), st.just(...))
    changes = st.lists(st.one_of(right, right, right, wrong, left_out), min_size=1, max_size=4)
    return changes.map(lambda each: {key: value for key, value in {**tree, **dict(each)}.items() if value is not ...})


def trees(command: str) -> st.SearchStrategy[Tree]:
    """Files of a command; what a sweep and a study vary is changed too."""
    if command not in ("sweep", "study"):
        return changed(command, CASES[command])
    base = changed("run", CASES[command]["base"])
    keys = st.sampled_from(sorted(schema_of("run")["properties"])) | st.text(max_size=6)
    grid = st.dictionaries(keys, st.lists(anything, max_size=3) | anything, max_size=3)
    inner = st.fixed_dictionaries({}, optional={"base": base, "grid": grid, "zip": grid})
    return st.tuples(changed(command, CASES[command]), inner).map(lambda each: each[0] | each[1])


def damaged(text: str) -> st.SearchStrategy[str]:
    """A text, or one of which a part has been replaced."""
    places = st.integers(0, len(text))
    part = st.text(max_size=5) | st.sampled_from(SNIPPETS)
    cut = st.tuples(places, places, part).map(lambda at: text[: min(at[:2])] + at[2] + text[max(at[:2]) :])
    return st.one_of(st.just(text), st.just(text), cut)


def files(command: str) -> st.SearchStrategy[Input]:
    """A command with a changed or damaged file."""
    texts = trees(command).map(lambda tree: yaml.safe_dump(tree, allow_unicode=True, sort_keys=False)).flatmap(damaged)
    dry = () if command == "study" else ("--dry-run",)
    return texts.map(lambda text: Input((command, "case.yaml", *dry), {"case.yaml": text}))


@cache
def options_of(name: str) -> list[Any]:
    """The options of a command, also of one that is made when it is used."""
    command: Any = get_command(app).commands[name]  # type: ignore[attr-defined]
    return [each for each in getattr(command, "whole", command).params if each.opts[0][0] == "-"]


@st.composite
def lines(draw: st.DrawFn) -> Input:
    """A command line with any of its options, and any words for their values."""
    name = draw(st.sampled_from(TYPED))
    options = options_of(name)
    value = st.one_of(st.sampled_from(PLACES), st.sampled_from(QUANTITIES + WORDS), st.text(max_size=8))
    words = [name, *draw(st.lists(st.sampled_from(PLACES[:4]) | value, max_size=2))]
    for option in draw(st.lists(st.sampled_from(options), max_size=4)):
        words += [draw(st.sampled_from(option.opts)), *([] if option.is_flag else [draw(value)])]
    words += ["--dry-run"] if any("--dry-run" in each.opts for each in options) else []
    record = draw(st.sampled_from(["{", "[]", "{}", '{"kind": "curve"}', '{"status": 1, "kind": "run"}']))
    table = draw(st.sampled_from(["", "t,dU\n0,x\n", "d,dU\n0.1,1\n0.2,2\n", "\0"]) | st.text(max_size=9))
    results = {f"results/{each}.csv": table for each in ("series", "curve")} | {"results/run.json": record}
    case = yaml.safe_dump(CASES.get(name, CASES["run"]))
    return Input(tuple(word.replace("\0", "") for word in words), {"case.yaml": case, "pipe": None, **results})


KINDS = {**{command: files(command) for command in CASES}, "line": lines()}
"""What makes each kind of input."""
