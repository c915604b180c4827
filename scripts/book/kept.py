"""Results of cases that several parts of a study look at: each is computed once, and found by the next command."""

from __future__ import annotations

import hashlib
from collections import defaultdict
from collections.abc import Sequence
from functools import cached_property
from pathlib import Path
from threading import Lock
from typing import Any

from book.code import SHOWN, code_of
from book.study import solved
from pairsim.cases.case import SceneCase
from pairsim.cases.identity import folder_name, identity_of, key_of


class Kept:
    """The results of cases in the folder in which those of the parts lie, too.

    A result is found by its case and by the code, so that none of other code is taken. A part that needs what another
    one computes at that time waits for it.

    Args:
        uses: Packages and modules whose code the results depend on, as in `Study.uses`.
        seconds: Wall time after which a case is stopped.
    """

    def __init__(self, uses: Sequence[str], seconds: float) -> None:
        self.uses, self.seconds = uses, seconds
        self._locks: defaultdict[str, Lock] = defaultdict(Lock)

    @cached_property
    def _code(self) -> str:
        return hashlib.sha256(code_of(self.uses).encode()).hexdigest()[:SHOWN]

    def result(self, question: str, case: SceneCase, folder: Path) -> Any:
        """The result of a case for the part whose folder is given; where it has failed its status and reason say so.

        Raises:
            Stopped: The study was stopped.
        """
        name = folder_name(f"{self._code}-{case.slug}", key_of(question, identity_of(case)))
        with self._locks[name]:
            return solved(question, case, folder.with_name(name), self.seconds)
