"""pairsim: soft and rigid spheres on the axis of a tube, driven by pressure.

    import pairsim

    result = pairsim.run({"beta": 0.4, "De": 0, "Ca_e": 0.1, "d0": 0.1}, time={"end": 1})
    result.table.plot("t", "dU")

`load` checks a case; `run`, `curve`, `critical` and `sweep` compute; `open` reads a folder of results, `plot` draws it,
`report` puts it into one HTML file. They are imported when first used: `import pairsim` alone loads nothing.
"""

import os
from importlib import import_module
from typing import TYPE_CHECKING, Any

from pairsim import errors
from pairsim.runtime.errors import InputError, PairsimError, RunFailure
from pairsim.runtime.signals import no_interrupt_lost
from pairsim.runtime.version import __version__

# One thread a process: MPI is how pairsim uses more cores, and BLAS threads under it only fight each other.
# This must come before anything numerical is imported.
for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

if TYPE_CHECKING:
    from pairsim.api.cases import load as load
    from pairsim.api.compute import critical, curve, run
    from pairsim.api.folders import open_folder as open
    from pairsim.api.pictures import plot
    from pairsim.api.report import report
    from pairsim.api.results import CriticalResult, CurveResult, Result, RunResult
    from pairsim.api.sweeps import SweepResult, sweep

_MODULES = {
    "load": "cases",
    "run": "compute",
    "curve": "compute",
    "critical": "compute",
    "sweep": "sweeps",
    "open": "folders",
    "plot": "pictures",
    "report": "report",
    "Result": "results",
    "RunResult": "results",
    "CurveResult": "results",
    "CriticalResult": "results",
    "SweepResult": "sweeps",
}

__all__ = [
    "CriticalResult",
    "CurveResult",
    "InputError",
    "PairsimError",
    "Result",
    "RunFailure",
    "RunResult",
    "SweepResult",
    "__version__",
    "critical",
    "curve",
    "errors",
    "load",
    "open",
    "plot",
    "report",
    "run",
    "sweep",
]


def __getattr__(name: str) -> Any:
    """Import a name of the interface when it is first used; every command is a function."""
    if name.startswith("_"):
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    with no_interrupt_lost():
        if name in _MODULES:
            module = import_module(f"pairsim.api.{_MODULES[name]}")
            value = getattr(module, "open_folder" if name == "open" else name)
        else:
            commands = import_module("pairsim.commands").COMMANDS
            if name not in commands:
                raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
            value = import_module("pairsim.api.compute").function_of(commands[name])
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *_MODULES})
