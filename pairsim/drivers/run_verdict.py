"""What the particles of a run do once its start-up has decayed, for run.json."""

from __future__ import annotations

from typing import Any

from pairsim.config.case import Case
from pairsim.runtime.errors import RunFailure
from pairsim.runtime.fenicsx import MPI
from pairsim.runtime.signals import Stopped
from pairsim.solvers.run_end import settled
from pairsim.solvers.transient import Transient


def settled_entry(case: Case, comm: MPI.Comm, transient: Transient) -> dict[str, Any]:
    """The quasi-steady solution at the last distances of a run; frees the memory of its solver.

    Args:
        case: The case, with two particles or more.
        comm: Its communicator.
        transient: The run, after its last step.

    Returns:
        dU with its error at every gap [U_av], the time in which a disturbance decays [D_c/U_av], how the run started
        and which part of dU `accuracy` allows as error; or a message, if there is no quasi-steady solution.
    """
    transient.close()
    try:
        with transient.clock("quasi-steady"):
            point = settled(comm, transient.problem, transient.meshed.geometry_at(transient.history.h[0]).gaps)
    except RunFailure as failure:
        return {"message": failure.message}
    except Stopped:
        return {"message": "the quasi-steady solution at the last distances was interrupted"}
    entry = {"d": list(point.gaps), "dU": point.dUs.tolist(), "dU_error": point.dU_errors.tolist()}
    memory = max(case.De, 4 * max(case.Ca_es))
    return entry | {"memory": memory, "start": case.start, "accuracy": case.error_wanted}
