"""Typed exceptions: `InputError` for invalid input, `RunFailure` for computations that fail."""

from __future__ import annotations

import sys
import traceback
from collections.abc import Mapping, Sequence
from typing import Any

__all__ = [
    "InputError",
    "InvertedCell",
    "MeshFailure",
    "NewtonFailure",
    "NoSteadyState",
    "PairsimError",
    "RunFailure",
    "StepTooSmall",
    "TooManySteps",
    "WallTime",
    "WriteFailure",
]


class PairsimError(Exception):
    """Base class of the exceptions that pairsim raises deliberately."""


class InputError(PairsimError, ValueError):
    """Invalid input; the command ends with exit code 2.

    The message has one line for each mistake: its location, the value given and the values allowed.

    Args:
        file: Path of the file, or name of the command-line option.
        key: Dotted key in the file, empty if the error concerns the file as a whole.
        value: The invalid value, as given.
        allowed: Description of the values allowed, such as "must be above 0".
        line: Line number of the key in the file, None if unknown.
        entry: Name of the case in a file with several cases, empty otherwise.
        others: Further errors in the same input.
    """

    def __init__(
        self,
        file: str,
        key: str,
        value: Any,
        allowed: str,
        *,
        line: int | None = None,
        entry: str = "",
        others: Sequence[InputError] = (),
    ) -> None:
        self.file, self.key, self.value, self.allowed = file, key, value, allowed
        self.line, self.entry, self.others = line, entry, tuple(others)
        where = [file if line is None else f"{file}:{line}", *(part for part in (entry, key) if part)]
        shown = "" if value is None else f"got {as_typed(value)}; "
        self.sentence = f"{': '.join(where)}: {shown}{allowed}"
        super().__init__("\n".join(error.sentence for error in self.mistakes))

    @property
    def mistakes(self) -> tuple[InputError, ...]:
        """All errors in the input, this one first."""
        return (self, *(mistake for error in self.others for mistake in error.mistakes))

    def __reduce__(self) -> tuple[Any, ...]:
        """Support pickling, by which mpi4py sends errors between processes."""
        named = {"line": self.line, "entry": self.entry, "others": self.others}
        return _input_error, ((self.file, self.key, self.value, self.allowed), named)


def as_typed(value: Any) -> str:
    """A value as it would be typed in a file.

    Numbers have fifteen digits, so that the rounding error of a conversion does not show: 0.34, not
    0.33999999999999997.
    """
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        return f"{value:.15g}"
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{key}: {as_typed(entry)}" for key, entry in value.items()) + "}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(as_typed, value))}]"
    return "null" if value is None else repr(value)


def _input_error(words: tuple[str, str, Any, str], named: dict[str, Any]) -> InputError:
    return InputError(*words, **named)


class RunFailure(PairsimError):
    """A computation that could not be completed; the command ends with exit code 3.

    Args:
        message: What happened, with the relevant figures.
        t: Time reached [D_c/U_av].
        step: Number of accepted time steps.
        advice: What to try, as a phrase that follows "try".
    """

    reason = "failed"

    def __init__(self, message: str, *, t: float = 0.0, step: int = 0, advice: str = "") -> None:
        self.message, self.t, self.step, self.advice = message, t, step, advice
        where = f" at t = {t:g} (step {step})" if step or t else ""
        super().__init__(f"{self.reason}{where}: {message}" + (f"; try {advice}" if advice else ""))

    def __reduce__(self) -> tuple[Any, ...]:
        """Support pickling, by which mpi4py sends errors between processes."""
        state = {"t": self.t, "step": self.step, "advice": self.advice}
        return _failure, (type(self), self.message, state)


def _failure(kind: type[RunFailure], message: str, state: dict[str, Any]) -> RunFailure:
    return kind(message, **state)


class MeshFailure(RunFailure):
    """No valid mesh of the geometry could be generated."""

    reason = "mesh_failed"


class NewtonFailure(RunFailure):
    """Newton's method did not converge, even with the smallest step allowed."""

    reason = "newton_diverged"


class InvertedCell(RunFailure):
    """A cell of the moving mesh was inverted, even after remeshing."""

    reason = "inverted_cell"


class StepTooSmall(RunFailure):
    """The error control requires a time step below the smallest one allowed."""

    reason = "step_too_small"


class WallTime(RunFailure):
    """The wall-time limit of the case was reached."""

    reason = "wall_time"


class TooManySteps(RunFailure):
    """The step limit of the case was reached."""

    reason = "max_steps"


class WriteFailure(RunFailure):
    """Results could not be written."""

    reason = "write_failed"


class NoSteadyState(RunFailure):
    """No quasi-steady solution was found, for example because the branch of steady shapes ends in a fold."""

    reason = "no_steady_state"


def failure_of(reason: str, message: str) -> RunFailure:
    """The exception that corresponds to a failure recorded in run.json.

    Args:
        reason: Value of `reason` in the record.
        message: Full message in the record, with time, step and advice.

    Returns:
        An exception of the class with this `reason`, or a `RunFailure` if there is no such class.
    """
    failure = next((kind for kind in RunFailure.__subclasses__() if kind.reason == reason), RunFailure)(message)
    failure.args = (message,)  # the recorded message already contains reason, time and step
    return failure


def unexpected() -> int:
    """Print the traceback of an unexpected exception, and abort the other MPI processes, which would otherwise hang.

    Returns:
        The exit code, 1.
    """
    traceback.print_exc()
    mpi = sys.modules.get("mpi4py.MPI")
    if mpi is not None and mpi.COMM_WORLD.size > 1:
        mpi.COMM_WORLD.Abort(1)
    return 1
