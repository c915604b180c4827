"""Commands that prepare a computation: `init`, `schema`, `mesh`, `check-law` and `doctor`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from pairsim.cli.options import (
    CaseFile,
    OfExamples,
    OfFiles,
    OfQuestion,
    OverwriteFile,
    Physical,
    Settings,
    check_free,
    print_table,
)
from pairsim.runtime.errors import EnvironmentFailure, InputError, PairsimError

if TYPE_CHECKING:
    from pairsim.physics.material import Material

app = typer.Typer()
WRONG = 3  # exit code of `check-law` where a statement does not hold


@app.command(epilog="Examples: pairsim init | pairsim init beads --kind curve")
def init(
    name: Annotated[str | None, typer.Argument(help="Name of the case and of its file (default: the kind).")] = None,
    kind: Annotated[OfExamples, typer.Option("--kind", help="The command that reads the file.")] = "run",
) -> None:
    """Write a commented example to NAME.yaml; an existing file is never replaced."""
    from pairsim.cases.example import write_example

    path = write_example(kind, name or kind, Path())
    typer.echo(str(path))
    typer.echo(f"next: pairsim {kind} {path} --dry-run", err=True)


@app.command(epilog="Examples: pairsim schema curve | pairsim schema run --json > run.schema.json")
def schema(
    command: Annotated[OfFiles, typer.Argument(help="The command that reads the file.")] = "run",
    as_json: Annotated[
        bool, typer.Option("--json", help="Print a JSON Schema, with which editors check files.")
    ] = False,
) -> None:
    """List every key of a file with its allowed values, default, meaning and unit."""
    from rich.table import Table

    from pairsim.computing.schema import json_schema, schema_rows

    if as_json:
        typer.echo(json_schema(command))
        return
    table = Table("key", "allowed", "default", "meaning", box=None, pad_edge=False)
    for row in schema_rows(command):
        table.add_row(*row)
    print_table(table)


@app.command(epilog="Examples: pairsim mesh case.yaml -o pair.msh | pairsim mesh case.yaml -o train.vtu --kind train")
def mesh(
    case: CaseFile,
    output: Annotated[
        Path, typer.Option("-o", "--output", help="File to write: .msh (gmsh), .vtu, .vtk, .xdmf or .inp (Abaqus).")
    ],
    kind: Annotated[
        OfQuestion | None,
        typer.Option("--kind", help="The command that reads the file (default: the first one that has all its keys)."),
    ] = None,
    physical: Physical = None,
    overwrite: OverwriteFile = False,
    set_: Settings = None,
) -> None:
    """Write the mesh with which the computation of a case would begin; nothing is computed.

    It is that around the undeformed spheres at the first distances, before it is
    adapted: of a train, one period. Its six-node triangles are in the half-plane of
    the axis z and the radius r; in um where the case has a physical block, else in
    D_c. Regions are liquid, particle_1, particle_2, ... from upstream (a rigid
    particle has no cells); boundaries are wall, inlet, outlet, axis, surface_1, ....
    """
    from pairsim.computing import QUESTIONS
    from pairsim.computing.case_files import commands_for, read_case
    from pairsim.quantities.kinds import LENGTH
    from pairsim.results.folder import write_file
    from pairsim.results.mesh_files import FORMATS

    if output.suffix not in FORMATS:
        raise InputError("pairsim mesh", "-o", str(output), f"must end in {' or '.join(FORMATS)}")
    check_free(output, overwrite)
    settings = tuple(set_ or ())
    question, *others = [kind] if kind else commands_for(case, settings)
    of_case = read_case(QUESTIONS[question], case, settings)
    if physical and of_case.scales is None:
        raise InputError(str(case), "--physical", None, "must be a case with a physical block (docs/how-to/units.md)")
    import pairsim.runtime.fenicsx  # noqa: F401  # before everything else that loads MPI or is compiled
    from pairsim.computing.first_mesh import first_mesh

    scales = of_case.scales if physical is not False else None
    made = first_mesh(of_case).scaled(LENGTH.factor(scales))
    write_file(output, made.content(output.suffix))
    typer.echo(str(output))
    cells = ", ".join(f"{name} {len(part):,}" for name, part in made.regions.items())
    unit = LENGTH.name if scales is None else LENGTH.physical
    choice = f" (--kind {' or '.join(others)} for another command)" if others else ""
    typer.echo(f"`pairsim {question}` would begin with this mesh{choice}; triangles: {cells}; in {unit}", err=True)


@app.command(
    "check-law", epilog="Examples: pairsim check-law my_laws.py:FeneCR L2=20 | pairsim check-law my_laws.py:Gent Jm=1"
)
def check_law(
    law: Annotated[str, typer.Argument(help="A class in a file, such as my_laws.py:FeneCR.", metavar="FILE:CLASS")],
    numbers: Annotated[
        list[str] | None,
        typer.Argument(help="Parameters, such as L2=20; the others have their defaults, or values in their ranges."),
    ] = None,
) -> None:
    """Check a law of your own as those that ship are checked.

    At rest, in shear and extension, and in turned frames; its Jacobian; and a
    liquid in the tube, for which forms are compiled the first time (half a
    minute).

    Exit codes: 0 all statements hold, 3 some do not.
    """
    import pairsim.runtime.fenicsx  # noqa: F401  # before everything else that loads MPI or is compiled
    from pairsim.solvers.check_law import checks

    chosen = _law_in(law, numbers or ())
    typer.echo(f"{chosen.name}: {', '.join(f'{k} = {v:g}' for k, v in chosen.numbers.items()) or 'no parameters'}")
    wrong = 0
    for check in checks(chosen):
        wrong += not check.holds
        typer.echo(f"{'ok' if check.holds else 'WRONG':6} {check.says}  {check.why or f'(off by {check.off:.1e})'}")
    if wrong:
        raise typer.Exit(WRONG)


def _law_in(place: str, numbers: Sequence[str]) -> Material:
    """A law in a file, with given parameters; InputError where it is not there, or one is not in its range."""
    from pairsim.physics.own_laws import load_file, name_file
    from pairsim.solvers.check_law import sample

    name, file = (part[::-1] for part in place[::-1].partition(":")[::2])
    if not Path(file).is_file():
        raise InputError("check-law", "", place, "must be a class in a file, such as my_laws.py:FeneCR")
    name_file(Path(file))
    laws = {law.__name__: law for law in load_file(Path(file))}
    if name not in laws:
        raise InputError(file, "", name, f"must be {' or '.join(laws)}")
    declared, given = laws[name].parameters(), dict[str, float]()
    for text in numbers:
        key, _, value = text.partition("=")
        if (p := declared.get(key)) is None:
            raise InputError("check-law", key, value, f"is no parameter of {name}, which has {', '.join(declared)}")
        try:
            given[key] = float(value)
        except ValueError:
            given[key] = float("nan")
        if not p.least <= given[key] <= p.most or (p.open and given[key] == p.least):
            raise InputError("check-law", key, value, f"must be a number from {p.least:g} to {p.most:g}")
    return sample(laws[name], given)


@app.command(epilog="Example: pairsim doctor")
def doctor() -> None:
    """Check the installation: versions and places of what is needed, and a small case.

    The first time forms are compiled, for some ten seconds.

    Exit codes: 0 cases can be computed, 4 they cannot.
    """
    from pairsim.api.doctor import findings

    try:
        for name, found in findings():
            typer.echo(f"{name}: {found}")
    except (PairsimError, ImportError) as error:
        typer.echo(f"pairsim: {error}", err=True)
        raise typer.Exit(EnvironmentFailure.exit_code) from None
