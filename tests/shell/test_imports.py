"""The direction of imports where import-linter does not look: by name, and inside functions."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from functools import cache
from typing import NamedTuple

import pytest
from support.inputs import ROOT

LARGE = {
    *("dolfinx", "gmsh", "h5py", "jinja2", "matplotlib", "meshio", "mpi4py", "numpy", "pandas", "petsc4py"),
    *("pint", "pydantic", "pyvista", "rich", "ruamel", "scipy", "ufl", "xarray"),
}
"""Libraries that take more than some ten milliseconds to import."""
BY_NAME = {
    "pairsim/__init__.py": "of the interface, when it is first used: nothing below imports the package itself",
    "pairsim/app/command_line.py": "commands beside it",
    "pairsim/computing/question.py": "a record where it is pickled, which names the module that has it",
    "pairsim/physics/material.py": "laws beside a file",
    "pairsim/physics/operations.py": "numpy or UFL",
    "pairsim/questions/registry.py": "questions beside it",
}
"""Files that import by name, and what."""
AT_ONCE = {
    "pairsim/__init__.py": "the package alone loads nothing",
    "pairsim/__main__.py": "Ctrl-C is answered first",
    "pairsim/app/command_line.py": "a command is loaded when it is called",
    "pairsim/computing/off_axis/beside.py": "the solver of disturbances is loaded where a case asks for rates",
}
"""Files whose functions import what loads no large library, and why."""


class Module(NamedTuple):
    """What a module imports when it is imported itself, and inside its functions."""

    ours: frozenset[str]
    others: frozenset[str]
    inside: tuple[tuple[int, frozenset[str]], ...]


FILES = {
    ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"): path
    for path in sorted((ROOT / "pairsim").rglob("*.py"))
}


def names(node: ast.Import | ast.ImportFrom) -> frozenset[str]:
    """The modules that a statement imports, and the packages that they are in."""
    if isinstance(node, ast.Import):
        found = {each.name for each in node.names}
    else:
        members = {f"{node.module}.{each.name}" for each in node.names}
        found = {member if member in FILES else str(node.module) for member in members}
    return frozenset(name.rsplit(".", i)[0] for name in found for i in range(name.count(".") + 1))


def statements(nodes: list[ast.stmt]) -> Iterator[ast.AST]:
    """What is executed when a module is imported."""
    for node in nodes:
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            yield from statements(node.orelse)
        elif not isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            yield node
            for part in ("body", "orelse", "handlers", "finalbody"):
                yield from statements(getattr(node, part, []))


@cache
def module(name: str) -> Module:
    tree = ast.parse(FILES[name].read_text())
    imported = [names(node) for node in statements(tree.body) if isinstance(node, ast.Import | ast.ImportFrom)]
    every = frozenset(each for one in imported for each in one)
    functions = (node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef))
    own = {node: names(node) for each in functions for node in ast.walk(each) if isinstance(node, ast.ImportFrom)}
    inside = tuple((node.lineno, each & FILES.keys()) for node, each in own.items() if each & FILES.keys())
    packages = frozenset(name.rsplit(".", i)[0] for i in range(1, name.count(".") + 1))
    return Module((every & FILES.keys()) | packages, every - FILES.keys(), inside)


def libraries(start: frozenset[str]) -> set[str]:
    """The large libraries that modules load when they are imported."""
    seen, left, found = set[str](), [*start], set[str]()
    while left:
        if (name := left.pop()) not in seen:
            seen.add(name)
            left += module(name).ours
            found |= {each.partition(".")[0] for each in module(name).others}
    return found & LARGE


def test_few_files_import_by_name() -> None:
    called = {"import_module", "resolve_name", "__import__"}
    by_name = {
        path.relative_to(ROOT).as_posix()
        for path in FILES.values()
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.Call) and ast.unparse(node.func).rpartition(".")[2] in called
    }
    # resolve_name is also handed over, to be called when a record is unpickled
    assert by_name | {"pairsim/computing/question.py"} == BY_NAME.keys()


@pytest.mark.parametrize("file", ["pairsim/questions/registry.py", "pairsim/app/command_line.py"])
def test_what_is_imported_by_name_is_beside_the_file(file: str) -> None:
    calls = [node for node in ast.walk(ast.parse((ROOT / file).read_text())) if isinstance(node, ast.Call)]
    given = [ast.unparse(call.args[0]) for call in calls if ast.unparse(call.func) == "import_module"]
    assert given
    assert all(each.startswith("f'{__package__}.") for each in given)


def test_nothing_below_imports_the_package_itself() -> None:
    """Its names are those of all floors: whoever imports it could reach upwards."""
    named = {name for name in FILES if name != "pairsim" and "import pairsim\n" in FILES[name].read_text()}
    assert named
    assert all(name.startswith("pairsim.app.commands.") for name in named)


@pytest.mark.parametrize("name", FILES)
def test_functions_import_only_what_loads_a_large_library(name: str) -> None:
    """A module that costs nothing is imported at the top of a file, where its direction is seen at once."""
    file = FILES[name].relative_to(ROOT).as_posix()
    loaded = libraries(frozenset({name}))
    needless = [line for line, target in module(name).inside if not libraries(target) - loaded]
    assert not needless or file in AT_ONCE, f"{file}: lines {needless}"
