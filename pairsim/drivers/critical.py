"""`pairsim critical`: compute the critical distances of a case and write them to a folder."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, cast

from pairsim.config.curve_case import CriticalCase
from pairsim.config.form_kinds import forms_of
from pairsim.drivers.adaptive import Adaptation
from pairsim.drivers.critical_output import CriticalOutput
from pairsim.drivers.outcome import Outcome
from pairsim.drivers.problems import steady_problem
from pairsim.drivers.quasi_steady import conclude, kept
from pairsim.drivers.session import Options, Session, open_session
from pairsim.drivers.warnings import large_errors
from pairsim.fem.form_cache import ensure_compiled
from pairsim.runtime.errors import MeshFailure, NoSteadyState
from pairsim.solvers.curves.branch import Branch
from pairsim.solvers.curves.critical import Followed, Region, find_all, follow_all, with_value
from pairsim.solvers.parameters import Parameters


def run_critical(case: CriticalCase, directory: Path, options: Options) -> Outcome:
    """Find critical distances, follow them over a parameter, and write them to a folder.

    Args:
        case: The validated case.
        directory: Folder for the results.
        options: Overwriting, progress and signals.

    Returns:
        How the command ended. Results found before a failure are in the folder, too.

    Raises:
        InputError: The folder exists and may not be overwritten, or another command is writing to it.
        WriteFailure: The first files of the folder cannot be written.
    """
    with open_session(case, directory, options) as session:
        return _run(case, session)


def _run(case: CriticalCase, session: Session) -> Outcome:
    """Find and follow the critical distances of every line in an open session."""
    session.write(lambda: session.record.write(None, {}, {}))
    least, most = case.d
    region = _region(case)
    lines = list(_lines(case, region))
    count = len(lines) * (len(region.values) if region is not None else 1)
    session.announce(f"zeros of dU between d = {least:g} and {most:g}", count)
    output = CriticalOutput(case, session)
    branch: Branch | None = None
    adaptation: Adaptation | None = None

    def work() -> Outcome:
        nonlocal branch, adaptation
        output.write()
        ensure_compiled(forms_of(case), session.reporter.note)
        failures: list[str] = []
        for line, start in lines:
            output.begin_line(line)
            try:
                if branch is None:
                    last = start if region is None else with_value(region.name, start, region.values[-1])
                    adaptation, branch = _begin(case, session, start, last)
                branch.at(start)
                findings = find_all(branch, least, most) if region is None else follow_all(branch, region)
                for found in findings:
                    output.take(found)
            except (NoSteadyState, MeshFailure) as failure:
                if not line:
                    raise
                failures += [f"{name} = {value:g}: {failure}" for name, value in line.items()]
                session.reporter.note(failures[-1])
        if failures:
            raise NoSteadyState("; ".join(failures))
        message = f"{len(output.rows)} critical distances on {output.branches} branches"
        return Outcome("finished", "end", message)

    outcome = session.carry_out(work, kept)
    large = large_errors(case, "the error of a critical distance or parameter", "itself", output.errors)
    warnings = [*output.warnings, *large]
    summary: dict[str, Any] = {"ends": output.ends}
    if adaptation is not None:
        summary["adaptation"], missed = adaptation.report(output.kept_points)
        warnings += missed
    outcome = conclude(case, session, outcome, branch, output.points, warnings, summary)
    if branch is not None:
        branch.close()
    session.reporter.finish(outcome.message)
    return outcome


def _begin(
    case: CriticalCase, session: Session, start: Parameters, last: Parameters
) -> tuple[Adaptation | None, Branch]:
    """A first solution. Meshes are adapted to the zeros that were asked for, not to those between them.

    Raises:
        NoSteadyState: No solution was found.
        MeshFailure: A mesh could not be generated.
    """
    problem = steady_problem(case, case.d[0])
    if case.adapts:
        options: Any = {"mesh_error": case.mesh_error, "zeros_only": True, "last": last}
        adaptation = Adaptation.begin(case, problem, start, [start.gaps], **options)
        if adaptation is not None:
            return adaptation, adaptation.branch
    return None, Branch(problem, start, case.mesh_error)


def _region(case: CriticalCase) -> Region | None:
    """Parameter values and distances within which zeros are followed, None to find zeros of this case only."""
    if case.along is None:
        return None
    name, values = next(iter(case.along.items()))
    return Region(cast(Followed, name), tuple(sorted(values)), *case.d)


def _lines(case: CriticalCase, region: Region | None) -> Iterator[tuple[dict[str, float], Parameters]]:
    """Yield, for each line, the value of its parameter (empty without `lines`) and the parameters where it begins."""
    start = Parameters((case.d[1],), case.solid_models, case.liquid_model)
    if region is not None:
        start = with_value(region.name, start, region.values[0])
    if case.lines is None:
        yield {}, start
        return
    name, values = next(iter(case.lines.items()))
    for value in sorted(values):
        yield {name: value}, with_value(cast(Followed, name), start, value)
