"""Typed exceptions: `InputError` for invalid input, `RunFailure` for computations that fail."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from pairsim.runtime.message import Message, Text
from pairsim.runtime.text import as_typed, shortened

MOST_MISTAKES = 20  # number of mistakes listed in a message
TRY = "; try "  # between what happened and what to try, in the sentence of a failure

__all__ = ["BudgetSpent", "EnvironmentFailure", "InputError", "InvertedCell", "MeshFailure", "NewtonFailure"]
__all__ += ["NoSteadyState", "PairsimError", "RunFailure", "StepTooSmall", "TooManySteps", "WallTime", "WriteFailure"]


class PairsimError(Exception):
    """Base class of the exceptions that pairsim raises deliberately."""

    exit_code = 1  # of a command which it ends


class Argument(str):
    """The name of an argument of a function, given as the file or the key of an `InputError`.

    In the rest of the message such names are in backquotes. A command replaces them all by the names of its options.
    """


class InputError(PairsimError, ValueError):
    """Invalid input.

    The message has one line for each of the first 20 mistakes: its location, the value given and the values allowed.
    Values are shortened.

    Args:
        file: Path of the file, or name of the function or of its argument.
        key: Dotted key in the file, or name of an argument; empty if the error concerns the file as a whole.
        value: The invalid value, as given.
        allowed: Description of the values allowed, such as "must be above 0".
        line: Line number of the key in the file, None if unknown.
        entry: Name of the case in a file with several cases, empty otherwise.
        others: Further errors in the same input.
    """

    exit_code = 2

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
        super().__init__(file, key, value, allowed)  # the arguments with which it is unpickled in another process

    @staticmethod
    def of_all(errors: Iterable[InputError]) -> InputError:
        """Combine errors into one, in the order of the lines of the file; those without a line come last."""
        first, *rest = sorted(errors, key=lambda error: (error.line is None, error.file, error.line or 0))
        first.others = tuple(rest)
        return first

    @property
    def sentence(self) -> str:
        """The message about this mistake alone."""
        parts = filter(None, (self.entry, shortened(self.key)))
        where = [self.file if self.line is None else f"{self.file}:{self.line}", *parts]
        given = "" if self.value is None else f"got {as_typed(self.value)}; "
        return f"{': '.join(where)}: {given}{self.allowed}"

    def __str__(self) -> str:
        sentences = [error.sentence for error in self.mistakes]
        more = [f"and {len(sentences) - MOST_MISTAKES} more mistakes"] if len(sentences) > MOST_MISTAKES else []
        return "\n".join(sentences[:MOST_MISTAKES] + more)

    def call_arguments(self, names: Mapping[str, str]) -> None:
        """Replace the names of arguments in all mistakes by other names, such as those of a command's options."""

        def called(text: str) -> str:
            if isinstance(text, Argument):
                return names.get(text, text)
            return re.sub(r"`(\w+)`", lambda name: names.get(name[1], name[0]), text)

        for each in self.mistakes:
            each.file, each.key, each.allowed = called(each.file), called(each.key), called(each.allowed)

    @property
    def mistakes(self) -> tuple[InputError, ...]:
        """All errors in the input, this one first."""
        return (self, *(mistake for error in self.others for mistake in error.mistakes))


class RunFailure(PairsimError):
    """A computation that could not be completed.

    Args:
        message: What happened, with the relevant figures.
        at: Time and step reached, such as "t = 0.3 (step 12)"; empty outside of a run.
        advice: What to try, as a phrase that follows "try".

    Attributes:
        reason: A word for what went wrong, as written into run.json.
        remedy: What usually helps, for the documentation; `advice` is for the case at hand.
        sentence: The reason, followed by all of this.
    """

    reason = "failed"
    remedy = ""
    exit_code = 3

    def __init__(self, message: Text, *, at: Text = "", advice: str = "") -> None:
        self.message, self.advice = message, advice
        where = Message(" at {}", at) if at else ""
        self.sentence: Text = Message("{}{}: {}{}", self.reason, where, message, advice and f"{TRY}{advice}")
        super().__init__(message)  # the argument with which it is unpickled in another process

    def __str__(self) -> str:
        return str(self.sentence)


class MeshFailure(RunFailure):
    """No valid mesh of the geometry could be generated."""

    reason = "mesh_failed"
    remedy = (
        "A larger `mesh.Np`; a run that begins with particles farther apart. Very soft particles may "
        "have no steady shape: `pairsim curve` says where these end."
    )


class NewtonFailure(RunFailure):
    """Newton's method did not converge, even with the smallest step allowed."""

    reason = "newton_diverged"
    remedy = "A larger `mesh.Np`, a smaller `time.first_step`, or automatic steps where `time.fixed_step` is given."


class InvertedCell(RunFailure):
    """A cell of the moving mesh was inverted, even after remeshing."""

    reason = "inverted_cell"
    remedy = "A larger `mesh.Np`. Very soft particles may have no steady shape: `pairsim curve` says where these end."


class StepTooSmall(RunFailure):
    """The error control requires a time step below the smallest one allowed."""

    reason = "step_too_small"
    remedy = "A larger `time.tol`; at a large De, a larger `mesh.Np`."


class WallTime(RunFailure):
    """The wall-time limit of the case was reached."""

    reason = "wall_time"
    remedy = "`--resume` with a larger `limits.wall_time`."


class BudgetSpent(RunFailure):
    """The time budget is spent, or a command without a budget has found nothing for minutes."""

    reason = "budget"
    remedy = "A larger `--budget`; a run goes on with `--resume`."


class TooManySteps(RunFailure):
    """The step limit of the case was reached."""

    reason = "max_steps"
    remedy = "`--resume` with a larger `limits.max_steps`."


class WriteFailure(RunFailure):
    """Results could not be written."""

    reason = "write_failed"
    remedy = "Make room on the disk; a run goes on with `--resume`."


class EnvironmentFailure(RunFailure):
    """Something outside pairsim is missing or broken, such as a C compiler.

    The case is not at fault: a sweep repeats it with the next command. `pairsim doctor` checks the installation.
    """

    reason = "environment"
    remedy = "`pairsim doctor` says what is missing."
    exit_code = 4


OF_MACHINE = (WriteFailure.reason, "out_of_memory", "refused", EnvironmentFailure.reason)
"""Reasons of failures that are due to the machine, not to the case: the same command may succeed later."""


class NoSteadyState(RunFailure):
    """No quasi-steady solution was found; whether there is one is not known."""

    reason = "not_resolved"
    remedy = "`pairsim run` from this distance, which shows whether a steady state is approached; another `mesh.Np`."


class BranchEnd(NoSteadyState):
    """The branch of steady states ends before it reaches the parameters asked for, whatever the mesh."""

    reason = "no_steady_state"
    remedy = (
        "Parameters before the end that `end_of_branch` in run.json names; beyond it, `pairsim run` "
        "shows what becomes of the particles."
    )
    exit_code = 5


def kinds_of_failures() -> list[type[RunFailure]]:
    """The classes of failures, one for each reason."""
    return [*RunFailure.__subclasses__(), BranchEnd]


def happened_and_advice(sentence: str) -> tuple[str, str]:
    """What happened and what to try, in the sentence of a failure; the latter is "" if it has no advice."""
    happened, _, advice = sentence.rpartition(TRY)
    return (happened, advice) if happened else (sentence, "")


def failure_of(reason: str, message: str) -> RunFailure:
    """The exception for a failure recorded in run.json, whose message has time, step and advice.

    It is of the class with this `reason`, or a `RunFailure` if there is none.
    """
    failure = next((kind for kind in kinds_of_failures() if kind.reason == reason), RunFailure)(message)
    failure.sentence = message  # which contains reason, time and step
    return failure
