"""Write the mesh with which the computation of a case would begin; nothing is computed.

It is the mesh around the undeformed spheres at the first distances, before it
is adapted; for a train, that of one period. Its six-node triangles are in the
half-plane of the axis z and the radius r; in um where the case has a physical
block, else in D_c. Regions are liquid, particle_1, particle_2, ... from
upstream (a rigid particle has no cells); boundaries are wall, inlet, outlet,
axis, surface_1, ....
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pairsim.app.options import CaseFile, OfQuestion, OverwriteFile, Physical, Settings, check_free
from pairsim.quantities.kinds import LENGTH
from pairsim.questions.registry import QUESTIONS
from pairsim.record.folder import write_file
from pairsim.runtime.errors import InputError

EXAMPLES = "Examples: pairsim mesh case.yaml -o pair.msh | pairsim mesh case.yaml -o train.vtu --kind train"


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
    from pairsim.computing.case_files import Files, commands_for, first_accepted, read_case
    from pairsim.record.mesh_files import FORMATS
    from pairsim.sweeps.files import FILES

    if output.suffix not in FORMATS:
        raise InputError("pairsim mesh", "-o", str(output), f"must end in {' or '.join(FORMATS)}")
    check_free(output, overwrite)
    settings = tuple(set_ or ())
    fits = [kind] if kind else commands_for(case, Files(QUESTIONS), settings)
    question, of_case = first_accepted(fits, lambda name: read_case(QUESTIONS[name], case, settings, FILES))
    if physical and of_case.scales is None:
        raise InputError(str(case), "--physical", None, "must be a case with a physical block (docs/how-to/units.md)")
    import pairsim.runtime.fenicsx  # noqa: F401  # before everything else that loads MPI or is compiled
    from pairsim.computing.first_mesh import first_mesh

    scales = of_case.scales if physical is not False else None
    made = first_mesh(of_case).scaled(LENGTH.factor(scales))
    write_file(output, made.content(output.suffix), "-o")
    typer.echo(str(output))
    cells = ", ".join(f"{name} {len(part):,}" for name, part in made.regions.items())
    unit = LENGTH.name if scales is None else LENGTH.physical
    others = " or ".join(name for name in fits if name != question)
    choice = f" (--kind {others} for another command)" if others else ""
    typer.echo(f"`pairsim {question}` would begin with this mesh{choice}; triangles: {cells}; in {unit}", err=True)
