"""Check the installation: versions and locations of what pairsim needs, and a small case.

The first time it compiles forms, which takes some ten seconds.

Exit codes: 0 cases can be computed, 4 they cannot.
"""

from __future__ import annotations

import typer

from pairsim.runtime.errors import EnvironmentFailure, PairsimError

EXAMPLES = "Example: pairsim doctor"


def doctor() -> None:
    from pairsim.app.installation import findings

    try:
        for name, found in findings():
            typer.echo(f"{name}: {found}")
    except (PairsimError, ImportError) as error:
        typer.echo(f"pairsim: {error}", err=True)
        raise typer.Exit(EnvironmentFailure.exit_code) from None
