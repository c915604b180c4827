"""pairsim: soft and rigid spheres on the axis of a tube, driven by pressure.

    import pairsim

    result = pairsim.run({"beta": 0.4, "De": 0, "Ca_e": 0.1, "d0": 0.1}, time={"end": 1})
    result.table.plot("t", "dU")

`load` checks a case, `units` makes one of an experiment, `ask` and `fit` use an atlas; `run`, `curve`, `critical`,
`shape`, `pressure`, `train` and `sweep` compute; `open` reads a folder of results, `plot` draws it, `report` puts it
into one HTML file; `moduli` reads a cytometer's file; `use_laws` makes laws of one's own known. They are imported when
first used: `import pairsim` alone loads nothing.
"""

import os as _os
from importlib import import_module as _import_module
from typing import TYPE_CHECKING as _TYPE_CHECKING
from typing import Any as _Any

from pairsim import errors as errors
from pairsim.runtime.errors import InputError as InputError
from pairsim.runtime.errors import PairsimError as PairsimError
from pairsim.runtime.errors import RunFailure as RunFailure
from pairsim.runtime.questions import NAMES as _QUESTIONS
from pairsim.runtime.version import __version__ as __version__

# One thread a process: MPI is how pairsim uses more cores, and BLAS threads under it only fight each other.
# This must come before anything numerical is imported.
for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    _os.environ.setdefault(_name, "1")

if _TYPE_CHECKING:
    from pairsim.api.ask import ask as ask
    from pairsim.api.cases import load as load
    from pairsim.api.cases import use_laws as use_laws
    from pairsim.api.fit import fit as fit
    from pairsim.api.folders import open as open
    from pairsim.api.folders import plot as plot
    from pairsim.api.moduli import moduli as moduli
    from pairsim.api.report import report as report
    from pairsim.api.results import Result as Result
    from pairsim.api.sweeps import SweepResult as SweepResult
    from pairsim.api.sweeps import sweep as sweep
    from pairsim.api.units import units as units
    from pairsim.questions.critical import CriticalResult as CriticalResult
    from pairsim.questions.critical import critical as critical
    from pairsim.questions.curve import CurveResult as CurveResult
    from pairsim.questions.curve import curve as curve
    from pairsim.questions.pressure import PressureResult as PressureResult
    from pairsim.questions.pressure import pressure as pressure
    from pairsim.questions.run import RunResult as RunResult
    from pairsim.questions.run import run as run
    from pairsim.questions.shape import ShapeResult as ShapeResult
    from pairsim.questions.shape import shape as shape
    from pairsim.questions.train import TrainResult as TrainResult
    from pairsim.questions.train import train as train

_MODULES = {
    "api.ask": ("ask",),
    "api.cases": ("load", "use_laws"),
    "api.fit": ("fit",),
    "api.folders": ("open", "plot"),
    "api.moduli": ("moduli",),
    "api.report": ("report",),
    "api.results": ("Result",),
    "api.sweeps": ("sweep", "SweepResult"),
    "api.units": ("units",),
    **{f"questions.{_name}": (_name, f"{_name.capitalize()}Result") for _name in _QUESTIONS},
}
"""Modules, and what they are imported for: each file of a question has its function and the class of its results."""
_HERE = ("InputError", "PairsimError", "RunFailure", "__version__", "errors")

__all__ = sorted((*_HERE, *(_name for _names in _MODULES.values() for _name in _names)))


def __getattr__(name: str) -> _Any:
    """Import a name of the interface when it is first used."""
    module = next((module for module, names in _MODULES.items() if name in names), None)
    if module is None:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = globals()[name] = getattr(_import_module(f"pairsim.{module}"), name)
    return value


def __dir__() -> list[str]:
    return __all__
