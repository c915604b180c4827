"""The command `mesh`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pairsim.cli.options import CaseFile, OverwriteFile, Settings, check_free, path_option
from pairsim.runtime.errors import InputError

app = typer.Typer()


@app.command(epilog="Example: pairsim mesh configs/quickstart.yaml -o meshes/pair.msh")
def mesh(
    case: CaseFile,
    output: Annotated[Path, path_option("-o", "--output", words="Mesh file: .msh (gmsh), .vtu or .xdmf.")],
    overwrite: OverwriteFile = False,
    set_: Settings = None,
) -> None:
    """Write the mesh with which a run of a case begins.

    Lengths are in tube diameters D_c. Prints the numbers of cells and nodes.
    """
    from pairsim.computing import QUESTIONS
    from pairsim.computing.case_files import read_case

    checked = read_case(QUESTIONS["run"], case, tuple(set_ or ()))
    check_free(output, overwrite)
    if output.suffix not in (".msh", ".vtu", ".xdmf"):
        raise InputError(str(output), "-o", output.suffix, "must be a name ending in .msh, .vtu or .xdmf")

    from pairsim.computing.mesh import write_mesh

    for name, count in write_mesh(checked, output).items():
        typer.echo(f"{name}: {count}")
