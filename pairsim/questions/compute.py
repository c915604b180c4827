"""The computation of one case, which is what `pairsim.run` and the functions of all other questions do."""

from __future__ import annotations

import shutil
import tempfile
from concurrent.futures import Executor
from contextlib import nullcontext
from inspect import cleandoc
from os import PathLike
from pathlib import Path
from threading import RLock
from typing import Any

from pairsim.cases.estimate import LARGE
from pairsim.cases.quantity_text import seconds_of
from pairsim.computing.case_files import Files
from pairsim.computing.loading import AnyCase, case_of
from pairsim.computing.progress import Reporter
from pairsim.computing.question import Question, own_files
from pairsim.computing.result import Result
from pairsim.computing.workers import Workers
from pairsim.questions.registry import QUESTIONS
from pairsim.runtime.errors import InputError
from pairsim.runtime.locks import command_line
from pairsim.runtime.signals import Signals

Folder = str | PathLike[str]
# Processor time without any result after which a command ends if no budget is given [s]; for large cases it grows in
# proportion to the unknowns. Chosen: among fifty scenes, the longest proof that there is no steady state took a wall
# time of 200 s on a busy machine.
PATIENCE = 240.0
ONE_AT_A_TIME = RLock()
"""Held by the thread that computes: PETSc, MUMPS and gmsh must be used by one thread of a process at a time."""


class Computation[R: Result]:
    """The Python function of a question, such as `pairsim.run`.

    Args:
        question: The question.
        files: The kinds of files among which to look for the right one, if a case is not one of this question.
        answers: Whether the answer is shown after the progress.
    """

    def __init__(self, question: Question[Any], files: Files | None = None, *, answers: bool = True) -> None:
        self.question, self._files, self._answers = question, files, answers
        sentence = question.help.splitlines()[0]
        self.__name__, self.__doc__ = question.name, f"{sentence}\n\n{cleandoc(str(Computation.__call__.__doc__))}"

    def __call__(
        self,
        case: AnyCase | None = None,
        *,
        folder: Folder | None = None,
        overwrite: bool = False,
        progress: bool = False,
        signals: bool | Signals = False,
        budget: str | None = None,
        workers: int = 1,
        executor: Executor | None = None,
        **more: Any,
    ) -> R:
        """Compute a case; a call from a second thread waits until the first one has ended.

        Args:
            case: Path of a case file, a dict of its keys, or a case from `load`; without it `more` are its keys.
            folder: Folder for the files of the command; None for a temporary one, which is removed with the result.
            overwrite: Replace earlier results in the folder.
            progress: Show progress on stderr, and the answer.
            signals: Stop at SIGINT, SIGTERM and SIGHUP and keep what was computed, as the command line does: True, or a
                `pairsim.runtime.signals.Signals` that the caller has entered. By default no signal handler is
                installed; a KeyboardInterrupt ends the computation, and what was computed until then is returned.
            budget: Largest wall time, such as "10min"; what is known by then is kept.
            workers: Number of processes that share the work on the case, except for `run`. Results with different
                numbers agree within their errors, but need not be equal to the last digit.
            executor: Starts the processes beside this one: an executor of `concurrent.futures` on this machine, such as
                that of a Dask client. By default threads do.
            more: Keys to replace, as for `load`, and options of single questions: `resume=True` of `run` continues from
                the folder's checkpoint, or begins if there is none; `sensitivities=True` of `curve` adds the
                derivatives of dU with respect to Ca_e, De, xi and beta.

        Returns:
            The result, even if the computation failed or was interrupted: see its `status`, or call its `check`.

        Raises:
            InputError: The case or the folder cannot be used.
            WriteFailure: The first files of the folder or the last run.json cannot be written.
        """
        helpers = self._workers(workers, executor)
        with helpers:  # their processes load libraries while this one does
            return self._compute(
                {} if case is None else case, folder, overwrite, progress, signals, budget, helpers, more
            )

    def _workers(self, count: int, executor: Executor | None) -> Workers:
        """The processes that share the work.

        Raises:
            InputError: Their number is not valid, or the work on this question cannot be shared.
        """
        source = f"pairsim.{self.__name__}"
        if count != 1 and not self.question.shared:
            raise InputError(source, "workers", count, f"must be 1: a {self.question.name} is computed on one core")
        if isinstance(count, bool) or not isinstance(count, int) or count < 1:
            raise InputError(source, "workers", count, "must be a whole number of at least 1")
        if executor is not None and count == 1:
            raise InputError(source, "workers", count, "must be 2 or more with an executor, including this process")
        return Workers(count, executor)

    def _compute(
        self,
        case: AnyCase,
        folder: Folder | None,
        overwrite: bool,
        progress: bool,
        signals: bool | Signals,
        budget: str | None,
        workers: Workers,
        more: dict[str, Any],
    ) -> R:
        """Compute a case; arguments as for `__call__`, with `more` as a dict."""
        import pairsim.runtime.fenicsx  # noqa: F401  # before everything else that loads MPI or is compiled

        # isort: split
        from pairsim.computing.session import Options, carry_out

        given = {flag: more.pop(flag.name, False) for flag in self.question.flags}
        resumed = [flag.name for flag, on in given.items() if flag.resumes and on]
        flags = {flag.name: on for flag, on in given.items() if not flag.resumes}
        if resumed and folder is None:
            allowed = "must be left out without a folder, where the checkpoint is"
            raise InputError(f"pairsim.{self.__name__}", resumed[0], True, allowed)
        overwrite = overwrite and not resumed
        checked = case_of(self.question, case, more, self._files)
        reporter = Reporter(progress)
        patience = PATIENCE * max(self.question.estimate(checked).unknowns / LARGE, 1.0)
        title = "" if folder is None else Path(folder).resolve().name
        directory = Path(tempfile.mkdtemp(prefix="pairsim-") if folder is None else folder)
        try:
            with ONE_AT_A_TIME, Signals() if signals is True else nullcontext(signals or None) as caught:
                own = own_files(QUESTIONS.values())
                seconds = seconds_of(budget)
                options = Options(overwrite, reporter, command_line(), own, caught, seconds, patience, title, workers)
                outcome = carry_out(self.question, checked, directory, options, resume=bool(resumed), **flags)
        except BaseException:
            if folder is None:
                shutil.rmtree(directory, ignore_errors=True)
            raise
        result: R = self.question.result(self.question, directory, outcome, temporary=folder is None)
        if progress and self._answers:
            reporter.say(result.answer)
        return result
