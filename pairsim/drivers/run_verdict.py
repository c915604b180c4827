"""What the particles of a run do once its start-up has decayed, for run.json."""

from __future__ import annotations

import math
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
        dU with its error at every gap [U_av], the decay time of a disturbance [D_c/U_av], how the run started and
         which part of dU `accuracy` allows as error; or a message, if there is no quasi-steady solution.
    """
    transient.close()
    try:
        with transient.clock("quasi-steady"):
            point = settled(comm, transient.problem, transient.meshed.geometry_at(transient.history.h[0]).gaps)
    except RunFailure as failure:
        return {"message": failure.message}
    except Stopped:
        return {"message": "the quasi-steady solution at the last distances was interrupted"}
    if not math.isfinite(point.t_relax):
        return {"message": "disturbances of the quasi-steady state at the last distances do not decay"}
    entry = {"d": list(point.gaps), "dU": point.dUs.tolist(), "dU_error": point.dU_errors.tolist()}
    return entry | {"t_relax": point.t_relax, "start": case.start, "accuracy": case.error_wanted}
