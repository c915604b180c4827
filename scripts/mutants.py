"""A random sample of mutants (small changes of the source) of physics, constraints and time scheme, by cosmic-ray."""

from __future__ import annotations

import ast
import random
import re
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cosmic_ray.ast import ast_nodes, get_ast
from cosmic_ray.mutating import mutate_code
from cosmic_ray.plugins import get_operator, operator_names

ROOT = Path(__file__).resolve().parent.parent
TARGETS = (
    "pairsim/physics/**/*.py",
    "pairsim/fem/algebra/constraints.py",
    "pairsim/fem/algebra/scene_constraints.py",
    "pairsim/fem/algebra/reduced_matrix.py",
    "pairsim/fem/phases/compiled_phase.py",
    "pairsim/fem/phases/phase.py",
    "pairsim/solvers/stepping/history.py",
    "pairsim/solvers/transient/scene.py",
    "pairsim/solvers/transient/transient.py",
    "pairsim/solvers/stepping/step_size.py",
    "pairsim/solvers/errors/time_error.py",
)
TRIVIAL = re.compile(r"_(BitOr|BitAnd|BitXor|LShift|RShift|FloorDiv|Mod)$")  # these fail at once on floats


@dataclass(frozen=True)
class Mutant:
    """One change at one position in the source.

    Attributes:
        file: Path of the module, relative to the root of the repository.
        operator: Name of the mutation operator of cosmic-ray.
        occurrence: Number of the position among those to which the operator applies in the module.
        line: Line number of the position.
    """

    file: str
    operator: str
    occurrence: int
    line: int


def meaning(source: str) -> str:
    """Syntax tree of a module without annotations, docstrings and class decorators, which do not affect results."""
    tree = ast.parse(source)
    for node in ast.walk(tree):
        if isinstance(node, ast.arg | ast.AnnAssign):
            node.annotation = ast.Constant(None)
        if isinstance(node, ast.FunctionDef):
            node.returns = None
        if isinstance(node, ast.ClassDef):
            node.decorator_list = []
        body = getattr(node, "body", None)
        if isinstance(body, list):
            node.body = [  # type: ignore[attr-defined]
                part for part in body if not (isinstance(part, ast.Expr) and isinstance(part.value, ast.Constant))
            ]
    return ast.dump(tree)


def applied(mutant: Mutant, root: Path = ROOT) -> str | None:
    """Source of the changed module, None if its meaning is unchanged or it is not valid Python."""
    source = (root / mutant.file).read_text(encoding="utf-8")
    changed = mutate_code(source, get_operator(mutant.operator)(), mutant.occurrence)
    try:
        return changed if changed and meaning(changed) != meaning(source) else None
    except SyntaxError:
        return None


def places(file: str) -> list[list[Mutant]]:
    """All mutants of a module, grouped by position."""
    tree = get_ast((ROOT / file).read_text(encoding="utf-8"))
    found: dict[tuple[Any, Any], list[Mutant]] = defaultdict(list)
    for name in sorted(operator_names()):
        operator_class = get_operator(name)
        if operator_class.arguments() or TRIVIAL.search(name):
            continue
        operator = operator_class()
        positions = (position for node in ast_nodes(tree) for position in operator.mutation_positions(node))
        for occurrence, (start, end) in enumerate(positions):
            found[start, end].append(Mutant(file, name, occurrence, start[0]))
    return [found[key] for key in sorted(found)]


def sample(count: int, seed: int, only: str) -> list[Mutant]:
    """Draw mutants at random, at most one for each position.

    Args:
        count: Number of mutants.
        seed: Seed of the random numbers; a larger count with the same seed extends the sample.
        only: Text that the path of the module must contain.
    """
    files = sorted({str(p.relative_to(ROOT)) for pattern in TARGETS for p in ROOT.glob(pattern)})
    everywhere = [place for file in files if only in file for place in places(file)]
    chance = random.Random(seed)
    chance.shuffle(everywhere)
    chosen: list[Mutant] = []
    for place in everywhere:
        if len(chosen) == count:
            break
        mutant = chance.choice(place)
        if applied(mutant) is not None:
            chosen.append(mutant)
    return chosen
