"""The work of a child process in a sweep: it computes one case, whose results go to the folder of the case."""

from __future__ import annotations

import pickle
import traceback
from contextlib import suppress
from typing import TYPE_CHECKING

from pairsim.computing.progress import Reporter
from pairsim.computing.question import own_files
from pairsim.computing.session import Options, carry_out
from pairsim.questions.registry import QUESTIONS
from pairsim.record.folder import CHECKPOINT
from pairsim.runtime.errors import InputError, RunFailure
from pairsim.runtime.signals import Signals

if TYPE_CHECKING:
    from pairsim.sweeps.task import Task


def compute(task: Task) -> tuple[str, str]:
    """Compute the case of a task and write its folder; a run goes on from its checkpoint, if it has one.

    Returns:
        Reason and message of a failure, which run.json may not have; empty texts if the computation was carried out.
    """
    folder, question = task.folder, QUESTIONS[task.command]
    try:
        case, outcome = pickle.loads(task.case), None
        with Signals() as signals:
            options = Options(True, Reporter(), task.line, own_files(QUESTIONS.values()), signals)
            if question.resumable and (folder / CHECKPOINT).is_file():
                with suppress(InputError):  # the checkpoint cannot be used
                    outcome = carry_out(question, case, folder, options, resume=True, **task.flags)
            if outcome is None:
                outcome = carry_out(question, case, folder, options, **task.flags)
        if outcome.status == "finished" and question.draws_from is not None:
            from pairsim.plots.style import Page  # matplotlib takes a quarter of the time to start

            with suppress(OSError, InputError):  # a picture can be drawn again
                question.draw(folder, folder, Page())
    except InputError as error:
        return "refused", str(error)
    except RunFailure as failure:
        return failure.reason, str(failure)
    except MemoryError as error:
        return "out_of_memory", str(error) or "MemoryError"
    except Exception as error:
        traceback.print_exc()
        return "error", f"{type(error).__name__}: {error}"
    return "", ""
