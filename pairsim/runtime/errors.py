"""Typed errors: what the user gave (`InputError`) and what the computation met (`RunFailure`)."""

from __future__ import annotations

import sys
import traceback
from collections.abc import Sequence
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
    """Base of every error that pairsim raises on purpose."""


class InputError(PairsimError, ValueError):
    """Something the user gave cannot be used; the command ends with exit code 2.

    Its message has a line for each mistake: where it stands, the value as given and what must be.

    Args:
        file: Path or name of what was read (or the command-line option).
        key: Dotted key inside the file, empty if the file as a whole is meant.
        value: The offending value, as given.
        allowed: What would have been accepted, in words.
        line: Line of the file on which the key stands, None where that is unknown.
        entry: The case among those of the file, empty if it holds one.
        others: Further mistakes of the same input.
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
        shown = "" if value is None else f"got {str(value).lower() if isinstance(value, bool) else repr(value)}; "
        self.sentence = f"{': '.join(where)}: {shown}{allowed}"
        super().__init__("\n".join(error.sentence for error in self.mistakes))

    @property
    def mistakes(self) -> tuple[InputError, ...]:
        """Every mistake, this one first."""
        return (self, *(mistake for error in self.others for mistake in error.mistakes))

    def __reduce__(self) -> tuple[Any, ...]:
        """Errors travel between processes."""
        named = {"line": self.line, "entry": self.entry, "others": self.others}
        return _input_error, ((self.file, self.key, self.value, self.allowed), named)


def _input_error(words: tuple[str, str, Any, str], named: dict[str, Any]) -> InputError:
    return InputError(*words, **named)


class RunFailure(PairsimError):
    """A computation could not go on; the command ends with exit code 3.

    Args:
        message: What happened, with the figures that say so.
        t: Time reached (in units of D_c/U_av).
        step: Number of accepted steps.
        advice: What to try.
    """

    reason = "failed"

    def __init__(self, message: str, *, t: float = 0.0, step: int = 0, advice: str = "") -> None:
        self.message, self.t, self.step, self.advice = message, t, step, advice
        where = f" at t = {t:g} (step {step})" if step or t else ""
        super().__init__(f"{self.reason}{where}: {message}" + (f"; try {advice}" if advice else ""))

    def __reduce__(self) -> tuple[Any, ...]:
        """Errors travel between processes."""
        state = {"t": self.t, "step": self.step, "advice": self.advice}
        return _failure, (type(self), self.message, state)


def _failure(kind: type[RunFailure], message: str, state: dict[str, Any]) -> RunFailure:
    return kind(message, **state)


class MeshFailure(RunFailure):
    """gmsh could not make a valid mesh of the scene."""

    reason = "mesh_failed"


class NewtonFailure(RunFailure):
    """Newton's method did not converge and no smaller step is left to try."""

    reason = "newton_diverged"


class InvertedCell(RunFailure):
    """A cell of the moving mesh turned over and remeshing did not help."""

    reason = "inverted_cell"


class StepTooSmall(RunFailure):
    """The error control asked for a step below the smallest allowed one."""

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
    """A quasi-steady branch could not be followed farther: past a fold there is no steady shape."""

    reason = "no_steady_state"


def failure_of(reason: str, message: str) -> RunFailure:
    """The typed failure that a record in run.json is of.

    Args:
        reason: Its `reason`; a RunFailure for one that is not known here.
        message: What it said.
    """
    failure = next((kind for kind in RunFailure.__subclasses__() if kind.reason == reason), RunFailure)(message)
    failure.args = (message,)  # where and why are in it already
    return failure


def unexpected() -> int:
    """Show an exception that is not meant to happen, leave no other process waiting for this one; the exit code."""
    traceback.print_exc()
    mpi = sys.modules.get("mpi4py.MPI")
    if mpi is not None and mpi.COMM_WORLD.size > 1:
        mpi.COMM_WORLD.Abort(1)
    return 1
