"""Shared by all commands: common arguments, and tables on the terminal."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from pairsim.cases.kinds_of_cases import has_example
from pairsim.questions.registry import NAMES
from pairsim.runtime.errors import InputError

if TYPE_CHECKING:  # mypy cannot know their values
    OfQuestion = str
    OfExamples = str
    OfFiles = str
else:
    OfQuestion = Literal[NAMES]
    OfFiles = Literal[(*NAMES, "sweep", "study", "atlas")]
    OfExamples = Literal[tuple(name for name in (*NAMES, "sweep") if has_example(name))]
_CASE_FILE = typer.Argument(help="Case file (YAML); pairsim schema lists its keys.")
CaseFile = Annotated[Path, _CASE_FILE]
CaseFileOrNone = Annotated[Path | None, _CASE_FILE]
Folder = Annotated[Path, typer.Argument(help="Folder of results.", metavar="DIR")]
Settings = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="Replace a key of the file, such as mesh.Np=20; may be repeated."),
]
Output = Annotated[
    Path | None,
    typer.Option(
        "-o", "--output", help="Folder for the results (default: runs/<name>; without a name runs/<file>-<hash>)."
    ),
]
OutputOfMany = Annotated[
    Path | None, typer.Option("-o", "--output", help="Folder for the results (default: runs/<name>).")
]
Workers = Annotated[int, typer.Option(help="Number of cases computed at the same time (without mpirun).", min=1)]
WorkersOfCase = Annotated[
    int, typer.Option(help="Number of processes that share the work, at most one per core.", min=1)
]
CaseTimeout = Annotated[float | None, typer.Option(help="Limit on the wall time of each case, in seconds.", min=0.0)]
DryRun = Annotated[
    bool,
    typer.Option("--dry-run", help="Only check the case, and estimate its unknowns and its time."),
]
Budget = Annotated[
    str | None,
    typer.Option(
        help="Time limit, such as 10min; what has been found by then is kept. Without it, a command that has found "
        "nothing ends after 4 min of processor time of its own process (later above 3e5 unknowns).",
        metavar="TIME",
    ),
]
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace the results in an existing folder.")]
OverwriteFile = Annotated[bool, typer.Option("--overwrite", help="Replace an existing file.")]
Physical = Annotated[
    bool | None,
    typer.Option(
        "--physical/--dimensionless",
        help="In um, s, um/s and Pa, or in D_c and U_av (default: the former where the case has a physical block).",
    ),
]
Fps = Annotated[
    str | None,
    typer.Option(metavar="NUMBER", help="Frames per second, for a film with frame numbers instead of times."),
]
Pixel = Annotated[
    str | None,
    typer.Option(
        metavar="QUANTITY", help="Size of a pixel, for a film with lengths in px, such as '.65 +- .01 um' or 1.54px/um."
    ),
]
Particles = Annotated[
    str | None,
    typer.Option(
        metavar="NAMES", help="Which two beads of a film with more, such as 3,5; 3+7,5 joins parts of a track."
    ),
]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Print only the folder, without progress and answer.")]


def check_free(path: Path | None, overwrite: bool, option: str = "-o") -> None:
    """Refuse a file that exists and is not to be overwritten, by an InputError."""
    if path is not None and path.exists() and not overwrite:
        raise InputError(str(path), option, None, "the file exists; use --overwrite or another name")


def print_table(view: object) -> None:
    """Print a table to stdout; 160 columns wide if stdout is not a terminal."""
    from rich.console import Console

    Console(width=None if sys.stdout.isatty() else 160, markup=False, highlight=False).print(view)
