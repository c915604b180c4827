"""pairsim: soft and rigid spheres on the axis of a tube, driven by pressure.

    import pairsim

    result = pairsim.run({"beta": 0.4, "De": 0, "Ca_e": 0.1, "d0": 0.1}, time={"end": 1})
    result.table.plot("t", "dU")

`load` checks a case, `units` makes one of an experiment, `ask` and `fit` use an atlas; `run`, `curve`, `critical`,
`shape`, `pressure`, `focus`, `train`, `stream` and `sweep` compute; `open` reads a folder of results, `plot` draws it,
`report` puts it into one HTML file; `moduli` reads a cytometer's file; `use_laws` makes laws of one's own known. They
are imported when first used: `import pairsim` alone loads nothing.
"""

# The command line imports this first, and can answer Ctrl-C only afterwards: it takes a millisecond, without typing.
import os as _os

# One thread per process: pairsim uses several cores by several processes, whose BLAS threads would only compete.
# This must come before anything numerical is imported.
for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    _os.environ.setdefault(_name, "1")

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any as _Any

    from pairsim import errors as errors
    from pairsim.app.html_report import report as report
    from pairsim.app.open_and_plot import open as open
    from pairsim.app.open_and_plot import plot as plot
    from pairsim.app.sweep_results import SweepResult as SweepResult
    from pairsim.app.sweep_results import sweep as sweep
    from pairsim.computing.result import Result as Result
    from pairsim.lab.ask_atlas import ask as ask
    from pairsim.lab.cytometer.moduli import moduli as moduli
    from pairsim.lab.dimensionless_numbers import units as units
    from pairsim.lab.films.fit_film import fit as fit
    from pairsim.lab.load import load as load
    from pairsim.physics.own_laws import use_laws as use_laws
    from pairsim.questions.compute import Computation as _Computation
    from pairsim.questions.critical import CriticalResult as CriticalResult
    from pairsim.questions.curve.result import CurveResult as CurveResult
    from pairsim.questions.focus import FocusResult as FocusResult
    from pairsim.questions.pressure import PressureResult as PressureResult
    from pairsim.questions.run import RunResult as RunResult
    from pairsim.questions.shape import ShapeResult as ShapeResult
    from pairsim.questions.stream import StreamResult as StreamResult
    from pairsim.questions.train import TrainResult as TrainResult
    from pairsim.runtime.errors import InputError as InputError
    from pairsim.runtime.errors import PairsimError as PairsimError
    from pairsim.runtime.errors import RunFailure as RunFailure
    from pairsim.runtime.version import __version__ as __version__

    critical: _Computation[CriticalResult]
    curve: _Computation[CurveResult]
    focus: _Computation[FocusResult]
    pressure: _Computation[PressureResult]
    run: _Computation[RunResult]
    shape: _Computation[ShapeResult]
    stream: _Computation[StreamResult]
    train: _Computation[TrainResult]

_MODULES = {
    "lab.ask_atlas": ("ask",),
    "lab.load": ("load",),
    "lab.films.fit_film": ("fit",),
    "app.open_and_plot": ("open", "plot"),
    "lab.cytometer.moduli": ("moduli",),
    "app.html_report": ("report",),
    "computing.result": ("Result",),
    "app.sweep_results": ("sweep", "SweepResult"),
    "lab.dimensionless_numbers": ("units",),
    "physics.own_laws": ("use_laws",),
    "errors": ("errors",),
    "runtime.errors": ("InputError", "PairsimError", "RunFailure"),
    "runtime.version": ("__version__",),
}
"""Modules, and the names of the interface that are imported from them."""


def __getattr__(name: str) -> "_Any":
    """Import a name of the interface when it is first used."""
    from importlib import import_module

    module = next((module for module, names in _MODULES.items() if name in names), None)
    found = None if module is None else import_module(f"pairsim.{module}")
    value = _of_questions(name) if found is None else getattr(found, name, found)
    globals()[name] = value
    return value


def _of_questions(name: str) -> "_Any":
    """The function of a question, such as `run`, made of its record; the class of its results, such as `RunResult`."""
    from pairsim.questions.registry import NAMES, QUESTIONS

    results = {f"{question.capitalize()}Result": question for question in NAMES}
    if name == "__all__":
        return sorted((*(each for names in _MODULES.values() for each in names), *NAMES, *results))
    if name in results:
        return QUESTIONS[results[name]].result
    if name not in NAMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from pairsim.app.question_functions import function_of

    return function_of(name)


def __dir__() -> list[str]:
    return list(__getattr__("__all__"))
